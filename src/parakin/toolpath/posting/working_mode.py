"""Which of the joint vectors that have a path's poses the machine takes: its working mode, and its turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...kinematics.wrist import PRINTED, SWING, TURN
from ...machine import Machine
from ..path import Floats, ToolPath
from .turn_counts import choose_turns, find_turns_in_range, rewind_in_rapids
from .turn_steps import add_turn_steps


@dataclass(frozen=True, eq=False)
class Branch:
    """A path's joints in one working mode.

    mode : signs of the legs, and of head and table where the path begins
    poses, joints : (n, axes) and (n, joints); C and a joint are turned back from each of ``rewinds`` on
    rewinds : records to which a rapid motion leads that turns back
    flips : how many motions in feed turn a joint by more than a quarter turn
    """

    mode: str
    poses: Floats
    joints: Floats
    rewinds: tuple[int, ...]
    flips: int


def list_candidate_modes(machine: Machine, mode: str | None) -> list[str]:
    """The working modes that a path may take: the given one, or the default with either sign of head and table.

    The legs' signs are the machine's: it can't change them without passing a serial singularity.
    """
    default = machine.checked_mode(mode)
    return machine.head_modes(default) if mode is None else [default]


def choose_branch(machine: Machine, path: ToolPath, poses: Floats, mode: str) -> Branch:
    """The joints that follow from poses in a working mode, their turns counted.

    The turns are those with which the fewest records break a limit, then those by which the joints turn least, then
    those nearest to home. A turn is taken back only in a rapid motion, where C goes on by whole turns and the joint
    with it; the motion is looked at in small steps for that.
    """
    joints = _followed(machine, path, poses, mode)
    turning = [i for i, unit in enumerate(machine.joint_units) if unit == "rad"]
    rewinds: tuple[int, ...] = ()
    if not turning or not len(joints):
        return Branch(mode, poses, joints, rewinds, 0)
    first = None if machine.wrist is None else machine.wrist.first
    home = np.nan_to_num(machine.inverse(machine.home, mode))
    back = None
    for column in turning:
        turns = find_turns_in_range(machine.drives[column], joints[:, column], float(home[column]))
        if turns is not None:
            joints[:, column] += TURN * turns
        elif column == first:
            back = column
        else:
            joints[:, column] += TURN * choose_turns(machine, poses, joints, mode, column, float(home[column]))
    if back is not None:
        poses, joints, rewinds = rewind_in_rapids(machine, path, poses, joints, mode, float(home[back]))
    return Branch(mode, poses, joints, rewinds, _flips(joints[:, turning], path.rapid))


def _followed(machine: Machine, path: ToolPath, poses: Floats, mode: str) -> Floats:
    """Joints along poses; where a program turns the tool they go evenly from record to record, however far apart."""
    if path.turns is None or machine.wrist is None:
        return machine.follow(poses, mode, PRINTED)
    thick, at = add_turn_steps(poses, [i for i, letter in enumerate(machine.axes) if letter in "ABC"])
    joints: Floats = machine.follow(thick, mode, PRINTED)[at]
    return joints


def _flips(angles: Floats, rapid: NDArray[np.bool_]) -> int:
    with np.errstate(invalid="ignore"):
        wide = (np.abs(np.diff(angles, axis=0)) > SWING).any(axis=1)
    return int(np.count_nonzero(wide & ~rapid[1:]))
