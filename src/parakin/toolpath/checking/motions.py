"""The motions of a posted path: the pose goes straight from record to record, the joints go on without a jump."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.tall_matrices import compute_determinants
from ...kinematics.turns import count_nearest_turns
from ...kinematics.wrist.pole_crossing import EITHER, OTHER, OWN, WristModes
from ...kinematics.wrist.pole_thresholds import PRINTED
from ...machine import Machine
from ...performance.characteristic_length import choose_characteristic_length
from ...performance.jacobians import list_column_scales
from ..posting.posted import Posted

NEAR_SINGULAR = 1e-4  # determinants up to this fraction of det A at home are next to a parallel singularity
SIGNLESS = 1e-12  # a determinant of unit wrenches no greater has no sign


@dataclass(frozen=True, eq=False)
class MotionPoints:
    """n points of motions: poses, the joints that the machine has there, the limits' margins, the wrist's modes."""

    poses: Array
    joints: Array
    margins: Array
    wrist_modes: WristModes

    def select(self, which: Flags | Indices) -> MotionPoints:
        """Return some of the points."""
        return MotionPoints(self.poses[which], self.joints[which], self.margins[which], self.wrist_modes[which])

    def append(self, other: MotionPoints) -> MotionPoints:
        """Return these points and others behind them."""
        return MotionPoints(
            np.concatenate([self.poses, other.poses]),
            np.concatenate([self.joints, other.joints]),
            np.concatenate([self.margins, other.margins]),
            np.concatenate([self.wrist_modes, other.wrist_modes]),
        )


class PathMotions:
    """The motions of a posted path; motion i leads from record i - 1 to record i, i ≥ 1.

    wrist_limits : (limits,) which of the machine's limits bound a joint of the wrist
    computed_points : how many points had their margins computed, a measure of the work
    """

    def __init__(self, posted: Posted):
        self.posted, self.machine = posted, posted.machine
        self.wrist = self.machine.wrist
        self.wrist_joints = [] if self.wrist is None else sorted(self.wrist.pair)
        self.turning_joints = self.machine.turning_joints
        self.modes = [posted.mode] if self.wrist is None else [posted.mode, self.wrist.other_mode(posted.mode)]
        ends = [f"{self.machine.joints[i]}.{side}" for i in self.wrist_joints for side in ("min", "max")]
        self.wrist_limits = np.array([name in ends for name in self.machine.limits], bool)
        self.computed_points = 0

    def get_record_points(self, records: Indices) -> MotionPoints:
        """Return the points at records, with the joints that the path has there."""
        poses, joints = self.posted.poses[records], self.posted.joints[records]
        return MotionPoints(poses, joints, self._compute_margins(poses, joints), self.find_wrist_modes(poses, joints))

    def interpolate_poses(self, motion: Indices, share: Array) -> Array:
        """Interpolate poses (n, axes) at a share of each motion."""
        start, end = self.posted.poses[motion - 1], self.posted.poses[motion]
        return np.ascontiguousarray(start + share[:, None] * (end - start))

    def compute_points(self, motion: Indices, share: Array, guess: Array, wrist_modes: WristModes) -> MotionPoints:
        """Compute points at shares of motions, with the joints nearest to a guess (n, joints).

        wrist_modes : (n,) the wrist's working mode where it is known, else EITHER
        """
        poses = self.interpolate_poses(motion, share)
        joints, wrist_modes = self._solve_nearest(poses, guess, wrist_modes)
        return MotionPoints(poses, joints, self._compute_margins(poses, joints), wrist_modes)

    def _compute_margins(self, poses: Array, joints: Array) -> Array:
        self.computed_points += len(poses)
        return self.machine.margins(poses, joints, self.posted.mode)

    def find_wrist_modes(self, poses: Array, joints: Array) -> WristModes:
        """Find the wrist's working mode that joints (n, joints) of poses (n, axes) are in, (n,)."""
        wrist_modes = np.full(len(poses), OWN, np.int8)
        if self.wrist is None:
            return wrist_modes
        odd = np.flatnonzero(~self.wrist.has_mode(poses, joints, self.modes[0]))
        wrist_modes[odd] = np.where(self.wrist.has_mode(poses[odd], joints[odd], self.modes[1]), OTHER, EITHER)
        return wrist_modes

    def _solve_nearest(self, poses: Array, guess: Array, wrist_modes: WristModes) -> tuple[Array, WristModes]:
        if self.wrist is not None:
            return self.wrist.solve_nearest(poses, self.modes[0], guess, PRINTED, wrist_modes)
        joints = self.machine.inverse(poses, self.modes[0])
        count_nearest_turns(joints, guess, self.turning_joints)
        return joints, np.full(len(poses), OWN, np.int8)

    def compute_determinants(self, points: MotionPoints) -> Array:
        """Compute det A of unit wrenches, (n,): its sign changes where a motion passes a parallel singularity.

        With more drives than freedoms it has no sign, and only falls to zero there.
        """
        a_scale, (height, width) = self._scales[0], self.machine.parallel_block
        a, _, wrench_norms = self.machine.twist_rates(points.poses, points.joints)
        a = a * a_scale
        with np.errstate(all="ignore"):
            return np.asarray(compute_determinants(a[:, :height, :width]) / wrench_norms.prod(1))

    @cached_property
    def singular_determinant(self) -> float:
        """The greatest determinant that counts as next to a parallel singularity."""
        home = self.machine.home[None]
        joints = self.machine.inverse(home, self.posted.mode)
        points = MotionPoints(home, joints, np.empty((1, 0)), np.full(1, OWN, np.int8))
        at_home = abs(float(self.compute_determinants(points)[0]))
        return NEAR_SINGULAR * at_home if at_home > SIGNLESS else SIGNLESS

    @cached_property
    def _scales(self) -> tuple[Array, Array, int]:
        return (*list_column_scales(self.machine, choose_characteristic_length(self.machine)), len(self.machine.axes))


def find_pole_crossings(first: MotionPoints, last: MotionPoints) -> Flags:
    """Find motions (n,) that pass over the wrist's pole: its working mode is another at their end.

    The wrist's joints go straight from value to value there, past the pole: these motions break no limit of a wrist
    joint that their ends keep.
    """
    one, two = first.wrist_modes, last.wrist_modes
    return np.asarray((one != two) & (one != EITHER) & (two != EITHER))


def merge_wrist_modes(one: WristModes, two: WristModes) -> WristModes:
    """Merge the modes (n,) at both ends of sections into the one between; EITHER where it is free or not known."""
    merged = np.where(one == EITHER, two, np.where((two == EITHER) | (two == one), one, EITHER))
    return merged.astype(np.int8)


def measure_machine_size(machine: Machine) -> float:
    """Return the greatest length that a limit names, mm; at least 1."""
    sizes = [abs(limit.bound) for limit in machine.limit_definitions if limit.unit != "rad"]
    return max([1.0, *sizes])
