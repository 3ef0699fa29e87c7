"""Interactive figures for HTML pages that need no network: plotly's own JSON, written without its Python classes.

The classes take a second to import and check what is constant here; the browser's library is all that is needed.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .scene import Points, Scene
from .solids import LOOKS, Solid, build_solids

Figure = dict[str, Any]  # plotly's {"data": [traces], "layout": {...}}
PlotTrace = dict[str, Any]

FONT = {"family": "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif", "size": 13}
INK, FAINT = "#263238", "#e3e8ec"
_LIGHT = {"ambient": 0.62, "diffuse": 0.75, "specular": 0.15, "roughness": 0.6}


def round_numbers(values: ArrayLike, digits: int = 3) -> list[float | None]:
    """Round numbers for JSON, with None for NaN and infinity: plotly leaves a gap there."""
    array = np.round(np.asarray(values, float).ravel(), digits) + 0.0
    return [v if ok else None for v, ok in zip(array.tolist(), np.isfinite(array).tolist(), strict=True)]


def split_coordinates(points: ArrayLike, digits: int) -> dict[str, list[float | None]]:
    """Split points (n, 3) into rounded ``x``, ``y`` and ``z`` for a trace."""
    return {letter: round_numbers(column, digits) for letter, column in zip("xyz", np.asarray(points).T, strict=True)}


def render_page(title: str, body: str) -> str:
    """Render a whole HTML page around a body with figures (:func:`embed_figure`); ``body`` is HTML, ``title`` text."""
    template = Template(files(__package__).joinpath("page.html").read_text("utf-8"))
    script = files("plotly").joinpath("package_data", "plotly.min.js").read_text("utf-8")
    return template.substitute(title=escape(title), body=body, plotly=script)


def embed_figure(name: str, figure: Figure, height: str) -> str:
    """Render a figure as HTML; ``height`` is a CSS length."""
    # Within a script element only "<" could end or open anything.
    data = json.dumps(figure, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return (
        f'<div id="{name}" class="figure" style="height:{height}"></div>\n'
        f'<script type="application/json" data-figure="{name}">{data}</script>\n'
    )


def build_machine_traces(scene: Scene, name: str, scale: float, colour: str | None = None) -> list[PlotTrace]:
    """Build a machine as meshes, one for each colour; one entry of the legend, ``name``, shows and hides them all.

    With ``colour`` the machine is drawn as a shadow in that one colour.
    """
    by_kind: dict[str, list[Solid]] = {}
    for solid in build_solids(scene, scale):
        by_kind.setdefault(solid.kind if colour is None else "shadow", []).append(solid)
    traces = []
    shown = next((kind for kind in ("telescope", "rod") if kind in by_kind), next(iter(by_kind), ""))
    for kind, group in by_kind.items():
        first = np.cumsum([0, *[len(solid.vertices) for solid in group[:-1]]])
        i, j, k = np.vstack([solid.triangles + start for solid, start in zip(group, first, strict=True)]).T
        vertices = np.vstack([solid.vertices for solid in group])
        trace: PlotTrace = {"type": "mesh3d", **split_coordinates(vertices, 1)}
        trace |= {"i": i.tolist(), "j": j.tolist(), "k": k.tolist(), "hoverinfo": "skip", "lighting": _LIGHT}
        trace["lightposition"] = {"x": 4e4, "y": -8e4, "z": 9e4}
        trace |= {"color": colour or LOOKS[kind].colour, "opacity": 1.0 if colour is None else 0.22}
        trace |= {"name": name, "legendgroup": name, "showlegend": kind == shown, "flatshading": False}
        traces.append(trace)
    return traces


def build_scene_layout(boxes: Iterable[Points], normal: Points | None) -> Figure:
    """Lay out a 3D figure around (2, 3) boxes, with equal scales; a planar machine is seen straight on."""
    corners = np.vstack(list(boxes))
    low, high = corners.min(0), corners.max(0)
    pad = 0.09 * float(np.linalg.norm(high - low)) + 1.0
    spans = high - low + 2.0 * pad
    axes = {}
    for number, letter in enumerate("XYZ"):
        axis: Figure = {
            "title": {"text": f"{letter} [mm]", "font": {"size": 12}},
            "gridcolor": FAINT,
            "zerolinecolor": "#c3ccd3",
        }
        axis |= {"showbackground": False, "showspikes": False, "tickfont": {"size": 11, "color": "#607d8b"}}
        axis |= {"range": [float(low[number] - pad), float(high[number] + pad)], "tickformat": ",.0f", "nticks": 7}
        if normal is not None and abs(normal[number]) > 0.999:
            axis["visible"] = False
        axes[f"{letter.lower()}axis"] = axis
    camera: Figure = {"eye": {"x": 0.95, "y": -1.35, "z": 0.45}, "center": {"x": 0, "y": 0, "z": -0.07}}
    if normal is not None:
        eye = np.sign(normal.sum()) * normal * (1.0 if abs(normal[1]) < 0.5 else -1.0)  # XZ is seen from -Y
        camera = {"eye": dict(zip("xyz", (1.6 * eye).tolist(), strict=True)), "projection": {"type": "orthographic"}}
        camera["up"] = {"x": 0, "y": 1, "z": 0} if abs(normal[2]) > 0.5 else {"x": 0, "y": 0, "z": 1}
    # Equal scales, as aspectmode "data" gives, but of a size that fills the view and no more.
    ratio = dict(
        zip("xyz", (spans * (_fit_scale(spans) if normal is None else 1.25 / spans.max())).tolist(), strict=True)
    )
    scene = {"aspectmode": "manual", "aspectratio": ratio, "camera": camera, "dragmode": "orbit", **axes}
    legend = {"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom", "itemsizing": "constant"}
    layout = {"scene": scene, "margin": {"l": 0, "r": 0, "t": 0, "b": 0}, "legend": legend, "paper_bgcolor": "#fff"}
    return layout | {"font": {**FONT, "color": INK}, "modebar": {"orientation": "v"}}


def _fit_scale(spans: Points) -> float:
    """Find the scale at which a box of these sides fills the view from the front right."""
    across, up = 0.82 * spans[0] + 0.58 * spans[1], spans[2] + 0.2 * (spans[0] + spans[1])
    return float(1.5 / max(across, up))
