"""The inside of a workspace for ``parakin workspace``: the largest box in it, and its connected components."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..budget import SECONDS
from ..errors import InputError, PoseError
from ..export.json.workspace_inside import encode_box, encode_components
from ..export.number_format import format_fixed
from .region_options import parse_axis_values

if TYPE_CHECKING:
    from ..arrays import Progress
    from ..workspaces.certified.region import Region
    from ..workspaces.connected.components import Components
    from ..workspaces.inscribed.largest_box import InscribedBox
    from .console import ProgressBar


@dataclass(frozen=True)
class InsideOptions:
    """The options, as given."""

    box: bool = False
    shape: str | None = None
    around: str | None = None
    parts: bool = False
    start: str | None = None
    seconds: float = SECONDS


@dataclass(frozen=True)
class Inside:
    """The largest box and the connected components; None for what was not requested."""

    box: InscribedBox | None = None
    no_box: str = ""  # why there is none
    components: Components | None = None


def check_inside(region: Region, options: InsideOptions) -> None:
    """Refuse options that can't be answered before the workspace is looked for."""
    if options.shape is not None:
        _parse_shape(options.shape)
    if options.around is not None:
        _parse_position(region, options.around)
    if options.start is not None:
        parse_axis_values(region.machine, options.start, "--start")
    if (options.parts or options.start is not None) and not region.every_orientation:
        from ..workspaces.connected.components import ONE_ORIENTATION

        raise InputError(f"some: {ONE_ORIENTATION}", "--parts" if options.start is None else "--start")


def explore_inside(region: Region, options: InsideOptions, progress: ProgressBar) -> Inside:
    """Find the box and the components that the options want."""
    box, no_box, components = None, "", None
    if options.box or options.shape is not None or options.around is not None:
        from ..workspaces.inscribed.largest_box import NoBoxError

        try:
            box = _find_box(region, options, progress.stage("looking for the box", 0.0, 1.0))
        except NoBoxError as error:
            no_box = str(error)
    if options.parts or options.start is not None:
        components = _find_components(region, options, progress.stage("looking for the parts", 0.0, 1.0))
    return Inside(box, no_box, components)


def _find_box(region: Region, options: InsideOptions, progress: Progress) -> InscribedBox:
    from ..workspaces.inscribed.largest_box import NoBoxError, find_largest_box

    shape = None if options.shape is None else _parse_shape(options.shape)
    around = None if options.around is None else _parse_position(region, options.around)
    try:
        return find_largest_box(region, shape, around, seconds=options.seconds, progress=progress)
    except NoBoxError:
        raise
    except PoseError as error:
        source = "--around" if around is not None else "--shape" if shape is not None else "--box"
        raise InputError(_strip_argument(error), source) from None


def _find_components(region: Region, options: InsideOptions, progress: Progress) -> Components:
    from ..workspaces.connected.components import find_components

    machine, start = region.machine, None
    if options.start is not None:
        given = parse_axis_values(machine, options.start, "--start")
        home = zip(machine.axes, machine.home.tolist(), strict=True)
        start = list(({**dict(home), **region.fixed_axes, **given}).values())
    try:
        return find_components(region, start, seconds=options.seconds, progress=progress)
    except PoseError as error:
        raise InputError(_strip_argument(error), "--parts" if start is None else "--start") from None


def _strip_argument(error: PoseError) -> str:
    """Remove the argument's name from an error, because the option stands before it."""
    name, colon, rest = str(error).partition(": ")
    return rest if colon and name in ("shape", "around", "start", "cell") else str(error)


def _parse_shape(text: str) -> list[float]:
    from ..errors import quote

    try:
        return [float(side) for side in text.split(":")]
    except ValueError:
        raise InputError(f"{quote(text)}: expected proportions such as 3:3:1", "--shape") from None


def _parse_position(region: Region, text: str) -> list[float]:
    given = parse_axis_values(region.machine, text, "--around")
    if set(given) != set(region.free_axes):
        raise InputError(f"expected {', '.join(region.free_axes)}, no more and no less", "--around")
    return [given[axis] for axis in region.free_axes]


def encode_inside(inside: Inside) -> Mapping[str, Any]:
    """Encode the box and the components for JSON: mm and degrees."""
    content: dict[str, Any] = {}
    if inside.box is not None:
        content["box_inside"] = encode_box(inside.box)
    elif inside.no_box:
        content["box_inside"] = {"proved": False, "reason": inside.no_box}
    if inside.components is not None:
        content["parts"] = encode_components(inside.components)
    return content


def format_inside(inside: Inside) -> str:
    """Format the box and the components for people."""
    lines: list[str] = []
    if inside.box is not None:
        lines += _format_box(inside.box)
    elif inside.no_box:
        lines += ["", f"box inside  {inside.no_box}"]
    if inside.components is not None:
        lines += _format_components(inside.components)
    return "".join(f"\n{line}" for line in lines)


def _format_box(box: InscribedBox) -> list[str]:
    from ..export.workspace.describe import format_volume

    edges = " × ".join(format_fixed(edge, 1) for edge in box.edges.tolist())
    lines = ["", f"box inside  {edges} mm, {format_volume(box.volume, len(box.axes))}, proved"]
    ends = zip(box.axes, box.low.tolist(), box.high.tolist(), box.stops[::2], box.stops[1::2], strict=True)
    for axis, low, high, first, last in ends:
        stops = f"stopped by {first.limit or '-'} and {last.limit or '-'}"
        lines.append(f"            {axis} {format_fixed(low, 1)} to {format_fixed(high, 1)} mm, {stops}")
    if box.stopped == "time":
        lines.append("            the time was up before its faces were moved as far as they go; --time gives more")
    return lines


def _format_components(components: Components) -> list[str]:
    from ..export.workspace.describe import format_bracket, format_volume

    d = len(components.region.free_axes)
    lines = [
        "",
        f"parts that a path can't leave  {len(components)}, at least {components.at_least} proved to be different",
    ]
    for number, component in enumerate(components.components):
        sign = "as at home" if component.sign > 0 else "the other assembly"
        here = ", holds the start" if number == components.start else ""
        size = format_volume(component.volume.estimate, d)
        lines.append(f"            {size}, between {format_bracket(component.volume, d)}, {sign}{here}")
    if components.stopped == "time":
        lines.append("            the time was up before the cells were as small as they should be; --time gives more")
    if components.undecided >= 0.005:
        lines.append(f"            undecided {format_volume(components.undecided, d)}")
    return lines
