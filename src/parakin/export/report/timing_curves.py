"""A trajectory as curves: the feed, what sets the pace, and each joint's motion, all over the cycle."""

from __future__ import annotations

from html import escape
from math import degrees, floor, inf, isfinite, log10
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Flags
from ...toolpath.posting.range_use import RangeUse
from ..number_format import format_bound
from .binding_limits import build_binding_traces
from .figures import Figure, PlotTrace, round_numbers
from .joint_curves import build_panel, format_heading
from .panels import Panel, stack_panels
from .timing_samples import ThinnedCurve, thin_curves

if TYPE_CHECKING:
    from ...machine import Machine
    from ...toolpath.timing import Trajectory

_MOST, _ALL = 3000, 27_000  # points of a curve, and of all together
_BLUE, _GREY = "#2f6fb3", "#a9b8c2"
_KINDS = {  # of limits: what their unit is per, their colour, and how the axis writes numbers
    "speed": ("/s", "#f57c00", ","),
    "acceleration": ("/s²", "#d32f2f", "~s"),
    "jerk": ("/s³", "#7b1fa2", "~s"),
}
_ROOM = 1.15  # the feed's axis shows the greatest programmed feed times this


def draw_timing_curves(trajectory: Trajectory, shades: dict[str, str]) -> tuple[Figure, int]:
    """Draw the curves over the cycle, ``shades`` being the limits' colours; return the figure and its height in px."""
    machine = trajectory.posted.machine
    kinds = [kind for kind in _KINDS if kind != "jerk" or any(d.jerk < inf for d in machine.drives)]
    curves = thin_curves(trajectory, min(_MOST, _ALL // (len(machine.joints) * (1 + len(kinds)) + 2)))
    heading = format_heading("what sets the pace", "share of the time", "")
    binds = Panel(heading, build_binding_traces(trajectory, shades), [0.0, 1.0], ticks=".0%")
    rows = [[_build_feed_panel(trajectory, curves)], [binds]]
    for number in range(len(machine.joints)):
        rates = [_build_rate_panel(trajectory, curves, number, kind) for kind in kinds]
        rows.append([_build_position_panel(trajectory, curves, number), *rates])
    figure, height = stack_panels(rows, "time [s]")
    figure["layout"] |= {"barmode": "stack", "bargap": 0}
    figure["layout"]["xaxis"]["range"] = [0.0, trajectory.seconds]
    return figure, height


def _build_line(
    trajectory: Trajectory,
    curve: ThinnedCurve,
    shown: Flags | None,
    look: Figure,
    name: str,
    unit: str,
    scale: float = 1.0,
) -> PlotTrace:
    """Build a curve; with ``shown`` only the parts behind these points, drawn over it without hover texts."""
    at = np.arange(len(curve.times))
    if shown is not None:
        drawn = shown | np.concatenate([[False], shown[:-1]])
        # The first point that is not drawn becomes the gap behind those that are.
        at = at[drawn | np.concatenate([[False], drawn[:-1]])]
    values = curve.values[at] * scale
    if shown is not None:
        values = np.where(drawn[at], values, np.nan)
    peak = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    digits = 3 if peak <= 0.0 else min(9, max(0, 5 - floor(log10(peak))))
    trace: PlotTrace = {"type": "scatter", "mode": "lines", "name": name, "line": look}
    trace |= {
        "x": round_numbers(curve.times[at], max(3, 6 - floor(log10(trajectory.seconds)))),
        "y": round_numbers(values, digits),
    }
    if shown is not None:
        return trace | {"hoverinfo": "skip"}
    record = curve.record[at]
    trace["customdata"] = np.column_stack([record, trajectory.posted.path.line[record]]).tolist()
    place = "%{x:,.3f} s, record %{customdata[0]:,}, line %{customdata[1]}"
    return trace | {"hovertemplate": f"{place}<br>%{{y:,.3f}} {unit}<extra>{name}</extra>"}


def _build_feed_panel(trajectory: Trajectory, curves: dict[str, ThinnedCurve]) -> Panel:
    reached, programmed, fastest = (curves[f"feed.{name}"] for name in ("reached", "programmed", "any"))
    fed = reached.binding == trajectory.names.index("feed")
    unit, dotted = "mm/min", {"color": "#455a64", "width": 1.2, "dash": "dot", "shape": "hv"}
    traces = [
        _build_line(trajectory, programmed, None, dotted, "programmed feed", unit),
        _build_line(trajectory, fastest, None, {"color": _GREY, "width": 1}, "feed reached", unit),
        _build_line(trajectory, reached, fed, {"color": _BLUE, "width": 1.6}, "set by the feed", unit),
        _build_line(trajectory, reached, ~fed, {"color": "#f57c00", "width": 1.6}, "held back", unit),
    ]
    feeds = programmed.values[np.isfinite(programmed.values)]
    top = _ROOM * float(feeds.max() if len(feeds) else fastest.values.max())
    key = (
        f"[{unit}]  <span style='color:{_BLUE}'>set by the feed</span>,"
        " <span style='color:#b84400'>held back by a drive</span>, in rapid grey; programmed dotted"
    )
    return Panel(f"<b>feed</b>  <span style='color:var(--soft)'>{key}</span>", traces, [0.0, top])


def _build_position_panel(trajectory: Trajectory, curves: dict[str, ThinnedCurve], number: int) -> Panel:
    drive, curve = trajectory.posted.machine.drives[number], curves[trajectory.posted.machine.joints[number]]
    use = RangeUse(drive.name, drive.name, drive.unit, drive.low, drive.high, *_find_ends(curve))
    unit, scale = _find_display_scale(trajectory.posted.machine, number)
    trace = _build_line(trajectory, curve, None, {"color": _BLUE, "width": 1.3}, escape(drive.name), unit, scale)
    return build_panel(use, format_heading(drive.name, unit, ""), [trace])


def _build_rate_panel(trajectory: Trajectory, curves: dict[str, ThinnedCurve], number: int, kind: str) -> Panel:
    """Build the panel of a joint's speed, acceleration or jerk, coloured where its limit sets the pace."""
    drive = trajectory.posted.machine.drives[number]
    bound, (per, colour, ticks) = getattr(drive, kind), _KINDS[kind]
    unit, scale = _find_display_scale(trajectory.posted.machine, number)
    text = f"limit {format_bound(bound, drive.unit)}" if isfinite(bound) else "no limit"
    title = format_heading(f"{drive.name} {kind}", unit + per, text)
    name = f"{drive.name}.{kind}"
    if name not in curves:  # a jerk without a limit beside others with one
        return Panel(title, [], [-1.0, 1.0])
    curve, label = curves[name], escape(f"{drive.name} {kind}")
    traces = [_build_line(trajectory, curve, None, {"color": _BLUE, "width": 1.1}, label, unit + per, scale)]
    bound_here = curve.binding == trajectory.names.index(name)
    if bound_here.any():
        look = {"color": colour, "width": 1.8}
        traces.append(_build_line(trajectory, curve, bound_here, look, label, unit + per, scale))
    return build_panel(RangeUse(name, name, drive.unit, -bound, bound, *_find_ends(curve)), title, traces, ticks)


def _find_ends(curve: ThinnedCurve) -> tuple[float, float]:
    return float(curve.values.min()), float(curve.values.max())


def _find_display_scale(machine: Machine, number: int) -> tuple[str, float]:
    """Return a joint's unit for people, and the factor of its values."""
    return ("°", degrees(1.0)) if machine.joint_units[number] == "rad" else ("mm", 1.0)
