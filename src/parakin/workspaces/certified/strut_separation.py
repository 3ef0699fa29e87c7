"""Proofs that two struts keep their distance, or do not, by a direction along which they are apart and by two points.

A segment's points are x = a0 + s·(a1 - a0); all is told by the four vectors between the ends of one and of the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...algebra import Term, Vec, sub
from ...arrays import Array
from .matrix_bounds import LinearMatrices, MatrixBounds
from .sign_proofs import ROUNDING, FormPlanes, ProvedSigns, SignProof

_TINY = 1e-300
_PARALLEL = 1e-9  # of squared lengths: keeps directions that follow nearly parallel segments bounded
_TILTS = 8  # directions about that of a distance
_TILTED, _MOST_TILTED = 0.7, 0.6  # of what leaves enough of the distance, and rad


def make_separation_proof(
    frames: Sequence[tuple[tuple[Vec, Vec], tuple[Vec, Vec]]], least: float, inputs: Sequence[Term]
) -> SignProof:
    """Make the proof that two segments are ``least`` apart, or nearer than that, in one of some frames.

    They are apart if along one direction both ends are so far from both of the other, and nearer if two of their points
    are. Direction and points are those of the distance in the middle of the box: nothing depends on which points are
    nearest elsewhere, and what stands still in a frame has no spread there.
    """
    gaps = [MatrixBounds([sub(a, b) for a in one for b in two], inputs, inputs[0].trace) for one, two in frames]

    def prove(low: Array, high: Array) -> ProvedSigns:
        count, d = low.shape
        best, spread = np.full(count, -np.inf), np.zeros(low.shape)
        planes = FormPlanes(np.zeros((count, d)), np.full(count, -np.inf), np.full(count, np.inf))
        for bounds in gaps:
            form = bounds(low, high)
            nearest = _find_nearest(form.middle)
            own = _bound_distance(form, nearest)
            closer = own.high - own.low < planes.high - planes.low
            for best_so_far, new in zip(planes, own, strict=True):
                best_so_far[closer] = new[closer]
            _tighten_separation(form, nearest, least, best, spread)
        change = np.abs(planes.slopes).sum(1) * (1.0 + ROUNDING)
        apart = (best >= least) | (planes.low - change >= least)
        near = planes.high + change < least
        signs = np.where(apart, 1.0, np.where(near, -1.0, 0.0))
        return ProvedSigns(signs, spread, FormPlanes(planes.slopes, planes.low - least, planes.high - least))

    return prove


class _NearestPoints(NamedTuple):
    """The nearest points of N pairs of segments.

    direction, distance : (N, 3) from the second to the first, of length 1 or 0, and (N,) mm
    weights : (N, 4) what the vectors between ends have in the vector between the nearest points
    inside : (N, 2) whether each point is inside its segment
    """

    direction: Array
    distance: Array
    weights: Array
    inside: Array


def _bound_distance(form: LinearMatrices, nearest: _NearestPoints) -> FormPlanes:
    """Bound the distance of segments by planes; both rests are of the second order in the box's size.

    It is at most that of the points that are nearest in the middle, and at least what the least of the four vectors has
    along a direction that turns with the inputs as the common perpendicular does.
    """
    direction, distance, weights, _ = nearest
    bounded = form.bounded & (distance > 0.0) & np.isfinite(weights).all(1)
    low, high = np.full(len(distance), -np.inf), np.full(len(distance), np.inf)
    slopes = np.zeros(form.half.shape)
    form, weights = form.take(bounded), weights[bounded]
    along = np.einsum("ndki,ni->ndk", form.slopes, direction[bounded]) * form.half[:, :, None]
    slopes[bounded] = np.einsum("ndk,nk->nd", along, weights)
    own = slopes[bounded], distance[bounded]
    high[bounded] = _bound_above(form, direction[bounded], weights, *own)
    low[bounded] = _bound_below(form, _NearestPoints(*(x[bounded] for x in nearest)), along, own[0])
    return FormPlanes(slopes, low, high)


def _bound_above(form: LinearMatrices, direction: Array, weights: Array, slopes: Array, distance: Array) -> Array:
    """Bound the distance of the points of ``weights`` above its plane of ``slopes``, (N,)."""
    axes = _complete_axes(direction)
    moves = np.einsum("nk,ndki,nji->ndj", weights, form.slopes, axes) * form.half[:, :, None]
    rest = np.einsum("nk,nki,nji->nj", weights, form.rest, np.abs(axes))
    rest += ROUNDING * (np.abs(form.middle).max((1, 2)) + np.abs(moves).sum((1, 2)))[:, None]
    aside = np.square(np.abs(moves[:, :, 1:]).sum(1) + rest[:, 1:]).sum(1)
    change = np.abs(slopes).sum(1)
    least = distance - change - rest[:, 0]
    most = np.sqrt(np.square(distance + change + rest[:, 0]) + aside) + change  # where the points may meet
    apart = least > _TINY
    return np.asarray(np.where(apart, distance + rest[:, 0] + aside / (2.0 * np.where(apart, least, 1.0)), most))


def _bound_below(form: LinearMatrices, nearest: _NearestPoints, along: Array, slopes: Array) -> Array:
    """Bound the distance of segments below its plane of ``slopes``, (N,)."""
    direction = nearest.direction
    turns = _follow_perpendicular(form, nearest, along)  # of the direction, by inputs in [-1, 1]
    size = np.linalg.norm(turns, axis=2)
    moves = form.slopes * form.half[:, :, None, None]
    own = along + np.einsum("nci,nki->nck", turns, form.middle) - slopes[:, :, None]
    second = np.abs(np.einsum("nci,ndki->ncdk", turns, moves)).sum((1, 2))
    reach = np.abs(direction) + np.abs(turns).sum(1)
    rest = np.einsum("ni,nki->nk", reach, form.rest + ROUNDING * (np.abs(form.middle) + form.linear_change))
    values = np.einsum("ni,nki->nk", direction, form.middle) - np.abs(own).sum(1) - second - rest
    least = values.min(1)
    longest = np.sqrt(1.0 + np.square(size.sum(1))) * (1.0 + ROUNDING)
    most = np.maximum(least + np.abs(slopes).sum(1), 0.0)
    return np.asarray(least - (1.0 - 1.0 / longest) * most)


def _follow_perpendicular(form: LinearMatrices, nearest: _NearestPoints, along: Array) -> Array:
    """Find how the direction turns with each input so that it stays at right angles to both segments, (N, d, 3).

    A segment whose nearest point is its end needs none: along the direction its other end is farther away.
    """
    first = (form.middle[:, 2] - form.middle[:, 0]) * nearest.inside[:, :1]
    second = (form.middle[:, 0] - form.middle[:, 1]) * nearest.inside[:, 1:]
    sides = np.stack([first, second], 1)
    sides -= np.einsum("nki,ni->nk", sides, nearest.direction)[:, :, None] * nearest.direction[:, None]
    changes = np.stack([along[:, :, 0] - along[:, :, 2], along[:, :, 1] - along[:, :, 0]], 2)
    changes *= nearest.inside[:, None]
    squares = np.einsum("nki,nli->nkl", sides, sides)
    size = np.trace(squares, axis1=1, axis2=2)
    squares += (_PARALLEL * size + (size == 0.0))[:, None, None] * np.eye(2)
    return np.asarray(changes @ np.linalg.inv(squares) @ sides)


def _tighten_separation(
    form: LinearMatrices, nearest: _NearestPoints, least: float, best: Array, spread: Array
) -> None:
    """Tighten the ``best`` separations (N,) proved so far, and how far each input spreads them (N, d).

    Where the direction of the distance is not enough, others about it are tried, by as much as leaves ``least`` of it.
    """
    direction, distance = nearest.direction, nearest.distance
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
    rounding = ROUNDING * (np.abs(form.middle) + form.linear_change) + form.own
    with np.errstate(invalid="ignore"):
        clear = along - changes.sum(1) * (1.0 + ROUNDING) - np.einsum("nki,ni->nk", rounding, size)
    clear = np.nan_to_num(clear, nan=-np.inf)
    worst = clear.argmin(1)
    return clear.min(1), changes[np.arange(len(worst)), :, worst]


def _tilt_directions(direction: Array, distance: Array, least: float, number: int) -> Array:
    """Tilt unit vectors (N, 3) to one of :data:`_TILTS` sides, by most of what leaves ``least`` of the distance."""
    with np.errstate(invalid="ignore", divide="ignore"):
        by = np.minimum(_TILTED * np.arccos(np.minimum(least / distance, 1.0)), _MOST_TILTED)[:, None]
    turn = 2.0 * np.pi * number / _TILTS
    _, first, second = _complete_axes(direction).transpose(1, 0, 2)
    return np.asarray(np.cos(by) * direction + np.sin(by) * (np.cos(turn) * first + np.sin(turn) * second))


def _complete_axes(direction: Array) -> Array:
    """Complete unit vectors (N, 3) to three at right angles, (N, 3, 3)."""
    direction = np.where(direction.any(1, keepdims=True), direction, np.eye(3)[2])
    first = np.cross(direction, np.eye(3)[np.abs(direction).argmin(1)])
    first /= np.linalg.norm(first, axis=1)[:, None] + _TINY
    return np.stack([direction, first, np.cross(direction, first)], 1)


def _find_nearest(gaps: Array) -> _NearestPoints:
    """Find the nearest points of two segments.

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
        weights = np.stack([(1.0 - s) * (1.0 - t), (1.0 - s) * t, s * (1.0 - t), s * t], 1)
        inside = np.stack([(s > 0.0) & (s < 1.0), (t > 0.0) & (t < 1.0)], 1).astype(float)
    return _NearestPoints(np.where(np.isfinite(direction), direction, 0.0), np.nan_to_num(distance), weights, inside)
