"""Measurements as functions of a family's sizes: residuals and their derivatives, weighed by both sides' noise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..errors import PoseError
from ..families.family import Family
from ..machine import Machine
from .measurements import LETTERS, Measurements
from .setups import Setup, make_setups


class Linearised(NamedTuple):
    """Residuals of measurements and what they depend on, row by row of (N, c) numbers measured.

    residuals : (N, c) measured less predicted; the whole pose's as a twist
    slopes : (N, c, k) of what is predicted, by the sizes
    unknown : (N, c, u) the same by the unknown numbers of the setups
    joints : (N, c, m) the same by what the drives say
    """

    residuals: Array
    slopes: Array
    unknown: Array
    joints: Array


def find_poses(machine: Machine, joints: Array) -> Array:
    """Find the poses (N, axes) of joints, from home, and where that fails from the pose of the nearest joints.

    Raises :class:`PoseError` for a row that has none.
    """
    solution = machine.forward(joints)
    poses, reached = solution.poses, np.array(solution.converged)
    while not reached.all() and reached.any():
        known, rest = np.flatnonzero(reached), np.flatnonzero(~reached)
        gaps = np.linalg.norm(joints[rest][:, None] - joints[known], axis=2)
        solution = machine.forward(joints[rest], near=poses[known[gaps.argmin(1)]])
        if not np.any(solution.converged):
            break
        poses[rest], reached[rest] = solution.poses, solution.converged
    if not reached.all():
        row = int((~reached).argmax())
        raise PoseError(f"joints: row {row + 1} has no pose: {machine.forward(joints[row]).reasons}")
    return poses


class MeasuredFamily:
    """Measurements of a machine of a family, and where its tool was about."""

    def __init__(
        self,
        family: Family,
        measured: Measurements,
        starts: Array | None = None,
        setups: Sequence[Setup] | None = None,
    ):
        self.family, self.measured = family, measured
        all_axes = len(measured.axes) == len(family.machine.axes) and measured.frame == "machine"
        self.whole = all_axes and measured.width == len(measured.axes)
        if self.whole:
            starts = measured.values
        self.starts: Array = find_poses(family.machine, measured.joints) if starts is None else starts
        self.tip_axes = [axis for axis in family.machine.axes if axis in LETTERS]
        made = [] if self.whole else make_setups(measured, self._find_tips(self.starts))
        self.setups = [one for one, _ in made] if setups is None else list(setups)
        self._values = [values for _, values in made]

    def _find_tips(self, poses: Array) -> Array:
        """Find the tips (N, 3) of poses; an axis that the machine lacks is 0."""
        tips = np.zeros((len(poses), 3))
        for axis in self.tip_axes:
            tips[:, LETTERS.index(axis)] = poses[:, self.family.machine.axes.index(axis)]
        return tips

    def split(self, unknown: Array) -> list[Array]:
        """Split the unknown numbers by setups."""
        return np.split(unknown, np.cumsum([len(one.begin) for one in self.setups])[:-1]) if self.setups else []

    @property
    def begin(self) -> Array:
        """The unknown numbers of the setups, (u,), about."""
        return np.concatenate([np.empty(0), *(one.begin for one in self.setups)])

    @property
    def turns(self) -> Array:
        """Which of them are angles, (u,)."""
        return np.concatenate([np.empty(0, bool), *(one.turns for one in self.setups)])

    def linearise(self, sizes: Array, unknown: Array) -> Linearised:
        """Compute residuals and slopes for sizes (k,) and the unknown numbers of the setups (u,).

        NaN where the machine of these sizes has no pose.
        """
        family, measured = self.family, self.measured
        joints, count = measured.joints, len(measured.joints)
        poses = self.starts
        if not self.whole:
            poses = family.forward(joints, sizes, near=self.starts).poses
        rates = family.twist_rates(poses, joints, sizes)
        by_sizes, by_joints = rates.compute_size_rates(), rates.compute_joint_rates()
        if self.whole:
            off = rates.solve(rates.closures[:, :, None])[:, :, 0]
            return Linearised(off, by_sizes, np.empty((count, off.shape[1], 0)), by_joints)
        tips, rows = self._find_tips(poses), [LETTERS.index(axis) for axis in self.tip_axes]
        predictions = [one.predict(tips, own) for one, own in zip(self.setups, self.split(unknown), strict=True)]
        by_tips = np.concatenate([one.by_tips for one in predictions], 1)[:, :, rows]
        by_unknown = np.zeros((*by_tips.shape[:2], len(unknown)))
        row = column = 0
        for one in predictions:
            r, u = one.by_unknown.shape[1:]
            by_unknown[:, row : row + r, column : column + u] = one.by_unknown
            row, column = row + r, column + u
        residuals = np.hstack(self._values) - np.hstack([one.values for one in predictions])
        tip = slice(len(rows))
        return Linearised(residuals, by_tips @ by_sizes[:, tip], by_unknown, by_tips @ by_joints[:, tip])

    def compute_weights(self, at: Linearised) -> Array:
        """Compute the matrices (N, c, c) that make residuals uncorrelated with deviation one: of both sides' noise."""
        noise, machine = self.measured.noise, self.family.machine
        tips = len(self.tip_axes)
        count = at.residuals.shape[1]
        own = np.full(count, noise.length)
        if self.whole:
            own[tips:] = noise.angle
        drives = np.where(np.array(machine.joint_units) == "rad", noise.turn, noise.slide)
        spread = at.joints * drives
        covariance = np.einsum("ncm,ndm->ncd", spread, spread) + np.diag(own**2)
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))
