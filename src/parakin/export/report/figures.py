"""Figures for HTML pages that need no network, in plotly's JSON as far as ``plots.js`` draws it."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

Figure = dict[str, Any]  # plotly's {"data": [traces], "layout": {...}}
PlotTrace = dict[str, Any]

FONT = {"family": "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif", "size": 13}


def round_numbers(values: ArrayLike, digits: int = 3) -> list[float | None]:
    """Round numbers for JSON, with None for NaN and infinity: a curve has a gap there."""
    array = np.round(np.asarray(values, float).ravel(), digits) + 0.0
    return [v if ok else None for v, ok in zip(array.tolist(), np.isfinite(array).tolist(), strict=True)]


def render_page(title: str, body: str) -> str:
    """Render a whole HTML page around a body with figures (:func:`embed_figure`); ``body`` is HTML, ``title`` text."""
    names = ("report.html", "page_frame.js", "plots.js")
    template, page, plots = (files(__package__).joinpath(name).read_text("utf-8") for name in names)
    return Template(template).substitute(title=escape(title), body=body, page=page, plots=plots)


def embed_figure(name: str, figure: Figure, height: str) -> str:
    """Render a figure as HTML; ``height`` is a CSS length."""
    # Within a script element only "<" could end or open anything.
    data = json.dumps(figure, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return (
        f'<div id="{name}" class="figure" style="height:{height}"></div>\n'
        f'<script type="application/json" data-figure="{name}">{data}</script>\n'
    )
