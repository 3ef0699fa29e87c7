"""Find where a wrist's first joint, which a controller lets stand on the pole, would have to jump behind it."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Indices
from ...errors import PoseError
from ...kinematics.turns import wrap_angle
from ...kinematics.wrist.pole_thresholds import STANDING
from .joint_path import JointPath

_MADE_UP = 0.9e-3  # s at the joint's speed: a controller makes up for so much in a cycle
_ROUNDS = 50


def refuse_pole_jumps(joint_path: JointPath) -> None:
    """Refuse a path on which the first joint comes to a wrist's pole at another angle than it has to leave it at.

    A controller that is given poses lets the joint stand while the tool is nearer to the pole than STANDING. Where the
    tool comes in and goes out its angle is told by the pose, in either mode.

    Raises :class:`PoseError` with file and line for a difference that takes the joint more than a controller's cycle.
    """
    machine, mode = joint_path.posted.machine, joint_path.posted.mode
    wrist = machine.wrist
    if wrist is None or len(joint_path.step) == 0:
        return
    rows = np.arange(len(joint_path.segment))
    free = wrist.find_free(joint_path.poses(rows, np.zeros(len(rows))), STANDING)
    entries, exits = np.flatnonzero(~free[:-1] & free[1:]), np.flatnonzero(free[:-1] & ~free[1:])
    exits = exits[exits > entries[0]] if len(entries) else exits[:0]
    entries = entries[: len(exits)]
    if not len(exits):
        return
    come, leave = (_locate_rim(joint_path, steps, inward) for steps, inward in ((entries, True), (exits, False)))
    before, *after = (
        machine.inverse(poses, each)[:, wrist.first]
        for poses, each in ((come, mode), (leave, mode), (leave, wrist.other_mode(mode)))
    )
    jump = np.min([np.abs(wrap_angle(angle - before)) for angle in after], axis=0)
    worst = int(jump.argmax())
    if jump[worst] > _MADE_UP * machine.drives[wrist.first].speed:
        joint, turn = machine.joints[wrist.first], np.degrees(jump[worst])
        place = joint_path.describe_step(int(exits[worst]))
        raise PoseError(f"{place} {joint} would have to jump by {turn:.2g}°, where the tool leaves the wrist's pole")


def _locate_rim(joint_path: JointPath, steps: Indices, inward: bool) -> Array:
    """Locate where steps (k,) cross the circle in which the joint stands: poses (k, axes) just outside it."""
    wrist = joint_path.posted.machine.wrist
    assert wrist is not None
    length = joint_path.step[steps]
    outside, inside = (np.zeros(len(steps)), length.copy()) if inward else (length.copy(), np.zeros(len(steps)))
    for _ in range(_ROUNDS):
        middle = 0.5 * (outside + inside)
        free = wrist.find_free(joint_path.poses(steps, middle), STANDING)
        inside, outside = np.where(free, middle, inside), np.where(free, outside, middle)
    return joint_path.poses(steps, outside)
