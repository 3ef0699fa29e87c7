"""The text that ``parakin workspace`` prints of a workspace."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..export.number_format import format_fixed
from .console import format_table

if TYPE_CHECKING:
    from ..workspaces.certified.workspace import Volume, Workspace
    from ..workspaces.sampled.sampling import SampledWorkspace

_HUGE = 1e3  # gap beyond which it is no number
_NEGLIGIBLE = 0.5  # mm³ (mm², mm): less is shown as zero
_VAGUE = 0.2  # gap beyond which an estimate tells little
_STOPPED = {
    "gap": "as asked for",
    "cell": "the cells are as small as asked for",
    "time": "the time is up",
    "interrupted": "interrupted",
    "resolution": "the numbers have no more digits",
    "memory": "more cells would not fit",
}


def format_workspace(workspace: Workspace | SampledWorkspace, seconds: float, elsewhere: Volume | None = None) -> str:
    """Format a workspace for people, the time it took, s, and what the machine reaches besides home's part."""
    from ..export.workspace.describe import describe_workspace
    from ..workspaces.certified.workspace import Workspace
    from ..workspaces.sampled.grid import GridWorkspace

    head = describe_workspace(workspace)
    if isinstance(workspace, Workspace) and workspace.empty:
        besides = ""
        if elsewhere is not None and elsewhere.outer >= _NEGLIGIBLE:
            besides = f"\nbesides   {_format_elsewhere(elsewhere, workspace.unit)}"
        return f"{head}\n\nempty: no pose is allowed, proved in {seconds:.1f} s{besides}"
    rows = _list_certified(workspace) if isinstance(workspace, Workspace) else _list_sampled(workspace)
    limits = []
    if isinstance(workspace, Workspace | GridWorkspace):
        if workspace.box is not None:
            ends = zip(workspace.axes, *workspace.box, strict=True)
            rows += [
                ("" if i else "within", f"{axis} {format_fixed(low, 1)} to {format_fixed(high, 1)} mm")
                for i, (axis, low, high) in enumerate(ends)
            ]
        if workspace.centroid is not None:
            rows.append(("centroid", _format_position(workspace.axes, workspace.centroid.tolist())))
        limits = [
            (limit.limit, f"{limit.fraction:.1%}", _format_position(workspace.axes, limit.middle))
            for limit in workspace.bounded_by
        ]
    if elsewhere is not None and elsewhere.outer >= _NEGLIGIBLE:
        rows.append(("besides", _format_elsewhere(elsewhere, workspace.unit)))
    rows.append(("time", f"{seconds:.1f} s"))
    lines = [head, "", *(f"{name:<8}  {text}" for name, text in rows)]
    if limits:
        lines += ["", format_table(limits, ("bounded by", "share", "about"), " r")]
    return "\n".join(lines)


def _format_elsewhere(elsewhere: Volume, unit: str) -> str:
    most = f"{elsewhere.outer:,.0f} {unit}"
    if elsewhere.inner > 0.0:
        what = f"{elsewhere.estimate:,.0f} {unit} in parts that home can't reach"
        return f"{what}, {elsewhere.inner:,.0f} to {most}; --all-parts counts them"
    return f"at most {most} in parts that home can't reach; --all-parts counts them"


def _list_certified(workspace: Workspace) -> list[tuple[str, str]]:
    from ..export.workspace.describe import format_bracket, format_volume

    volume, d, cells = workspace.volume, len(workspace.axes), workspace.cells
    inside = int(cells.inside.sum())
    return [
        (_name_volume(d), f"{volume.estimate:,.0f} {workspace.unit}, {format_volume(volume.estimate, d)}"),
        ("proved", f"{volume.inner:,.0f} to {volume.outer:,.0f} {workspace.unit}, between {format_bracket(volume, d)}"),
        ("gap", f"{_format_gap(volume)}, {_STOPPED[workspace.stopped]}{_warn_of_gap(volume)}"),
        ("cells", f"{inside:,} inside, {len(cells.low) - inside:,} at the boundary"),
    ]


def _format_gap(volume: Volume) -> str:
    return f"{volume.gap:.2%}" if volume.gap < _HUGE else "no volume is proved yet"


def _warn_of_gap(volume: Volume) -> str:
    """Say that an estimate between bounds far apart is no more than that."""
    return "; the volume is a guess from samples, only its bounds are proved" if volume.gap > _VAGUE else ""


def _list_sampled(workspace: SampledWorkspace) -> list[tuple[str, str]]:
    from ..export.workspace.describe import find_note, format_volume

    d, estimate = len(workspace.axes), workspace.estimate
    volume = format_volume(estimate, d)
    rows = [
        (_name_volume(d), f"{estimate:,.0f} {workspace.unit}, {volume}; an estimate, nothing is proved"),
        ("step", f"{workspace.step:,.4g} {'mm' if workspace.method != 'drives' else 'mm, of the drives'}"),
    ]
    if not estimate > 0.0:
        rows[0] = (_name_volume(d), "none of the places looked at is allowed; nothing is proved")
    text = find_note(workspace)
    return rows + ([("note", text)] if text else [])


def _name_volume(dimension: int) -> str:
    return ("length", "area", "volume")[dimension - 1]


def _format_position(axes: Sequence[str], values: Sequence[float]) -> str:
    return "  ".join(f"{axis} {format_fixed(value, 1)}" for axis, value in zip(axes, values, strict=True)) + " mm"
