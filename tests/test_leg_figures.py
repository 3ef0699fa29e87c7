"""The reference's figures of leg kinds: plane geometry, and the code, in the branches that the labels say."""

import re
import sys
from math import acos, atan2, cos, hypot, pi, sin, sqrt
from pathlib import Path

import numpy as np
import pytest

from parakin.algebra import IDENTITY
from parakin.model.legs import KINDS

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from leg_figures import FIGURES, LEGS, OTHER

FOLDER = Path(__file__).parents[1] / "docs" / "pictures" / "legs"
BLACK = "#000000"


def draw_length(leg, x, z):
    return {"": ([((0, 0), (x, z))], [hypot(x, z)])}, []


def draw_ring(leg, x, z):
    hinge = x - leg.radius
    return {"": ([((0, 0), (hinge, z))], [hypot(hinge, z)])}, [((x, -375), (hinge, -375))]


def draw_slider(leg, x, z):
    half = sqrt(leg.rod**2 - z**2)
    feet = {"-": x - half, "+": x + half}  # behind the platform's joint, ahead of it
    drawn = {branch: ([((foot, 0), (x, z))], [foot]) for branch, foot in feet.items()}
    return drawn, [((0, 45), (feet["-"], 45)), ((560, 45), (690, 45))]


def draw_crank(leg, x, z):
    distance = hypot(x, z)
    off = acos((distance**2 + leg.arm**2 - leg.rod**2) / (2 * distance * leg.arm))
    angles = {"+": atan2(z, x) - off, "-": atan2(z, x) + off}  # the axis points to the reader
    drawn = {}
    for branch, angle in angles.items():
        knee = leg.arm * cos(angle), leg.arm * sin(angle)
        drawn[branch] = [(knee, (x, z)), ((0, 0), knee)], [angle]
    return drawn, [((0, 0), (330, 0)), ((90, 0), (90 * cos(angles["-"]), 90 * sin(angles["-"])))]


def draw_lambda(leg, x, z):
    long = x - sqrt(leg.long**2 - z**2)
    share = leg.hinge / leg.long
    hinge = x + share * (long - x), z - share * z
    short = hinge[0] + sqrt(leg.short**2 - hinge[1] ** 2)
    struts = [((long, 0), (x, z)), ((short, 0), hinge)]
    return {"-+": (struts, [long, short])}, [((0, -45), (long, -45)), ((0, -95), (short, -95)), ((720, 30), (850, 30))]


def draw_column(leg, x, z):
    half = sqrt(leg.rod**2 - (leg.radius - x) ** 2)
    heights = {"-": z - half, "+": z + half}
    drawn = {branch: ([((leg.radius, slide), (x, z))], [0.0, slide]) for branch, slide in heights.items()}
    return drawn, [((0, 0), (leg.radius, 0)), ((610, 0), (610, heights["-"]))]


def draw_driven_column(leg, x, z):
    columns, marks = draw_column(leg, x, z)
    drawn = {b: (struts, [*q, atan2(z - q[1], leg.radius - x)]) for b, (struts, q) in columns.items()}
    *_, low, angle = drawn["-"][1]
    end = leg.radius + 130 * cos(pi - angle), low + 130 * sin(pi - angle)
    return drawn, [*marks, ((leg.radius - 130, low), end)]


GEOMETRY = {name[5:]: function for name, function in globals().items() if name.startswith("draw_")}


def read_lines(svg):
    """The struts by colour, the thick lines of two points; and the ends of all other lines and arrows."""
    struts, marks = {}, []
    for path, style in re.findall(r'<path d="([^"]*)"(?: clip-path="[^"]*")? style="([^"]*)"', svg):
        points = [(float(x), float(y)) for x, y in re.findall(r"(-?[\d.]+) (-?[\d.]+)", path)]
        if "fill: none" not in style:
            continue
        marks.append((points[0], points[-1]))
        colour = re.search(r"stroke: (#\w+)", style)[1]
        if "stroke-width: 3" in style and "linecap: round" in style:
            struts.setdefault(colour, []).append((points[0], points[-1]))
    return struts, marks


def fit_drawing(drawn, shown):
    """The scale (scale, right, down) by which points in mm are drawn, not turned or mirrored, and what it misses."""
    x, z = np.array(drawn, float).reshape(-1, 2).T
    u, v = np.array(shown, float).reshape(-1, 2).T
    none, one = np.zeros_like(x), np.ones_like(x)
    rows = np.vstack([np.column_stack([x, one, none]), np.column_stack([-z, none, one])])
    fit = np.linalg.lstsq(rows, np.concatenate([u, v]), rcond=None)[0]
    return fit, np.abs(rows @ fit - np.concatenate([u, v])).max()


@pytest.mark.parametrize("kind", KINDS)
def test_a_figure_shows_what_a_leg_does(kind):
    leg, (x, _, z) = LEGS[kind]
    branches, marks = GEOMETRY[kind](leg, x, z)
    svg = (FOLDER / f"{kind}.svg").read_text(encoding="utf-8")
    struts, lines = read_lines(svg)
    own, *others = branches
    assert own == str(getattr(leg, "branch", ""))
    colours = dict(zip((own, *others), (BLACK, OTHER), strict=False))
    assert {*struts} - {"#0072b2"} == {*colours.values()}
    drawn = [strut for branch in branches for strut in branches[branch][0]]
    shown = [strut for branch in branches for strut in struts[colours[branch]]]
    (scale, right, down), missed = fit_drawing(drawn, shown)
    assert scale > 0.1 and missed < 1e-3
    for start, end in marks:
        ends = np.array([(right + scale * x, down - scale * z) for x, z in (start, end)])
        assert min(np.abs(np.array(line) - ends).max() for line in lines) < 2.0, (start, end)  # an arrow's tip
    for branch, colour in colours.items():
        told = re.findall(r'<text style="[^"]*?(?:; fill: (#\w+))?"[^>]*>[^<]*branch "([+-]+)"', svg)
        assert not branch or (colour if colour != BLACK else "", branch) in told
        point = leg.place_joint(IDENTITY, (x, 0.0, z)) if kind == "ring" else (x, 0.0, z)
        joints = [float(q) for q in leg.inverse(point, branch).joints]
        assert joints == pytest.approx(branches[branch][1], abs=1e-9)
        assert [(s[0], s[2], e[0], e[2]) for s, e in leg.struts(point, joints)] == [
            pytest.approx((*start, *end), abs=1e-9) for start, end in branches[branch][0]
        ]


def test_every_kind_has_a_figure():
    assert {*FIGURES} == {*LEGS} == {*KINDS}
