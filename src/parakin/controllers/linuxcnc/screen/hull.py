"""Find what a machine reaches straight from home, with home's orientation: the workspace as its screen shows it."""

from __future__ import annotations

import numpy as np

from ....arrays import Array, Flags, Indices
from ....export.machine.scene import Scene
from ....export.machine.solids import build_skin
from ....machine import Machine
from ..axis_ranges import estimate_axis_ranges

_RINGS, _SIDES = 17, 32  # rays from home: on a sphere by latitude and longitude
_STEPS = 60  # of a ray, first coarse and then once more within the step where it leaves


def find_workspace_hull(machine: Machine, home: Array, scene: Scene) -> tuple[Array, Indices]:
    """Find the surface around what straight rays from a pose ``home`` (axes,) reach: vertices in M, triangles.

    A ray ends at the first limit or singularity; what lies behind is not seen. The scene is home's.
    """
    columns = np.flatnonzero(np.array(machine.axis_units) == "mm")
    directions, triangles = _spread_directions(len(columns))
    low, high = (np.array(ends)[columns] for ends in estimate_axis_ranges(machine))
    reach = float(np.linalg.norm(np.maximum(high - home[columns], home[columns] - low)))
    last = np.zeros(len(directions))
    for step in (reach / _STEPS, reach / _STEPS**2):
        along = last[:, None] + step * np.arange(_STEPS + 1)
        poses = np.broadcast_to(home, (*along.shape, len(home))).copy()
        poses[..., columns] += along[..., None] * directions[:, None, :]
        good = _is_allowed(machine, home, poses.reshape(-1, len(home))).reshape(along.shape)
        last = last + step * (np.cumprod(good, axis=1).sum(axis=1) - 1).clip(0)
    places = np.tile(scene.frames["tool"][:, 3], (len(directions), 1))
    letters = ["XYZ".index(machine.axes[column]) for column in columns]
    places[:, letters] = home[columns] + last[:, None] * directions
    frame = scene.frames.get("workpiece")
    return places if frame is None else places @ frame[:, :3].T + frame[:, 3], triangles


def list_hull_lines(count: int) -> list[list[int]]:
    """List the lines on the surface of :func:`find_workspace_hull`, each by its vertices: parallels and meridians.

    ``count`` is how many axes move the tip; in a plane there is one line, the outline.
    """
    circle = [*range(_SIDES), 0]
    if count < 3:
        return [circle]
    parallels = [[ring * _SIDES + side for side in circle] for ring in range(0, _RINGS, 2)]
    first, last = _RINGS * _SIDES, _RINGS * _SIDES + 1
    meridians = [[first, *[ring * _SIDES + side for ring in range(_RINGS)], last] for side in range(0, _SIDES, 2)]
    return parallels + meridians


def _is_allowed(machine: Machine, home: Array, poses: Array) -> Flags:
    """Tell where poses (n, axes) keep all limits, in home's assembly mode: (n,)."""
    same_side: Flags = machine.sides(poses) * machine.sides(home[None]) > 0.0
    allowed: Flags = (machine.check(poses) == 0) & same_side
    return allowed


def _spread_directions(count: int) -> tuple[Array, Indices]:
    """Spread directions (n, count) around a point, in space or in a plane, and the triangles between their ends."""
    around = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    if count < 3:
        fan = np.column_stack([np.full(_SIDES, _SIDES), np.arange(_SIDES), (np.arange(_SIDES) + 1) % _SIDES])
        return np.vstack([circle[:, :count], np.zeros((1, count))]), fan
    rings = [
        np.column_stack([np.cos(tilt) * circle, np.full(_SIDES, np.sin(tilt))])
        for tilt in np.linspace(-0.5 * np.pi, 0.5 * np.pi, _RINGS + 2)[1:-1]
    ]
    return np.vstack([*rings, [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]]), build_skin(_RINGS, _SIDES)
