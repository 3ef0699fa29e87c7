"""A platform that only translates, with two turning axes in head and table."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import IDENTITY, Mat, Scalar, Vec, add, apply, cross, dot, sub, transpose
from ..chain import UNIT, Pointing, compose_chain, invert_rotations, transform_to_local
from ..elements import TRANSLATIONS
from ..spec import Spec
from .base import PlatformPlacement
from .five_axis import FiveAxis, compute_axis_angles, turn_tool_axis


class Carried(FiveAxis):
    """A platform that only translates; head and table together turn twice."""

    pointing: Pointing

    def __init__(self, spec: Spec):
        super().__init__(spec)
        self.coordinates = TRANSLATIONS
        chain = [*invert_rotations(spec.table), *spec.mounting, *spec.head]
        self.pointing = Pointing.from_steps(chain, "head" if self.head_joints else "table")
        # The turning axes as they follow on each other: the table's, inverted, then the head's.
        drives = [step.drive for step in spec.head if step.drive] + [step.drive for step in spec.table if step.drive]
        self.serial_order = tuple(drives.index(step.drive) for step in chain if step.drive is not None)

    @property
    def _has_wrist_centre(self) -> bool:
        """Whether both axes and the tool's axis meet: then the tool's axis alone shifts the tip."""
        head = self.spec.head
        driven = [i for i, step in enumerate(head) if step.drive is not None]
        if self.has_turning_table or len(driven) < 2:
            return False
        arm = compose_chain(head[driven[0] + 1 : driven[1]], ())[1]
        rotation, tool = compose_chain(head[driven[1] + 1 :], ())
        return not any(arm) and not any(cross(tool, apply(rotation, UNIT["tz"])))

    def bound_platform_way(self, ways: Sequence[Scalar]) -> Scalar | None:
        if not self._has_wrist_centre:
            return None
        tip, (b, c) = ways[:3], ways[self.direction.pair]
        return 2.0 * (dot(tip, tip) + self.measure_tool_reach() ** 2 * (b * b + c * c))

    def _split(self, serial: Sequence[Scalar]) -> tuple[Sequence[Scalar], Sequence[Scalar]]:
        return serial[: self.head_joints], serial[self.head_joints :]

    def _origin(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> Vec:
        head, table = self._split(serial)
        top, place = compose_chain(self.spec.table, table)
        world = add(place, apply(top, pose[:3]))
        _, tip = compose_chain(self.spec.head, head)
        return sub(transform_to_local(self.mount, self.base, world), tip)

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> PlatformPlacement:
        k, _, _ = turn_tool_axis(pose)
        turns = self.pointing.solve(k, branch, first)
        serial = [turns.joints[self.serial_order.index(i)] for i in range(2)]
        origin = self._origin(pose, serial)
        return PlatformPlacement(IDENTITY, origin, list(origin), serial, turns.reach, turns.freedom, turns.off_axis)

    def place_with_joints(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> PlatformPlacement:
        origin = self._origin(pose, serial)
        reach = self.place(pose, self.branches).reach
        return PlatformPlacement(IDENTITY, origin, list(origin), list(serial), reach)

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        return IDENTITY, tuple(coordinates)

    def _axis(self, serial: Sequence[Scalar]) -> Vec:
        head, table = self._split(serial)
        k = apply(self.mount, apply(compose_chain(self.spec.head, head)[0], UNIT["tz"]))
        return apply(transpose(compose_chain(self.spec.table, table)[0]), k)

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        head, table = self._split(serial)
        tip = add(tuple(coordinates), compose_chain(self.spec.head, head)[1])
        top, place = compose_chain(self.spec.table, table)
        return [
            *transform_to_local(top, place, add(apply(self.mount, tip), self.base)),
            *compute_axis_angles(self._axis(serial)),
        ]

    def closure(
        self, pose: Sequence[Scalar], serial: Sequence[Scalar], turn: Sequence[Scalar] = ()
    ) -> tuple[Mat, Vec, list[Scalar]]:
        return IDENTITY, self._origin(pose, serial), self._tilt_rows(pose, turn, self._axis(serial))
