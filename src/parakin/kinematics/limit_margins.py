"""The margins of all limits in batches, for poses with their own joints or with those that a path takes there."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Indices, find_finite_rows
from ..kernels.batch import evaluate_tape, find_first_negative
from ..model.traces import Model


def compute_margins(model: Model, poses: Array, joints: Array | None, mode: str) -> Array:
    """Compute every limit's margin (n, limits) at poses (n, axes); where a leg can't close there is a NaN.

    joints : (n, joints) that a path takes there; None: those of the inverse in the working mode
    """
    own, count = model.check_tape(mode), len(model.limits)
    if joints is None:
        return evaluate_tape(own, poses, np.empty((len(poses), count)), whole=False)
    margins = evaluate_tape(model.margins_tape(mode), poses, np.empty((len(poses), count)), joints, whole=False)
    lost = ~find_finite_rows(joints)
    if lost.any():  # where joints do not exist, the pose tells which leg can't close
        at_lost = np.ascontiguousarray(poses[lost])
        margins[lost] = evaluate_tape(own, at_lost, np.empty((len(at_lost), count)), whole=False)
        margins[lost & (margins >= 0.0).all(1), :1] = np.nan
    return margins


def find_broken_limits(model: Model, poses: Array, joints: Array | None, mode: str) -> Indices:
    """Find the first limit broken at each pose, (n,): 0 where there is none, else 1 + its index.

    Parameters as of :func:`compute_margins`. A pose that is not a number, or without joints, breaks one in any case.
    """
    if not model.limits:
        return np.zeros(len(poses), np.int64)
    own, nothing = model.check_tape(mode), np.empty((len(poses), 0))
    if joints is None:
        return find_first_negative(own, poses, nothing)
    broken = find_first_negative(model.margins_tape(mode), poses, joints)
    lost = ~find_finite_rows(joints)
    if lost.any():
        of_pose = find_first_negative(own, np.ascontiguousarray(poses[lost]), nothing[lost])
        broken[lost] = np.where(of_pose == 0, 1, of_pose)
    return broken
