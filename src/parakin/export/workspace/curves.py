"""The curves of a sweep: a polar sweep's outlines and rays, the contours and nets of the drives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...workspaces.sampled.drive_sweep import DriveImage, DriveWorkspace
from ...workspaces.sampled.polar_sweep import PolarWorkspace

Floats = NDArray[np.float64]

_MESHES = 16  # of a net, each way


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves (k, d), mm, that belong together; ``fine`` ones are the net between the others."""

    name: str
    lines: list[Floats]
    fine: bool = False


def curves(found: PolarWorkspace | DriveWorkspace) -> list[Curves]:
    if isinstance(found, PolarWorkspace):
        return [Curves("outlines", found.outlines), Curves("rays", _meridians(found), fine=True)]
    contours: dict[str, list[Floats]] = {}
    for image in found.contours:
        contours.setdefault(image.strategy.name, []).extend(image.pieces)
    nets = [line for image in found.nets for line in _meshes(image)]
    return [*(Curves(name, lines) for name, lines in contours.items()), Curves("net", nets, fine=True)]


def _meridians(found: PolarWorkspace) -> list[Floats]:
    """Ends of rays of one angle, from plane to plane; in a single plane the rays themselves."""
    ways = np.stack([np.cos(found.angles), np.sin(found.angles)], 1)
    ends = found.axis + found.radii[..., None] * ways
    if found.heights is None:
        return [np.array([found.axis, end]) for end in ends[0] if not np.isnan(end).any()]
    heights = np.broadcast_to(found.heights[:, None, None], (*ends.shape[:2], 1))
    return [piece for line in np.concatenate([ends, heights], 2).swapaxes(0, 1) for piece in _pieces(line)]


def _meshes(image: DriveImage) -> list[Floats]:
    places = image.positions
    found = []
    for sheet in (places, places.swapaxes(0, 1)):
        for index in np.unique(np.linspace(0, len(sheet) - 1, _MESHES + 1).round().astype(int)).tolist():
            found += _pieces(sheet[index])
    return found


def _pieces(line: Floats) -> list[Floats]:
    """A line's parts between places that are none."""
    there = ~np.isnan(line).any(1)
    edges = np.flatnonzero(np.diff(there.astype(np.int8), prepend=0, append=0))
    return [line[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1]
