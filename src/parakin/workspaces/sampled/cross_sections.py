"""Cross-sections of a region: outlines and their areas, from its distance field in the plane of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arguments import check_arguments, check_positive
from ...arrays import Array, Progress
from ...budget import SECONDS, Budget
from ...errors import PoseError
from .distance_field import SampledField, sample_field
from .sampling import TOO_SLOW

COUNT = 5  # evenly spaced cross-sections


@dataclass(frozen=True, eq=False)
class CrossSection:
    """A region where one of its axes has a value, or a region in a plane.

    axis, value : the axis, and its value, mm; both None of a region in a plane
    plane : the two axes of a point
    outlines : closed polygons (n, 2), mm, the first point again at the end: counterclockwise around what is inside,
        clockwise around a hole
    """

    axis: str | None
    value: float | None
    plane: tuple[str, ...]
    outlines: tuple[Array, ...]

    @property
    def area(self) -> float:
        """The area without holes, mm²."""
        return sum((compute_signed_area(outline) for outline in self.outlines), 0.0)

    def __repr__(self) -> str:
        at = "of a plane" if self.axis is None else f"at {self.axis} {self.value:.6g} mm"
        return f"<parakin cross-section {at}: {len(self.outlines)} outlines, {self.area:.6g} mm²>"


def compute_signed_area(outline: Array) -> float:
    """Compute the area of a closed polygon (n, 2), mm², by the shoelace formula; below zero for a clockwise one."""
    x, y = (outline - outline[0]).T
    return float(0.5 * (x[:-1] @ y[1:] - x[1:] @ y[:-1]))


@check_arguments
def find_cross_sections(
    field: SampledField,
    axis: str | None = None,
    values: Sequence[float] | int = COUNT,
    step: float | None = None,
    progress: Progress | None = None,
    seconds: float | None = SECONDS,
) -> tuple[CrossSection, ...]:
    """Find cross-sections of a region in space; of one in a plane its own outline alone.

    Parameters
    ----------
    field : of the whole region
    axis : the axis that is constant in a cross-section; by default the last of the region's
    values : of that axis, mm; or how many, in the middle of layers of one thickness
    step : of the cross-sections' grids, mm at most; by default a 240th of the box's longest edge
    progress : called with the fraction done
    seconds : the time in which all must be sampled; None for no end

    Raises :class:`PoseError` for a region along a line, an axis that is not the region's, an invalid step, and where
    the time is up.
    """
    region, budget = field.region, Budget(seconds)
    if step is not None:
        check_positive("step", step, "mm")
    if len(region.free_axes) == 1:
        raise PoseError(f"a workspace along {region.free_axes[0]} alone has no cross-sections")
    if len(region.free_axes) == 2:
        return (CrossSection(None, None, region.free_axes, trace_outlines(field)),)
    axis = region.free_axes[-1] if axis is None else axis
    if axis not in region.free_axes:
        raise PoseError(f"cross-sections of {axis}: the workspace's axes are {' '.join(region.free_axes)}")
    across = region.free_axes.index(axis)
    if isinstance(values, int):
        first, last = (end[across] for end in field.span)
        heights = (first + (last - first) * (np.arange(values) + 0.5) / values).tolist()
    else:
        heights = [float(value) for value in values]
    low, high = (np.delete(end, across) for end in field.box)
    sections = []
    for number, value in enumerate(heights):
        cut = region.fix({axis: value})
        if budget.is_spent():
            raise PoseError(TOO_SLOW)
        left = None if seconds is None else budget.seconds_left
        plane = sample_field(cut, (low, high), step, field.distance.turns_step, seconds=left)
        sections.append(CrossSection(axis, value, cut.free_axes, trace_outlines(plane)))
        if progress:
            progress((number + 1) / len(heights))
    return tuple(sections)


def trace_outlines(field: SampledField) -> tuple[Array, ...]:
    """Trace where a field in the plane is zero: closed polygons, (n, 2) mm, those with most area first."""
    from skimage.measure import find_contours

    contours = find_contours(field.values, 0.0, positive_orientation="high")
    polygons = [field.refine_crossings(np.asarray(points, np.float64)) for points in contours]
    return tuple(sorted(polygons, key=lambda polygon: -abs(compute_signed_area(polygon))))
