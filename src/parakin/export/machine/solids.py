"""A scene as solids: bars, plates and balls as triangle meshes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import ceil, inf
from typing import NamedTuple

import numpy as np

from ...arrays import Indices
from ...dynamics.masses import THICKNESS
from ...dynamics.polygon import Points
from .scene import Scene, SceneItem, SceneKind

_SIDES = 14


class Solid(NamedTuple):
    """A mesh of one colour: vertices (v, 3) in mm, triangles (t, 3) of their indices."""

    kind: str
    name: str
    vertices: Points
    triangles: Indices


class Look(NamedTuple):
    """How a kind of item is drawn: colour, and thickness (a bar's radius, a plate's half) over the scene's size."""

    colour: str
    radius: float


LOOKS: dict[str, Look] = {
    "base": Look("#5b6670", THICKNESS["base"]),
    "rail": Look("#aab4bd", 0.0045),
    "telescope": Look("#2f6fb3", 0.0105),
    "piston": Look("#c9d3dc", 0.0060),
    "rod": Look("#2f6fb3", THICKNESS["rod"]),
    "arm": Look("#4c9a8b", 0.0060),
    "carriage": Look("#37474f", THICKNESS["carriage"]),
    "joint": Look("#37474f", 0.0085),
    "platform": Look("#e0912f", THICKNESS["platform"]),
    "central": Look("#8b98a4", 0.0075),
    "head": Look("#e0912f", THICKNESS["head"]),
    "tool": Look("#b3372f", 0.0050),
    "table": Look("#c3ad84", THICKNESS["table"]),
    "axis": Look("#8a7a5c", 0.0075),
}


def build_solids(scene: Scene, scale: float | None = None, piece: float = inf) -> Iterator[Solid]:
    """Build all meshes of a scene.

    Parameters
    ----------
    scale : the size that thicknesses follow, mm; the scene's own by default
    piece : bars are cut into lengths of at most this, mm, for a renderer that sorts faces by their middles
    """
    size = scene.size if scale is None else scale
    for item in scene.items:
        yield from _build_item(item, size, piece)


def _build_item(item: SceneItem, size: float, piece: float) -> Iterator[Solid]:
    radius = LOOKS[item.kind].radius * size
    points = item.points
    if item.kind in ("platform", "table") and item.closed:
        yield _build_plate(item.kind, item.name, points, radius)
    elif len(points) == 1:
        yield _build_ball(item.kind, item.name, points[0], 2.0 * radius)
    else:
        ends = np.vstack([points, points[:1]]) if item.closed else points
        bars = list(pairwise(ends))
        for a, b in bars:
            yield from _build_link(item.kind, item.name, a, b, size, piece)
        if len(bars) > 1 and item.kind != "rail":
            for corner in points:
                yield _build_ball(item.kind, item.name, corner, radius)
    if item.kind in ("telescope", "rod", "arm"):
        foot: SceneKind | str = "carriage" if item.kind != "telescope" else "joint"
        yield _build_ball(foot, item.name, points[0], LOOKS[foot].radius * size)
        yield _build_ball("joint", item.name, points[1], LOOKS["joint"].radius * size)


def _build_link(kind: str, name: str, a: Points, b: Points, size: float, piece: float) -> Iterator[Solid]:
    radius = LOOKS[kind].radius * size
    if kind == "tool":
        yield _build_bar(kind, name, a, b, radius, piece, 0.25 * radius)
    elif kind == "telescope":
        middle = a + 0.58 * (b - a)
        yield _build_bar(kind, name, a, middle, radius, piece)
        yield _build_bar("piston", name, middle, b, LOOKS["piston"].radius * size, piece)
    else:
        yield _build_bar(kind, name, a, b, radius, piece)


def _build_bar(
    kind: str, name: str, a: Points, b: Points, radius: float, piece: float, end: float | None = None
) -> Solid:
    """Build a round bar from a to b, closed at both ends, with another radius at its end if ``end`` is given."""
    along = b - a
    length = float(np.linalg.norm(along))
    if length == 0.0:
        return _build_ball(kind, name, a, radius)
    pieces = max(1, ceil(length / piece))
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    other = np.cross(along / length, across)
    turn = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    circle = np.outer(np.cos(turn), across) + np.outer(np.sin(turn), other)
    radii = np.linspace(radius, radius if end is None else end, pieces + 1)
    rings = [a + t * along + r * circle for t, r in zip(np.linspace(0.0, 1.0, pieces + 1), radii, strict=True)]
    return Solid(kind, name, np.vstack([*rings, a[None], b[None]]), build_skin(pieces + 1, _SIDES))


def build_skin(rings: int, sides: int) -> Indices:
    """Build triangles, facing outward, over rings of vertices and the fans to the two poles that follow them."""
    i = np.arange(sides)
    j = (i + 1) % sides
    faces = []
    for ring in range(rings - 1):
        low, high = ring * sides, (ring + 1) * sides
        faces += [np.column_stack([low + i, low + j, high + j]), np.column_stack([low + i, high + j, high + i])]
    first, last = rings * sides, rings * sides + 1
    top = (rings - 1) * sides
    faces += [np.column_stack([0 * i + first, j, i]), np.column_stack([0 * i + last, top + i, top + j])]
    return np.vstack(faces)


def _build_plate(kind: str, name: str, ring: Points, half: float) -> Solid:
    """Build a plate over a ring of corners; its middle is the fan's pole, so the corners need not lie in one plane."""
    off = ring - ring.mean(axis=0)
    normal = np.linalg.svd(off)[2][2]
    if np.cross(off[0], off[1]) @ normal < 0.0:
        normal = -normal
    up = half * normal
    middle = ring.mean(axis=0)
    return Solid(kind, name, np.vstack([ring - up, ring + up, middle - up, middle + up]), build_skin(2, len(ring)))


def _build_ball(kind: str, name: str, centre: Points, radius: float) -> Solid:
    sides, rings = 12, 6
    around = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    layers = []
    for tilt in np.linspace(-np.pi / 2, np.pi / 2, rings + 2)[1:-1]:
        flat = np.column_stack([np.cos(around), np.sin(around), 0.0 * around]) * np.cos(tilt)
        layers.append(flat + np.array([0.0, 0.0, np.sin(tilt)]))
    unit = np.vstack([*layers, [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]])
    return Solid(kind, name, centre + radius * unit, build_skin(rings, sides))
