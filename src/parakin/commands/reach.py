"""``parakin reach``: how far a machine can go from a pose, proved, and what ends it."""

from __future__ import annotations

from math import floor
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..errors import InputError
from ..export.number_format import format_fixed
from ..units import name_display_unit, to_display
from .console import announce_compiling, format_table, print_json, print_text
from .options import OFF_LIMITS, Json, Mode, Name, Sizes, load_machine
from .region_options import parse_axis_values
from .values import parse_row

if TYPE_CHECKING:
    from ..arrays import Array
    from ..kinematics.travel import Travel, TravelEnd
    from ..machine import Machine

_DIGITS = 4


def reach(
    name: Name,
    /,
    *,
    at: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    along: Annotated[list[str] | None, Parameter(allow_leading_hyphen=True)] = None,
    mode: Mode = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """How far the machine can go from a pose along every axis, proved, and what ends it.

    Every pose on the way keeps every limit, and no parallel singularity is met. The exit code is 3 if the pose itself
    is off limits.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    at
        The pose: X=10,Z=-1400 or all values in order, mm and degrees; the rest is home's. By default home.
    along
        A direction instead of the axes, mm and degrees: X=1,Y=1; the travel is told in multiples of it. May be given
        again.
    """
    machine = load_machine(name, sizes)
    pose = machine.home
    if at is not None:
        pose = parse_row(at.split(","), machine.axes, machine.axis_units, machine.home, "--at")
    directions: dict[str, str | dict[str, float]] = {axis: axis for axis in machine.axes}
    if along is not None:
        directions = {text: _parse_direction(machine, text) for text in along}
    announce_compiling()
    travels = {text: machine.travel(pose, direction, mode) for text, direction in directions.items()}
    if json:
        from ..export.json.travel import encode_travel

        print_json(encode_travel(machine, pose, travels))
    else:
        print_text(_format_travels(machine, pose, travels))
    return OFF_LIMITS if machine.check(pose, mode=mode) else 0


def _parse_direction(machine: Machine, text: str) -> dict[str, float]:
    direction = parse_axis_values(machine, text, "--along")
    if not any(direction.values()):
        raise InputError(f'"{text}": a direction that is not zero expected', "--along")
    return direction


def _format_travels(machine: Machine, pose: Array, travels: dict[str, Travel]) -> str:
    """Format a line for each axis or direction; what is proved is rounded down."""
    start = dict(zip(machine.axes, zip(pose.tolist(), machine.axis_units, strict=True), strict=True))
    rows = []
    for along, travel in travels.items():
        value, unit = start.get(along, (None, "1"))
        rows.append(
            (
                along,
                "" if value is None else format_fixed(to_display(value, unit), _DIGITS),
                _format_distance(travel.back, unit),
                travel.back.limit or "-",
                _format_distance(travel.ahead, unit),
                travel.ahead.limit or "-",
                "times" if value is None else name_display_unit(unit),
            )
        )
    return format_table(rows, ("along", "at", "back", "until", "ahead", "until", ""), " rr r")


def _format_distance(end: TravelEnd, unit: str) -> str:
    scale = 10.0**_DIGITS
    return format_fixed(floor(to_display(end.distance, unit) * scale) / scale, _DIGITS)
