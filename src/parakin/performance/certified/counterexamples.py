"""Counterexamples: singular poses of a box, searched for before anything is proved."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np

from ...arrays import Array
from ..search import search_maxima_in_box
from ..singularities import CONSTRAINT, PARALLEL, compute_singularity_margins, list_margin_names
from .interval_matrices import PoseBox

SingularityKind = Literal["parallel", "serial", "constraint"]

ZERO = 1e-9  # a singularity margin no greater is a singularity


def find_singular_pose(box: PoseBox, kind: SingularityKind) -> tuple[Array, str] | None:
    """Find a pose of the box where a margin is zero, with the margin's name; None if none was found."""
    points = box.samples
    names = [name for name in list_margin_names(box.machine) if _is_of_kind(name, kind)]
    margins = _compute_margins(box, kind, points)
    for number, name in enumerate(names):
        values = margins[:, number]
        evaluate = partial(_compute_margin, box, kind, number)
        if (values > 0.0).any() and (values < 0.0).any():
            point = _bisect_crossing(evaluate, points[int(np.nanargmax(values))], points[int(np.nanargmin(values))])
        else:
            point = _search_least(evaluate, box, points[[int(np.nanargmin(np.abs(values)))]])
        if abs(evaluate(point[None])[0]) <= ZERO:
            return box.poses(point[None])[0], name
    return None


def _is_of_kind(name: str, kind: SingularityKind) -> bool:
    of_kind = {PARALLEL: "parallel", CONSTRAINT: "constraint"}.get(name, "serial")
    return of_kind == kind


def _compute_margins(box: PoseBox, kind: SingularityKind, points: Array) -> Array:
    """Compute the singularity margins of one kind at points of the box, (N, margins)."""
    margins = compute_singularity_margins(box.machine, box.poses(points), box.length.value, box.mode)
    return np.asarray(margins[:, [_is_of_kind(name, kind) for name in list_margin_names(box.machine)]])


def _compute_margin(box: PoseBox, kind: SingularityKind, number: int, points: Array) -> Array:
    return _compute_margins(box, kind, points)[:, number]


def _bisect_crossing(evaluate: Callable[[Array], Array], above: Array, below: Array) -> Array:
    """Find by bisection where a value changes its sign between two points, to the last digits."""
    for _ in range(100):
        middle = 0.5 * (above + below)
        if evaluate(middle[None])[0] > 0.0:
            above = middle
        else:
            below = middle
    return above if abs(evaluate(above[None])[0]) < abs(evaluate(below[None])[0]) else below


def _search_least(evaluate: Callable[[Array], Array], box: PoseBox, start: Array) -> Array:
    """Search for the point of the box where a margin's size is least, from a sample (1, d)."""
    if start.shape[1]:
        start, _ = search_maxima_in_box(lambda points: -np.abs(evaluate(points)), box.low, box.high, start, 1e-14)
    return np.asarray(start[0])
