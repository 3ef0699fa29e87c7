"""A posted path as data of a page: samples over time, or by records where it has no times, and its offences."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Array, Indices
from ...toolpath.posting.frames import compose_frames, find_frame_angles, invert_frame
from ...toolpath.posting.offence_texts import describe_place
from ...toolpath.posting.range_use import compute_relative_margin, measure_range_use
from ..colours import choose_binding_colours
from .machine_data import encode_mode
from .packed_arrays import pack_array

if TYPE_CHECKING:
    from ...toolpath.posting.posted import Offence, Posted
    from ...toolpath.timing import Trajectory

_MOST_OFFENCES = 200
_SPAN = 2e-4  # s
_GAPS = 1e-3  # s or records: samples no farther apart show nothing more


def encode_page_path(posted: Posted, trajectory: Trajectory | None, numbers: int) -> dict[str, Any]:
    """Encode a path of one record or more: columns of float32 in base64, mm, rad, s and mm/min.

    With a trajectory they are samples at even times and at the corners as far as there is room, of what the machine
    does; else the records themselves, with their number in place of the time. All samples together have ``numbers``
    numbers at most, and each tells the least margin, and whether a limit is broken, since the one before.
    """
    if trajectory is not None and trajectory.seconds <= 0.0:
        trajectory = None  # it stands still
    most = max(2, numbers // (len(posted.machine.axes) + len(posted.machine.joints) + 7))
    if trajectory is None:
        columns = _sample_records(posted, most)
        passed = columns["records"]
    else:
        columns = _sample_trajectory(posted, trajectory, most)
        passed = columns["records"] - 1.0
    _gather_records(posted, columns, passed)
    offences = posted.offences[:_MOST_OFFENCES]
    colours = {} if trajectory is None else choose_binding_colours(trajectory)
    names = () if trajectory is None else trajectory.names
    return {
        "source": Path(posted.path.source).name or posted.path.source,
        "timed": trajectory is not None,
        "end": float(np.float32(columns["times"][-1])),  # as the column has it, whose last sample is reached then
        "signs": encode_mode(posted.mode),
        "samples": len(columns["times"]),
        "columns": {name: pack_array(values, "<f4") for name, values in columns.items()},
        "bindings": [{"name": name, "colour": colours.get(name)} for name in names],
        "offences": [
            _encode_offence(posted, offence, int(np.abs(columns["times"] - at).argmin()))
            for offence, at in zip(offences, _locate_offences(trajectory, offences), strict=True)
        ],
        "records": len(posted.path),
        "workpiece": _find_workpiece(posted),
    }


def _find_workpiece(posted: Posted) -> list[float]:
    """Find X, Y, Z, mm, and A, B, C, rad, of the workpiece that a path was posted on, without the path's own frame."""
    own = posted.path.frame
    placed = posted.frame if own is None else compose_frames(posted.frame, invert_frame(own))
    return [*placed[:, 3].tolist(), *find_frame_angles(placed)]


def _locate_offences(trajectory: Trajectory | None, offences: Sequence[Offence]) -> list[float]:
    """Locate offences in the samples' times: s, or records and shares of the motions to them."""
    motions = [(max(offence.record - 1, 0), offence.record, offence.share) for offence in offences]
    if trajectory is None:
        return [before + share * (to - before) for before, to, share in motions]
    times = trajectory.times
    return [float(times[before] + share * (times[to] - times[before])) for before, to, share in motions]


def _encode_offence(posted: Posted, offence: Offence, sample: int) -> dict[str, Any]:
    place = describe_place(posted, offence, Path(posted.path.source).name)
    return {"text": f"{place}: {offence.text}", "limit": offence.limit, "sample": sample}


