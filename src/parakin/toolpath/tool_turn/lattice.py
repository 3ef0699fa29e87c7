"""The lattice of stations along a path and turns of the tool: joints and margins at all of its nodes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Progress, split_rows
from ...kinematics.turns import find_nearest_turn
from ...kinematics.wrist.pole_thresholds import is_on_pole
from ...machine import Machine
from ...performance.singularities import compute_singularity_margins
from ..posting.range_use import compute_relative_margin
from ..posting.tool_orientation import solve_three_turns

STEP = np.radians(3.0)  # rad from turn to turn
_REACH = 60  # turns to either side of home's: all round
_POLE = 0.1  # rad: nearer to A = ±90° the pose's angles swing
_SINGULAR = 0.5  # of home's margin of a singularity: what is kept of it, unless C as at home keeps less
_BLOCK = 64  # stations at once


class Lattice(NamedTuple):
    """m stations by t turns of the tool; C of the machine tells the turn, and the middle one is home's.

    turns : (t,) C, rad
    joints : (m, t, joints)
    margins : (m, t) the least margin over half its limit's range; negative where a node can't be used
    """

    turns: Array
    joints: Array
    margins: Array

    @property
    def home(self) -> int:
        """The turn that is home's."""
        return len(self.turns) // 2


def pose_tools(machine: Machine, tip: Array, axis: Array, c: Array) -> tuple[Array, Flags]:
    """Compute poses (n, axes) of tips and axes (n, 3) in M turned to C (n,), and which are beside A = ±90°."""
    angles, _, _ = solve_three_turns(axis, c)
    poses = np.empty((len(tip), len(machine.axes)))
    for letter, values in zip("XYZABC", (*tip.T, *angles), strict=True):
        if letter in machine.axes:
            poses[:, machine.axes.index(letter)] = values
    return poses, is_on_pole(np.cos(angles[0]) ** 2, _POLE)


def build_lattice(machine: Machine, tip: Array, axis: Array, mode: str, progress: Progress) -> Lattice:
    """Build the lattice of stations with tips and axes (m, 3) in M.

    Nodes beside A = ±90°, out of reach, or nearer to a singularity than half of what home is (than C as at home ever
    is, if that is nearer) can't be used.
    """
    turns = float(machine.home[machine.turning_columns[-1]]) + STEP * np.arange(-_REACH, _REACH + 1)
    count = len(turns)
    joints = np.empty((len(tip), count, len(machine.joints)))
    margins = np.empty((len(tip), count))
    least = _find_least_singularity_margins(machine, tip, axis, mode, turns[count // 2])
    for block in split_rows(len(tip), _BLOCK):
        size = len(tip[block])
        poses, beside_pole = pose_tools(
            machine, np.repeat(tip[block], count, axis=0), np.repeat(axis[block], count, axis=0), np.tile(turns, size)
        )
        solved = machine.inverse(poses, mode)
        _turn_into_range(machine, solved)
        relative = compute_relative_margin(machine, machine.margins(poses, solved, mode))
        relative[beside_pole | ~np.isfinite(relative)] = -np.inf
        sound = np.flatnonzero(relative >= 0.0)
        singular = compute_singularity_margins(machine, poses[sound], mode=mode)
        relative[sound[~(singular >= least).all(axis=1)]] = -np.inf
        joints[block], margins[block] = solved.reshape(size, count, -1), relative.reshape(size, count)
        progress(block.stop / len(tip))
    return Lattice(turns, joints, margins)


def _turn_into_range(machine: Machine, joints: Array) -> None:
    """Turn turning joints (n, joints) by the whole turns that bring them nearest to their ranges' middles, in place."""
    for column in machine.turning_joints:
        middle = 0.5 * (machine.drives[column].low + machine.drives[column].high)
        if np.isfinite(middle):
            joints[:, column] = find_nearest_turn(joints[:, column], np.array(middle))


def _find_least_singularity_margins(machine: Machine, tip: Array, axis: Array, mode: str, home_c: float) -> Array:
    """Find how near to each singularity a node may come, (margins,)."""
    poses, _ = pose_tools(machine, tip, axis, np.full(len(tip), home_c))
    along = np.fmin.reduce(compute_singularity_margins(machine, poses, mode=mode), axis=0)
    at_home = compute_singularity_margins(machine, machine.home, mode=mode)
    floor = np.fmin(np.where(along > 0.0, along, np.inf), _SINGULAR * at_home)
    least: Array = np.nan_to_num(floor, nan=0.0, posinf=0.0)
    return least
