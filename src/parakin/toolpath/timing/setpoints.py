"""Setpoints of a law: where every joint and the tool are at given times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..path import Floats

if TYPE_CHECKING:
    from ..timing.trajectory import Law


@dataclass(frozen=True, eq=False)
class Setpoints:
    """Where a machine is at k times. Lengths are mm, angles rad.

    columns : names of :attr:`table`'s columns
    times : (k,) s
    joints, speeds, accelerations : (k, joints)
    poses : (k, axes) of the tool, as in :attr:`Posted.poses`
    """

    columns: tuple[str, ...]
    times: Floats
    joints: Floats
    speeds: Floats
    accelerations: Floats
    poses: Floats

    @property
    def table(self) -> Floats:
        """All of it as one table: ``time``, ``d1`` ..., ``d1.speed`` ..., ``d1.acceleration`` ..., ``X`` ..."""
        return np.column_stack([self.times, self.joints, self.speeds, self.accelerations, self.poses])


def setpoints(law: Law, times: Floats) -> Setpoints:
    """See :meth:`~.law.Law.at`."""
    course, pace, machine = law.course, law.pace, law.posted.machine
    kinds = ("", ".speed", ".acceleration")
    columns = ("time", *(joint + kind for kind in kinds for joint in machine.joints), *machine.axes)
    if not len(pace.cell):
        still = np.zeros((len(times), len(machine.joints)))
        joints, poses = still + law.posted.joints[0], np.tile(law.posted.poses[0], (len(times), 1))
        return Setpoints(columns, times, joints, still, still, poses)
    piece = np.clip(np.searchsorted(pace.time, times, "right") - 1, 0, len(pace.cell) - 1)
    t = np.clip(times, 0.0, law.seconds) - pace.time[piece]
    v, a, e, cell = pace.speed[piece], pace.rise[piece], pace.jerk[piece], pace.cell[piece]
    shift = pace.shift[piece] + t * (v + t * (0.5 * a + t * e / 6.0))
    shift = np.clip(shift, 0.0, course.step[cell])
    moving = (times >= 0.0) & (times <= law.seconds)
    speed, rise = (v + t * (a + 0.5 * t * e)) * moving, (a + t * e) * moving
    joints, speeds, accelerations = course.splines(cell, shift, np.maximum(speed, 0.0), rise)
    return Setpoints(columns, times, joints, speeds, accelerations, course.poses(cell, shift))
