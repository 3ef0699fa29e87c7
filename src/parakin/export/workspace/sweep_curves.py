"""The curves of a sweep: a polar sweep's outlines and rays, the contours and nets of the drives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...workspaces.sampled.drive_sweep import DriveImage, DriveWorkspace
from ...workspaces.sampled.polar_sweep import PolarWorkspace

_MESHES = 16  # meshes of a net in each direction


@dataclass(frozen=True, eq=False)
class CurveGroup:
    """Curves (k, d), mm, that belong together; ``fine`` ones are the net between the others."""

    name: str
    lines: list[Array]
    fine: bool = False


def build_sweep_curves(workspace: PolarWorkspace | DriveWorkspace) -> list[CurveGroup]:
    """Build the curves of a sweep, in groups."""
    if isinstance(workspace, PolarWorkspace):
        return [CurveGroup("outlines", workspace.outlines), CurveGroup("rays", _build_meridians(workspace), fine=True)]
    contours: dict[str, list[Array]] = {}
    for image in workspace.contours:
        contours.setdefault(image.strategy.name, []).extend(image.pieces)
    nets = [line for image in workspace.nets for line in _build_net(image)]
    return [*(CurveGroup(name, lines) for name, lines in contours.items()), CurveGroup("net", nets, fine=True)]


def _build_meridians(workspace: PolarWorkspace) -> list[Array]:
    """Join the ends of rays of one angle, from plane to plane; in a single plane return the rays themselves."""
    ways = np.stack([np.cos(workspace.angles), np.sin(workspace.angles)], 1)
    ends = workspace.axis + workspace.radii[..., None] * ways
    if workspace.heights is None:
        return [np.array([workspace.axis, end]) for end in ends[0] if not np.isnan(end).any()]
    heights = np.broadcast_to(workspace.heights[:, None, None], (*ends.shape[:2], 1))
    return [piece for line in np.concatenate([ends, heights], 2).swapaxes(0, 1) for piece in _split_line(line)]


def _build_net(image: DriveImage) -> list[Array]:
    positions = image.positions
    lines = []
    for sheet in (positions, positions.swapaxes(0, 1)):
        for index in np.unique(np.linspace(0, len(sheet) - 1, _MESHES + 1).round().astype(int)).tolist():
            lines += _split_line(sheet[index])
    return lines


def _split_line(line: Array) -> list[Array]:
    """Split a line where it is NaN."""
    exists = ~np.isnan(line).any(1)
    edges = np.flatnonzero(np.diff(exists.astype(np.int8), prepend=0, append=0))
    return [line[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1]
