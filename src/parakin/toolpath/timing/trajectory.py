"""A trajectory: a posted tool path with the time at which the machine passes each place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ...arguments import check_arguments, read_numbers
from ...arrays import Array, Indices
from ...errors import PoseError
from ..posting.posted import Posted
from .corners import Curve, check_tolerance
from .joint_path import JointPath
from .kernels.splines import PathState
from .speed_profile import SpeedProfile

_MOST_SETPOINTS = 20_000_000  # in memory at a time


@dataclass(frozen=True, eq=False)
class Setpoints:
    """Where a machine is at k times, and how it moves there. Lengths are mm, angles rad.

    columns : names of :attr:`table`'s columns
    times : (k,) s
    joints, speeds, accelerations : (k, joints) mm, mm/s, mm/s², or rad
    poses : (k, axes) of the tool, as in :attr:`Posted.poses`
    """

    columns: tuple[str, ...]
    times: Array
    joints: Array
    speeds: Array
    accelerations: Array
    poses: Array

    @property
    def table(self) -> Array:
        """All columns, (k, columns): ``time``, ``d1`` ..., ``d1.speed`` ..., ``d1.acceleration`` ..., ``X`` ..."""
        return np.column_stack([self.times, self.joints, self.speeds, self.accelerations, self.poses])

    def __repr__(self) -> str:
        return f"<parakin setpoints: {len(self.times)} times, {' '.join(self.columns[:8])} ...>"


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The motion of a machine over time on a tool path of n records. Lengths are mm, angles rad, times s.

    posted : the path that was planned
    curve : the tool's path with its corners, rounded or not
    joint_path : the joints along the curve, by rows
    profile : the speed along the curve
    binding : (rows,) the limit that bounds the speed at each row, an index into ``names``
    names : ``feed``, then for each joint ``d1.speed``, ``d1.acceleration``, ``d1.jerk``, ``d1.force``,
        ``d1.power``, ``d1.rated`` (at all rows, if at any), and ``start/stop``
    """

    posted: Posted
    curve: Curve
    joint_path: JointPath
    profile: SpeedProfile
    binding: Indices
    names: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """The cycle time, s."""
        return float(self.profile.time[-1])

    @cached_property
    def times(self) -> Array:
        """(n,) when each record is passed; at a rounded corner when the tool is nearest to it."""
        first = np.searchsorted(self.joint_path.segment, np.arange(len(self.curve.length)))
        corner_times = np.append(self.profile.row_times[first], self.profile.row_times[-1])
        return corner_times[self.curve.corner_of_record]

    @cached_property
    def binding_fractions(self) -> dict[str, float]:
        """The fraction of the cycle time in which each limit binds, the greatest first; but for one that never does."""
        spans = np.diff(self.profile.row_times)
        near = 0.5 * (np.append(spans, 0.0) + np.append(0.0, spans))
        sums = np.bincount(self.binding, near, len(self.names)) / (self.seconds or 1.0)
        return {self.names[i]: float(sums[i]) for i in np.argsort(-sums, kind="stable") if sums[i] > 0.0}

    @cached_property
    def switches(self) -> Array:
        """(rows - 1,) s: when the binding limit of one row of the joint path gives way to the next row's."""
        passed = self.profile.row_times
        return 0.5 * (passed[1:] + passed[:-1])

    def find_binding(self, times: Array) -> Indices:
        """Find the limit that bounds the speed at ``times`` (k,) s, an index into :attr:`names`."""
        return self.binding[np.searchsorted(self.switches, times, "right")]

    def at(self, times: ArrayLike) -> Setpoints:
        """Compute the setpoints at ``times`` (k,) s; before the start and after the end the machine stands still."""
        times = read_numbers("times", times)
        profile, machine = self.profile, self.posted.machine
        kinds = ("", ".speed", ".acceleration")
        columns = ("time", *(joint + kind for kind in kinds for joint in machine.joints), *machine.axes)
        if not len(profile.row):
            still = np.zeros((len(times), len(machine.joints)))
            joints, poses = still + self.posted.joints[0], np.tile(self.posted.poses[0], (len(times), 1))
            return Setpoints(columns, times, joints, still, still, poses)
        row, shift, speed, acceleration = profile.at(times)
        shift = np.clip(shift, 0.0, self.joint_path.step[row])
        moving = (times >= 0.0) & (times <= self.seconds)
        speed, acceleration = speed * moving, acceleration * moving
        state = self.joint_path.evaluate(PathState(row, shift, np.maximum(speed, 0.0), acceleration))
        poses = self.joint_path.poses(row, shift)
        return Setpoints(columns, times, state.joints, state.speeds, state.accelerations, poses)

    @check_arguments
    def sample(self, rate: float) -> Setpoints:
        """Compute setpoints at ``rate`` Hz, from the start to the first one at which the motion is over.

        Raises :class:`PoseError` for a rate that is not above zero, or at which they would fill the memory.
        """
        check_tolerance(rate, "rate")
        if not self.seconds * rate <= _MOST_SETPOINTS:
            raise PoseError(
                f"rate: {rate:g} Hz over {self.seconds:,.1f} s would make {self.seconds * rate:.3g} setpoints, at most "
                f"{_MOST_SETPOINTS:,} are possible; Trajectory.at gives them a part at a time"
            )
        count = int(np.ceil(self.seconds * rate - 1e-9)) + 1
        return self.at(np.arange(count) / rate)

    def __repr__(self) -> str:
        return (
            f"<parakin trajectory on {self.posted.machine.name}: {len(self.posted.path)} records, {self.seconds:.6g} s>"
        )


def name_limits(joints: Sequence[str]) -> tuple[str, ...]:
    """Name all limits that can bind, in the order of :attr:`Trajectory.binding`."""
    kinds = ("speed", "acceleration", "jerk", "force", "power", "rated")
    return ("feed", *(f"{joint}.{kind}" for kind in kinds for joint in joints), "start/stop")
