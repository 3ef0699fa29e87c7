"""What the real LinuxCNC commanded in every cycle, held against the library's joints and the drives' limits."""

from __future__ import annotations

import numpy as np
from geometry import Description
from simulation import CYCLE
from stub import FIELDS, inward, outward, pose, world

from parakin.controllers.linuxcnc.home_pose import find_home_pose

RATES = ("speed", "acceleration")
DIGIT = 5e-7  # half a unit of the last digit that is sampled
SPEED, RISE = 1.02, 1.05  # of a joint's limits, in any cycle


def find_joints(machine, poses, last):
    """The library's joints, mm and degrees: of both solutions of a wrist, and all turns, those nearest to the last."""
    given, last = pose(machine, poses), inward(machine, last)
    turning = np.array(machine.joint_units) == "rad"
    found = np.stack([machine.inverse(given, mode) for mode in machine.head_modes(machine.mode)])
    found[..., turning] -= 2.0 * np.pi * np.round((found - last)[..., turning] / (2.0 * np.pi))
    nearest = np.abs(found - last)[..., turning].sum(-1).argmin(0)
    return outward(machine, found[nearest, np.arange(len(given))])


def find_read_error(machine, poses, joints):
    """How far the joints of sampled poses may be off, mm and degrees: the sampler writes six digits of all of them."""
    at, off = find_joints(machine, poses, joints), np.full(joints.shape, DIGIT)
    for letter in machine.axes:
        moved = poses.copy()
        moved[:, FIELDS.index(letter)] += DIGIT
        off += np.abs(find_joints(machine, moved, joints) - at)
    return 1.5 * off


def find_near_pole(machine, joints):
    """Where the first joint of a wrist is free or nearly so, (n,)."""
    if machine.wrist is None:
        return np.zeros(len(joints), bool)
    return np.abs(joints[:, machine.wrist.second]) < 0.01


def check_joints(machine, poses, joints):
    """Every cycle's joints are the library's, to the digits that are sampled, and the library's put the tool there.

    Where a wrist's first joint is free it may be any.
    """
    turning = np.array(machine.joint_units) == "rad"
    found, free = find_joints(machine, poses[1:], joints[:-1]), find_near_pole(machine, joints)[1:]
    off, read = np.abs(joints[1:] - found), find_read_error(machine, poses[1:], joints[:-1])
    assert (off < read)[~free].all(), f"joints are {off[~free].max():g} off"
    assert off[~free][:, ~turning].max(initial=0.0) < 8e-6, f"joints are {off[~free].max():g} off"
    miss, tilt = Description.of(machine.spec).misses(pose(machine, poses[1:]), inward(machine, found))
    assert miss.max() < 1e-8 and tilt.max() < 1e-8, f"the tool is {miss.max():g} mm and {tilt.max():g} rad off"


def measure_use(machine, joints):
    """The joints' greatest speed and acceleration over their limits, in the cycles apart from a wrist's pole."""
    limits = [outward(machine, np.array([[getattr(d, rate) for d in machine.drives]])) for rate in RATES]
    read = 2.0 * DIGIT / CYCLE / limits[0].min(), 4.0 * DIGIT / CYCLE**2 / limits[1].min()  # what the digits make of it
    apart = ~find_near_pole(machine, joints)
    rises = np.abs(np.diff(joints, 2, axis=0)) / CYCLE**2 / limits[1]
    speed = (np.abs(np.diff(joints, axis=0)) / CYCLE / limits[0]).max()
    return speed - read[0], rises[apart[:-2] & apart[1:-1] & apart[2:]].max() - read[1]


def write_move_away(machine):
    """A block that moves 20 mm and turns 10 degrees away from home along all axes, where it is allowed."""
    step = np.where(np.array(machine.axis_units) == "mm", 20.0, np.radians(10.0))
    home = find_home_pose(machine)
    end = next(home + sign * step for sign in (1.0, -1.0) if machine.check(home + sign * step) == 0)
    row = world(machine, end[None])[0]
    words = [f"{axis}{row[FIELDS.index(axis)]:.6f}" for axis in machine.axes]
    return " ".join(["G1", *words, "F9000"])
