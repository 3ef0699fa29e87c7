"""A tool path in space: on its machine within a sample of the workspace, and close up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.wrist.pose_angles import point_direction, solve_direction
from ...machine import Machine
from ...toolpath.posting.range_use import compute_relative_margin
from ..machine.figures import (
    Figure,
    PlotTrace,
    build_machine_traces,
    build_scene_layout,
    round_numbers,
    split_coordinates,
)
from ..machine.scene import Points, Scene, build_scene
from .joint_curves import pick_extremes

if TYPE_CHECKING:
    from ...toolpath.posting.posted import Posted

_CLOSE, _FAR, _MARKED = 20_000, 4_000, 3_000  # points of the path close up, on its machine, and off limits
_CELLS = 27  # cells of the workspace's sample along each side
_SCALE = [[0.0, "#c62828"], [0.12, "#ef8a3c"], [0.35, "#e8c547"], [0.65, "#4aa58c"], [1.0, "#1f5f99"]]


@dataclass(frozen=True, eq=False)
class PathView:
    """A path in space.

    machine, path : the machine with it, and the path close up
    record : at which the machine stands
    place : (3, 4) the frame in which poses are drawn there
    normal : of the plane of a planar machine, else None
    """

    machine: Figure
    path: Figure
    record: int
    place: Points
    normal: Points | None


def build_path_view(posted: Posted, relative: Array) -> PathView:
    """Build the figures of a path; ``relative`` (n,) is the least relative margin of every record."""
    record = _choose_record(posted, relative)
    machine = posted.machine
    home = build_scene(machine)
    joints = posted.joints[record]
    if np.isfinite(joints).all():
        drawn = build_scene(machine, posted.poses[record], joints, posted.mode)
        where = f"line {int(posted.path.line[record])}"
    else:  # no record is within reach
        drawn, where = home, "home"
    place = drawn.workpiece
    tips = find_tips(machine, posted.poses) @ place[:, :3].T + place[:, 3]
    kept = _choose_path_points(posted, tips, relative, _FAR)
    size = home.size
    far = build_machine_traces(drawn, f"machine at {where}", size)
    if drawn is not home:
        far += build_machine_traces(home, "machine at home", size, "#78909c")
    cloud, reach = _sample_workspace(posted, place, tips, size)
    far += cloud
    far += [_build_motions(posted, tips, kept, False, {"color": "#00695c", "width": 3}, "tool path")[0]]
    far += _mark_offences(posted, tips)
    boxes = [drawn.box, home.box, np.array([tips[kept].min(0), tips[kept].max(0)]), *reach]
    machine_figure = {"data": far, "layout": build_scene_layout(boxes, drawn.normal)}
    return PathView(machine_figure, _build_close_up(posted, relative, tips, drawn), record, place, drawn.normal)


def find_tips(machine: Machine, poses: Array) -> Points:
    """Find the tool tips (n, 3) of poses; coordinates that a machine does not have are 0."""
    missing = np.zeros(len(poses))
    return np.column_stack([poses[:, machine.axes.index(c)] if c in machine.axes else missing for c in "XYZ"])


def _choose_record(posted: Posted, relative: Array) -> int:
    """Choose the record to draw: the worst or the first off limits, if the legs can reach it, else the tightest."""
    for offence in (posted.worst, posted.first):
        if offence is not None and np.isfinite(posted.joints[offence.record]).all():
            return offence.record
    real = np.where(np.isnan(relative), np.inf, relative)
    return int(real.argmin())


def _build_close_up(posted: Posted, relative: Array, tips: Points, drawn: Scene) -> Figure:
    kept = _choose_path_points(posted, tips, relative, _CLOSE)
    top = float(np.ceil(20.0 * max(0.05, np.nanmax(relative[kept], initial=0.05))) / 20.0)
    bar = {"title": {"text": "least margin", "font": {"size": 12}}, "thickness": 12, "len": 0.6, "x": 1.0}
    bar |= {"tickformat": ".0%", "tickfont": {"size": 11}}
    line = {"width": 4, "colorscale": _SCALE, "cmin": 0.0, "cmax": top, "showscale": True, "colorbar": bar}
    cut, at = _build_motions(posted, tips, kept, False, line, "feed")
    cut["showlegend"] = False  # the colour bar stands for it
    cut["line"]["color"] = round_numbers(np.nan_to_num(relative[at], nan=0.0), 3)
    rapid, _ = _build_motions(posted, tips, kept, True, {"color": "#90a4ae", "width": 2, "dash": "dash"}, "rapid")
    traces = [trace for trace in (cut, rapid, *_mark_offences(posted, tips)) if trace["x"]]
    points = tips[kept]
    return {"data": traces, "layout": build_scene_layout([np.array([points.min(0), points.max(0)])], drawn.normal)}


def _choose_path_points(posted: Posted, tips: Points, relative: Array, most: int) -> Indices:
    return choose_points((*tips.T, relative), np.flatnonzero(np.diff(posted.path.rapid)), most)


def choose_points(values: Sequence[Array], turns: Indices, most: int) -> Indices:
    """Choose points of a path to draw: every value's extremes, and those around ``turns`` unless too many."""
    if len(values[0]) <= most:
        return np.arange(len(values[0]))
    picks = [pick_extremes(column, most // len(values)) for column in values]
    if 2 * len(turns) <= most:
        picks += [turns, turns + 1]
    return np.unique(np.concatenate(picks))


def _build_motions(
    posted: Posted, tips: Points, kept: Indices, rapid: bool, line: Figure, name: str
) -> tuple[PlotTrace, Indices]:
    """Build the motions in feed or in rapid; return also the record of each point. A motion ends at its record."""
    trace, at = build_stroke(tips, kept, posted.path.rapid[kept[1:]] == rapid, line, name)
    trace["customdata"] = posted.path.line[at].tolist()
    trace["hovertemplate"] = "line %{customdata}<br>%{x:,.2f}, %{y:,.2f}, %{z:,.2f}<extra>%{fullData.name}</extra>"
    return trace, at


def build_stroke(points: Points, kept: Indices, wanted: Flags, line: Figure, name: str) -> tuple[PlotTrace, Indices]:
    """Build the ``wanted`` (k - 1,) of the motions between kept points (k,) as one line with gaps.

    Returns the line, and the index of each of its points.
    """
    begins = wanted & ~np.concatenate([[False], wanted[:-1]])
    ends = np.arange(1, len(kept))
    # For each motion its end, and where a run begins first a gap and the run's first point.
    triples = np.column_stack([np.full(len(ends), -1), ends - 1, ends])
    order = triples[np.column_stack([begins, begins, wanted])]
    at = kept[np.maximum(order, 0)]
    drawn = np.where(order[:, None] < 0, np.nan, points[at])
    trace: PlotTrace = {"type": "scatter3d", "mode": "lines", "name": name, "line": dict(line)}
    return trace | split_coordinates(drawn, 2), at


def _mark_offences(posted: Posted, tips: Points) -> list[PlotTrace]:
    """Mark places off limits; a sample of them if there are many, with the first and every limit's worst."""
    off = np.flatnonzero(posted.broken)
    shown = [offence for offence in (*posted.offences, posted.first) if offence is not None]
    if not shown:
        return []
    records = [offence.record for offence in shown if offence.share == 1.0]
    at = np.unique(np.concatenate([off[:: max(1, len(off) // _MARKED)], records]).astype(np.int64))
    limits = [posted.limits[i - 1] if i else "" for i in posted.broken[at].tolist()]
    text = [f"line {line}: {escape(name)}" for line, name in zip(posted.path.line[at].tolist(), limits, strict=True)]
    points = tips[at]
    between = [offence for offence in shown if offence.share < 1.0]
    if between:
        to, share = np.array([o.record for o in between]), np.array([o.share for o in between])[:, None]
        points = np.vstack([points, (1.0 - share) * tips[to - 1] + share * tips[to]])
        text += [f"line {o.line}, on the way: {escape(o.limit)}" for o in between]
    trace: PlotTrace = {"type": "scatter3d", "mode": "markers", "name": "off limits", "hovertext": text}
    trace |= {"hoverinfo": "text", "marker": {"size": 3, "color": "#d50000"}}
    return [trace | split_coordinates(points, 2), *_mark_broken_motions(posted, tips)]


def _mark_broken_motions(posted: Posted, tips: Points) -> list[PlotTrace]:
    """Mark motions that break a limit which both their records keep; a sample of them if there are many."""
    if posted.broken_motions is None or not posted.broken_motion_count:
        return []
    to = np.flatnonzero(posted.broken_motions)
    to = to[:: max(1, len(to) // _MARKED)]
    kept = np.unique(np.concatenate([to - 1, to]))
    wanted = np.isin(kept[1:], to) & (np.diff(kept) == 1)
    trace, at = build_stroke(tips, kept, wanted, {"color": "#d50000", "width": 5}, "motions off limits")
    trace["hovertext"] = [f"to line {line}" for line in posted.path.line[at].tolist()]
    return [trace | {"hoverinfo": "text"}]


# The workspace around the path.


def _sample_workspace(posted: Posted, place: Points, tips: Points, size: float) -> tuple[list[PlotTrace], list[Points]]:
    """Sample the workspace on a coarse grid of tips at the path's mean orientation.

    Returns a translucent surface where the least margin is 0, and its box (2, 3); nothing where no tip is allowed.
    """
    machine = posted.machine
    pose = _average_pose(machine, posted.poses)
    middle = place[:, :3] @ find_tips(machine, pose[None])[0] + place[:, 3]
    used = [i for i, letter in enumerate("XYZ") if letter in machine.axes]
    low, high = middle - 0.8 * size, middle + 0.8 * size
    for _ in range(2):  # find the workspace, then sample it closer
        sides = [np.linspace(low[i], high[i], _CELLS if len(used) == 3 else 4 * _CELLS) for i in used]
        points = np.tile(middle, (len(sides[0]) ** len(used), 1))
        points[:, used] = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(used))
        poses = np.tile(pose, (len(points), 1))
        tip = (points - place[:, 3]) @ place[:, :3]  # the grid stands in M, poses are the workpiece's
        for i in used:
            poses[:, machine.axes.index("XYZ"[i])] = tip[:, i]
        value = compute_relative_margin(machine, machine.margins(poses, mode=posted.mode))
        inside = value >= 0.0
        if not inside.any():
            return [], []
        step = (high - low) / (len(sides[0]) - 1)
        low, high = points[inside].min(axis=0) - step, points[inside].max(axis=0) + step
    value = np.clip(np.where(np.isnan(value), -0.1, value), -0.1, 0.1)
    reach = np.array([points[inside].min(0), points[inside].max(0)])
    name = "workspace (coarse sample)"
    base: PlotTrace = {"name": name, "showlegend": True, "showscale": False, "hoverinfo": "skip", "opacity": 0.16}
    base["colorscale"] = [[0, "#26a69a"], [1, "#26a69a"]]
    if len(used) == 2:
        points = np.where(inside[:, None], points, np.nan)
        x, y, z = (_split_rows(column, len(sides[1])) for column in points.T)
        return [base | {"type": "surface", "x": x, "y": y, "z": z}], [reach]
    surface: PlotTrace = {"type": "isosurface", **split_coordinates(points, 1)}
    surface |= {"value": round_numbers(value, 4), "isomin": 0.0, "isomax": 0.0, "surface": {"count": 1}}
    return [base | surface | {"caps": {c: {"show": False} for c in "xyz"}, "flatshading": False}], [reach]


def _split_rows(column: Array, width: int) -> list[list[float | None]]:
    flat = round_numbers(column, 1)
    return [flat[i : i + width] for i in range(0, len(flat), width)]


def _average_pose(machine: Machine, poses: Array) -> Array:
    """Average poses: the middle of the tips, with the mean tool axis (mean angles, where the pose has them all)."""
    real = poses[np.isfinite(poses).all(axis=1)]
    if not len(real):
        return np.array(machine.home)
    pose = np.array(real.mean(axis=0))
    for letter in "XYZ":
        if letter in machine.axes:
            column = real[:, machine.axes.index(letter)]
            pose[machine.axes.index(letter)] = 0.5 * (column.min() + column.max())
    if machine.direction is not None:
        b, c = real[:, machine.direction.pair].T
        k = point_direction(b, c).mean(axis=0)
        pose[machine.direction.pair] = np.concatenate(solve_direction(k[None])[:2])
    return pose
