"""What designs are worth: limits, amplification, strokes and footprint, for batches of designs and poses at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..kernels.small_matrices import compute_singular_values, solve_quotients
from ..performance.characteristic_length import choose_characteristic_length
from ..performance.jacobians import list_column_scales
from .problem import DesignProblem

LOST = 1.0  # what a pose out of reach breaks a want by


class Measures(NamedTuple):
    """Designs at poses, (..., poses, k) each; NaN out of reach.

    margins : of the limits that count, ≥ 0 where they are kept, in parts of the machine's size or rad
    side : det A by that in the box's middle, > 0 on its side of the parallel singularities, (..., poses, 1)
    psi : the greatest velocity amplification and the reciprocal of the least
    joints : of the legs' drives
    feet : twice the distance of the struts' joints at the base from the machine's Z axis, mm
    """

    margins: Array
    side: Array
    psi: Array
    joints: Array
    feet: Array


class DesignEvaluator:
    """Evaluates a problem's designs through one tape for each quantity, whose inputs are poses and sizes."""

    def __init__(self, problem: DesignProblem):
        self.problem, machine = problem, problem.machine
        self.length = choose_characteristic_length(machine)
        self.scales = list_column_scales(machine, self.length)
        drives = [drive.name for drive in machine.drives[: machine.leg_count]]
        fitted = {f"{name}.{end}" for name in drives for end in ("min", "max")} if problem.fit_strokes else set()
        self.counted = [i for i, name in enumerate(machine.limits) if name not in fitted]
        self.limits = [machine.limits[i] for i in self.counted]
        units = [machine.limit_definitions[i].unit for i in self.counted]
        self.size = max(machine.leg_sizes)
        powers = {"mm": 1.0, "mm²": 2.0}
        self.limit_scales = np.array([self.size ** -powers.get(unit, 0.0) for unit in units])

    def measure(self, x: Array, points: Array) -> Measures:
        """Measure designs x (S, variables) at points (P, d) of the box."""
        problem, family = self.problem, self.problem.family
        middle = np.full((1, points.shape[1]), 0.5)
        poses = problem.place_poses(x[:, None], np.concatenate([points, middle])[None])
        sizes = x[:, None, : len(family.names)]
        joints = family.inverse(poses, sizes)
        margins = family.margins(poses, sizes)[..., self.counted] * self.limit_scales
        feet = 2.0 * np.hypot(*np.moveaxis(family.base_joints(poses, sizes)[..., :2], -1, 0))
        flat = np.broadcast_to(sizes, (*poses.shape[:-1], sizes.shape[-1]))
        rates = family.twist_rates(
            poses.reshape(-1, poses.shape[-1]), joints.reshape(-1, joints.shape[-1]), flat.reshape(-1, flat.shape[-1])
        )
        a, b = rates.a * self.scales[0], rates.b * self.scales[1]
        psi = compute_extremes(a, b)
        with np.errstate(divide="ignore", invalid="ignore"):
            side = np.linalg.det(a[:, : self._rows, : self._rows]).reshape(*poses.shape[:-1], 1)
            side = side / side[:, -1:]
        legs = joints[..., : problem.machine.leg_count]
        psi = psi.reshape(*poses.shape[:-1], 2)
        return Measures(*(array[:, :-1] for array in (margins, side, psi, legs, feet)))

    @property
    def _rows(self) -> int:
        return self.problem.machine.parallel_size


def compute_extremes(a: Array, b: Array) -> Array:
    """Compute the greatest singular value of A⁻¹B and the reciprocal of the least, (N, 2); NaN where A or B is."""
    quotients = solve_quotients(a, b)
    s = compute_singular_values(quotients)
    with np.errstate(divide="ignore"):
        result = np.stack([s[:, 0], 1.0 / s[:, -1]], -1)
    result[np.isinf(quotients[:, 0, 0])] = np.inf
    return result
