"""Points in their own plane: which are distinct, and their order round their middle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]

_NEAR = 1e-6  # mm; points nearer than this are one


def order_polygon(points: Points) -> Points:
    """Order the distinct points round their middle in their own plane; of a line return the ends."""
    ordered: Points = points[list_polygon(points)]
    return ordered


def list_polygon(points: Points) -> list[int]:
    """List the distinct points in order round their middle in their own plane; of a line the ends."""
    distinct = np.array(find_distinct(list(points)))
    points = points[distinct]
    if len(points) < 3:
        return list(distinct.tolist())
    off = points - points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(off)
    if sizes[1] < 1e-9 * sizes[0]:
        along = off @ axes[0]
        return list(distinct[[along.argmin(), along.argmax()]].tolist())
    return list(distinct[np.argsort(np.arctan2(off @ axes[1], off @ axes[0]))].tolist())


def find_distinct(points: list[Points]) -> list[int]:
    """Find the first point of each place."""
    kept: list[int] = []
    for number, point in enumerate(points):
        if not any(coincide(point, points[other]) for other in kept):
            kept.append(number)
    return kept


def coincide(a: Points, b: Points) -> bool:
    """Tell whether two points are one."""
    return bool(np.linalg.norm(a - b) < _NEAR)
