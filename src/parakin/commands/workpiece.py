"""Parse the options of ``parakin post`` that place the part: ``--workpiece`` and ``--place``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import InputError, quote
from ..units import AXIS_UNITS
from .values import check_assignments, parse_value, split_assignments

if TYPE_CHECKING:
    from ..arrays import Array

_WORKPIECE, _PLACE = "--workpiece", "--place"
_FORM = 'expected x,y,z or x,y,z,a,b,c (mm, degrees), or names as in "X=10,Z=-1400,C=30"'
_EXAMPLE = "X=-100:100,Z=-1500,C=-90:90"


def parse_workpiece(text: str) -> Array:
    """Parse the option ``--workpiece``; return the transform (3, 4): R = Rz(C)·Ry(B)·Rx(A) and the origin, mm.

    ``x,y,z`` or ``x,y,z,a,b,c``, or any of them by name: ``X=10,Z=-1400,C=30``. Plain numbers are mm and degrees; a
    unit may follow (``X=2in``, ``C=0.5rad``).

    Raises :class:`InputError`.
    """
    from .. import workpiece

    words = [word.strip() for word in text.split(",")]
    named = ["=" in word for word in words]
    if any(named) and not all(named):
        raise InputError(f"{quote(text)} has values with a name and without one; {_FORM}", _WORKPIECE)
    if not all(named) and len(words) not in (3, 6):
        raise InputError(f"{quote(text)} has {len(words)} value{'s' * (len(words) != 1)}; {_FORM}", _WORKPIECE)
    if all(named):
        pairs = [(name.strip().upper(), value.strip()) for name, _, value in (word.partition("=") for word in words)]
    else:
        pairs = list(zip(AXIS_UNITS, words, strict=False))
    values: dict[str, float] = {}
    for axis, value in check_assignments(pairs, AXIS_UNITS, _WORKPIECE):
        values[axis] = parse_value(axis, value, _WORKPIECE)
    return workpiece(**values)


def parse_bounds(text: str) -> dict[str, tuple[float, float]]:
    """Parse the option ``--place``: ``X=-100:100,Z=-1500,C=-90:90``; return the ends by axis, mm and rad.

    A single value holds its axis; axes not named are 0, as in ``--workpiece``. Plain numbers are mm and degrees; a unit
    may follow.

    Raises :class:`InputError`.
    """
    bounds: dict[str, tuple[float, float]] = {}
    form = f"AXIS=LOW:HIGH or AXIS=VALUE, such as {_EXAMPLE}"
    for axis, value in split_assignments(text, AXIS_UNITS, _PLACE, form):
        low, colon, high = (word.strip() for word in value.partition(":"))
        if colon and not (low and high):
            raise InputError(f"{axis}: expected a range LOW:HIGH, such as -100:100", _PLACE)
        ends = parse_value(axis, low, _PLACE), parse_value(axis, high if colon else low, _PLACE)
        if ends[0] > ends[1]:
            raise InputError(f"{axis}: {quote(value)} is empty, the lesser end comes first", _PLACE)
        bounds[axis] = ends
    return bounds
