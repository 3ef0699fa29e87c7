"""Parasitic motions without a closed form: Newton's method with a fixed number of steps, from those at home."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from math import isfinite
from typing import Any

import numpy as np

from ...algebra import (
    IDENTITY,
    ORIGIN,
    Mat,
    Scalar,
    Term,
    Trace,
    Vec,
    apply,
    derivative,
    evaluate_trace,
    expand_determinant,
    maximum,
    minimum,
    product,
    sincos,
    sqrt,
    stop_gradient,
    sub,
)
from ...algebra import make_axis_rotation as turned
from ...arrays import Flags
from ...errors import DescriptionError
from ..chain import make_small_rotation
from ..elements import ROTATIONS, TRANSLATIONS, PlaneConstraint, RodConstraint
from ..legs import Leg
from ..nominal_values import find_nominal_value
from ..spec import Spec
from .constraint_rates import find_carrier, measure_constraint
from .parasitic import FoundFrame

STEPS = 5  # Newton's, from home's parasitic motions; the number of right digits doubles with each
CONVERGED = 1e-7  # the last step's size, mm in a machine of a metre and rad: what is left is its square
_HOME_STEPS = 60
_FAR = 1e12  # mm; more than any origin's coordinate
_SAMPLES, _ROUNDS = 2000, 4  # poses that are looked at for how far parasitic motions go
_MARGIN = 3.0  # times what is seen
_REGULAR = 0.2  # of home's determinant: nearer to a constraint singularity parasitic motions have no bound
_LEAST = {"t": 1.0, "r": 1e-3}  # mm and rad
_LEAST_OF_FREE = {"t": 60.0, "r": 0.12}  # likewise where sizes are free: a calibrated pair moves it far
_WORDS = (*TRANSLATIONS, *ROTATIONS)


class SolvedConstraints:
    """Constraints of any kind, as many as there are parasitic motions, solved by Newton's method.

    The platform's frame is given by all six words: where ``middle`` is in the base, and R = Rz·Ry·Rx. Derivatives by
    the other words, and by sizes that are free, are those of the solution, to the second order: they pass through the
    last two steps. Where the steps begin and how far motions go is decided by the sizes' nominal values.
    """

    def __init__(self, spec: Spec, middle: Vec, home: Mapping[str, Scalar]):
        self.middle = middle
        self.unknown = tuple(word for word in _WORDS if word in spec.parasitic)
        self._trace = Trace()
        given = dict(zip(_WORDS, self._trace.inputs(6), strict=True))
        small = make_small_rotation(self._trace.inputs(3, 6))
        self._sizes: list[Term] = []  # that are free, terms of another trace; they are inputs of this one

        def take_size(size: Term) -> Scalar:
            self._sizes.append(size)
            return self._trace.input(8 + len(self._sizes))

        own = replace_terms(spec, take_size)
        frame = self._place(given, small, replace_terms(middle, take_size))
        open_by = [measure_constraint(own, constraint, *frame) for constraint in own.constraints]
        self.spec, self._nominal_middle = replace_terms((spec, middle), find_nominal_value)
        self._nominal_sizes = [find_nominal_value(size) for size in self._sizes]
        slopes = [derivative(f, given[word]) for f in open_by for word in self.unknown]
        self._outputs = [*open_by, *slopes]
        self.start = dict.fromkeys(self.unknown, 0.0)
        self.home_determinant = 1.0
        home = {word: find_nominal_value(value) for word, value in home.items()}
        self._assemble_home(home)
        with np.errstate(all="ignore"):
            self.farthest = self._bound_motions(home)

    def _place(self, values: Mapping[str, Scalar], small: Mat, middle: Vec) -> tuple[Mat, Vec]:
        rotation = small
        for word in ("rz", "ry", "rx"):
            rotation = product(rotation, turned(word, *sincos(values[word])))
        return rotation, sub([values[word] for word in TRANSLATIONS], apply(rotation, middle))

    def _step(
        self, values: Mapping[str, Scalar], turn: Vec, sizes: Sequence[Scalar]
    ) -> tuple[dict[str, Scalar], Scalar]:
        """Take one of Newton's steps from values of all six words; return the changes, and the determinant."""
        n = len(self.unknown)
        results = evaluate_trace(self._trace, self._outputs, [*(values[word] for word in _WORDS), *turn, *sizes])
        open_by, rows = results[:n], [results[n + i * n : n + (i + 1) * n] for i in range(n)]
        determinant = expand_determinant(rows)
        inverse = 1.0 / determinant
        changes = {}
        for column, word in enumerate(self.unknown):
            replaced = [
                [-f if i == column else entry for i, entry in enumerate(row)]
                for row, f in zip(rows, open_by, strict=True)
            ]
            changes[word] = expand_determinant(replaced) * inverse
        return changes, determinant

    def _assemble_home(self, home: Mapping[str, float]) -> None:
        """Find home's parasitic motions from none, by damped steps."""
        values = {**dict.fromkeys(_WORDS, 0.0), **home}
        for _ in range(_HOME_STEPS):
            changes, determinant = self._step(values, ORIGIN, self._nominal_sizes)
            steps = {word: float(change) for word, change in changes.items()}
            if not all(isfinite(step) for step in steps.values()):
                break
            turn = max((abs(step) for word, step in steps.items() if word in ROTATIONS), default=0.0)
            damping = min(1.0, 0.3 / max(turn, 0.3))
            for word, step in steps.items():
                values[word] += damping * step
            if self._measure_step(steps) < CONVERGED**4:
                self.start = {word: values[word] for word in self.unknown}
                self.home_determinant = float(determinant)
                return
        raise DescriptionError("constraints", "no frame of the platform keeps them at home")

    def _clamp(self, word: str, value: Scalar) -> Scalar:
        """Keep a parasitic motion within what is looked at: then bounds over boxes of any size have an end."""
        return maximum(minimum(value, self.start[word] + self.farthest[word]), self.start[word] - self.farthest[word])

    def _bound_motions(self, home: Mapping[str, float]) -> dict[str, float]:
        """Bound how far parasitic motions go from home's: a multiple of what is seen where all drives are in range."""
        size = max(sum(map(abs, (*each.platform, *each.foot))) + _get_rod(each) for each in self.spec.constraints)
        rng, farthest = np.random.default_rng(0), {word: 1.0 if word in ROTATIONS else size for word in self.unknown}
        spread = {word: 1.0 if word in ROTATIONS else size for word in home}
        least = _LEAST_OF_FREE if self._sizes else _LEAST
        for _ in range(_ROUNDS):
            values: dict[str, Scalar] = {
                word: value + spread[word] * rng.uniform(-1.0, 1.0, _SAMPLES) for word, value in home.items()
            }
            values.update({word: np.full(_SAMPLES, start) for word, start in self.start.items()})
            changes: dict[str, Scalar] = {}
            determinant: Scalar = 0.0
            for _ in range(2 * STEPS):
                changes, determinant = self._step(values, ORIGIN, self._nominal_sizes)
                values.update({word: values[word] + change for word, change in changes.items()})
            regular = determinant * (1.0 / self.home_determinant) > _REGULAR
            kept = (self._measure_step(changes) < CONVERGED**2) & regular & self._find_in_range(values)
            if kept.any():
                spread = {word: 1.2 * np.abs(values[word][kept] - home[word]).max() for word in home}
                farthest = {
                    word: _MARGIN * float(np.abs(values[word][kept] - self.start[word]).max()) + least[word[0]]
                    for word in self.unknown
                }
        return farthest

    def _find_in_range(self, values: Mapping[str, Scalar]) -> Flags:
        """Find rows in which every leg's joints are within their ranges."""
        rotation, origin = self._place(values, IDENTITY, self._nominal_middle)
        kept = np.ones(_SAMPLES, np.bool_)
        for leg in self.spec.legs:
            joints = leg.inverse(leg.place_joint(rotation, origin), getattr(leg, "branch", "")).joints
            for drive, q in zip(leg.drives, joints, strict=True):
                kept &= (q - drive.offset >= drive.low) & (q - drive.offset <= drive.high)
        return kept

    def _measure_step(self, changes: Mapping[str, Scalar]) -> Scalar:
        """Measure the square of a step, of a machine of a metre."""
        return sum((c * c * (1.0 if word in ROTATIONS else 1e-6) for word, c in changes.items()), 0.0)

    def find_frame(self, known: Mapping[str, Scalar], turn: Vec) -> FoundFrame:
        """Find the frame for the words that are not parasitic, turned on by small angles about the base's axes.

        Its origin is NaN where the steps don't converge. Its reach is the determinant of the constraints' rates, 1 at
        home.
        """
        values: dict[str, Scalar] = {**known, **self.start}
        size: Scalar = 0.0
        determinant: Scalar = 1.0
        for step in range(STEPS):
            if step == STEPS - 2:
                values.update({word: stop_gradient(values[word]) for word in self.unknown})
            changes, determinant = self._step(values, turn, self._sizes)
            values.update({word: self._clamp(word, values[word] + change) for word, change in changes.items()})
            size = maximum(minimum(self._measure_step(changes), 1.0), 0.0)  # bounds of it have an end
        rotation, origin = self._place(values, make_small_rotation(turn), self.middle)
        first, *others = origin
        first = minimum(first, _FAR + sqrt(stop_gradient(1.0 - size * CONVERGED**-2)))
        return FoundFrame(rotation, (first, *others), (determinant * (1.0 / self.home_determinant),))


