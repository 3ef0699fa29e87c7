"""A path between its records: the pose goes straight from one to the next, and the joints go on as the machine takes
them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...kinematics.wrist import PRINTED, find_nearest_turn
from ...machine import Machine
from ...performance.characteristic_length import characteristic_length
from ...performance.jacobians import column_scales
from ..path import Floats
from ..posting.posted import Posted

Indices = NDArray[np.int64]
Signs = NDArray[np.int8]

ONE, OTHER, EITHER = 0, 1, 2  # working modes of head and table: the path's own, the other one, free
NEAR = 1e-4  # of det A at home, next to a parallel singularity
SIGNLESS = 1e-12  # a determinant of unit wrenches no greater has no sign


@dataclass(frozen=True, eq=False)
class Places:
    """Places on motions, n of them: poses, joints taken there, the limits' margins, head and table's working mode."""

    poses: Floats
    joints: Floats
    margins: Floats
    sign: Signs

    def take(self, which: NDArray[np.bool_] | Indices) -> Places:
        return Places(self.poses[which], self.joints[which], self.margins[which], self.sign[which])

    def joined(self, other: Places) -> Places:
        poses, joints = np.concatenate([self.poses, other.poses]), np.concatenate([self.joints, other.joints])
        margins, sign = np.concatenate([self.margins, other.margins]), np.concatenate([self.sign, other.sign])
        return Places(poses, joints, margins, sign)


class Motions:
    """The motions of a posted path; motion i leads from record i - 1 to record i, i ≥ 1."""

    def __init__(self, posted: Posted):
        self.posted, self.machine = posted, posted.machine
        self.wrist = self.machine.wrist
        self.serial = [] if self.wrist is None else sorted(self.wrist.pair)
        self.turning = [i for i, unit in enumerate(self.machine.joint_units) if unit == "rad"]
        self.modes = [posted.mode] if self.wrist is None else [posted.mode, self.wrist.other_mode(posted.mode)]
        names, ends = (
            self.machine.limits,
            [f"{self.machine.joints[i]}.{k}" for i in self.serial for k in ("min", "max")],
        )
        self.of_serial = np.array([name in ends for name in names], bool)  # columns of the limits
        self.looked_at = 0  # places, so that the work can be told

    def at_records(self, records: Indices) -> Places:
        """What the path has there."""
        poses, joints = self.posted.poses[records], self.posted.joints[records]
        return Places(poses, joints, self._margins(poses, joints), self.signs(poses, joints))

    def along(self, motion: Indices, share: Floats) -> Floats:
        """Poses (n, axes) after a share of each motion."""
        start, end = self.posted.poses[motion - 1], self.posted.poses[motion]
        return np.ascontiguousarray(start + share[:, None] * (end - start))

    def at(self, motion: Indices, share: Floats, guess: Floats, sign: Signs) -> Places:
        """Places on motions, with the joints nearest to ``guess``; ``sign`` is the working mode where it is known."""
        poses = self.along(motion, share)
        joints, sign = self._taken(poses, guess, sign)
        return Places(poses, joints, self._margins(poses, joints), sign)

    def _margins(self, poses: Floats, joints: Floats) -> Floats:
        self.looked_at += len(poses)
        return self.machine.margins(poses, joints, self.posted.mode)

    def signs(self, poses: Floats, joints: Floats) -> Signs:
        """The working mode of head and table that joints are of."""
        signs = np.zeros(len(poses), np.int8)
        if self.wrist is None:
            return signs
        odd = np.flatnonzero(~self.wrist.has_mode(poses, joints, self.modes[0]))
        signs[odd] = np.where(self.wrist.has_mode(poses[odd], joints[odd], self.modes[1]), OTHER, EITHER)
        return signs

    def _taken(self, poses: Floats, guess: Floats, sign: Signs) -> tuple[Floats, Signs]:
        joints = self._counted(self.machine.inverse(poses, self.modes[0]), guess)
        if self.wrist is None:
            return joints, np.zeros(len(poses), np.int8)
        other = self._counted(self.machine.inverse(poses, self.modes[1]), guess)
        far, near = (((q - guess)[:, self.serial] ** 2).sum(1) for q in (joints, other))
        found = np.where(sign == EITHER, np.where(near < far, OTHER, ONE), sign).astype(np.int8)
        joints[found == OTHER] = other[found == OTHER]
        first = guess[:, self.wrist.first]
        free = np.flatnonzero(self.wrist.find_free(poses, PRINTED) & np.isfinite(first))
        if len(free):
            solved = self.wrist.solve_with_first(poses[free], self.modes[0], first[free])
            joints[free] = self._counted(solved, guess[free])
            found[free] = EITHER
        return joints, found

    def _counted(self, joints: Floats, guess: Floats) -> Floats:
        for i in self.turning:
            counted = find_nearest_turn(joints[:, i], guess[:, i])
            joints[:, i] = np.where(np.isfinite(counted), counted, joints[:, i])
        return joints

    @staticmethod
    def over_the_pole(start: Places, end: Places) -> NDArray[np.bool_]:
        """Which motions change head and table's working mode on the way.

        These joints go straight from value to value, past the pole: none of their limits is broken that the ends keep.
        """
        return np.asarray((start.sign != end.sign) & (start.sign != EITHER) & (end.sign != EITHER))

    def sides(self, places: Places) -> Floats:
        """det A of unit wrenches, (n,): its sign changes where a parallel singularity is passed."""
        a_scale, _, n = self._scales
        a, _, spans = self.machine.twist_rates(places.poses, places.joints)
        a, legs = a * a_scale, spans.shape[1]
        size = legs if n - legs == 2 else n  # five axes: head and table never matter
        with np.errstate(all="ignore"):
            determinant: Floats = np.linalg.det(a[:, :size, :size]) / spans.prod(1)
        return determinant

    @cached_property
    def next_to_singular(self) -> float:
        """A determinant no greater is as good as 0."""
        home = self.machine.home[None]
        joints = self.machine.inverse(home, self.posted.mode)
        at_home = abs(float(self.sides(Places(home, joints, np.empty((1, 0)), np.zeros(1, np.int8)))[0]))
        return NEAR * at_home if at_home > SIGNLESS else SIGNLESS

    @cached_property
    def _scales(self) -> tuple[Floats, Floats, int]:
        return (*column_scales(self.machine, characteristic_length(self.machine)), len(self.machine.axes))


def machine_size(machine: Machine) -> float:
    """The greatest length that a limit names, mm; at least 1."""
    sizes = [abs(limit.bound) for limit in machine.limit_parts if limit.unit != "rad"]
    return max([1.0, *sizes])
