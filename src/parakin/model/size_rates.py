"""Named sizes of a machine file as inputs: every number of the description that follows them, with its rates."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from math import cos, isfinite, sin
from typing import Any, Literal, NamedTuple

from ..algebra import Scalar, sincos
from ..errors import ParakinError
from .elements import Unit
from .spec import Spec

_STEP = 0.01  # of a length, or mm where it is zero, by which it is changed to see what it changes
_TURN = 0.1  # rad, by which an angle is
_EVEN = 1e-9  # by which a number may miss where its rates say it is, of one more than its size
_TRIALS = (2.0, -1.0)  # steps at which more than an even change is told and held against

SpecMaker = Callable[[Mapping[str, float]], Spec]  # a description with other values of some of its sizes
TermShape = Literal["even", "cos", "sin"]


class SizeTerm(NamedTuple):
    """A function of one size, by its number: itself, or of an angle its cosine or sine."""

    size: int
    shape: TermShape

    def evaluate(self, sizes: Sequence[Scalar]) -> Scalar:
        """Evaluate it at sizes, scalars of any kind."""
        size = sizes[self.size]
        return size if self.shape == "even" else sincos(size)[self.shape == "cos"]


@dataclass(frozen=True)
class SizeRates:
    """How the numbers of a description follow its named sizes: each is a constant plus rates times terms of the sizes.

    names : of the sizes that change numbers, or sizes among these, so, whatever the others are; as in the file
    units, nominal : of them, and their values in these
    terms : of the sizes
    rates : for each number of the description, in the order of :func:`list_numbers`, its rates by the terms
    follows : for each size, its rates by the others, as the file calculates it from them
    """

    names: tuple[str, ...]
    units: tuple[Unit, ...]
    nominal: tuple[float, ...]
    terms: tuple[SizeTerm, ...]
    rates: tuple[tuple[float, ...], ...]
    follows: tuple[tuple[float, ...], ...]

    @property
    def acting(self) -> tuple[str, ...]:
        """Names of the sizes that change numbers themselves, not by other sizes alone."""
        moving = {term.size for k, term in enumerate(self.terms) if any(row[k] for row in self.rates)}
        return tuple(name for i, name in enumerate(self.names) if i in moving)

    def apply(self, spec: Spec, sizes: Sequence[Scalar]) -> Spec:
        """Apply sizes, scalars of any kind, to the description for whose nominal ones the rates are."""
        values = [(term.evaluate(sizes), term.evaluate(self.nominal)) for term in self.terms]
        numbers = []
        for number, rates in zip(list_numbers(spec), self.rates, strict=True):
            moved: Scalar = number
            for rate, (value, nominal) in zip(rates, values, strict=True):
                if rate != 0.0:
                    moved = value * rate + (moved - rate * nominal)
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
    """Find the rates of a description's numbers by its lengths and angles, by differences, and prove them at others.

    A size that changes numbers, or other sizes, otherwise is left out, as is one that changes what legs and limits
    there are, and one that changes nothing.
    """
    reader = _SizeReader(spec, make_spec)
    acting: dict[str, dict[TermShape, list[float]]] = {}
    known = [name for name in spec.sizes if name in spec.size_units]
    for name in known:
        rates = reader.measure_rates(name)
        if rates and reader.is_proved({**acting, name: rates}):
            acting[name] = rates
    ways = {name: reader.measure_ways(name) for name in known}
    names = [name for name, way in ways.items() if way is not None and (name in acting or set(way) & set(acting))]
    terms = [(SizeTerm(i, shape), column) for i, n in enumerate(names) for shape, column in acting.get(n, {}).items()]
    return SizeRates(
        tuple(names),
        tuple(spec.size_units[name] for name in names),
        tuple(spec.sizes[name] for name in names),
        tuple(term for term, _ in terms),
        tuple(tuple(column[i] for _, column in terms) for i in range(len(reader.numbers))),
        tuple(tuple((ways[other] or {}).get(name, 0.0) for other in names) for name in names),
    )


class _SizeReader:
    """Reads a description with other sizes."""

    def __init__(self, spec: Spec, make_spec: SpecMaker):
        self.sizes, self._units = dict(spec.sizes), spec.size_units
        self.numbers, self._make_spec = list_numbers(spec), make_spec

    def measure_rates(self, name: str) -> dict[TermShape, list[float]]:
        """Measure the rates of the numbers by a size, all others as they are; none where there are no such rates."""
        step = self._choose_step(name)
        once, twice, back = (self._read({name: count * step}) for count in (1.0, *_TRIALS))
        if once is None or twice is None or back is None:
            return {}
        even, cosine, sine = ([0.0] * len(self.numbers) for _ in range(3))
        for i, (base, *moved) in enumerate(zip(self.numbers, once, twice, back, strict=True)):
            if not all(map(isfinite, (base, *moved))):
                continue
            even[i] = _round_rate((moved[0] - base) / step)
            if self._units[name] == "rad" and not _is_near(moved[1], base + 2.0 * step * even[i]):
                even[i] = 0.0
                cosine[i], sine[i] = _solve_wave(self.sizes[name], step, moved[0] - base, moved[2] - base)
        shapes: list[tuple[TermShape, list[float]]] = [("even", even), ("cos", cosine), ("sin", sine)]
        return {shape: rates for shape, rates in shapes if any(rates)}

    def measure_ways(self, name: str) -> dict[str, float] | None:
        """Measure the rates of the sizes that the file calculates from one, all others given; None if not even."""
        step = self._choose_step(name)
        moved = [self._read_sizes({name: count * step}) for count in (1.0, *_TRIALS)]
        followers = [other for other in self._units if other != name and any(m is None or m[other] for m in moved)]
        rates = {}
        for other in followers:
            own = [self._read_sizes({name: count * step}, leave=other) for count in (1.0, *_TRIALS)]
            if any(change is None for change in own):
                return None
            first, *more = (change[other] for change in own if change is not None)
            rate = _round_rate(first / step)
            if not all(_is_near(m, c * step * rate) for m, c in zip(more, _TRIALS, strict=True)):
                return None
            if rate:
                rates[other] = rate
        return rates

    def is_proved(self, chosen: Mapping[str, Mapping[TermShape, list[float]]]) -> bool:
        """Tell whether the numbers are where the rates say, with all chosen sizes changed at once, to either side."""
        for way in _list_ways(len(chosen)):
            steps = {name: count * self._choose_step(name) for name, count in zip(chosen, way, strict=True)}
            moved = self._read(steps)
            if moved is None:
                return False
            waves = []
            for name, rates in chosen.items():
                ends = [self.sizes[name] + steps[name]], [self.sizes[name]]
                for shape, column in rates.items():
                    after, before = (SizeTerm(0, shape).evaluate(end) for end in ends)
                    waves.append((after - before, column))
            for i, (number, now) in enumerate(zip(self.numbers, moved, strict=True)):
                if not _is_near(now, number + sum(column[i] * change for change, column in waves)):
                    return False
        return True

    def _choose_step(self, name: str) -> float:
        return _TURN if self._units[name] == "rad" else _STEP * abs(self.sizes[name]) or _STEP

    def _read(self, steps: Mapping[str, float]) -> list[float] | None:
        """Read the numbers with sizes changed by steps; None where there is no such machine, or another one."""
        given = {name: value + steps.get(name, 0.0) for name, value in self.sizes.items()}
        try:
            numbers = list_numbers(self._make_spec(given))
        except ParakinError:
            return None
        return numbers if len(numbers) == len(self.numbers) else None

    def _read_sizes(self, steps: Mapping[str, float], leave: str | None = None) -> dict[str, float] | None:
        """Read by how much sizes change where some are given, changed by steps: these, or all but one."""
        kept = {name for name in self.sizes if name != leave} if leave is not None else set(steps)
        try:
            moved = self._make_spec({name: self.sizes[name] + steps.get(name, 0.0) for name in kept}).sizes
        except ParakinError:
            return None
        return {name: moved[name] - value for name, value in self.sizes.items()}


def _round_rate(rate: float) -> float:
    """Round a rate to the simple number from which rounding alone tells it."""
    return float(round(rate)) if abs(rate - round(rate)) < _EVEN else rate


def _is_near(now: float, expected: float) -> bool:
    return now == expected or abs(now - expected) <= _EVEN * (1.0 + abs(now))


def _solve_wave(angle: float, step: float, ahead: float, behind: float) -> tuple[float, float]:
    """Solve for the rates by cosine and sine of an angle from the changes a step ahead of it and a step behind it."""
    rise, bend = (ahead - behind) / (2.0 * sin(step)), (ahead + behind) / (2.0 * (cos(step) - 1.0))
    return _round_rate(bend * cos(angle) - rise * sin(angle)), _round_rate(bend * sin(angle) + rise * cos(angle))


def _list_ways(count: int) -> Iterator[list[float]]:
    """List ways to change sizes at once: by twice, by one to the other side, and in turns."""
    yield [2.0] * count
    yield [-1.0] * count
    yield [1.5 if i % 2 else -0.7 for i in range(count)]
