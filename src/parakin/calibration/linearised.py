"""Measurements as functions of a family's sizes: residuals and their derivatives, weighed by both sides' noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..errors import PoseError
from ..families.family import Family, solve_each
from ..machine import Machine
from .measurements import Measurements

_TIP = "XYZ"


class Linearised(NamedTuple):
    """Residuals of measurements and what they depend on, row by row of (N, c) numbers measured.

    residuals : (N, c) measured less predicted; the whole pose's as a twist
    slopes : (N, c, k) of what is predicted, by the sizes
    centre : (N, c, 3) the same by the distances' unknown point, else (N, c, 0)
    joints : (N, c, m) the same by what the drives say
    """

    residuals: Array
    slopes: Array
    centre: Array
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

    def __init__(self, family: Family, measured: Measurements, starts: Array | None = None):
        self.family, self.measured = family, measured
        self.whole = len(measured.axes) == len(family.machine.axes) and measured.distances is None
        if self.whole:
            starts = measured.values
        self.starts: Array = find_poses(family.machine, measured.joints) if starts is None else starts

    def linearise(self, sizes: Array, centre: Array) -> Linearised:
        """Compute residuals and slopes for sizes (k,) and the distances' point (3,), if that is unknown.

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
            off = solve_each(rates.a, rates.closures[:, :, None])[:, :, 0]
            return Linearised(off, by_sizes, np.empty((count, off.shape[1], 0)), by_joints)
        axes = family.machine.axes
        tip_axes = [axis for axis in axes if axis in _TIP]
        rows = [tip_axes.index(axis) for axis in measured.axes]
        columns = [axes.index(axis) for axis in measured.axes]
        differences = [measured.values - poses[:, columns]]
        slopes, of_joints = [by_sizes[:, rows]], [by_joints[:, rows]]
        of_centre = np.zeros((count, len(rows), centre.size))
        if measured.distances is not None:
            point = centre if measured.centre is None else measured.centre
            tips = np.zeros((count, 3))
            tips[:, [_TIP.index(axis) for axis in tip_axes]] = poses[:, [axes.index(axis) for axis in tip_axes]]
            lengths = np.linalg.norm(tips - point, axis=1)
            along = (tips - point) / lengths[:, None]
            own = along[:, [_TIP.index(axis) for axis in tip_axes]]
            differences.append((measured.distances - lengths)[:, None])
            slopes.append(np.einsum("ni,nik->nk", own, by_sizes[:, : len(tip_axes)])[:, None])
            of_joints.append(np.einsum("ni,nik->nk", own, by_joints[:, : len(tip_axes)])[:, None])
            of_centre = np.concatenate([of_centre, -along[:, None, : centre.size]], 1)
        joined = (np.concatenate(pieces, 1) for pieces in (differences, slopes, of_joints))
        residuals, by_size, by_joint = joined
        return Linearised(residuals, by_size, of_centre, by_joint)

    def find_centre(self) -> Array:
        """Find the point from which the distances were measured, about, (3,); (0,) where it is known or there is none.

        The differences of the squared distances are linear in it.
        """
        measured = self.measured
        if measured.distances is None or measured.centre is not None:
            return np.empty(0)
        axes = self.family.machine.axes
        tips = np.zeros((len(self.starts), 3))
        for i, letter in enumerate(_TIP):
            if letter in axes:
                tips[:, i] = self.starts[:, axes.index(letter)]
        matrix = np.hstack([2.0 * tips, np.ones((len(tips), 1))])
        right = (tips * tips).sum(1) - measured.distances**2
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0][:3])

    def compute_weights(self, at: Linearised) -> Array:
        """Compute the matrices (N, c, c) that make residuals uncorrelated with deviation one: of both sides' noise."""
        noise, machine = self.measured.noise, self.family.machine
        tips = sum(axis in _TIP for axis in machine.axes)
        count = at.residuals.shape[1]
        own = np.full(count, noise.length)
        if self.whole:
            own[tips:] = noise.angle
        drives = np.where(np.array(machine.joint_units) == "rad", noise.turn, noise.slide)
        spread = at.joints * drives
        covariance = np.einsum("ncm,ndm->ncd", spread, spread) + np.diag(own**2)
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))