def _get_rod(constraint: PlaneConstraint | RodConstraint) -> float:
    return constraint.rod if isinstance(constraint, RodConstraint) else 0.0


class UnturnedByRods:
    """Rods in parallel with the rods of three legs, of the same length: the platform keeps its orientation."""

    def __init__(self, spec: Spec):
        self.spec = spec

    def find_frame(self, origin: Vec) -> FoundFrame:
        return FoundFrame(IDENTITY, tuple(origin), ())


def replace_terms(described: Any, change: Callable[[Term], Scalar]) -> Any:
    """Replace the terms of a description, of tuples, mappings and dataclasses, by what ``change`` makes of each."""
    if isinstance(described, Term):
        return change(described)
    if isinstance(described, tuple):
        return tuple(replace_terms(each, change) for each in described)
    if isinstance(described, Mapping):
        return {key: replace_terms(each, change) for key, each in described.items()}
    if is_dataclass(described) and not isinstance(described, type):
        names = [field.name for field in fields(described) if field.init]
        return replace(described, **{name: replace_terms(getattr(described, name), change) for name in names})
    return described


def has_parallelograms(spec: Spec) -> bool:
    """Tell whether every constraint is a rod that makes a parallelogram with the rod of the leg that carries it."""
    return all(isinstance(each, RodConstraint) and _is_parallel(spec, each) for each in spec.constraints)


def _is_parallel(spec: Spec, rod: RodConstraint) -> bool:
    if rod.drive is None:
        return False
    leg, number = find_carrier(spec, rod.drive)
    if leg.find_fixed_joint() is None or leg.sphere([0.0] * len(leg.drives)) is None:
        return False
    return not any(_find_skew(rod, leg, number, q) for q in (0.0, 0.7, -1.3))


def _find_skew(rod: RodConstraint, leg: Leg, number: int, q: float) -> bool:
    """Find whether a rod is not parallel to the leg's own, or of another length, at one value of joints.

    What follows from free sizes counts as zero only where it is for all of them.
    """
    joints = [q] * len(leg.drives)
    sphere = leg.sphere(joints)
    assert sphere is not None
    feet = sub(leg.carry(rod.foot, joints, number), sphere[0])
    off = (*sub(feet, sub(rod.platform, leg.platform)), rod.rod - sphere[1])
    return any(isinstance(x, Term) or abs(x) > 1e-12 * find_nominal_value(rod.rod) for x in off)
