"""The options that say which workspace is asked for, read: ``--at B=0 --every A=-15:15``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError, PoseError
from .values import parse_value

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
Without = Annotated[
    list[str] | None,
    Parameter(help="A limit that does not count, with * for any letters: gap*. May be given again."),
]


def region_of(
    machine: Machine,
    at: str | None = None,
    every: str | None = None,
    some: str | None = None,
    dexterous: bool = False,
    without: Sequence[str] | None = None,
    mode: str | None = None,
) -> Region:
    """The region that the options ask for; what is wrong with one of them is told with its name."""
    from ..workspaces.certified.region import make_region

    given: dict[str, Any] = {
        "at": values_of(machine, at, "--at"),
        "every": ranges_of(machine, every, "--every"),
        "some": ranges_of(machine, some, "--some"),
        "without": without or (),
        "mode": mode,
    }
    try:
        return make_region(machine, dexterous=dexterous, **given)
    except PoseError:
        for option, value in given.items():  # which of them is invalid by itself
            try:
                make_region(machine, **{option: value})
            except PoseError as error:
                raise InputError(str(error), f"--{option}") from None
        raise


def values_of(machine: Machine, text: str | None, source: str) -> dict[str, float]:
    """Axes with a value each, mm and rad: ``B=0,C=0``."""
    return {axis: parse_value(axis, value, source) for axis, value in parts_of(machine, text, source, "X=10,Z=-1400")}


def ranges_of(machine: Machine, text: str | None, source: str) -> dict[str, tuple[float, float]]:
    from ..errors import quote

    ranges = {}
    for axis, value in parts_of(machine, text, source, "A=-15:15,B=-15:15"):
        low, colon, high = (part.strip() for part in value.partition(":"))
        if not (low and colon and high):
            raise InputError(f"{axis}: expected a range LOW:HIGH, such as -15:15", source)
        ranges[axis] = (parse_value(axis, low, source), parse_value(axis, high, source))
        if ranges[axis][0] > ranges[axis][1]:
            raise InputError(f"{axis}: {quote(value)} is empty, the lesser end comes first", source)
    return ranges


def parts_of(machine: Machine, text: str | None, source: str, example: str) -> list[tuple[str, str]]:
    """Axes and what is said of each."""
    from ..errors import quote, suggest

    found: dict[str, str] = {}
    for part in text.split(",") if text is not None else ():
        axis, equals, value = (word.strip() for word in part.partition("="))
        if not (axis and equals and value):
            raise InputError(f"{quote(part.strip())}: expected AXIS=VALUE, such as {example}", source)
        axis = axis.upper()
        if axis not in machine.axes:
            raise InputError(f"unknown axis {quote(axis)}{suggest(axis, machine.axes)}", source)
        if axis in found:
            raise InputError(f"{axis} is given twice", source)
        found[axis] = value
    return list(found.items())


def length(text: str | None, source: str) -> float | None:
    """A length above 0, mm, with or without a unit."""
    from ..errors import quote

    if text is None:
        return None
    value = parse_value("length", text, source, "mm")
    if not value > 0.0:
        raise InputError(f"{quote(text)}: expected a length above 0 mm", source)
    return value
