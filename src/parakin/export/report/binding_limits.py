"""Which limit sets the pace of a trajectory: for how long, when, and where on the path."""

from __future__ import annotations

from html import escape
from itertools import chain, repeat
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Indices
from ..machine.figures import Figure, PlotTrace, build_scene_layout, round_numbers
from ..number_format import format_duration
from .path_view import PathView, build_stroke, choose_points, find_tips

if TYPE_CHECKING:
    from ...toolpath.timing import Trajectory

_POINTS = 12_000  # points drawn on the path
_BINS = 300  # equal spans of the cycle
_FEED, _REST = "#9fb3c0", "#546e7a"
_COLOURS = (
    "#d32f2f", "#f57c00", "#7b1fa2", "#00838f", "#c2185b", "#558b2f", "#5d4037", "#fbc02d",
    "#303f9f", "#00695c", "#e64a19", "#9e9d24", "#512da8", "#0277bd",
)  # fmt: skip


def choose_colours(trajectory: Trajectory) -> dict[str, str]:
    """Choose a colour for each limit that binds anywhere, in the order of their fractions."""
    free = chain(_COLOURS, repeat(_REST))
    return {name: _FEED if name == "feed" else next(free) for name in trajectory.binding_fractions}


def render_binding_bars(trajectory: Trajectory, shades: dict[str, str]) -> str:
    """Render how long each limit sets the pace, as HTML bars."""
    return "".join(
        f"<div class='bar pace'><div><b>{_allow_breaks(name)}</b></div><div class=scale>"
        f"<i style='left:0;width:{100.0 * fraction:.2f}%;background:{shades[name]}'></i></div>"
        f"<div class=slack>{format_percent(fraction)} <small>{_format_brief(fraction * trajectory.seconds)}</small>"
        "</div></div>\n"
        for name, fraction in trajectory.binding_fractions.items()
    )


def format_percent(fraction: float) -> str:
    return "below 0.1 %" if fraction < 0.001 else f"{100.0 * fraction:.1f} %"


def _format_brief(seconds: float) -> str:
    return format_duration(seconds) if seconds >= 1.0 else f"{seconds:.2g} s"


def _allow_breaks(name: str) -> str:
    return escape(name).replace(".", ".<wbr>")


def build_binding_traces(trajectory: Trajectory, shades: dict[str, str]) -> list[PlotTrace]:
    """Build for each limit the fraction of short spans of the cycle in which it binds; they sum to 1."""
    ends = np.linspace(0.0, trajectory.seconds, _BINS + 1)
    bounds = np.concatenate([[0.0], trajectory.switches, [trajectory.seconds]])
    spans = np.diff(bounds)
    traces = []
    for name, shade in shades.items():
        so_far = np.append(0.0, np.cumsum(np.where(trajectory.binding == trajectory.names.index(name), spans, 0.0)))
        fraction = np.diff(np.interp(ends, bounds, so_far)) * (_BINS / trajectory.seconds)
        bins = np.flatnonzero(fraction > 1e-6)
        trace: PlotTrace = {"type": "bar", "name": escape(name), "marker": {"color": shade, "line": {"width": 0}}}
        trace |= {"x": round_numbers(0.5 * (ends[bins] + ends[bins + 1]), 6), "y": round_numbers(fraction[bins], 4)}
        trace |= {
            "width": trajectory.seconds / _BINS,
            "hovertemplate": "%{x:,.3f} s<br>%{y:.1%} %{fullData.name}<extra></extra>",
        }
        traces.append(trace)
    return traces


def build_bound_path(trajectory: Trajectory, view: PathView, shades: dict[str, str]) -> Figure:
    """Build the tool tip's path, coloured by the limit that sets the pace; rapid motions are thin."""
    posted, joint_path = trajectory.posted, trajectory.joint_path
    rows = len(joint_path.segment)
    tips = find_tips(posted.machine, joint_path.poses(np.arange(rows), np.zeros(rows)))
    tips = tips @ view.place[:, :3].T + view.place[:, 3]
    before = np.maximum(np.arange(rows) - 1, 0)
    record = trajectory.curve.record_of_piece[joint_path.segment[before]]  # that the step to a row leads to
    rapid = posted.path.rapid[record]
    limited = (trajectory.binding != 0).astype(float)  # so that thinning drops no stretch where a drive binds
    turns = np.flatnonzero((np.diff(trajectory.binding) != 0) | (np.diff(rapid) != 0))
    kept = choose_points((*tips.T, limited), turns, _POINTS)
    traces: list[PlotTrace] = []
    for name, shade in shades.items():
        here = trajectory.binding[kept[1:]] == trajectory.names.index(name)
        for fast in (False, True):
            wanted = here & (rapid[kept[1:]] == fast)
            if not wanted.any():
                continue
            line: Figure = {"color": shade, "width": 2 if fast else 5}
            trace, at = build_stroke(tips, kept, wanted, line, escape(name))
            trace |= {
                "legendgroup": name,
                "showlegend": not any(t["legendgroup"] == name for t in traces),
            }
            trace["customdata"] = _describe_points(trajectory, at, record)
            trace["hovertemplate"] = (
                "%{customdata[0]:,.3f} s, record %{customdata[1]:,}, line %{customdata[2]}"
                f"<br>%{{x:,.2f}}, %{{y:,.2f}}, %{{z:,.2f}}<extra>{escape(name)}</extra>"
            )
            traces.append(trace)
    points = tips[kept]
    layout = build_scene_layout([np.array([points.min(0), points.max(0)])], view.normal)
    layout["legend"] |= {"font": {"size": 11}}
    return {"data": traces, "layout": layout}


def _describe_points(trajectory: Trajectory, rows: Indices, record: Indices) -> list[list[float | int | None]]:
    """Describe points by time (s), record and source line, for the mouse."""
    times, records = round_numbers(trajectory.profile.row_times[rows], 3), record[rows]
    lines = trajectory.posted.path.line[records]
    return [[*point] for point in zip(times, records.tolist(), lines.tolist(), strict=True)]
