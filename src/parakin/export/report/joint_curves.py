"""Curves over a path: few points that hide no extreme, and the figure of all joints."""

from __future__ import annotations

from html import escape
from math import ceil, degrees, isfinite
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Array, Indices
from ...toolpath.posting.range_use import RangeUse
from ..number_format import format_bound
from .figures import Figure, PlotTrace, round_numbers
from .panels import Panel, stack_panels

if TYPE_CHECKING:
    from ...toolpath.posting.posted import Posted

POINTS = 4000  # a curve
_ALL_POINTS = 36_000  # greatest number of points of all curves together, for machines with many joints


def pick_extremes(values: Array, most: int) -> Indices:
    """Pick at most ``most`` + 2 values: in every stretch the least, the greatest and the first NaN.

    Returns ascending indices. Of a curve with no more values all are kept; the first and the last always are.
    """
    n = len(values)
    if n <= most:
        return np.arange(n)
    return pick_extremes_within(values, np.arange(0, n, ceil(n / max(1, most // 3))))


def pick_extremes_within(values: Array, starts: Indices) -> Indices:
    """Pick as :func:`pick_extremes`, in stretches that begin at ``starts``, ascending from 0."""
    stretch = np.repeat(np.arange(len(starts)), np.diff(starts, append=len(values)))
    kept = [np.array([0, len(values) - 1])]
    least, most = np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)
    for chosen in (values == least[stretch], values == most[stretch], np.isnan(values)):
        at = np.flatnonzero(chosen)
        kept.append(at[np.diff(stretch[at], prepend=-1) > 0])  # the first in its stretch
    return np.unique(np.concatenate(kept))


def build_joint_curves(posted: Posted, uses: list[RangeUse]) -> tuple[Figure, int]:
    """Build one curve for each joint over the records; return the figure and its height in px."""
    most = min(POINTS, _ALL_POINTS // len(uses))
    rows = []
    for use, values in zip(uses, posted.joints.T, strict=True):
        traces = _build_curve(posted, use, values, degrees(1.0) if use.unit == "rad" else 1.0, most)
        rows.append([build_panel(use, _format_use_heading(use), traces)])
    return stack_panels(rows, "record, counted from 0")


def build_panel(use: RangeUse, heading: str, traces: list[PlotTrace], ticks: str = ",") -> Panel:
    """Build a panel of a bounded quantity, in mm or degrees, which shows the range used and the limits near it."""
    scale = degrees(1.0) if use.unit == "rad" else 1.0
    return Panel(heading, traces, _choose_axis_range(use, scale), [b * scale for b in (use.low, use.high)], ticks)


def _build_curve(posted: Posted, use: RangeUse, values: Array, scale: float, most: int) -> list[PlotTrace]:
    """Build the curve, and over it in red the parts beyond a limit."""
    kept = pick_extremes(values, most)
    y, lines = values[kept], posted.path.line[kept].tolist()
    unit = "°" if use.unit == "rad" else f" {use.unit}"
    digits = 4 if use.unit == "rad" else 3
    base: PlotTrace = {
        "type": "scatter",
        "x": kept.tolist(),
        "customdata": lines,
        "name": escape(use.name),
    }
    base["hovertemplate"] = (
        f"line %{{customdata}}, record %{{x:,}}<br>%{{y:,.3f}}{unit}<extra>%{{fullData.name}}</extra>"
    )
    few = len(kept) < 60
    traces = [base | {"y": round_numbers(y * scale, digits), "mode": "lines+markers" if few else "lines",
                      "line": {"color": "#2f6fb3", "width": 1.4}, "marker": {"size": 4}}]  # fmt: skip
    beyond = (y < use.low) | (y > use.high)
    if beyond.any():
        red = round_numbers(np.where(beyond, y, np.nan) * scale, digits)
        traces.append(base | {"y": red, "mode": "lines+markers", "line": {"color": "#c62828", "width": 2},
                              "marker": {"size": 3.5, "color": "#c62828"}})  # fmt: skip
    return traces


def _choose_axis_range(use: RangeUse, scale: float) -> list[float]:
    """Choose the axis' ends: the range used, and the limits no farther from it than its own width."""
    if not isfinite(use.least):
        low, high = (use.low, use.high) if isfinite(use.low) and isfinite(use.high) else (-1.0, 1.0)
    else:
        low, high = use.least, use.most
        wide = max(high - low, 0.04 * use.span if isfinite(use.low) or isfinite(use.high) else 0.0, 1e-3)
        low, high = (low + high - wide) / 2.0, (low + high + wide) / 2.0
        low, high = (
            (use.low if low - wide < use.low < low else low),
            (use.high if high < use.high < high + wide else high),
        )
    pad = 0.08 * (high - low)
    return [(low - pad) * scale, (high + pad) * scale]


def _format_use_heading(use: RangeUse) -> str:
    limits = "no limits"
    if isfinite(use.low) or isfinite(use.high):
        low, high = (format_bound(v, use.unit) if isfinite(v) else "–" for v in (use.low, use.high))
        limits = f"limits {low} to {high}"
    return format_heading(use.name, "°" if use.unit == "rad" else use.unit, limits)


def format_heading(name: str, unit: str, limits: str) -> str:
    """Format a panel's heading, in HTML."""
    return f"<b>{escape(name)}</b>  <span style='color:var(--soft)'>[{unit}]  {limits}</span>"
