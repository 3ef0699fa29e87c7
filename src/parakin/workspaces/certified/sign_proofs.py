"""Proofs of a margin's sign over whole boxes, by forms that intervals bound far closer than the margin itself.

Each takes boxes [low, high] (N, d) of positions and orientations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ...algebra import Scalar, Term, Vec, sub
from ...arrays import Array
from .matrix_bounds import LinearMatrices, MatrixBounds, prove_regular


class ProvedSigns(NamedTuple):
    """What is proved of a margin over N boxes.

    sign : (N,) 1 where it is kept all over the box, -1 where it is broken all over it, 0 where neither is proved
    spread : (N, d) how far each input spreads the form's bounds
    """

    sign: Array
    spread: Array


SignProof: TypeAlias = Callable[[Array, Array], ProvedSigns]

_ROUNDING = 1e-12  # relative, of sums of a few products
_TINY = 1e-300
_TILTS = 8  # directions about that of a distance
_TILTED, _MOST_TILTED = 0.7, 0.6  # of what leaves enough of the distance, and rad


def make_margin_proof(margin: Scalar, inputs: Sequence[Term]) -> SignProof:
    """Make the proof by another margin of the same sign."""
    bounds = MatrixBounds([[margin]], inputs, inputs[0].trace)

    def prove(low: Array, high: Array) -> ProvedSigns:
        form = bounds(low, high)
        off = (form.linear_change + form.rest)[:, 0, 0] * (1.0 + _ROUNDING)
        middle = form.middle[:, 0, 0]
        with np.errstate(invalid="ignore"):
            kept, broken = middle - off >= 0.0, middle + off < 0.0
        return ProvedSigns(
            np.where(kept, 1.0, np.where(broken, -1.0, 0.0)),
            form.half * (np.abs(form.slopes) + form.spread)[:, :, 0, 0],
        )

    return prove


def make_separation_proof(
    frames: Sequence[tuple[tuple[Vec, Vec], tuple[Vec, Vec]]], least: float, inputs: Sequence[Term]
) -> SignProof:
    """Make the proof that two segments are ``least`` apart: along one direction, both ends from both of the other.

    The direction is that of their distance in the middle of the box, in one of some frames. Nothing depends on which
    points are nearest, and what stands still in a frame has no spread there.
    """
    gaps = [MatrixBounds([sub(a, b) for a in one for b in two], inputs, inputs[0].trace) for one, two in frames]

    def prove(low: Array, high: Array) -> ProvedSigns:
        best, spread = np.full(len(low), -np.inf), np.zeros(low.shape)
        for bounds in gaps:
            _tighten_separation(bounds, (low, high), least, best, spread)
        return ProvedSigns(np.where(best >= least, 1.0, 0.0), spread)

    return prove


def _tighten_separation(
    bounds: MatrixBounds, boxes: tuple[Array, Array], least: float, best: Array, spread: Array
) -> None:
    """Tighten the ``best`` separations (N,) proved so far, and how far each input spreads them (N, d).

    Where the direction of the distance is not enough, others about it are tried, by as much as leaves ``least`` of it.
    """
    form = bounds(*boxes)
    direction, distance = _find_directions(form.middle)
    rows = np.flatnonzero(best < least)
    for tilt in (None, *range(_TILTS)):
        own = direction[rows] if tilt is None else _tilt_directions(direction[rows], distance[rows], least, tilt)
        clear, changes = _measure_separation(form.take(rows), own)
        better = clear > best[rows]
        best[rows[better]], spread[rows[better]] = clear[better], changes[better]
        rows = rows[best[rows] < least]
        if not len(rows):
            break


def _measure_separation(form: LinearMatrices, direction: Array) -> tuple[Array, Array]:
    """Measure how far apart segments are at least along directions, (N,), and how far each input spreads that."""
    size = np.abs(direction)
    along = np.einsum("nki,ni->nk", form.middle, direction)
    slopes = np.abs(np.einsum("ndki,ni->ndk", form.slopes, direction))
    changes = form.half[:, :, None] * (slopes + np.einsum("ndki,ni->ndk", form.spread, size))
    rounding = _ROUNDING * (np.abs(form.middle) + form.linear_change) + form.own
    with np.errstate(invalid="ignore"):
        clear = along - changes.sum(1) * (1.0 + _ROUNDING) - np.einsum("nki,ni->nk", rounding, size)
    clear = np.nan_to_num(clear, nan=-np.inf)
    worst = clear.argmin(1)
    return clear.min(1), changes[np.arange(len(worst)), :, worst]


def _tilt_directions(direction: Array, distance: Array, least: float, number: int) -> Array:
    """Tilt unit vectors (N, 3) to one of :data:`_TILTS` sides, by most of what leaves ``least`` of the distance."""
    with np.errstate(invalid="ignore", divide="ignore"):
        by = np.minimum(_TILTED * np.arccos(np.minimum(least / distance, 1.0)), _MOST_TILTED)[:, None]
    axis = np.eye(3)[np.abs(direction).argmin(1)]
    first = np.cross(direction, axis)
    first /= np.linalg.norm(first, axis=1)[:, None] + _TINY
    turn = 2.0 * np.pi * number / _TILTS
    side = np.cos(turn) * first + np.sin(turn) * np.cross(direction, first)
    return np.asarray(np.cos(by) * direction + np.sin(by) * side)


def make_side_proof(rows: Sequence[Sequence[Scalar]], side: float, inputs: Sequence[Term]) -> SignProof:
    """Make the proof that a determinant has the sign of ``side`` all over a box, by the matrices' regularity."""
    bounds = MatrixBounds(rows, inputs, inputs[0].trace)

    def prove(low: Array, high: Array) -> ProvedSigns:
        regular = prove_regular(bounds(low, high))
        return ProvedSigns(regular.sign * side, regular.spread)

    return prove


def _find_directions(gaps: Array) -> tuple[Array, Array]:
    """Find unit vectors (N, 3) from the nearest point of the second segment to that of the first, and distances (N,).

    gaps : (N, 4, 3) of the ends: first to first, first to second, second to first, second to second
    """
    w, u, v = gaps[:, 0], gaps[:, 2] - gaps[:, 0], gaps[:, 0] - gaps[:, 1]
    with np.errstate(all="ignore"):
        uu, vv, uv, uw, vw = (np.einsum("ni,ni->n", a, b) for a, b in ((u, u), (v, v), (u, v), (u, w), (v, w)))
        s = np.clip((uv * vw - uw * vv) / np.maximum(uu * vv - uv * uv, 1e-14 * uu * vv), 0.0, 1.0)
        t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
        s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
        between = w + u * s[:, None] - v * t[:, None]
        distance = np.linalg.norm(between, axis=1)
        direction = between / (distance + _TINY)[:, None]
    return np.where(np.isfinite(direction), direction, 0.0), np.nan_to_num(distance)
