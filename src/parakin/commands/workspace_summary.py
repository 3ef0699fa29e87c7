"""What ``parakin workspace`` says of a workspace to people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from .console import fixed, table

if TYPE_CHECKING:
    from ..workspaces.certified.workspace import Workspace
    from ..workspaces.sampled.sampling import SampledWorkspace

_STOPPED = {
    "gap": "as asked for",
    "cell": "the cells are as small as asked for",
    "time": "the time is up",
    "interrupted": "interrupted",
    "resolution": "the numbers have no more digits",
    "memory": "more cells would not fit",
}


def summary(found: Workspace | SampledWorkspace, seconds: float) -> str:
    """The account for people."""
    from ..export.workspace.summary import heading
    from ..workspaces.certified.workspace import Workspace
    from ..workspaces.sampled.grid import GridWorkspace

    head = heading(found)
    if isinstance(found, Workspace) and found.empty:
        return f"{head}\n\nempty: no pose is allowed, proved in {seconds:.1f} s"
    rows = _proved(found) if isinstance(found, Workspace) else _estimated(found)
    bounds = []
    if isinstance(found, Workspace | GridWorkspace):
        if found.box is not None:
            ends = zip(found.axes, *found.box, strict=True)
            rows += [
                ("" if i else "within", f"{axis} {fixed(low, 1)} to {fixed(high, 1)} mm")
                for i, (axis, low, high) in enumerate(ends)
            ]
        if found.centroid is not None:
            rows.append(("centroid", _place(found.axes, found.centroid.tolist())))
        bounds = [
            (bound.limit, f"{bound.fraction:.1%}", _place(found.axes, bound.middle)) for bound in found.bounded_by
        ]
    rows.append(("time", f"{seconds:.1f} s"))
    lines = [head, "", *(f"{name:<8}  {text}" for name, text in rows)]
    if bounds:
        lines += ["", table(bounds, ("bounded by", "share", "about"), " r")]
    return "\n".join(lines)


def _proved(found: Workspace) -> list[tuple[str, str]]:
    from ..export.workspace.summary import amount, between

    volume, d, cells = found.volume, len(found.axes), found.cells
    inside = int(cells.inside.sum())
    return [
        (_what(d), f"{volume.estimate:,.0f} {found.unit}, {amount(volume.estimate, d)}"),
        ("proved", f"{volume.inner:,.0f} to {volume.outer:,.0f} {found.unit}, between {between(volume, d)}"),
        ("gap", f"{volume.gap:.2%}, {_STOPPED[found.stopped]}"),
        ("cells", f"{inside:,} inside, {len(cells.low) - inside:,} at the boundary"),
    ]


def _estimated(found: SampledWorkspace) -> list[tuple[str, str]]:
    from ..export.workspace.summary import amount, note

    d = len(found.axes)
    rows = [
        (_what(d), f"{found.estimate:,.0f} {found.unit}, {amount(found.estimate, d)}; an estimate, nothing is proved"),
        ("step", f"{found.step:,.4g} {'mm' if found.method != 'drives' else 'mm, of the drives'}"),
    ]
    if not found.estimate > 0.0:
        rows[0] = (_what(d), "none of the places looked at is allowed; nothing is proved")
    said = note(found)
    return rows + ([("note", said)] if said else [])


def _what(dimension: int) -> str:
    return ("length", "area", "volume")[dimension - 1]


def _place(axes: Sequence[str], values: Sequence[float]) -> str:
    return "  ".join(f"{axis} {fixed(value, 1)}" for axis, value in zip(axes, values, strict=True)) + " mm"
