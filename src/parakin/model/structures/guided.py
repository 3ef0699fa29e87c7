"""The motion's independent coordinates are the pose, and constraints tell the others."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import IDENTITY, Mat, Scalar, Vec, add, apply, product, sincos, sub
from ...algebra import make_axis_rotation as turned
from ...errors import DescriptionError
from ..chain import UNIT, compose_chain, compute_fixed_axis_angles, make_small_rotation
from ..elements import ROTATIONS, TRANSLATIONS
from ..nominal_values import find_nominal_value
from ..spec import Spec
from .base import LETTERS, PlatformPlacement, Structure
from .constraint_rates import list_rates
from .parasitic import (
    FoundFrame,
    TurnedByPlanes,
    TurnInBasePlanes,
    choose_branch,
    has_parallel_planes,
    has_planes_of,
    list_independent_words,
    list_planes,
)
from .solved_constraints import SolvedConstraints, UnturnedByRods, has_parallelograms


class Guided(Structure):
    """The pose is the motion's independent coordinates, and the others follow; tool and head are fixed frames.

    Closed forms: rods in parallel with legs' rods keep the platform upright, planes of the platform tell all three
    turns (axes X Y Z), or planes of the base tell the first turn of the motion, rz, and some translations. All else
    is solved in steps.
    Small turns are about the machine frame's axes.
    """

    def __init__(self, spec: Spec):
        super().__init__(spec)
        self.coordinates = list_independent_words(spec)
        self.axes = tuple(LETTERS[word] for word in self.coordinates)
        self.turns = tuple(f"w{word[1]}" for word in self.coordinates if word in ROTATIONS)
        turn_words = tuple(word for word in spec.motion if word in ROTATIONS)
        if turn_words != ("rz", "ry", "rx"):
            raise DescriptionError(
                "motion", f"{' '.join(spec.motion)}: its three turns go rz ry rx, as C, B and A of a pose do"
            )
        if any(step.axis in ROTATIONS and step.value for step in (*spec.mounting, *spec.head)):
            raise DescriptionError(
                "head", "a guided platform without a drive in head or table turns neither it nor its mounting"
            )
        _, self.tip = compose_chain(spec.head, ())
        home = [spec.home.get(letter, 0.0) for letter in self.axes]
        self.turned: TurnedByPlanes | UnturnedByRods | None = None
        self.planes: TurnInBasePlanes | None = None
        self.solved: SolvedConstraints | None = None
        self.branch = 1.0
        if self.coordinates == TRANSLATIONS and has_parallelograms(spec):
            self.turned = UnturnedByRods(spec)
        elif self.coordinates == TRANSLATIONS and has_parallel_planes(spec) and not self._has_head:
            self.turned = TurnedByPlanes(spec)
            self.turned.choose_branches(sub(home, self.base))
        elif "rz" in spec.parasitic and self.parasitic_turns == 1 and has_planes_of(spec, "base"):
            words = [word for word in TRANSLATIONS if word in spec.parasitic]
            self.planes = TurnInBasePlanes(list_planes(spec), words, self.tip)
            self.branch = choose_branch(self._solve(home, ()).rotation[0][0])
        elif set(turn_words) & set(spec.parasitic) in (set(), {"rz"}, set(ROTATIONS)):
            self.solved = SolvedConstraints(spec, self.tip, self._know(home))
        else:
            raise DescriptionError(
                "parasitic", f"{' '.join(spec.parasitic)}: of the turns rz ry rx none, rz or all are parasitic"
            )

    @property
    def _has_head(self) -> bool:
        return any(find_nominal_value(x) for x in self.tip)

    @property
    def is_solved(self) -> bool:
        return self.solved is not None

    def _know(self, pose: Sequence[Scalar]) -> dict[str, Scalar]:
        """Name the pose's coordinates by their words; lengths are in the base."""
        shifts = dict(zip(TRANSLATIONS, self.base, strict=True))
        return {word: value - shifts.get(word, 0.0) for word, value in zip(self.coordinates, pose, strict=True)}

    @property
    def middle_turn(self) -> int | None:
        return self.coordinates.index("ry") if "ry" in self.coordinates else None

    def _solve(self, pose: Sequence[Scalar], turn: Sequence[Scalar]) -> FoundFrame:
        given = self._know(pose)
        known = tuple(given.get(word, 0.0) for word in TRANSLATIONS)
        small = dict(zip(self.turns, turn, strict=False))
        turned_on = tuple(small.get(name, 0.0) for name in ("wx", "wy", "wz"))
        if self.solved is not None:
            return self.solved.find_frame(given, turned_on)
        if self.turned is not None:
            moved = self.turned.find_frame(known)
            return FoundFrame(moved.rotation, sub(moved.origin, apply(moved.rotation, self.tip)), moved.reach)
        assert self.planes is not None
        before = IDENTITY
        for word in ("ry", "rx"):
            before = product(before, turned(word, *sincos(given[word])))
        guided = self.planes.solve(make_small_rotation(turned_on), "rz", known, self.branch, before)
        return FoundFrame(guided.rotation, sub(guided.origin, apply(guided.rotation, self.tip)), guided.reach)

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> PlatformPlacement:
        guided = self._solve(pose, ())
        return PlatformPlacement(guided.rotation, guided.origin, list(pose), [], constraint_reach=guided.reach)

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        guided = self._solve(coordinates, ())
        return guided.rotation, guided.origin

    def coordinates_of(self, rotation: Mat, origin: Vec) -> list[Scalar]:
        tip = add(add(origin, apply(rotation, self.tip)), self.base)
        angles = compute_fixed_axis_angles(rotation)
        given = dict(zip((*TRANSLATIONS, *ROTATIONS), (*tip, *angles), strict=True))
        return [given[word] for word in self.coordinates]

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        return list(coordinates)

    def closure(
        self, pose: Sequence[Scalar], serial: Sequence[Scalar], turn: Sequence[Scalar] = ()
    ) -> tuple[Mat, Vec, list[Scalar]]:
        guided = self._solve(pose, turn)
        return guided.rotation, guided.origin, []

    def list_constraint_rates(self, pose: Sequence[Scalar], rotation: Mat, origin: Vec) -> list[list[Scalar]]:
        axes = [UNIT[word] for word in ROTATIONS] if self.parasitic_turns == 3 else [UNIT["tz"]]
        return list_rates(self.spec, rotation, origin, axes[: self.parasitic_turns])
