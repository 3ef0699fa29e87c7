"""The pose in which LinuxCNC's machine stands once it is homed: off the pole of a wrist."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...kinematics.turns import find_nearest_turn
from ...kinematics.wrist.pole_thresholds import FAR_TILT
from ...kinematics.wrist.pose_angles import flip_direction
from ...kinematics.wrist.turning_joints import Wrist
from ...machine import Machine
from ...toolpath.posting.wrist_poses import find_pose_with_wrist


def find_home_pose(machine: Machine) -> Array:
    """Find the pose (axes,) of LinuxCNC's home: the machine's own, but off the pole of a wrist.

    On the pole the first joint would have to jump as soon as the tool moves off it another way. The tip stays where it
    is, and the first joint, too. Where a tilted tool is not allowed it is the machine's own home.
    """
    home, wrist = np.array(machine.home), machine.wrist
    if wrist is None or not wrist.find_free(home[None], 0.5 * FAR_TILT)[0]:
        return home
    at_home = machine.inverse(home)
    for angle in (FAR_TILT, -FAR_TILT):
        for mode in machine.head_modes(machine.mode):
            pose = find_pose_with_wrist(machine, home, wrist.tilt(at_home, mode, angle), machine.mode)
            if pose is not None and machine.check(pose) == 0:
                return _write_near_home(machine, wrist, pose)
    return home


def _write_near_home(machine: Machine, wrist: Wrist, pose: Array) -> Array:
    """Write a pose's direction, of the two ways there are, with the C nearer to home's."""
    b, c = wrist.direction.b, wrist.direction.c
    flipped = pose.copy()
    flipped[[c, b]] = flip_direction(pose[[c]], pose[[b]])[0]
    ways = [pose.copy(), flipped]
    for way in ways:
        way[c] = find_nearest_turn(way[c], machine.home[c])
    return min(ways, key=lambda way: abs(float(way[c] - machine.home[c])))
