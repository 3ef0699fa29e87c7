"""Explain a cycle time that is far longer than the programmed feeds ask for, and refuse one that never ends."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ..path import Note
from .trajectory import Trajectory

_LONGER = 1.5  # times what feeds and rapids ask for, from which on it is explained,
_LONGEST = 1e8  # s, three years: a feed with a slip of the pen
_YEAR = 365.25 * 86400.0  # s
_LEAST = 0.3  # s: if it is so much longer: to start and to stop takes some tenths


def refuse_endless(trajectory: Trajectory) -> None:
    """Refuse a trajectory of more than three years, which no program can be made of in a bounded time."""
    if trajectory.seconds > _LONGEST:
        path, longest = trajectory.posted.path, int(np.diff(trajectory.times, prepend=0.0).argmax())
        raise PoseError(
            f"{path.source}:{path.line[longest]}: the path takes {trajectory.seconds / _YEAR:,.0f} years at its feeds, "
            f"most of them here; less than {_LONGEST / _YEAR:.3g} expected"
        )


def explain_lost_time(trajectory: Trajectory) -> Note | None:
    """Explain at its line what costs most, where a trajectory takes over 1.5 times what the feeds ask for."""
    seconds, feed_seconds = np.diff(trajectory.times, prepend=0.0), _measure_feed_times(trajectory)
    if not seconds.sum() > max(_LONGER * feed_seconds.sum(), feed_seconds.sum() + _LEAST):
        return None
    lines, number = np.unique(trajectory.posted.path.line, return_inverse=True)
    times_by_line, feed_times_by_line = (np.bincount(number, each) for each in (seconds, feed_seconds))
    worst = int((times_by_line - feed_times_by_line).argmax())
    spans = np.diff(trajectory.profile.row_times, append=trajectory.seconds)
    record = np.searchsorted(trajectory.times, trajectory.profile.row_times).clip(0, len(number) - 1)
    on_line = number[record] == worst
    times = np.bincount(trajectory.binding[on_line], spans[on_line], len(trajectory.names))
    limit = trajectory.names[int(times.argmax())]
    text = (
        f"the path takes {_format(seconds.sum(), 3)} s, its feeds ask for {_format(feed_seconds.sum(), 3)} s; "
        f"most is lost here, {_format(times_by_line[worst], 2)} s for {_format(feed_times_by_line[worst], 2)} s, "
        f"bound by {limit}"
    )
    return Note(int(lines[worst]), text)


def _format(seconds: float, digits: int) -> str:
    """Format with so many digits, without an exponent where there are more before the point."""
    return f"{seconds:.{digits}g}" if seconds < 10.0**digits - 0.5 else f"{seconds:,.0f}"


def _measure_feed_times(trajectory: Trajectory) -> Array:
    """Measure what the motions to the records (n,) would take by their feeds or programmed times, s.

    Rapid motions ask for what they take.
    """
    path = trajectory.posted.path
    seconds = np.diff(trajectory.times, prepend=0.0)
    tip = path.tip if path.extension is None else path.tip - path.extension[:, None] * path.axis
    length = np.linalg.norm(np.diff(tip, axis=0, prepend=tip[:1]), axis=1)
    feed_seconds = np.where(np.isnan(path.feed), seconds, length / path.feed * 60.0)
    if path.seconds is not None:
        feed_seconds = np.where(np.isnan(path.seconds), feed_seconds, path.seconds)
    feed_seconds[path.rapid] = seconds[path.rapid]
    return np.minimum(feed_seconds, seconds)
