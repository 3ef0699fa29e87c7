"""Named sizes of a machine file as inputs: every number of the description that they change evenly, with its rates."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from math import isfinite
from typing import Any

from ..algebra import Scalar
from ..errors import ParakinError
from .spec import Spec

_STEP = 0.01  # of a size, or mm and rad where it is zero, by which it is changed to see what it changes
_EVEN = 1e-9  # by which a number may miss a straight line, of one more than its size

SpecMaker = Callable[[Mapping[str, float]], Spec]  # a description with other values of all its sizes


@dataclass(frozen=True)
class SizeRates:
    """How the numbers of a description follow its named sizes: each is a constant plus rates times sizes.

    names : of the sizes that change numbers evenly, whatever the others are
    nominal : their values, mm or rad
    rates : for each number of the description, in the order of :func:`list_numbers`, its rates by the sizes
    """

    names: tuple[str, ...]
    nominal: tuple[float, ...]
    rates: tuple[tuple[float, ...], ...]

    def apply(self, spec: Spec, sizes: Sequence[Scalar]) -> Spec:
        """Apply sizes, scalars of any kind, to the description for whose nominal ones the rates are."""
        numbers = []
        for number, rates in zip(list_numbers(spec), self.rates, strict=True):
            moved: Scalar = number
            for rate, size, nominal in zip(rates, sizes, self.nominal, strict=True):
                if rate != 0.0:
                    moved = size * rate + (moved - rate * nominal)
            numbers.append(moved)
        remaining = iter(numbers)
        rebuilt: Spec = _replace_numbers(spec, lambda: next(remaining))
        return rebuilt


def list_numbers(spec: Spec) -> list[float]:
    """List every number of a description but its sizes themselves, in the order of its fields."""
    numbers: list[float] = []
    _replace_numbers(spec, None, numbers)
    return numbers


def _replace_numbers(value: Any, take: Callable[[], Scalar] | None, seen: list[float] | None = None) -> Any:
    """Replace each number by what ``take`` gives, or only note them; in one fixed order."""
    if isinstance(value, float):
        if seen is not None:
            seen.append(value)
        return value if take is None else take()
    if isinstance(value, tuple):
        return tuple(_replace_numbers(element, take, seen) for element in value)
    if isinstance(value, Mapping):
        return {key: _replace_numbers(own, take, seen) for key, own in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        names = [field.name for field in fields(value) if field.name != "sizes"]
        own = {name: _replace_numbers(getattr(value, name), take, seen) for name in names}
        return value if take is None else replace(value, **own)
    return value


def find_size_rates(spec: Spec, make_spec: SpecMaker) -> SizeRates:
    """Find the rates of a description's numbers by its named sizes, by differences, and prove each one straight.

    A size that changes numbers otherwise than evenly, or what legs and limits there are, is left out; so is one that
    changes nothing.
    """
    base, nominal = list_numbers(spec), dict(spec.sizes)
    chosen: dict[str, list[float]] = {}
    for name, value in nominal.items():
        rates = _measure_rates(base, name, value, nominal, make_spec)
        if rates is not None and any(rates) and _is_even({**chosen, name: rates}, base, nominal, make_spec):
            chosen[name] = rates
    columns = list(chosen.values())
    rows = tuple(tuple(column[i] for column in columns) for i in range(len(base)))
    return SizeRates(tuple(chosen), tuple(nominal[name] for name in chosen), rows)


def _choose_step(value: float) -> float:
    return _STEP * abs(value) or _STEP


def _read_numbers(sizes: Mapping[str, float], count: int, make_spec: SpecMaker) -> list[float] | None:
    try:
        numbers = list_numbers(make_spec(sizes))
    except ParakinError:  # no machine of such sizes
        return None
    return numbers if len(numbers) == count else None


def _measure_rates(
    base: list[float], name: str, value: float, nominal: Mapping[str, float], make_spec: SpecMaker
) -> list[float] | None:
    step = _choose_step(value)
    moved = _read_numbers({**nominal, name: value + step}, len(base), make_spec)
    if moved is None:
        return None
    return [
        _round_rate((b - a) / step) if isfinite(a) and isfinite(b) else 0.0 for a, b in zip(base, moved, strict=True)
    ]


def _round_rate(rate: float) -> float:
    """Round a rate to the simple number from which rounding alone tells it."""
    return float(round(rate)) if abs(rate - round(rate)) < _EVEN else rate


def _is_even(
    chosen: Mapping[str, list[float]], base: list[float], nominal: Mapping[str, float], make_spec: SpecMaker
) -> bool:
    """Tell whether the numbers are where the rates say, with all chosen sizes changed at once, to either side."""
    for way in _list_ways(len(chosen)):
        steps = {name: sign * _choose_step(nominal[name]) for name, sign in zip(chosen, way, strict=True)}
        moved = _read_numbers({**nominal, **{n: nominal[n] + s for n, s in steps.items()}}, len(base), make_spec)
        if moved is None:
            return False
        for i, (number, now) in enumerate(zip(base, moved, strict=True)):
            expected = number + sum(chosen[name][i] * step for name, step in steps.items())
            if not (now == expected or abs(now - expected) <= _EVEN * (1.0 + abs(now))):
                return False
    return True


def _list_ways(count: int) -> Iterator[list[float]]:
    """List ways to change sizes at once: by twice, by one to the other side, and in turns."""
    yield [2.0] * count
    yield [-1.0] * count
    yield [1.5 if i % 2 else -0.7 for i in range(count)]
