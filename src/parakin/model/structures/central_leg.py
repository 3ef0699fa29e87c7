"""A passive central leg and a wrist."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import pi

from ...algebra import (
    IDENTITY,
    Mat,
    Scalar,
    Vec,
    add,
    apply,
    atan2,
    cross,
    dot,
    make_axis_rotation,
    minimum,
    move_along,
    norm,
    product,
    scale,
    sincos,
    sqrt,
    sub,
    transpose,
)
from ...errors import DescriptionError
from ..chain import UNIT, Pointing, compose_chain, make_rotation_about, transform_to_local
from ..elements import ROTATIONS, Step
from ..nominal_values import find_nominal_value
from ..spec import Spec
from .base import PlatformPlacement
from .five_axis import FiveAxis, compute_axis_angles, turn_tool_axis
from .wrist_centre import find_wrist_centre


class CentralLeg(FiveAxis):
    """A passive central leg: two turns, a sliding tube, the platform at its end, and a wrist whose axes meet on it.

    With a third turn (``rz ry rz tz``) the platform turns about the central leg and takes the wrist's first axis.
    """

    pointing: Pointing
    has_central_leg = True
    carries_pole = True

    def __init__(self, spec: Spec):
        super().__init__(spec)
        turns = tuple(word for word in spec.motion if word in ROTATIONS)
        if spec.motion[-1] != "tz" or len(turns) != len(spec.motion) - 1 or len(turns) not in (2, 3):
            raise DescriptionError("motion", f"{' '.join(spec.motion)}: a central leg is two or three turns, then tz")
        if len(turns) == 3 and turns[2] != "rz":
            raise DescriptionError(
                "motion", f"{' '.join(spec.motion)}: the third turn of a central leg is about itself, rz"
            )
        if spec.table:
            raise DescriptionError("table", "a machine with a central leg has its turning axes in the head")
        self.roll = len(turns) == 3
        spin = [Step("rz", drive=spec.legs[0].drives[0])] if self.roll else []
        self.pointing = Pointing.from_steps([*spin, *spec.head], "head")
        self.serial_order = () if self.roll else (0, 1)
        self.above, self.reach = self._find_wrist_centre()
        self.sign = 1.0
        home = tuple(spec.home.get(letter, 0.0) for letter in self.axes)
        self.sign = 1.0 if find_nominal_value(self._centre(home[:3], turn_tool_axis(home)[0])[2]) > 0.0 else -1.0
        steps = [Step(turns[0], drive=spec.legs[0].drives[0]), Step(turns[1], drive=spec.legs[0].drives[0])]
        self.passive_turns = Pointing.from_steps(steps, "motion")
        self.passive_turns = Pointing(self.passive_turns.first, self.passive_turns.second, (0.0, 0.0, self.sign))

    def _find_wrist_centre(self) -> tuple[Scalar, Scalar]:
        """Find (h, l): the point (0, 0, h) of the platform lies at the tip + l·k in every position of the head."""
        centre, length = find_wrist_centre(self.spec.head)
        height, *aside = (abs(find_nominal_value(x)) for x in (centre[2], centre[0], centre[1]))
        if max(aside) > 1e-9 * (1.0 + abs(find_nominal_value(length)) + height):
            raise DescriptionError("head", "its axes must meet in one point of the central leg, on the tool's axis")
        return centre[2], length

    def _centre(self, tip: Sequence[Scalar], k: Vec) -> Vec:
        return transform_to_local(self.mount, self.base, move_along(tuple(tip), k, self.reach))

    def _aim_central_leg(self, tip: Sequence[Scalar], k: Vec) -> tuple[Vec, Vec, Scalar]:
        """Find the central leg's direction, the platform's origin, and tz, for a tip and a tool axis."""
        centre = self._centre(tip, k)
        distance = norm(centre)
        direction = scale(centre, 1.0 / distance)
        origin = move_along(centre, direction, -self.sign * self.above)  # not by the rotation: bounds stay narrow
        return direction, origin, self.sign * distance - self.above

    def _solve_passive_turns(self, tip: Sequence[Scalar], k: Vec) -> tuple[Mat, Vec, Scalar, list[Scalar]]:
        """Find the rotation of the central leg's two turns, the platform's origin, tz, and both turns' angles."""
        direction, origin, tz = self._aim_central_leg(tip, k)
        turns = self.passive_turns.solve(direction, "+")
        rotation = IDENTITY
        axes = self.passive_turns.first, self.passive_turns.second
        if self.roll:  # hanging along the first axis its turn is free, and 0 then: no quotient may stand in the way
            for axis, angle in zip(axes, turns.joints, strict=True):
                rotation = product(rotation, make_rotation_about(axis, *sincos(angle)))
        else:
            scales = 1.0 / turns.freedom, 1.0 / turns.second_size
            for axis, (s, c), size in zip(axes, turns.turns, scales, strict=True):
                rotation = product(rotation, make_rotation_about(axis, s * size, c * size))
        return rotation, origin, tz, list(turns.joints)

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> PlatformPlacement:
        k, _, _ = turn_tool_axis(pose)
        rotation, origin, tz, angles = self._solve_passive_turns(pose[:3], k)
        wrist = self.pointing.solve(apply(transpose(rotation), apply(transpose(self.mount), k)), branch, first)
        serial = list(wrist.joints)
        if self.roll:
            spin = serial.pop(0)
            rotation = product(rotation, make_axis_rotation("rz", *sincos(spin)))
            angles.append(spin)
        placed = rotation, origin, [*angles, tz], serial
        return PlatformPlacement(*placed, wrist.reach, wrist.freedom, wrist.off_axis)

    def turn_first_axis(self, pose: Sequence[Scalar]) -> Mat:
        return product(self.mount, self.place(pose, self.branches).rotation)

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        rotation = IDENTITY
        for word, angle in zip(self.coordinates, coordinates[:-1], strict=False):
            rotation = product(rotation, make_axis_rotation(word, *sincos(angle)))
        return rotation, scale([row[2] for row in rotation], coordinates[-1])

    def coordinates_of(self, rotation: Mat, origin: Vec) -> list[Scalar]:
        axis = [row[2] for row in rotation]
        if self.roll:
            angles = list(self.passive_turns.solve(scale(axis, self.sign), "+").joints)
            turned = IDENTITY
            for word, angle in zip(self.coordinates, angles, strict=False):
                turned = product(turned, make_axis_rotation(word, *sincos(angle)))
            spin = product(transpose(turned), rotation)
            angles.append(atan2(spin[1][0], spin[0][0]))
        else:
            first, second = (UNIT[word] for word in self.coordinates[:2])
            third = cross(first, second)
            swung, seen = apply(rotation, second), apply(transpose(rotation), first)
            angles = [atan2(dot(swung, third), dot(swung, second)), atan2(dot(seen, third), dot(seen, first))]
        return [*angles, dot(origin, axis)]

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        rotation, origin = self.frame(coordinates)
        turned, tip = compose_chain(self.spec.head, serial)
        world = add(apply(self.mount, add(origin, apply(rotation, tip))), self.base)
        k = apply(self.mount, apply(rotation, apply(turned, UNIT["tz"])))
        b, c = compute_axis_angles(k)
        # Beyond these the leg points there the other way round, with its platform turned: no pose says that.
        for margin in self._list_branch_margins(coordinates):
            b = minimum(b, 2.0 * pi + sqrt(margin))
        return [*world, b, c]

    def _list_branch_margins(self, coordinates: Sequence[Scalar]) -> Iterator[Scalar]:
        """Compute what is ≥ 0 where :meth:`place` would give these coordinates back."""
        yield self.sign * (coordinates[-1] + self.above)
        if not self.roll:
            s, c = sincos(coordinates[1])
            yield c if self.passive_turns.level else s

    def place_with_joints(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> PlatformPlacement:
        if not self.roll:
            return super().place_with_joints(pose, serial)
        k, _, _ = turn_tool_axis(pose)
        rotation, origin, tz, angles = self._solve_passive_turns(pose[:3], k)
        v = apply(transpose(rotation), apply(transpose(self.mount), k))
        w = apply(compose_chain(self.spec.head, serial)[0], UNIT["tz"])  # turned onto v by the platform's own turn
        spin = atan2(w[0] * v[1] - w[1] * v[0], w[0] * v[0] + w[1] * v[1])
        rotation = product(rotation, make_axis_rotation("rz", *sincos(spin)))
        return PlatformPlacement(rotation, origin, [*angles, spin, tz], list(serial))

    def closure(
        self, pose: Sequence[Scalar], serial: Sequence[Scalar], turn: Sequence[Scalar] = ()
    ) -> tuple[Mat, Vec, list[Scalar]]:
        turned, _ = compose_chain(self.spec.head, serial)
        k, _, _ = turn_tool_axis(pose, turn)
        if self.roll:
            return self._roll_platform(pose[:3], k, apply(turned, UNIT["tz"]))
        rotation, origin, _, _ = self._solve_passive_turns(pose[:3], k)
        pointed = apply(self.mount, apply(rotation, apply(turned, UNIT["tz"])))
        return rotation, origin, self._tilt_rows(pose, turn, pointed)

    def _roll_platform(self, tip: Sequence[Scalar], k: Vec, w: Vec) -> tuple[Mat, Vec, list[Scalar]]:
        """Turn the platform about the central leg so that ``w``, the tool's axis in it, stands over k.

        Its own turn takes one of the two conditions. No angle of the central leg is needed, which would be free where
        it hangs.
        """
        direction, origin, _ = self._aim_central_leg(tip, k)
        z, k = scale(direction, self.sign), apply(transpose(self.mount), k)
        across = cross(z, k)
        ahead = cross(across, z)
        size = 1.0 / (norm(across) * sqrt(w[0] * w[0] + w[1] * w[1]))
        x = scale(sub(scale(ahead, w[0]), scale(across, w[1])), size)
        y = scale(add(scale(ahead, w[1]), scale(across, w[0])), size)
        return transpose((x, y, z)), origin, [w[2] - dot(z, k)]
