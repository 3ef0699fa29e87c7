"""The nearest parallel singularity to a pose: the largest box or sphere about it that is proved to have none.

Best-first branch and bound (Land and Doig): of all parts of the poses the nearest to the middle are bounded next. A
part in which the legs close and the matrix is regular drops out; a pose on the other side of the singularities, or out
of reach, bounds the distance from above, for there is a singular pose on the line from the middle to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...arguments import check_arguments
from ...arrays import Array, AxisRange, Flags
from ...budget import SECONDS, Budget
from ...errors import PoseError
from ...machine import Machine
from ...workspaces.certified.matrix_bounds import MatrixBounds
from ...workspaces.certified.region import Region
from ..singularities import compute_singularity_margins
from .bisection import AT_ONCE, bisect_inputs, decide_nonnegative, decide_regular
from .interval_matrices import PoseBox
from .proofs import make_pose_box

Shape = Literal["box", "sphere"]
End = Literal["singular", "out of reach", "box", "time", "parts"]
_TOLERANCE = 0.01  # relative, between what is proved and what is met
_BOXES = 400_000
_HALVINGS = 50  # of the line on which a singular pose is bracketed


@dataclass(frozen=True, eq=False)
class SingularityDistance:
    """How far it is from the middle of a box of poses to the nearest parallel singularity, between two numbers.

    machine : the one that this is about
    ranges : low and high of the box's axes, mm and rad
    shape : ``box``: as a fraction of the box about its middle, 1 for all of it; ``sphere``: mm of the tip from the
        middle, at all of the box's orientations, up to the sphere that fits into the box
    middle : (axes,) mm and rad
    inner : up to there the legs close and no pose is singular, which is proved
    outer : there is one no farther away, or one out of reach; the greatest possible where none was met
    pose : (axes,) that pose; None where none was met
    reason : what is there, for people
    ended : what ended the growth: a ``singular`` pose, one ``out of reach``, the given ``box``, or the search's
        ``time`` or number of ``parts``, which leaves what is between both numbers undecided
    boxes : how many parts were examined
    """

    machine: Machine
    shape: Shape
    middle: Array
    ranges: Mapping[str, AxisRange]
    inner: float
    outer: float
    pose: Array | None
    reason: str
    ended: End
    boxes: int

    def __repr__(self) -> str:
        return f"<parakin singularity distance of {self.machine.name}: {self.inner:.4g} to {self.outer:.4g}>"

    @property
    def grown_ranges(self) -> dict[str, AxisRange]:
        """Low and high of the axes of the largest box, or of the box about the largest sphere."""
        result = {}
        for axis, (low, high) in self.ranges.items():
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            if self.shape == "sphere":
                half = self.inner if axis in "XYZ" else half
            else:
                half *= self.inner
            result[axis] = (middle - half, middle + half)
        return result


@check_arguments
def find_nearest_singularity(
    region: Region,
    ranges: Mapping[str, AxisRange],
    shape: Shape = "box",
    tolerance: float = _TOLERANCE,
    seconds: float | None = SECONDS,
) -> SingularityDistance:
    """Find the largest box of the proportions of ``ranges``, or the largest sphere, that has no parallel singularity.

    Both lie about the middle of the ranges and within them; sides and radius are bracketed to a relative ``tolerance``,
    as far as ``seconds`` allow. With more drives than freedoms no singular pose is told, for none separates two sides.

    region : made by :func:`parakin.region`; its machine, mode and fixed axes count
    ranges : low and high of some axes, mm and rad; others are fixed as in the region, or as at home
    shape : ``box`` or ``sphere``

    Raises :class:`PoseError` for invalid ranges, and a middle that is singular or out of reach.
    """
    if shape not in ("box", "sphere"):
        raise PoseError(f"shape: box or sphere expected, not {shape}")
    if not 0.0 < tolerance < 1.0:
        raise PoseError(f"tolerance: a share between 0 and 1 expected, not {tolerance:g}")
    box = make_pose_box(region, ranges)
    if not (set(box.ranges) & set("XYZ") if shape == "sphere" else box.ranges):
        what = "X, Y or Z" if shape == "sphere" else "an axis"
        raise PoseError(f"box: a range of {what} expected")
    return _DistanceSearch(box, shape, Budget(seconds, _BOXES)).run(tolerance)


class _DistanceSearch:
    def __init__(self, box: PoseBox, shape: Shape, budget: Budget):
        self.box, self.shape, self.budget = box, shape, budget
        self.middle, self.half = 0.5 * (box.low + box.high), 0.5 * (box.high - box.low)
        self.along = np.array([axis in "XYZ" for axis in box.ranges])
        self.greatest = 1.0 if shape == "box" else float(self.half[self.along].min())
        self.outer, self.farthest = self.greatest, np.empty(0)
        self.reason: Literal["singular", "out of reach", ""] = ""
        first = box.high - box.low
        self.regular = decide_regular(MatrixBounds(box.parallel, box.inputs, box.trace), first)
        self.reach = decide_nonnegative(MatrixBounds([box.reach], box.inputs, box.trace), first) if box.reach else None

    def run(self, tolerance: float) -> SingularityDistance:
        box, low, high = self.box, self.box.low[None], self.box.high[None]
        if not self._is_beyond(self.middle[None])[1][0]:
            raise PoseError("the middle of the box is out of reach or singular")
        nearest = self._measure(low, high)
        while len(low) and nearest.min() < (1.0 - tolerance) * self.outer and not self.budget.is_spent():
            order = np.argpartition(nearest, min(AT_ONCE, len(nearest)) - 1)
            now, rest = order[:AT_ONCE], order[AT_ONCE:]
            halves = self._split(low[now], high[now])
            low, high = (np.concatenate([own[rest], new]) for own, new in zip((low, high), halves, strict=True))
            nearest = self._measure(low, high)
            kept = nearest < self.outer
            low, high, nearest = *self._clip(low[kept], high[kept]), nearest[kept]
        inner = min(float(nearest.min(initial=np.inf)), self.outer)
        pose = None if not self.reason else self.box.poses(self._bracket_end()[None])[0]
        ended: End = self.reason or "box"
        if inner < (1.0 - tolerance) * self.outer:
            ended = "parts" if self.budget.used >= self.budget.boxes else "time"
        middle = box.poses(self.middle[None])[0]
        return SingularityDistance(
            box.machine, self.shape, middle, dict(box.ranges), inner, self.outer, pose, self.reason, ended,
            self.budget.used,
        )  # fmt: skip

    def _split(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Drop the parts that are proved, and halve the others."""
        self.budget.used += len(low)
        decided, axis = self.regular(low, high)
        if self.reach is not None:
            reached, widest = self.reach(low, high)
            axis = np.where(decided, widest, axis)
            decided = decided & reached
        low, high, axis = low[~decided], high[~decided], axis[~decided]
        self._meet(0.5 * (low + high))
        return bisect_inputs(low, high, axis)

    def _meet(self, points: Array) -> None:
        """Lower the outer bound by the nearest of the points beyond a singularity or out of reach."""
        beyond, inside = self._is_beyond(points)
        far = np.where(inside, np.inf, self._measure(points, points))
        best = int(far.argmin()) if len(far) else 0
        if len(far) and far[best] < self.outer:
            self.outer, self.farthest = float(far[best]), points[best]
            self.reason = "singular" if beyond[best] else "out of reach"

    def _is_beyond(self, points: Array) -> tuple[Flags, Flags]:
        """Tell of points (N, d) which lie beyond a singularity, and which on the middle's side."""
        rows = self.box.poses(np.concatenate([self.middle[None], points]))
        margins = compute_singularity_margins(self.box.machine, rows, self.box.length.value, self.box.mode)[:, 0]
        with np.errstate(invalid="ignore"):
            same = margins[1:] * np.sign(margins[0])
            return same <= 0.0, same > 0.0

    def _bracket_end(self) -> Array:
        """Bisect the line from the middle to the nearest point beyond: the first half may still have one, too."""
        near, far = self.middle, self.farthest
        for _ in range(_HALVINGS):
            point = 0.5 * (near + far)
            near, far = (point, far) if self._is_beyond(point[None])[1][0] else (near, point)
        beyond = self._is_beyond(far[None])[0][0]
        self.outer = min(self.outer, float(self._measure(far[None], far[None])[0]))
        self.reason = "singular" if beyond else "out of reach"
        return far

    def _clip(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Clip boxes (N, d) to what is no farther from the middle than the outer bound along each axis."""
        most = self.outer * self.half if self.shape == "box" else np.where(self.along, self.outer, np.inf)
        return np.maximum(low, self.middle - most), np.minimum(high, self.middle + most)

    def _measure(self, low: Array, high: Array) -> Array:
        """Measure the distance of the nearest point of boxes (N, d) from the middle."""
        off = np.maximum(np.maximum(low - self.middle, self.middle - high), 0.0)
        if self.shape == "box":
            return np.asarray((off / self.half).max(1))
        return np.asarray(np.sqrt((off[:, self.along] ** 2).sum(1)))