def _gather_records(posted: Posted, columns: dict[str, Array], passed: Array) -> None:
    """Gather in each sample what is between it and the one before, whose last records are ``passed``."""
    records, last = np.arange(len(posted.path)), len(passed) - 1
    behind = np.minimum(np.searchsorted(passed, records), last)
    with np.errstate(invalid="ignore"):  # NaN where no record is within reach
        np.minimum.at(columns["margins"], behind, measure_range_use(posted)[1])
    broken = posted.broken != 0
    if posted.broken_motions is not None:
        broken = broken | posted.broken_motions
    to = columns["records"]
    columns["broken"] = broken[to.astype(np.int64)].astype(np.float64)
    np.maximum.at(columns["broken"], np.minimum(np.searchsorted(to, records), last), broken.astype(np.float64))


def _choose_corners(posted: Posted, most: int) -> Indices:
    """Choose the records, ``most`` of them, where the tip is farthest off the line between its neighbours."""
    places = [i for i, axis in enumerate(posted.machine.axes) if axis in "XYZ"]
    tips = posted.poses[:, places]
    if len(tips) <= most:
        return np.arange(len(tips))
    back, ahead = tips[1:-1] - tips[:-2], tips[2:] - tips[1:-1]
    across, lengths = ahead - back, np.linalg.norm(ahead, axis=1) + np.linalg.norm(back, axis=1)
    off = np.linalg.norm(across, axis=1) * lengths
    return np.sort(np.argsort(-np.nan_to_num(off), kind="stable")[:most]) + 1


def _sample_records(posted: Posted, most: int) -> dict[str, Array]:
    count = len(posted.path)
    worst = [offence.record for offence in posted.offences]
    chosen = np.unique([*_choose_corners(posted, most), *worst[:_MOST_OFFENCES], count - 1])
    columns = _list_columns(posted, posted.poses[chosen], posted.joints[chosen])
    nothing = np.full(len(chosen), np.nan)
    return {
        "times": chosen.astype(np.float64),
        **columns,
        "feed": np.where(posted.path.rapid, np.nan, posted.path.feed)[chosen],
        "binding": nothing,
        "rapid": posted.path.rapid[chosen].astype(np.float64),
        "lines": posted.path.line[chosen].astype(np.float64),
        "records": chosen.astype(np.float64),
    }


def _sample_trajectory(posted: Posted, trajectory: Trajectory, most: int) -> dict[str, Array]:
    end = trajectory.seconds
    at_records = trajectory.times[_choose_corners(posted, most // 2)]
    times = np.unique(np.concatenate([np.linspace(0.0, end, most // 2), at_records]))
    times = times[np.append(True, np.diff(times) > _GAPS)] if end > 1.0 else times
    points, rows = trajectory.at(times), trajectory.profile.at(times)[0]
    to = trajectory.curve.record_of_piece[trajectory.joint_path.segment[rows]]
    return {
        "times": times,
        **_list_columns(posted, points.poses, points.joints),
        "feed": _measure_feed(trajectory, times),
        "binding": trajectory.find_binding(times).astype(np.float64),
        "rapid": posted.path.rapid[to].astype(np.float64),
        "lines": posted.path.line[to].astype(np.float64),
        "records": to.astype(np.float64),
    }


def _measure_feed(trajectory: Trajectory, times: Array) -> Array:
    """Measure the tip's speed, mm/min, over a short span about each time."""
    places = [i for i, axis in enumerate(trajectory.posted.machine.axes) if axis in "XYZ"]
    begin, end = np.maximum(times - _SPAN, 0.0), np.minimum(times + _SPAN, trajectory.seconds)
    way = (trajectory.at(end).poses - trajectory.at(begin).poses)[:, places]
    feed: Array = 60.0 * np.linalg.norm(way, axis=1) / np.maximum(end - begin, _SPAN)
    return feed


def _list_columns(posted: Posted, poses: Array, joints: Array) -> dict[str, Array]:
    """List poses and joints, and the least margin of all limits, over half of each one's range."""
    margins = posted.machine.margins(poses, joints, posted.mode)
    return {
        "poses": poses.ravel(),
        "joints": joints.ravel(),
        "margins": compute_relative_margin(posted.machine, margins),
    }
