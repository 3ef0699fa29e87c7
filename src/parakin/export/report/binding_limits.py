"""Which limit sets the pace of a trajectory: for how long, and when."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ..number_format import format_duration
from .figures import PlotTrace, round_numbers

if TYPE_CHECKING:
    from ...toolpath.timing import Trajectory

_BINS = 300  # equal spans of the cycle


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
