"""A platform that lifts and tilts over a table on two slides."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import IDENTITY, Mat, Scalar, Vec, add, apply, dot, product, scale, sincos, sub, transpose
from ...algebra import make_axis_rotation as turned
from ...errors import DescriptionError
from ..chain import UNIT, Pointing, compose_chain, transform_to_local
from ..elements import ROTATIONS, TRANSLATIONS
from ..nominal_values import find_nominal_value
from ..spec import Spec
from .base import PlatformPlacement
from .constraint_rates import list_rates
from .five_axis import FiveAxis, compute_axis_angles, make_least_rotation, turn_tool_axis
from .parasitic import (
    FoundFrame,
    TurnInBasePlanes,
    choose_branch,
    has_planes_of,
    list_independent_words,
    list_planes,
)

_ZERO = 1e-12  # of a direction: what is less is rounding


class SlidingTable(FiveAxis):
    """A platform that lifts and tilts, its own turn and two translations parasitic, over a table on two slides.

    The tool stands on the platform's z. The table's slides move along the parasitic translations: they follow the
    platform, and make the two axes that it lacks.
    """

    branches = ""
    has_slides = True

    def __init__(self, spec: Spec):
        super().__init__(spec)
        self.coordinates = list_independent_words(spec)
        self.turn_words = tuple(word for word in spec.motion if word in ROTATIONS)
        if "rz" not in spec.parasitic or self.turn_words[-1] != "rz" or self.parasitic_turns != 1:
            raise DescriptionError(
                "parasitic",
                f"{' '.join(spec.parasitic)}: over a sliding table it is two translations and rz, the last turn of "
                "the motion",
            )
        if not has_planes_of(spec, "base"):
            raise DescriptionError("constraints", "over a sliding table their planes are of the base")
        head, self.tip = compose_chain(spec.head, ())
        if any(step.drive is not None for step in spec.head):
            raise DescriptionError("head", "over a sliding table the head has no drives")
        aside = (*self.tip[:2], *sub(head[2], UNIT["tz"]))
        if any(find_nominal_value(x) for x in aside):
            raise DescriptionError("head", "over a sliding table the tool stands on the platform's z")
        words = [word for word in TRANSLATIONS if word in spec.parasitic]
        self.planes = TurnInBasePlanes(list_planes(spec), words)
        self.across = [TRANSLATIONS.index(word) for word in words]
        self._read_slides()
        first, second = self.turn_words[:2]
        self.tilts = Pointing(UNIT[first], UNIT[second], UNIT["tz"])
        self.branch = 1.0
        home = [spec.home.get(letter, 0.0) for letter in self.axes]
        self.branch = choose_branch(self._place(home, turn_tool_axis(home)[0])[0].rotation[0][0])

    def _read_slides(self) -> None:
        """Find the table's frame at zeros, and how its slides move the tip across the base, mm a mm."""
        steps = self.spec.table
        drives = [step for step in steps if step.drive is not None]
        if len(drives) != 2 or any(step.axis not in TRANSLATIONS for step in drives):
            raise DescriptionError("table", "its drives are two slides: with a guided platform it has two")
        self.table_rotation, self.table_origin = compose_chain(steps, (0.0, 0.0))
        ways = []
        for one in ((1.0, 0.0), (0.0, 1.0)):
            ways.append(apply(transpose(self.mount), sub(compose_chain(steps, one)[1], self.table_origin)))
        (along,) = (row for row in range(3) if row not in self.across)
        (a, c), (b, d) = ([way[row] for row in self.across] for way in ways)
        determinant = a * d - b * c
        off = max(abs(find_nominal_value(way[along])) for way in ways)
        if off > _ZERO or abs(find_nominal_value(determinant)) < _ZERO:
            raise DescriptionError("table", "its slides move along the parasitic translations")
        self.to_slides = [[entry * (1.0 / determinant) for entry in row] for row in ((d, -b), (-c, a))]

    def _place(self, pose: Sequence[Scalar], k: Vec) -> tuple[FoundFrame, list[Scalar]]:
        """Find the platform's frame, and the table's slides."""
        z = apply(transpose(self.mount), apply(self.table_rotation, k))
        world = add(self.table_origin, apply(self.table_rotation, tuple(pose[:3])))
        known = sub(transform_to_local(self.mount, self.base, world), scale(z, self.tip[2]))
        lifted = tuple(0.0 if i in self.across else c for i, c in enumerate(known))
        guided = self.planes.solve(make_least_rotation(z), "rz", lifted, self.branch)
        off = [guided.origin[i] - known[i] for i in self.across]
        return guided, [dot(row, off) for row in self.to_slides]

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> PlatformPlacement:
        guided, slides = self._place(pose, turn_tool_axis(pose)[0])
        coordinates = self.coordinates_of(guided.rotation, guided.origin)
        return PlatformPlacement(guided.rotation, guided.origin, coordinates, slides, constraint_reach=guided.reach)

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        given = dict(zip(self.coordinates, coordinates, strict=True))
        tilted = IDENTITY
        for word in self.turn_words[:2]:
            tilted = product(tilted, turned(word, *sincos(given[word])))
        lifted = tuple(given.get(word, 0.0) for word in TRANSLATIONS)
        guided = self.planes.solve(tilted, "rz", lifted, self.branch)
        return guided.rotation, guided.origin

    def coordinates_of(self, rotation: Mat, origin: Vec) -> list[Scalar]:
        angles = self.tilts.solve(tuple(row[2] for row in rotation), "+").joints
        given = {**dict(zip(TRANSLATIONS, origin, strict=True)), **dict(zip(self.turn_words, angles, strict=False))}
        return [given[word] for word in self.coordinates]

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        rotation, origin = self.frame(coordinates)
        z = tuple(row[2] for row in rotation)
        world = add(apply(self.mount, add(origin, scale(z, self.tip[2]))), self.base)
        k = apply(transpose(self.table_rotation), apply(self.mount, z))
        _, place = compose_chain(self.spec.table, serial)
        return [*transform_to_local(self.table_rotation, place, world), *compute_axis_angles(k)]

    def list_coordinate_margins(self, coordinates: Sequence[Scalar]) -> list[Scalar]:
        given = dict(zip(self.coordinates, coordinates, strict=True))
        return [sincos(given[self.turn_words[1]])[1]]

    def closure(
        self, pose: Sequence[Scalar], serial: Sequence[Scalar], turn: Sequence[Scalar] = ()
    ) -> tuple[Mat, Vec, list[Scalar]]:
        guided, slides = self._place(pose, turn_tool_axis(pose, turn)[0])
        return guided.rotation, guided.origin, [own - given for own, given in zip(slides, serial, strict=True)]

    def list_constraint_rates(self, pose: Sequence[Scalar], rotation: Mat, origin: Vec) -> list[list[Scalar]]:
        return list_rates(self.spec, rotation, origin, [tuple(row[2] for row in rotation)])
