"""A trajectory as curves: the feed, what sets the pace, and each joint's motion, all over the cycle."""

from __future__ import annotations

from html import escape
from math import degrees, floor, inf, isfinite, log10
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...toolpath.posting.range_use import RangeUse
from ..machine.figures import Figure, Trace, numbers
from ..number_format import format_bound
from .binding import bars_over_time
from .curves import heading, panel_of
from .panels import Panel, stacked
from .timing_samples import Thinned, thinned

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
_ROOM = 1.15  # times the greatest programmed feed: what the feed's axis shows


def draw_timing_curves(trajectory: Trajectory, shades: dict[str, str]) -> tuple[Figure, int]:
    """The curves over the cycle, and the figure's height in px; ``shades`` are the limits' colours."""
    machine = trajectory.posted.machine
    kinds = [kind for kind in _KINDS if kind != "jerk" or any(d.jerk < inf for d in machine.drives)]
    curves = thinned(trajectory, min(_MOST, _ALL // (len(machine.joints) * (1 + len(kinds)) + 2)))
    binds = Panel(heading("what sets the pace", "share of the time", ""), bars_over_time(trajectory, shades),
                  [0.0, 1.0], ticks=".0%")  # fmt: skip
    rows = [[_feed(trajectory, curves)], [binds]]
    for number in range(len(machine.joints)):
        rows.append(
            [_position(trajectory, curves, number), *(_motion(trajectory, curves, number, kind) for kind in kinds)]
        )
    figure, height = stacked(rows, "time [s]")
    figure["layout"] |= {"barmode": "stack", "bargap": 0}
    figure["layout"]["xaxis"]["range"] = [0.0, trajectory.seconds]
    return figure, height


def _line(
    trajectory: Trajectory,
    curve: Thinned,
    shown: NDArray[np.bool_] | None,
    look: Figure,
    name: str,
    unit: str,
    scale: float = 1.0,
) -> Trace:
    """A curve; with ``shown`` only the parts behind these points, drawn over it and without answers to the mouse."""
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
    trace: Trace = {"type": "scatter", "mode": "lines", "name": name, "line": look}
    trace |= {"x": numbers(curve.times[at], max(3, 6 - floor(log10(trajectory.seconds)))), "y": numbers(values, digits)}
    if shown is not None:
        return trace | {"hoverinfo": "skip"}
    record = curve.record[at]
    trace["customdata"] = np.column_stack([record, trajectory.posted.path.line[record]]).tolist()
    place = "%{x:,.3f} s, record %{customdata[0]:,}, line %{customdata[1]}"
    return trace | {"hovertemplate": f"{place}<br>%{{y:,.3f}} {unit}<extra>{name}</extra>"}


def _feed(trajectory: Trajectory, curves: dict[str, Thinned]) -> Panel:
    reached, programmed, fastest = (curves[f"feed.{name}"] for name in ("reached", "programmed", "any"))
    fed = reached.binding == trajectory.names.index("feed")
    unit = "mm/min"
    traces = [
        _line(
            trajectory,
            programmed,
            None,
            {"color": "#455a64", "width": 1.2, "dash": "dot", "shape": "hv"},
            "programmed feed",
            unit,
        ),
        _line(trajectory, fastest, None, {"color": _GREY, "width": 1}, "feed reached", unit),
        _line(trajectory, reached, fed, {"color": _BLUE, "width": 1.6}, "set by the feed", unit),
        _line(trajectory, reached, ~fed, {"color": "#f57c00", "width": 1.6}, "held back", unit),
    ]
    asked = programmed.values[np.isfinite(programmed.values)]
    top = _ROOM * float(asked.max() if len(asked) else fastest.values.max())
    key = (
        f"[{unit}]  <span style='color:{_BLUE}'>set by the feed</span>,"
        " <span style='color:#e65100'>held back by a drive</span>, in rapid grey; programmed dotted"
    )
    return Panel(f"<b>feed</b>  <span style='color:#607d8b'>{key}</span>", traces, [0.0, top])


def _position(trajectory: Trajectory, curves: dict[str, Thinned], number: int) -> Panel:
    drive, curve = trajectory.posted.machine.drives[number], curves[trajectory.posted.machine.joints[number]]
    use = RangeUse(drive.name, drive.name, drive.unit, drive.low, drive.high, *_ends(curve))
    unit, scale = _rim(trajectory.posted.machine, number)
    trace = _line(trajectory, curve, None, {"color": _BLUE, "width": 1.3}, escape(drive.name), unit, scale)
    return panel_of(use, heading(drive.name, unit, ""), [trace])


def _motion(trajectory: Trajectory, curves: dict[str, Thinned], number: int, kind: str) -> Panel:
    """A joint's speed, acceleration or jerk, coloured where its limit sets the pace."""
    drive = trajectory.posted.machine.drives[number]
    bound, (per, colour, ticks) = getattr(drive, kind), _KINDS[kind]
    unit, scale = _rim(trajectory.posted.machine, number)
    text = f"limit {format_bound(bound, drive.unit)}" if isfinite(bound) else "no limit"
    title = heading(f"{drive.name} {kind}", unit + per, text)
    name = f"{drive.name}.{kind}"
    if name not in curves:  # a jerk without a limit beside others with one
        return Panel(title, [], [-1.0, 1.0])
    curve, label = curves[name], escape(f"{drive.name} {kind}")
    traces = [_line(trajectory, curve, None, {"color": _BLUE, "width": 1.1}, label, unit + per, scale)]
    bound_here = curve.binding == trajectory.names.index(name)
    if bound_here.any():
        traces.append(_line(trajectory, curve, bound_here, {"color": colour, "width": 1.8}, label, unit + per, scale))
    return panel_of(RangeUse(name, name, drive.unit, -bound, bound, *_ends(curve)), title, traces, ticks)


def _ends(curve: Thinned) -> tuple[float, float]:
    return float(curve.values.min()), float(curve.values.max())


def _rim(machine: Machine, number: int) -> tuple[str, float]:
    """A joint's unit for people, and what its values are multiplied by."""
    return ("°", degrees(1.0)) if machine.joint_units[number] == "rad" else ("mm", 1.0)
