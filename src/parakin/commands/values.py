"""Parse values as a user writes them: ``10``, ``2in``, ``C=0.5rad``; plain numbers are mm and degrees."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from ..errors import InputError, quote, suggest
from ..units import ANGLE, AXIS_UNITS, LENGTH, QuantityError, parse_quantity

if TYPE_CHECKING:
    from ..arrays import Array


def parse_value(name: str, text: str, source: str, unit: str | None = None) -> float:
    """Parse a value in mm or degrees, with or without a unit; return mm or rad.

    Parameters
    ----------
    name : the axis or joint, for messages
    source : the option's name, for messages
    unit : the value's own, ``mm`` or ``rad``; by default the axis letter ``name`` decides

    Raises :class:`InputError`.
    """
    from ..toolpath.reading.text import LARGEST, is_number, parse_number

    angular = (AXIS_UNITS.get(name) if unit is None else unit) == "rad"
    try:
        if is_number(text):
            value = parse_number(text)
            return math.radians(value) if angular else value
        value = parse_quantity(text, ANGLE if angular else LENGTH)
    except (QuantityError, InputError) as error:
        message = error.message if isinstance(error, InputError) else str(error)
        raise InputError(f"{name}: {message}", source) from None
    if abs(value) > LARGEST:
        raise InputError(f"{name}: {quote(text)} is out of range", source)
    return value


def split_assignments(text: str, axes: Collection[str], source: str, form: str) -> Iterator[tuple[str, str]]:
    """Split ``AXIS=TEXT,AXIS=TEXT`` into each axis and its text.

    axes : those that may be named, each once
    source : the option's name, for messages; ``form`` says what is expected

    Raises :class:`InputError`.
    """
    return check_assignments((split_assignment(one, source, form) for one in text.split(",")), axes, source)


def split_assignment(assignment: str, source: str, form: str) -> tuple[str, str]:
    """Split ``AXIS=TEXT``; raises :class:`InputError` for anything else."""
    axis, equals, value = (word.strip() for word in assignment.partition("="))
    if not (axis and equals and value):
        raise InputError(f"{quote(assignment.strip())}: expected {form}", source)
    return axis.upper(), value


def check_assignments(
    pairs: Iterable[tuple[str, str]], axes: Collection[str], source: str
) -> Iterator[tuple[str, str]]:
    """Check one after the other that each of some pairs names an axis that is known and not named before."""
    seen: set[str] = set()
    for axis, value in pairs:
        if axis not in axes:
            raise InputError(f"unknown axis {quote(axis)}{suggest(axis, axes)}", source)
        if axis in seen:
            raise InputError(f"{axis} is given twice", source)
        seen.add(axis)
        yield axis, value


def parse_row(
    values: Sequence[str], names: Sequence[str], units: Sequence[str], default: Array | None, source: str
) -> Array:
    """Parse one row of values, in the order of names (``10 -20``) or by name (``X=10 Z=-20``); return mm and rad.

    Parameters
    ----------
    units : ``mm`` or ``rad`` for each name
    default : values for what is not named, (names,)
    source : the option's name, for messages

    Raises :class:`InputError`.
    """
    import numpy as np

    named = ["=" in value for value in values]
    wanted = " ".join(names)
    if any(named) and not all(named):
        raise InputError(f"values with a name and without one are mixed, expected either {wanted} or names", source)
    if not all(named) and len(values) != len(names):
        raise InputError(f"{len(values)} value{'s' * (len(values) != 1)}, expected {len(names)}: {wanted}", source)
    unit_of = dict(zip(names, units, strict=True))
    spelled = {name.lower(): name for name in names}
    row = np.full(len(names), np.nan) if default is None else np.array(default, dtype=np.float64)
    pairs = [v.partition("=")[::2] for v in values] if all(named) else list(zip(names, values, strict=True))
    seen: set[str] = set()
    for word, text in pairs:
        name = spelled.get(word.strip().lower())
        if name is None:
            raise InputError(f"unknown {quote(word.strip())}{suggest(word.strip(), names)}", source)
        if name in seen:
            raise InputError(f"{name} is given twice", source)
        seen.add(name)
        row[list(names).index(name)] = parse_value(name, text.strip(), source, unit_of[name])
    missing = [name for name, value in zip(names, row.tolist(), strict=True) if value != value]
    if missing:
        raise InputError(f"no value for {', '.join(missing)}, expected {wanted}", source)
    return row
