"""The volume of a design's total orientation workspace: estimated in a search, proved of its winner."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.stats import qmc

from ..arrays import Array
from ..budget import Budget
from ..errors import PoseError
from ..kernels.small_matrices import compute_volumes
from ..machine import Machine
from ..workspaces.certified.region import Region, make_region
from ..workspaces.certified.workspace import workspace
from .design_tapes import DesignTapes
from .pose_sets import PoseSet

_POSITIONS = 1500
_WIDER = 0.5  # of the nominal machine's extent, by which positions are drawn beyond it on each side
_GAP = 0.02  # relative, of what is proved
_SECONDS = 20.0  # of the nominal machine's extent
_LEAST_SECONDS = 1e-3


class WorkspaceGauge:
    """Gauges the positions at which machines are allowed at every orientation of wanted poses.

    tapes : of the machine, whose drives' ranges are its own
    poses : their turning axes' ranges and values count

    Raises :class:`PoseError` for a machine that does not move in X, Y and Z, or whose workspace has no end.
    """

    def __init__(self, tapes: DesignTapes, poses: PoseSet):
        self._tapes, self._wanted = tapes, poses
        region = self._make_region(tapes.machine)
        if len(region.free_axes) != 3:
            raise PoseError("workspace: a machine that moves in X, Y and Z expected")
        extent = region.find_extent(Budget(_SECONDS))
        if extent is None:
            raise PoseError("workspace: the machine reaches no position at every orientation; start from one that does")
        low, high = extent[0] - _WIDER * (extent[1] - extent[0]), extent[1] + _WIDER * (extent[1] - extent[0])
        self._volume = float(np.prod(high - low))
        positions = low + (high - low) * qmc.Halton(3, seed=0).random(_POSITIONS)
        ends = list(region.swept_axes.values())
        orientations = np.array([[0.5 * (a + b) for a, b in ends], *product(*ends)])
        self._count = len(orientations)
        self._poses = region.poses(np.repeat(positions, self._count, 0), np.tile(orientations, (_POSITIONS, 1)))
        self._edge = (self._volume / _POSITIONS) ** (1.0 / 3.0) / tapes.size

    def __repr__(self) -> str:
        return f"<parakin workspace gauge of {self._tapes.machine.name}: {len(self._poses)} poses>"

    def _make_region(self, machine: Machine) -> Region:
        turns = self._wanted.turns
        still = {a: ends[0] for a, ends in self._wanted.ends.items() if a not in "XYZ" and a not in turns}
        return make_region(machine, still, turns)

    def estimate(self, sizes: Array, middles: Array) -> Array:
        """Estimate the volumes of designs, (S,) mm³.

        sizes : (S, k) of the family, mm and rad
        middles : (S, axes) poses, mm and rad, whose side of the singularities counts

        Positions near a limit count in part, so that the estimate follows the sizes evenly.
        """
        return np.array([self._estimate_one(own, middle) for own, middle in zip(sizes, middles, strict=True)])

    def _estimate_one(self, sizes: Array, middle: Array) -> float:
        tapes, family = self._tapes, self._tapes.family
        margins = np.nan_to_num(family.margins(self._poses, sizes)[:, tapes.counted] * tapes.limit_scales, nan=-np.inf)
        fractions = np.clip(0.5 + margins.min(1) / self._edge, 0.0, 1.0)
        rows = np.flatnonzero(fractions > 0.0)
        poses = np.concatenate([middle[None], self._poses[rows]])
        height, width = tapes.machine.parallel_block
        a = family.twist_rates(poses, family.inverse(poses, sizes), sizes).a[:, :height, :width]
        with np.errstate(invalid="ignore"):
            sides = np.sign(compute_volumes(a))
        fractions[rows[sides[1:] != sides[0]]] = 0.0
        return self._volume * float(fractions.reshape(-1, self._count).min(1).mean())

    def prove(self, machine: Machine, seconds: float) -> float:
        """Bound the volume of a ``machine`` from below, mm³; the closer the more ``seconds`` there are."""
        return workspace(self._make_region(machine), _GAP, seconds=max(seconds, _LEAST_SECONDS)).volume.inner
