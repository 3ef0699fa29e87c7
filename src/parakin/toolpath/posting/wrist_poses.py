"""Poses at which a machine's tool tip is at a given place and its wrist stands as given."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...kinematics.turns import find_nearest_turn
from ...kinematics.wrist.pole_thresholds import EXACT
from ...machine import Machine

_ROUNDS = 60


def find_pose_with_wrist(machine: Machine, near: Array, joints: Array, mode: str) -> Array | None:
    """Find the pose (axes,) whose wrist stands as in ``joints`` (joints,) with the tip of a near pose (axes,).

    mode : the working mode that these joints are in

    Fixed-point iteration: the legs for the tip and the last orientation, the orientation for these legs and the wrist.
    It converges at once where nothing but the wrist turns the tool, and fast where a central leg does, too. C is the
    one nearest to the near pose's. None where the legs can't close or the iteration does not converge.
    """
    wrist, pose = machine.wrist, near.copy()
    assert wrist is not None
    columns, c = wrist.direction.pair, wrist.direction.c
    for _ in range(_ROUNDS):
        legs = machine.inverse(pose, mode)
        legs[wrist.pair] = joints[wrist.pair]
        solution = machine.forward(legs, near=pose)
        if not solution.converged:
            return None
        turned = np.array(solution.poses)
        turned[c] = find_nearest_turn(turned[c], pose[c])
        is_there = np.abs((turned - pose)[columns]).max() < EXACT
        pose[columns] = turned[columns]
        if is_there:
            return pose
    return None
