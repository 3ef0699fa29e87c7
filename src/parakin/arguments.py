"""Check the arguments of public functions, and read values that are given with units or by name.

What is mistaken raises :class:`PoseError` in one line that names the argument.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from inspect import signature
from math import inf, isfinite, pi
from numbers import Real
from typing import Any, TypeAlias, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from .annotations import accept_value, count_elements, describe_hint, describe_value, is_number_hint, resolve_hints
from .arrays import Array
from .errors import PoseError, quote
from .units import ANGLE, LENGTH, QuantityError, parse_quantity

Coordinates: TypeAlias = Mapping[str, Any]  # by name: numbers, mm and rad, texts with their unit, or arrays of them
RowsLike: TypeAlias = ArrayLike | Coordinates
F = TypeVar("F", bound=Callable[..., Any])

TURN = 2.0 * pi * (1.0 + 1e-9)  # rad; more is hardly meant
_LEAST, _GREATEST = 1e-60, 1e60  # of a number's size: its powers do not overflow
_ROWS_LOOKED_AT = 1000  # for angles that look like degrees
_PACKAGE = __name__.partition(".")[0]


def check_arguments(function: F) -> F:
    """Let a public function refuse arguments of the wrong kind, which its annotations tell."""
    call_signature = signature(function)
    hints: dict[str, Any] = {}

    @wraps(function)
    def call(*arguments: Any, **options: Any) -> Any:
        if not hints:
            hints.update(resolve_hints(function))
        try:
            bound = call_signature.bind(*arguments, **options)
        except TypeError:
            return function(*arguments, **options)  # Python's own error, with the function's name
        for name, value in bound.arguments.items():
            if name not in hints:
                continue
            check_kind(name, value, hints[name])
            if isinstance(value, Real) and is_number_hint(hints[name]):
                bound.arguments[name] = _check_size(name, float(value))
        return function(*bound.args, **bound.kwargs)

    return cast(F, call)


def check_constructor(kind: F) -> F:
    """Let a public class refuse arguments of the wrong kind, as :func:`check_arguments`."""
    kind.__init__ = check_arguments(kind.__init__)  # type: ignore[method-assign]
    return kind


def _check_size(name: str, value: float) -> float:
    """Return a number; those so small or great that sums and quotients of them overflow are refused."""
    if value != 0.0 and not _LEAST < abs(value) < _GREATEST and isfinite(value):
        raise PoseError(f"{name}: {value:g} is out of range")
    return value


def check_kind(name: str, value: object, kind: Any, such_as: str = "") -> None:
    """Raise :class:`PoseError` for a value that is not of the kind that an annotation tells."""
    if not accept_value(value, kind):
        raise PoseError(f"{name}: {describe_hint(kind)}{such_as} expected, not {describe_value(value)}")


def check_positive(name: str, value: float, unit: str = "") -> float:
    """Return a finite number above zero; raises :class:`PoseError` for others."""
    if not (isinstance(value, Real) and not isinstance(value, bool) and 0.0 < value < np.inf):
        raise PoseError(f"{name}: a number above 0{unit and ' '}{unit} expected, not {describe_value(value)}")
    return float(value)


def check_range(name: str, value: float, low: float, high: float, unit: str = "") -> None:
    """Refuse what is no number from low to high with a :class:`PoseError`."""
    if not (isinstance(value, Real) and not isinstance(value, bool) and low <= value <= high):
        ends = f"{low:g} to {high:.6g}{unit and ' '}{unit}"
        raise PoseError(f"{name}: a number from {ends} expected, not {describe_value(value)}")


def parse_coordinate(name: str, value: object, unit: str) -> float:
    """Return the value of an axis or a joint: a number, mm or rad, or a text with its unit such as "30 deg".

    A number of radians beyond a turn gets a warning: it may be meant in degrees.
    """
    if isinstance(value, str):
        try:
            return parse_quantity(value, ANGLE if unit == "rad" else LENGTH)
        except QuantityError as error:
            raise PoseError(f"{name}: {error}") from None
    if not isinstance(value, Real) or isinstance(value, bool):
        example = "30 deg" if unit == "rad" else "10 mm"
        expected = f'a number ({unit}) or a text such as "{example}"'
        raise PoseError(f"{name}: {expected} expected, not {describe_value(value)}")
    number = _convert_number(name, value)
    if unit == "rad" and TURN < abs(number) < inf:
        warn_of_degrees(name, number)
    return number


def _convert_number(name: str, value: Any) -> float:
    try:
        return float(value)
    except OverflowError:
        raise PoseError(f"{name}: a number that is out of range") from None


def parse_range(name: str, value: object, unit: str) -> tuple[float, float]:
    """Return the range of an axis, a pair of values as :func:`parse_coordinate` takes them."""
    if isinstance(value, (str, bytes)) or not isinstance(value, (Sequence, np.ndarray)) or len(value) != 2:
        raise PoseError(f"{name}: a pair (low, high) expected, not {describe_value(value)}")
    low, high = (parse_coordinate(name, end, unit) for end in value)
    return low, high


def read_numbers(what: str, value: object) -> Array:
    """Read a number, or a list of numbers that are not NaN; (k,)."""
    numbers = np.atleast_1d(_parse_cells(value, [what], ["mm"], what))
    if numbers.ndim != 1 or np.isnan(numbers).any():
        raise PoseError(f"{what}: numbers in one row expected, not an array of shape {numbers.shape}")
    return numbers


def read_vector(what: str, value: object, names: Sequence[str], kind: str = "numbers") -> Array:
    """Read finite numbers, one for each name, from a list or a dict by name; (names,)."""
    if isinstance(value, Mapping):
        missing = [name for name in names if name not in value]
        if missing or len(value) != len(names):
            raise PoseError(f"{what}: values of {' '.join(names)} expected")
        value = [value[name] for name in names]
    vector = _parse_cells(value, names, ["mm"] * len(names), what)
    if vector.shape != (len(names),) or not np.isfinite(vector).all():
        raise PoseError(f"{what}: {len(names)} {kind} expected, for {' '.join(names)}")
    return vector


def read_corners(what: str, value: Any, names: Sequence[str]) -> tuple[Array, Array]:
    """Read a box: its lower and its upper corner, which has the greater numbers, (names,) each."""
    try:
        if isinstance(value, (str, bytes, Mapping)) or count_elements(value) != 2:
            raise PoseError(what)
        low, high = (read_vector(what, corner, names) for corner in value)
        if not (low < high).all():
            raise PoseError(what)
    except PoseError:
        corners = f"a lower and an upper corner expected, each of {' '.join(names)} in mm"
        raise PoseError(f"{what}: {corners}") from None
    return low, high


def stack_named(values: Mapping[Any, Any], names: Sequence[str], units: Sequence[str], rest: Array, what: str) -> Array:
    """Make rows (..., names) of values by name, which broadcast; names that are not given take the rest's values."""
    spelled = {name.lower(): index for index, name in enumerate(names)}
    columns: list[Any] = list(rest.tolist())
    seen = set()
    if not values:
        raise PoseError(f"{what}: values of {' '.join(names)} expected, not an empty dict")
    for key, value in values.items():
        index = spelled.get(str(key).lower())
        if index is None:
            raise PoseError(f"{what}: unknown {quote(key)}, expected {' '.join(names)}")
        if index in seen:
            raise PoseError(f"{what}: {names[index]} is given twice")
        seen.add(index)
        columns[index] = _parse_cells(value, names[index : index + 1], units[index : index + 1], what)
    try:
        return np.stack(np.broadcast_arrays(*columns), -1)
    except ValueError:
        raise PoseError(f"{what}: the values of {' '.join(map(str, values))} have shapes that do not fit") from None


