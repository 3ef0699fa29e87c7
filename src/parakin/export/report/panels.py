"""Diagrams that share their x axis, one below another or in a few columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..colours import FAINT, INK
from .figures import FONT, Figure, PlotTrace

_ROW, _GAP, _BREAK = 118, 34, 44  # px: a diagram's height, the gap to the next, and more of it under an axis
_BETWEEN = 0.065  # gap between columns, as a fraction of the figure's width
_TOP, _BOTTOM = 26, 44  # px


@dataclass(frozen=True)
class Panel:
    """One diagram: its heading in HTML, traces without axes, the y axis' range and tick format, and dashed bounds."""

    heading: str
    traces: list[PlotTrace]
    span: list[float]
    bounds: Sequence[float] = ()
    ticks: str = ","


def stack_panels(rows: Sequence[Sequence[Panel]], title: str, tall: int = _ROW) -> tuple[Figure, int]:
    """Stack rows of panels, each ``tall`` px, over one x axis called ``title``; return the figure and its height in px.

    Rows of one panel come before rows of several; all of the latter have the same number.
    """
    wide = sum(len(row) == 1 for row in rows)
    parted = _BREAK if 0 < wide < len(rows) else 0
    inner = len(rows) * (tall + _GAP) - 24 + parted
    layout: Figure = {"height": inner + _TOP + _BOTTOM, "showlegend": False, "hovermode": "closest"}
    layout |= {"font": {**FONT, "color": INK}, "margin": {"l": 62, "r": 16, "t": _TOP, "b": _BOTTOM}}
    layout |= {"plot_bgcolor": "#fff", "paper_bgcolor": "#fff", "shapes": [], "annotations": []}
    traces: list[PlotTrace] = []
    feet: dict[tuple[int, int], str] = {}  # of each column, in how many: its lowest y axis
    count = 0
    for number, row in enumerate(rows):
        top = 1.0 - (number * (tall + _GAP) + parted * (len(row) > 1)) / inner
        for column, panel in enumerate(row):
            count += 1
            y = "y" if count == 1 else f"y{count}"
            left, right = _split_width(len(row))[column]
            x = _name_x_axis(wide > 0, len(row), column)
            feet[len(row), column] = y
            traces += [trace | ({"yaxis": y} if x == "x" else {"xaxis": x, "yaxis": y}) for trace in panel.traces]
            axis: Figure = {"domain": [max(0.0, top - tall / inner), top], "gridcolor": FAINT, "zeroline": False}
            axis |= {"nticks": 5, "range": panel.span, "tickformat": panel.ticks, "linecolor": "#cfd8dc"}
            layout[f"yaxis{y[1:]}"] = axis | {"showline": True} | ({} if x == "x" else {"anchor": x})
            dash: Figure = {"type": "line", "xref": "paper", "x0": left, "x1": right, "yref": y}
            dash["line"] = {"color": "#c62828", "width": 1.2, "dash": "dash"}
            low, high = panel.span
            layout["shapes"] += [dash | {"y0": b, "y1": b} for b in panel.bounds if low <= b <= high]
            layout["annotations"].append(_build_annotation(panel.heading, left, top))
    for (columns, column), y in feet.items():
        x = _name_x_axis(wide > 0, columns, column)
        axis = {"title": {"text": title, "font": {"size": 12}}, "gridcolor": FAINT, "zeroline": False}
        axis |= {"tickformat": ",", "anchor": y, "rangemode": "nonnegative"}
        if columns > 1:
            axis |= {"domain": list(_split_width(columns)[column]), "nticks": 6}
            axis |= {} if x == "x" else {"matches": "x"}
        layout[f"xaxis{x[1:]}"] = axis
    return {"data": traces, "layout": layout}, inner + _TOP + _BOTTOM


def _split_width(count: int) -> list[tuple[float, float]]:
    """Split the figure's width into columns; return their ends as fractions of it."""
    width = (1.0 - (count - 1) * _BETWEEN) / count
    return [(c * (width + _BETWEEN), c * (width + _BETWEEN) + width) for c in range(count)]


def _name_x_axis(wide: bool, columns: int, column: int) -> str:
    """Name the x axis of a column; where there are rows of one panel, theirs is the first."""
    number = 1 if columns == 1 else 1 + column + wide
    return "x" if number == 1 else f"x{number}"


def _build_annotation(text: str, left: float, top: float) -> Figure:
    return {"text": text, "x": left, "xref": "paper", "y": top, "yref": "paper", "xanchor": "left",
            "yanchor": "bottom", "showarrow": False, "font": {"size": 13}}  # fmt: skip
