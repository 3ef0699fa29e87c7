"""Cross-sections of a region: outlines and their areas, from its field in the plane of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from .field import Field, field

COUNT = 5  # evenly spaced sections


@dataclass(frozen=True, eq=False)
class Section:
    """A region where one of its axes has a value; of a region in a plane (``axis`` None) the whole of it.

    places : the two axes of a point
    outlines : closed polygons (n, 2), mm, the first point again at the end: counterclockwise around what is inside,
        clockwise around a hole
    """

    axis: str | None
    value: float | None
    places: tuple[str, ...]
    outlines: tuple[Array, ...]

    @property
    def area(self) -> float:
        """mm², holes left out."""
        return sum((enclosed(outline) for outline in self.outlines), 0.0)


def enclosed(outline: Array) -> float:
    """The area of a closed polygon (n, 2), mm²; below 0 for a clockwise one."""
    x, y = (outline - outline[0]).T
    return float(0.5 * (x[:-1] @ y[1:] - x[1:] @ y[:-1]))


def sections(
    whole: Field,
    axis: str | None = None,
    values: Sequence[float] | int = COUNT,
    step: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Section, ...]:
    """Cross-sections of a region in space; of one in a plane its own outline alone.

    Parameters
    ----------
    whole : the region's field
    axis : what is the same all over a section; by default the last of the region's
    values : of that axis, mm; or how many, in the middle of layers of one thickness
    step : of the sections' grids, mm at most; by default a 240th of the box's longest edge
    progress : called with the fraction done

    Raises :class:`PoseError` for a region along a line, an axis that is not the region's, or no such step.
    """
    region = whole.region
    if len(region.free_axes) == 1:
        raise PoseError(f"a workspace along {region.free_axes[0]} alone has no cross-sections")
    if len(region.free_axes) == 2:
        return (Section(None, None, region.free_axes, outlines(whole)),)
    axis = region.free_axes[-1] if axis is None else axis
    if axis not in region.free_axes:
        raise PoseError(f"cross-sections of {axis}: the workspace's axes are {' '.join(region.free_axes)}")
    across = region.free_axes.index(axis)
    if isinstance(values, int):
        first, last = (end[across] for end in whole.span)
        heights = (first + (last - first) * (np.arange(values) + 0.5) / values).tolist()
    else:
        heights = [float(value) for value in values]
    low, high = (np.delete(end, across) for end in whole.box)
    found = []
    for number, value in enumerate(heights):
        cut = region.fix({axis: value})
        plane = field(cut, (low, high), step, whole.distance.turn_step)
        found.append(Section(axis, value, cut.free_axes, outlines(plane)))
        if progress:
            progress((number + 1) / len(heights))
    return tuple(found)


def outlines(plane: Field) -> tuple[Array, ...]:
    """Where a field in the plane is 0: closed polygons, (n, 2) mm, those with most area first."""
    from skimage.measure import find_contours

    found = find_contours(plane.values, 0.0, positive_orientation="high")
    polygons = [plane.crossings(np.asarray(points, np.float64)) for points in found]
    return tuple(sorted(polygons, key=lambda polygon: -abs(enclosed(polygon))))
