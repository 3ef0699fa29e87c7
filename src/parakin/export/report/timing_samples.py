"""A trajectory as curves of few points that hide no extreme, whatever its length."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Array, Indices
from .joint_curves import pick_extremes_within

if TYPE_CHECKING:
    from ...toolpath.timing import Trajectory

_BLOCK = 1 << 15  # pieces of a trajectory at a time
# Second derivatives at -1, 0 and 1 of the quintic with three values and three derivatives there.
_JERKS = np.array(
    [[-11.5, 8.0, 3.5, -6.0, -8.0, -1.0], [2.0, -4.0, 2.0, 0.5, 0.0, -0.5], [3.5, 8.0, -11.5, 1.0, 8.0, 6.0]]
)
_SHORTEST = 1e-7  # s: a piece as short adds rounding only


@dataclass(frozen=True, eq=False)
class ThinnedCurve:
    """A curve over time, k points.

    times, values : (k,) s; mm or rad, s, and mm/min for feeds; NaN where there is no value
    binding : (k,) what limits the speed there, an index into the trajectory's names
    record : (k,) that the motion leads to
    """

    times: Array
    values: Array
    binding: Indices
    record: Indices


def thin_curves(trajectory: Trajectory, most: int) -> dict[str, ThinnedCurve]:
    """Thin the trajectory's curves to some ``most`` points each.

    They are of the tip ``feed.any``, ``feed.reached`` in feed motions and ``feed.programmed``; of each joint ``d1``,
    ``d1.speed``, ``d1.acceleration``, and ``d1.jerk`` if it is limited.

    The curves are sampled at the start, the middle and the end of every piece of the speed profile; of these samples
    each curve keeps the least and the greatest in every stretch. Stretches are short where pieces are, yet none is
    much longer than the others.
    """
    blocks_by_name: dict[str, list[ThinnedCurve]] = defaultdict(list)
    total, done = 3 * len(trajectory.profile.row), 0
    stretches = most // 3 if total > most else total
    for times, binding, record, curves in _sample_blocks(trajectory):
        along = 0.5 * (times / trajectory.seconds + np.arange(done, done + len(times)) / total)
        done += len(times)
        for name, values in curves.items():
            kept = np.arange(len(values))
            if total > most:
                kept = _drop_short_gaps(times, values, trajectory.seconds / stretches)
                starts = np.flatnonzero(np.diff(np.floor(along[kept] * stretches), prepend=-1.0))
                kept = kept[pick_extremes_within(values[kept], starts)]
            blocks_by_name[name].append(ThinnedCurve(times[kept], values[kept], binding[kept], record[kept]))
    return {name: _join_blocks(blocks) for name, blocks in blocks_by_name.items()}


def _join_blocks(blocks: list[ThinnedCurve]) -> ThinnedCurve:
    names = ("times", "values", "binding", "record")
    return ThinnedCurve(*(np.concatenate([getattr(block, name) for block in blocks]) for name in names))


def _drop_short_gaps(times: Array, values: Array, shortest: float) -> Indices:
    """Drop the NaN of gaps no longer than ``shortest``, s, which would separate the points that are left."""
    gone = np.isnan(values)
    if not gone.any():
        return np.arange(len(values))
    begins = np.flatnonzero(np.diff(gone, prepend=~gone[:1]))
    lasts = np.append(begins[1:], len(values)) - 1
    short = gone[begins] & (times[lasts] - times[begins] <= shortest)
    return np.flatnonzero(~np.repeat(short, lasts - begins + 1))


def _sample_blocks(trajectory: Trajectory) -> Iterator[tuple[Array, Indices, Indices, dict[str, Array]]]:
    """Yield times, binding limits, records, and curves by name, for some pieces at a time."""
    profile, joint_path, machine = trajectory.profile, trajectory.joint_path, trajectory.posted.machine
    tip = [i for i, axis in enumerate(machine.axes) if axis in "XYZ"]
    jerky = [i for i, drive in enumerate(machine.drives) if drive.jerk < np.inf]
    pieces = np.flatnonzero(np.diff(profile.time) > _SHORTEST)
    for first in range(0, len(pieces), _BLOCK):
        piece = pieces[first : first + _BLOCK]
        begin, end = profile.time[piece], np.nextafter(profile.time[piece + 1], 0.0)  # before the next piece takes over
        times = np.column_stack([begin, 0.5 * (begin + end), end])
        at = trajectory.at(times.ravel())
        record = np.repeat(trajectory.curve.record_of_piece[joint_path.segment[profile.row[piece]]], 3)
        feed = np.linalg.norm(_differentiate_parabolas(at.poses[:, tip], times), axis=1)
        curves = {"feed.any": 60.0 * feed, "feed.programmed": _find_programmed_feed(trajectory, record)}
        curves["feed.reached"] = np.where(trajectory.posted.path.rapid[record], np.nan, 60.0 * feed)
        jerks = _compute_jerks(at.speeds[:, jerky], at.accelerations[:, jerky], times)
        for j, name in enumerate(machine.joints):
            curves |= {name: at.joints[:, j], f"{name}.speed": at.speeds[:, j]}
            curves[f"{name}.acceleration"] = at.accelerations[:, j]
            if j in jerky:
                curves[f"{name}.jerk"] = jerks[:, jerky.index(j)]
        binding = trajectory.find_binding(at.times)
        yield at.times, binding, record, curves


def _differentiate_parabolas(values: Array, times: Array) -> Array:
    """Differentiate the parabolas through start, middle and end of k pieces (k, 3) there: (3 k, columns)."""
    first, middle, last = np.moveaxis(values.reshape(len(times), 3, -1), 1, 0)
    rates = np.stack([4.0 * middle - 3.0 * first - last, last - first, first - 4.0 * middle + 3.0 * last], axis=1)
    result: Array = (rates / (times[:, 2] - times[:, 0])[:, None, None]).reshape(values.shape)
    return result


def _compute_jerks(speeds: Array, accelerations: Array, times: Array) -> Array:
    """Compute the jerks (3 k, joints) at start, middle and end of k pieces, with errors of the fourth order.

    They are second derivatives of the quintics that have the speeds and accelerations there.
    """
    half = 0.5 * (times[:, 2] - times[:, 0])[:, None, None]
    given = np.concatenate(
        [speeds.reshape(len(times), 3, -1) / half**2, accelerations.reshape(len(times), 3, -1) / half], axis=1
    )
    result: Array = (_JERKS @ given).reshape(speeds.shape)
    return result


def _find_programmed_feed(trajectory: Trajectory, record: Indices) -> Array:
    """Find the programmed feed on motions to records, mm/min; NaN in rapid and where there is none."""
    path = trajectory.posted.path
    feed = path.feed.copy()
    if path.seconds is not None:
        steps = np.linalg.norm(np.diff(path.tip, axis=0, prepend=path.tip[:1]), axis=1)
        timed = path.seconds > 0.0
        feed[timed] = 60.0 * steps[timed] / path.seconds[timed]
    return np.where(path.rapid, np.nan, feed)[record]
