"""The options that make a region, such as ``--at B=0 --every A=-15:15``, and values of axes in options."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError, PoseError
from .values import parse_value, split_assignments

if TYPE_CHECKING:
    from ..machine import Machine
    from ..workspaces.certified.region import Region

At = Annotated[
    str | None,
    Parameter(
        help="Axes to hold, mm and degrees: B=0,C=0 or Z=-1400. Turning axes that are not named stand as at home."
    ),
]
Every = Annotated[
    str | None,
    Parameter(
        help="Ranges of turning axes all over which the machine must be allowed: A=-15:15,B=-15:15 (total orientation)."
    ),
]
Some = Annotated[
    str | None, Parameter(help="Ranges of turning axes of which one value must be allowed (inclusive orientation).")
]
AllParts = Annotated[
    bool,
    Parameter(
        name="--all-parts",
        help="Count what home can't reach too, such as the mirror image of the workspace behind the base.",
    ),
]
Time = Annotated[
    float | None,
    Parameter(
        help="Answer after this time with what is proved by then, s; 60 by default, for each of several questions."
    ),
]
Without = Annotated[
    list[str] | None,
    Parameter(help="A limit that does not count, with * for any letters: gap*. May be given again."),
]


def read_region(
    machine: Machine,
    at: str | None = None,
    every: str | None = None,
    some: str | None = None,
    dexterous: bool = False,
    without: Sequence[str] | None = None,
    mode: str | None = None,
    all_parts: bool = False,
) -> Region:
    """Make the region that the options describe; an error names the option that is invalid."""
    from ..workspaces.certified.region import CountedComponents, make_region

    swept = [name for name, value in (("every", every), ("some", some), ("dexterous", dexterous)) if value]
    if len(swept) > 1:
        raise InputError(f"goes without --{swept[0]}", f"--{swept[1]}")
    arguments: dict[str, Any] = {
        "at": parse_axis_values(machine, at, "--at"),
        "every": parse_axis_ranges(machine, every, "--every"),
        "some": parse_axis_ranges(machine, some, "--some"),
        "without": without or (),
    }
    components: CountedComponents = "all" if all_parts else "home"
    try:
        return make_region(machine, dexterous=dexterous, mode=mode, components=components, **arguments)
    except PoseError:
        for option, value in arguments.items():
            try:
                make_region(machine, **{option: value})
            except PoseError as error:
                raise InputError(str(error), f"--{option}") from None
        raise


def parse_axis_values(machine: Machine, text: str | None, source: str) -> dict[str, float]:
    """Parse axes with a value each, ``B=0,C=0``: mm and rad."""
    texts = split_axes(machine, text, source, "X=10,Z=-1400")
    return {axis: parse_value(axis, value, source) for axis, value in texts.items()}


def parse_axis_ranges(machine: Machine, text: str | None, source: str) -> dict[str, tuple[float, float]]:
    """Parse axes with a range each, ``A=-15:15``: mm and rad."""
    from ..errors import quote

    ranges = {}
    for axis, value in split_axes(machine, text, source, "A=-15:15,B=-15:15").items():
        low, colon, high = (word.strip() for word in value.partition(":"))
        if not (low and colon and high):
            raise InputError(f"{axis}: expected a range LOW:HIGH, such as -15:15", source)
        ranges[axis] = (parse_value(axis, low, source), parse_value(axis, high, source))
        if ranges[axis][0] > ranges[axis][1]:
            raise InputError(f"{axis}: {quote(value)} is empty, the lesser end comes first", source)
    return ranges


def split_axes(machine: Machine, text: str | None, source: str, example: str) -> dict[str, str]:
    """Split ``AXIS=TEXT,AXIS=TEXT`` into the text of each axis."""
    if text is None:
        return {}
    return dict(split_assignments(text, machine.axes, source, f"AXIS=VALUE, such as {example}"))


def parse_time(seconds: float | None) -> float | None:
    """Return the time that --time gives, s; refuse one that is not above 0."""
    if seconds is not None and not seconds > 0.0:
        raise InputError("expected a time above 0, in s", "--time")
    return seconds


def parse_length(text: str | None, source: str) -> float | None:
    """Parse a length above zero, with or without a unit: mm; None for no text."""
    from ..errors import quote

    if text is None:
        return None
    value = parse_value("length", text, source, "mm")
    if not value > 0.0:
        raise InputError(f"{quote(text)}: expected a length above 0 mm", source)
    return value