def _parse_cells(value: object, names: Sequence[str], units: Sequence[str], what: str) -> Array:
    """Parse numbers, or texts with units, in any shape; of several names the last dimension has one for each.

    What is masked is no number.
    """
    if isinstance(value, np.ma.MaskedArray) and value.dtype.kind in "biuf":
        value = np.ma.filled(value.astype(np.float64), np.nan)
    try:
        array = np.asarray(value)
        if array.dtype.kind in "biuf":
            return array.astype(np.float64, copy=False)
        cells = np.asarray(value, dtype=object)
    except (ValueError, TypeError, OverflowError) as error:
        raise PoseError(f"{what}: rows of numbers expected ({error})") from None
    if any(not isinstance(cell, (Real, str)) for cell in cells.flat):
        raise PoseError(f"{what}: numbers expected, not {array.dtype}")
    count = len(names)
    parsed = [
        parse_coordinate(f"{what} {names[i % count]}", cell, units[i % count])
        if isinstance(cell, str)
        else _convert_number(what, cell)
        for i, cell in enumerate(cells.flat)
    ]
    return np.array(parsed).reshape(cells.shape)


def read_rows(value: object, names: Sequence[str], units: Sequence[str], rest: Callable[[], Array], what: str) -> Array:
    """Read rows (..., names) of poses or joints: numbers (mm, rad), texts with units, or a dict of them by name.

    rest : makes the values (names,) of what a dict does not name
    """
    if isinstance(value, Mapping):
        array = stack_named(value, names, units, rest(), what)
    else:
        array = _parse_cells(value, names, units, what)
    if array.ndim == 0 or array.shape[-1] != len(names):
        raise PoseError(f"{what}: shape (..., {len(names)}) for {' '.join(names)} expected, not {array.shape}")
    return array


def bound_angles(units: Sequence[str], reach: Sequence[float]) -> Array:
    """Bound what is hardly meant in degrees, for each unit: a turn, or more where a drive reaches farther."""
    finite = [most if np.isfinite(most) else 0.0 for most in reach]
    return np.array([max(TURN, most) if unit == "rad" else np.inf for unit, most in zip(units, finite, strict=True)])


def warn_of_wide_angles(value: object, rows: Array, names: Sequence[str], bounds: Array, what: str) -> None:
    """Warn of numbers beyond bounds (names,) in the first rows: they may be meant in degrees.

    Arrays of many rows are results of a computation, in which turns are counted.
    """
    if isinstance(value, np.ndarray) and value.ndim > 1:
        return
    first = rows[:_ROWS_LOOKED_AT]
    with np.errstate(invalid="ignore"):
        wide = (np.abs(first) > bounds) & np.isfinite(first)
    if wide.any():
        row, column = np.argwhere(wide)[0].tolist()
        warn_of_degrees(f"{what} {names[column]}", float(first[row, column]))


def warn_of_degrees(name: str, value: float) -> None:
    """Warn that an angle is more than a turn, if the call comes from outside the package."""
    depth, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__") in _ENTRANCES:
        depth, frame = depth + 1, frame.f_back
    if not str(frame.f_globals.get("__name__")).startswith(f"{_PACKAGE}."):
        warnings.warn(
            f'{name}: {value:g} rad is more than a turn; for degrees write a text such as "{value:g} deg"',
            stacklevel=depth + 1,
        )


# Modules whose functions users call with angles; from others of the package they are what they should be.
_ENTRANCES = {
    __name__,
    *(
        f"{_PACKAGE}.{module}"
        for module in (
            "machine",
            "workspaces.certified.region",
            "toolpath.posting.frames",
            "toolpath.placing.placement",
        )
    ),
}
