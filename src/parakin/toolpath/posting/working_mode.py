"""Which of the joint vectors that have a path's poses the machine takes: its working mode, and its turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Flags
from ...kinematics.turns import TURN
from ...kinematics.wrist.pole_thresholds import PRINTED, SWING
from ...machine import Machine
from ..path import ToolPath
from .path_samples import SampledPath
from .turn_counts import TurningJoint, choose_turns, find_turns_in_range

HELD = 0.8  # fraction of the angle tolerance: an axis no farther off a pole is held beside it


@dataclass(frozen=True, eq=False)
class ModeSolution:
    """A path's joints in one working mode.

    mode : signs of the legs, and of head and table where the path begins
    poses, joints : (n, axes) and (n, joints)
    wide_turns : how many motions in feed turn a joint by more than a quarter turn
    """

    mode: str
    poses: Array
    joints: Array
    wide_turns: int


def list_candidate_modes(machine: Machine, mode: str | None) -> list[str]:
    """List the working modes that a path may take: the given one, or the default with either sign of head and table.

    The legs' signs are the machine's: it can't change them without passing a serial singularity.
    """
    checked = machine.checked_mode(mode)
    return machine.head_modes(checked) if mode is None else [checked]


def follow_working_mode(
    machine: Machine, path: ToolPath, sampled: SampledPath, mode: str, pole_zone: float = PRINTED
) -> ModeSolution:
    """Choose the joints for the poses of a path's records in a working mode, with their turns counted.

    pole_zone : rad off a wrist's pole: nearer, its first joint stands still

    The turns are those with which the fewest records break a limit, then those by which the joints turn least, then
    those nearest to home. They are the same all along the path; :mod:`~.rewinds` takes turns back.
    """
    poses = sampled.poses[sampled.at_records]
    known = sampled.joints if sampled.mode == mode else None
    along = machine.inverse(sampled.poses, mode) if known is None else known
    machine.make_continuous(sampled.poses, along, mode, pole_zone)
    joints = along[sampled.at_records]
    turning = machine.turning_joints
    if not turning or not len(joints):
        return ModeSolution(mode, poses, joints, 0)
    home = np.nan_to_num(machine.inverse(machine.home, mode)).tolist()
    for column in turning:
        turns = find_turns_in_range(machine.drives[column], joints[:, column], home[column])
        if turns is None:
            turns = choose_turns(TurningJoint.of(machine, poses, joints, mode, column, home[column]))
        joints[:, column] += TURN * turns
    return ModeSolution(mode, poses, joints, _count_wide_turns(joints[:, turning], path.rapid))


def _count_wide_turns(angles: Array, rapid: Flags) -> int:
    with np.errstate(invalid="ignore"):
        wide_turns = (np.abs(np.diff(angles, axis=0)) > SWING).any(axis=1)
    return int(np.count_nonzero(wide_turns & ~rapid[1:]))
