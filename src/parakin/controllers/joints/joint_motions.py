"""A trajectory as straight motions of the joints: the common model of all joint programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

import numpy as np

from ...arrays import Array, Flags
from ...toolpath.timing.drive_limits import DriveLimits
from ...toolpath.timing.trajectory import Trajectory
from ..event_commands import Command, list_commands
from ..gcode_text import to_display
from .thinning import thin_rows

_APPROACH_SPEED = 0.25  # fraction of the joints' speeds that is used on the way to the first record
_APPROACH_LEAST = 4.0  # s, for that way
_SHORTEST = 1e-3  # s: no motion is shorter
_UNROUNDED = {"mm": 12, "rad": 12}  # digits
FIRST = -1  # the place of commands before the way to the first row


@dataclass(frozen=True, eq=False)
class JointMotions:
    """k straight motions of the joints, each at one speed.

    rows : (k + 1, joints) that they lead between, mm and degrees as printed; none is the one before it
    seconds : (k,) what each takes
    halt : (k,) whether the joints stand still at its end
    approach : s, for the way to the first row
    slow_speed : mm or degrees a second that no joint minds on that way
    commands : what is said besides, by the number of motions before it; by ``FIRST`` before the way to the first row
    """

    rows: Array
    seconds: Array
    halt: Flags
    approach: float
    slow_speed: float
    commands: dict[int, list[Command]]

    @property
    def steps(self) -> Array:
        """(k, joints) what each motion moves the joints by, mm and degrees."""
        return np.diff(self.rows, axis=0)

    @property
    def lengths(self) -> Array:
        """(k,) of the motions, roots of the sums of the steps' squares."""
        lengths: Array = np.sqrt((self.steps**2).sum(axis=1))
        return lengths


def build_joint_motions(trajectory: Trajectory, digits: Mapping[str, int], shortest: float = 0.0) -> JointMotions:
    """Build the motions from record to record, each as slow as the trajectory or as the speeds of the joints ask for.

    Records at one place are one row, and so are those whose joints are printed alike; the time between them goes to the
    next motion. Where motions are shorter than the control takes they are fewer, as :func:`.thin_rows` has it.

    digits : after the point, for ``mm`` and for ``rad`` (printed as degrees)
    shortest : s that the control takes for a motion
    """
    posted, path, machine = trajectory.posted, trajectory.posted.path, trajectory.posted.machine
    corner = trajectory.curve.corner_of_record
    limits = DriveLimits.of(machine)
    records = np.flatnonzero(np.diff(corner, prepend=-1))
    rows = to_display(posted.joints[records], machine.joint_units, digits)
    moved = np.flatnonzero(np.append(True, np.diff(rows, axis=0).any(axis=1)))
    bounded = limits.bounds_acceleration or any(isfinite(drive.force) for drive in machine.drives)
    halt = np.logical_or.reduceat(trajectory.curve.parted & bounded, moved)
    reached = np.searchsorted(moved, np.arange(len(rows)), side="right") - 1  # the row of each corner
    places = [int(reached[corner[event.record - 1]]) if event.record else FIRST for event in path.events]
    fixed = halt.copy()
    fixed[[place for place in places if place != FIRST]] = True
    exact = to_display(posted.joints[records][moved], machine.joint_units, _UNROUNDED)
    kept = thin_rows(exact, trajectory.times[records][moved], fixed, shortest)
    rows, times = rows[moved][kept], trajectory.times[records][moved][kept]
    speeds = to_display(limits.speed[None], machine.joint_units, _UNROUNDED)[0]
    least = (np.abs(np.diff(rows, axis=0)) / speeds).max(axis=1, initial=0.0)
    seconds = np.maximum(np.diff(times), np.maximum(least, _SHORTEST))
    from_home = float((np.abs(posted.joints[0] - machine.inverse(machine.home)) / limits.speed).max())
    places = [place if place == FIRST else int(np.searchsorted(kept, place)) for place in places]
    return JointMotions(
        rows,
        seconds,
        halt[kept][1:],
        max(_APPROACH_LEAST, from_home / _APPROACH_SPEED),
        _APPROACH_SPEED * float(speeds.min()),
        list_commands(path, places),
    )
