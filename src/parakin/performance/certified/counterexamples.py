"""Poses of a box at which a machine is singular, looked for before anything is proved."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from ...arrays import Array
from ..search import climb_within
from ..singularities import PARALLEL, margin_names, singularity_margins
from .interval_matrices import Box

Kind = Literal["parallel", "serial"]

NOUGHT = 1e-9  # a singularity margin no greater is a singularity


def _margins(box: Box, kind: Kind, points: Array) -> Array:
    """(N, margins) of one kind at points of the box."""
    found = singularity_margins(box.machine, box.poses(points), box.length.value, box.mode)
    wanted = [(name == PARALLEL) == (kind == "parallel") for name in margin_names(box.machine)]
    return np.asarray(found[:, wanted])


def singular_pose(box: Box, kind: Kind) -> tuple[Array, str] | None:
    """A pose of the box where a margin is 0, with the margin's name; None if none was met."""
    points = box.samples
    margins = _margins(box, kind, points)
    names = [name for name in margin_names(box.machine) if (name == PARALLEL) == (kind == "parallel")]
    for number, name in enumerate(names):
        values = margins[:, number]
        if (values > 0.0).any() and (values < 0.0).any():
            ends = points[int(np.nanargmax(values))], points[int(np.nanargmin(values))]
            point = _crossing(lambda x, n=number: float(_margins(box, kind, x[None])[0, n]), *ends)  # type: ignore[misc]
        else:
            point = _least(box, kind, number, points, values)
        if abs(_margins(box, kind, point[None])[0, number]) <= NOUGHT:
            return box.poses(point[None])[0], name
    return None


def _crossing(value: Callable[[Array], float], above: Array, below: Array) -> Array:
    """Where a value changes its sign between two points, to the last digits."""
    for _ in range(100):
        middle = 0.5 * (above + below)
        if value(middle) > 0.0:
            above = middle
        else:
            below = middle
    return above if abs(value(above)) < abs(value(below)) else below


def _least(box: Box, kind: Kind, number: int, points: Array, values: Array) -> Array:
    """The point of the box where a margin's size is least, by search from the least sample."""
    start = points[[int(np.nanargmin(np.abs(values)))]]
    if start.shape[1]:
        start, _ = climb_within(
            lambda places: -np.abs(_margins(box, kind, places)[:, number]), box.low, box.high, start, 1e-14
        )
    return np.asarray(start[0])
