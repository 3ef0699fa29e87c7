"""What ``parakin workspace`` is asked of the inside: the largest box in it, and the parts that hang together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..errors import InputError, PoseError
from .console import fixed, rim
from .regions import values_of

if TYPE_CHECKING:
    from ..workspaces.certified.region import Region
    from ..workspaces.connected.components import Components
    from ..workspaces.inscribed.largest_box import InscribedBox


@dataclass(frozen=True)
class Within:
    """The options, as given."""

    box: bool = False
    shape: str | None = None
    around: str | None = None
    parts: bool = False
    start: str | None = None


@dataclass(frozen=True)
class Found:
    """What was found; None for what was not asked."""

    box: InscribedBox | None = None
    parts: Components | None = None


def looked_within(asked: Region, wanted: Within) -> Found:
    """The box and the parts that are wanted."""
    box, parts = None, None
    if wanted.box or wanted.shape is not None or wanted.around is not None:
        from ..workspaces.inscribed.largest_box import find_largest_box

        shape = None if wanted.shape is None else _shape(wanted.shape)
        around = None if wanted.around is None else _place(asked, wanted.around)
        try:
            box = find_largest_box(asked, shape, around)
        except PoseError as error:
            source = "--around" if around is not None else "--shape" if shape is not None else "--box"
            raise InputError(_plain(error), source) from None
    if wanted.parts or wanted.start is not None:
        from ..workspaces.connected.components import find_components

        start = None
        if wanted.start is not None:
            given = values_of(asked.machine, wanted.start, "--start")
            home = zip(asked.machine.axes, asked.machine.home.tolist(), strict=True)
            start = list(({**dict(home), **asked.fixed_axes, **given}).values())
        try:
            parts = find_components(asked, start)
        except PoseError as error:
            raise InputError(_plain(error), "--parts" if start is None else "--start") from None
    return Found(box, parts)


def _plain(error: PoseError) -> str:
    """Without the argument's name: the option stands before it."""
    name, colon, rest = str(error).partition(": ")
    return rest if colon and name in ("shape", "around", "start", "cell") else str(error)


def _shape(text: str) -> list[float]:
    from ..errors import quote

    try:
        return [float(part) for part in text.split(":")]
    except ValueError:
        raise InputError(f"{quote(text)}: expected proportions such as 3:3:1", "--shape") from None


def _place(asked: Region, text: str) -> list[float]:
    given = values_of(asked.machine, text, "--around")
    if set(given) != set(asked.free_axes):
        raise InputError(f"expected {', '.join(asked.free_axes)}, no more and no less", "--around")
    return [given[axis] for axis in asked.free_axes]


def within_told(found: Found) -> Mapping[str, Any]:
    """For programs: mm and degrees."""
    told: dict[str, Any] = {}
    if found.box is not None:
        box = found.box
        told["box_inside"] = {
            "low": box.low.tolist(),
            "high": box.high.tolist(),
            "volume": box.volume,
            "proved": box.proved,
            "tolerance": box.tolerance,
            "stops": [{"face": stop.face, "limit": stop.limit} for stop in box.stops],
            "shape": box.parameters["shape"],
            "around": box.parameters["around"],
        }
    if found.parts is not None:
        parts, machine = found.parts, found.parts.region.machine
        start = parts.parameters["start"]
        told["parts"] = {
            "count": len(parts),
            "at_least": parts.at_least,
            "undecided": parts.undecided,
            "cell": parts.cell,
            "stopped": parts.stopped,
            "holds_start": parts.start,
            "start": start and [rim(v, unit) for v, unit in zip(start, machine.axis_units, strict=True)],
            "each": [
                {
                    "sign": part.sign,
                    "volume": {
                        "inner": part.volume.inner,
                        "estimate": part.volume.estimate,
                        "outer": part.volume.outer,
                    },
                    "place": part.position.tolist(),
                    "box": {"low": part.low.tolist(), "high": part.high.tolist()},
                    "apart": part.apart,
                }
                for part in parts.components
            ],
        }
    return told


def within_summary(found: Found) -> str:
    """For people."""
    from ..export.workspace.summary import amount, between

    lines: list[str] = []
    if found.box is not None:
        box = found.box
        edges = " × ".join(fixed(edge, 1) for edge in box.edges.tolist())
        lines += ["", f"box inside  {edges} mm, {amount(box.volume, len(box.axes))}, proved"]
        for axis, low, high, first, last in zip(
            box.axes, box.low.tolist(), box.high.tolist(), box.stops[::2], box.stops[1::2], strict=True
        ):
            stops = f"stopped by {first.limit or '-'} and {last.limit or '-'}"
            lines.append(f"            {axis} {fixed(low, 1)} to {fixed(high, 1)} mm, {stops}")
    if found.parts is not None:
        parts = found.parts
        d = len(parts.region.free_axes)
        lines += ["", f"parts that a path can't leave  {len(parts)}, at least {parts.at_least} proved to be different"]
        for number, part in enumerate(parts.components):
            sign = "as at home" if part.sign > 0 else "the other assembly"
            here = ", holds the start" if number == parts.start else ""
            size = amount(part.volume.estimate, d)
            lines.append(f"            {size}, between {between(part.volume, d)}, {sign}{here}")
        if parts.undecided >= 0.005:
            lines.append(f"            undecided {amount(parts.undecided, d)}")
    return "".join(f"\n{line}" for line in lines)
