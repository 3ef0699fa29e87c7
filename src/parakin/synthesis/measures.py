"""What designs are worth at poses: margins of limits and every quantity, for batches of both at once."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..arrays import Array
from ..families.family import FamilyRates
from ..kernels.small_matrices import compute_singular_values, compute_volumes, solve_quotients
from .design_tapes import DesignTapes
from .part_timing import PartTimer
from .workspace_gauge import WorkspaceGauge

LOST = 1.0  # what a pose out of reach breaks a want by


class Measures:
    """Quantities of S designs at P poses each, computed as they are asked for; NaN out of reach.

    tapes : of the machine with free numbers
    poses : (S, P + 1, axes), mm and rad, the last of which is the one whose side of the parallel singularities counts
    sizes : (S, 1, k) of the family, mm and rad
    timer, shifts : of a part, and how far designs move it, (S, axes)
    gauge : of workspaces
    """

    def __init__(
        self,
        tapes: DesignTapes,
        poses: Array,
        sizes: Array,
        timer: PartTimer | None = None,
        shifts: Array | None = None,
        gauge: WorkspaceGauge | None = None,
    ):
        self._tapes, self._all, self._sizes, self._timer, self._shifts = tapes, poses, sizes, timer, shifts
        self._gauge = gauge

    @property
    def _poses(self) -> Array:
        return self._all[:, :-1]

    @cached_property
    def _all_joints(self) -> Array:
        return self._tapes.family.inverse(self._all, self._sizes)

    @property
    def joints(self) -> Array:
        """Joints of the legs' drives, (S, P, legs)."""
        return self._all_joints[:, :-1, : self._tapes.machine.leg_count]

    @cached_property
    def at_part(self) -> Measures | None:
        """The same designs at poses of the part's path; None without a part."""
        if self._timer is None or self._shifts is None:
            return None
        poses = self._timer.checked_poses + self._shifts[:, None]
        return Measures(self._tapes, np.concatenate([poses, self._all[:, -1:]], 1), self._sizes)

    @property
    def travel(self) -> Array:
        """Joints of the legs' drives at the poses and along the part, (S, P', legs)."""
        return self.joints if self.at_part is None else np.concatenate([self.joints, self.at_part.joints], 1)

    @cached_property
    def cycle_time(self) -> Array:
        """The part's cycle time as it is estimated, (S, 1, 1) s."""
        assert self._timer is not None and self._shifts is not None
        return self._timer.estimate_seconds(self._shifts, self._sizes[:, 0])[:, None, None]

    @cached_property
    def workspace(self) -> Array:
        """The volume of the total orientation workspace as it is estimated, (S, 1, 1) mm³."""
        assert self._gauge is not None
        return self._gauge.estimate(self._sizes[:, 0], self._all[:, -1])[:, None, None]

    @cached_property
    def margins(self) -> Array:
        """Margins of the limits that count, (S, P, limits), ≥ 0 where kept, in parts of the machine's size or rad."""
        tapes = self._tapes
        return np.asarray(tapes.family.margins(self._poses, self._sizes)[..., tapes.counted] * tapes.limit_scales)

    @cached_property
    def _rates(self) -> FamilyRates:
        sizes = np.broadcast_to(self._sizes, (*self._all.shape[:-1], self._sizes.shape[-1]))
        rows = (array.reshape(-1, array.shape[-1]) for array in (self._all, self._all_joints, sizes))
        return self._tapes.family.twist_rates(*rows)

    @cached_property
    def side(self) -> Array:
        """Det A by that of the pose that counts, > 0 on its side of the parallel singularities, (S, P, 1).

        With more drives than freedoms it is the volume, > 0 off singularities.
        """
        rows, columns = self._tapes.machine.parallel_block
        with np.errstate(divide="ignore", invalid="ignore"):
            side = compute_volumes(self._rates.a[:, :rows, :columns]).reshape(*self._all.shape[:-1], 1)
            return np.asarray(side[:, :-1] / side[:, -1:])

    @cached_property
    def psi(self) -> Array:
        """The greatest velocity amplification and the reciprocal of the least, (S, P, 2)."""
        rates, scales = self._rates, self._tapes.scales
        psi = compute_extremes(rates.a * scales[0], rates.b * scales[1])
        return psi.reshape(*self._all.shape[:-1], 2)[:, :-1]

    @cached_property
    def feet(self) -> Array:
        """Twice the distance of the struts' joints at the base from the machine's Z axis, (S, P, struts) mm."""
        feet = self._tapes.family.base_joints(self._poses, self._sizes)[..., :2]
        return np.asarray(2.0 * np.hypot(*np.moveaxis(feet, -1, 0)))

    @cached_property
    def distances(self) -> Array:
        """Distances of the axes of struts that share no joint, (S, P, pairs) mm."""
        return self._tapes.measure_distances(self._poses, self._sizes)

    @cached_property
    def stiffness(self) -> Array:
        """The tip's least stiffness over all directions, (S, P, 1) N/mm; zero at parallel singularities."""
        tapes = self._tapes
        rows = len(tapes.machine.joints)
        ways = tapes.evaluate_quotient("compliance", tapes.trace_compliance, self._poses, self._sizes, rows)
        with np.errstate(divide="ignore"):
            stiffness = compute_singular_values(ways)[..., :1] ** -2
        stiffness[np.isinf(ways[..., 0, 0])] = 0.0
        return stiffness

    @cached_property
    def deviation(self) -> Array:
        """Root mean square of the tip's error within the tolerances, (S, P, 1) mm."""
        tapes = self._tapes
        rows = len(tapes.machine.axes)  # of normal equations too
        ways = tapes.evaluate_quotient("error", tapes.trace_error, self._poses, self._sizes, rows)
        return np.asarray(np.sqrt(np.square(ways).sum((-2, -1)))[..., None])


def compute_extremes(a: Array, b: Array) -> Array:
    """Compute the greatest singular value of J = A⁻¹B and the reciprocal of the least, (N, 2); NaN where A or B is.

    Of a tall A, of more drives than freedoms, J is the pseudo-inverse of B⁻¹A.
    """
    tall = a.shape[1] > a.shape[2]
    quotients = solve_quotients(b, a).swapaxes(1, 2) if tall else solve_quotients(a, b)
    s = compute_singular_values(quotients)
    with np.errstate(divide="ignore"):
        ends = (1.0 / s[:, -1], s[:, 0]) if tall else (s[:, 0], 1.0 / s[:, -1])
    result = np.stack(ends, -1)
    result[np.isinf(quotients[:, 0, 0])] = np.inf
    return result
