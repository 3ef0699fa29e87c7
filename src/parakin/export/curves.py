"""Curves over a path: few points that hide no extreme, and the figure of all joints."""

from __future__ import annotations

from html import escape
from math import ceil, degrees, inf, isfinite
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .figures import FAINT, FONT, INK, Figure, Trace, numbers
from .ranges import Use, edge

if TYPE_CHECKING:
    from ..toolpath.result import Posted

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

POINTS = 4000  # a curve
_ALL_POINTS = 36_000  # of all curves together, for machines with many joints
_ROW, _GAP = 118, 34  # px: a curve's height, and what parts it from the next


def extremes(values: Floats, most: int) -> Indices:
    """Ascending indices of at most ``most`` + 2 values: in every stretch the least, the greatest and the first NaN.

    Of a curve with no more values than that all are kept; the first and the last always are.
    """
    n = len(values)
    if n <= most:
        return np.arange(n)
    size = ceil(n / max(1, most // 3))
    padded = np.full(ceil(n / size) * size, np.nan)
    padded[:n] = values
    grid = padded.reshape(-1, size)
    start = np.arange(len(grid)) * size
    gone = np.isnan(grid)
    low = start + np.where(gone, inf, grid).argmin(axis=1)
    high = start + np.where(gone, -inf, grid).argmax(axis=1)
    lost = (start + gone.argmax(axis=1))[gone.any(axis=1)]
    kept = np.unique(np.concatenate([[0, n - 1], low, high, lost]))
    return kept[kept < n]


def joint_curves(posted: Posted, uses: list[Use]) -> tuple[Figure, int]:
    """One curve a joint over the records, and the figure's height in px; ``uses`` are the joints'."""
    count = len(uses)
    height = count * (_ROW + _GAP) + 46
    most = min(POINTS, _ALL_POINTS // count)
    traces: list[Trace] = []
    layout: Figure = {"height": height, "showlegend": False, "hovermode": "closest", "font": {**FONT, "color": INK}}
    layout |= {"margin": {"l": 62, "r": 16, "t": 26, "b": 44}, "plot_bgcolor": "#fff", "paper_bgcolor": "#fff"}
    layout |= {"shapes": [], "annotations": []}
    inner = height - 70
    for row, (use, values) in enumerate(zip(uses, posted.joints.T, strict=True)):
        number = "" if row == 0 else str(row + 1)
        scale = degrees(1.0) if use.unit == "rad" else 1.0
        top = 1.0 - row * (_ROW + _GAP) / inner
        traces += _curve(posted, use, values, scale, most, number)
        axis: Figure = {
            "domain": [max(0.0, top - _ROW / inner), top],
            "gridcolor": FAINT,
            "zeroline": False,
            "nticks": 5,
        }
        axis |= {"range": _range(use, scale), "tickformat": ",", "linecolor": "#cfd8dc", "showline": True}
        layout[f"yaxis{number}"] = axis
        layout["shapes"] += _bounds(use, scale, number)
        layout["annotations"].append(_heading(use, top))
    last = "" if count == 1 else str(count)
    axis = {
        "title": {"text": "record, counted from 0", "font": {"size": 12}},
        "gridcolor": FAINT,
        "zeroline": False,
        "tickformat": ",",
    }
    layout["xaxis"] = axis | {"anchor": f"y{last}", "rangemode": "nonnegative"}
    return {"data": traces, "layout": layout}, height


def _curve(posted: Posted, use: Use, values: Floats, scale: float, most: int, number: str) -> list[Trace]:
    """The curve, and over it in red what lies beyond a limit."""
    kept = extremes(values, most)
    y, lines = values[kept], posted.path.line[kept].tolist()
    unit = "°" if use.unit == "rad" else f" {use.unit}"
    digits = 4 if use.unit == "rad" else 3
    base: Trace = {
        "type": "scatter",
        "x": kept.tolist(),
        "customdata": lines,
        "yaxis": f"y{number}",
        "name": escape(use.name),
    }
    base["hovertemplate"] = (
        f"line %{{customdata}}, record %{{x:,}}<br>%{{y:,.3f}}{unit}<extra>%{{fullData.name}}</extra>"
    )
    few = len(kept) < 60
    traces = [base | {"y": numbers(y * scale, digits), "mode": "lines+markers" if few else "lines",
                      "line": {"color": "#2f6fb3", "width": 1.4}, "marker": {"size": 4}}]  # fmt: skip
    beyond = (y < use.low) | (y > use.high)
    if beyond.any():
        red = numbers(np.where(beyond, y, np.nan) * scale, digits)
        traces.append(base | {"y": red, "mode": "lines+markers", "line": {"color": "#c62828", "width": 2},
                              "marker": {"size": 3.5, "color": "#c62828"}})  # fmt: skip
    return traces


def _range(use: Use, scale: float) -> list[float]:
    """What the curve's axis shows: the range used, and those limits that lie no farther off than its own width."""
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


def _bounds(use: Use, scale: float, number: str) -> list[Figure]:
    shape: Figure = {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": f"y{number}"}
    shape["line"] = {"color": "#c62828", "width": 1.2, "dash": "dash"}
    shown_from, shown_to = _range(use, scale)
    bounds = [b * scale for b in (use.low, use.high)]
    return [shape | {"y0": b, "y1": b} for b in bounds if shown_from <= b <= shown_to]


def _heading(use: Use, top: float) -> Figure:
    limits = "no limits"
    if isfinite(use.low) or isfinite(use.high):
        low, high = (edge(v, use.unit) if isfinite(v) else "–" for v in (use.low, use.high))
        limits = f"limits {low} to {high}"
    unit = "°" if use.unit == "rad" else use.unit
    text = f"<b>{escape(use.name)}</b>  <span style='color:#607d8b'>[{unit}]  {limits}</span>"
    return {"text": text, "x": 0, "xref": "paper", "y": top, "yref": "paper", "xanchor": "left", "yanchor": "bottom",
            "showarrow": False, "font": {"size": 13}}  # fmt: skip
