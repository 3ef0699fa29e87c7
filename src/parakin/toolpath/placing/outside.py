"""Say that a path lies outside the workspace as a whole, where the workspace is, and where the part would have to lie.

A file of its own tells coordinates from the part's zero, which a hanging machine never reaches: every record is off
limits then, and the limits that they break say little.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ...kinematics.rotations import TURNS
from ...machine import Machine
from ...units import AXIS_UNITS, to_display
from ..path import ToolPath
from ..posting.frames import compose_frames, find_frame_angles
from ..posting.post import post_path
from ..posting.posted import Posted

_DIRECTIONS, _STEPS = 600, 160  # of rays from home, and places on each
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # rad: turns that spread directions evenly
_ROUNDED = 1  # digits after the point of mm in the suggestion
_MOST_RECORDS = 200_000  # of a path that is posted again to try the suggestion


class Outside(NamedTuple):
    """A path that no record of is allowed, while the workspace is elsewhere. Lengths are mm, angles rad.

    path, workspace : (2, 3) least and greatest X, Y, Z of the path's tips as it lies now, and of where the tip can be
        at home's orientation, in straight lines from home; NaN for a letter that is no axis
    workpiece : X, Y, Z, A, B, C of the workpiece that would bring the path's middle to home
    broken : how many records would be off limits there; None where that was not tried
    """

    path: Array
    workspace: Array
    workpiece: dict[str, float]
    broken: int | None


def find_outside(posted: Posted, path: ToolPath, workpiece: Array | None) -> Outside | None:
    """Find where a path would have to lie, if no record of it is allowed where it lies; None if that is not the fault.

    Parameters
    ----------
    posted : the path on the machine
    path : as it was read, with its own frame
    workpiece : as it was posted with

    It is not the fault where the path's middle can be reached, or where no more records are allowed at home.
    """
    machine, letters = posted.machine, [k for k, letter in enumerate("XYZ") if letter in posted.machine.axes]
    if not len(path) or not posted.broken.all():
        return None
    tips = path.tip @ posted.frame[:, :3].T + posted.frame[:, 3]
    bounds = np.array([tips.min(axis=0), tips.max(axis=0)])
    middle, home = bounds.mean(axis=0), np.zeros(3)
    home[letters] = [machine.home[machine.axes.index("XYZ"[k])] for k in letters]
    workspace = np.full((2, 3), np.nan)
    workspace[:, letters] = measure_workspace(machine)[:, letters]
    inside = (middle >= workspace[0]) & (middle <= workspace[1])
    if inside[letters].all():
        return None
    shift = np.round(home - middle, _ROUNDED)
    placed = compose_frames(workpiece, None).copy()
    placed[:, 3] = np.round(placed[:, 3] + shift, _ROUNDED) + 0.0
    values = dict(zip("XYZ", placed[:, 3].tolist(), strict=True))
    turns = dict(zip(TURNS, find_frame_angles(placed), strict=True))
    values |= {letter: angle for letter, angle in turns.items() if angle}
    broken = None
    if len(path) <= _MOST_RECORDS:
        try:
            broken = int(np.count_nonzero(post_path(machine, path, workpiece=placed).broken))
        except PoseError:
            return None
        if broken == len(path) and (np.ptp(bounds, axis=0) <= np.ptp(workspace, axis=0))[letters].all():
            return None
    return Outside(bounds, workspace, values, broken)


def measure_workspace(machine: Machine) -> Array:
    """Measure the least and the greatest X, Y, Z, (2, 3) mm, that rays from home reach at its orientation.

    A letter that is no axis is 0.
    """
    number = np.arange(_DIRECTIONS) + 0.5
    height = 1.0 - 2.0 * number / _DIRECTIONS
    around = np.sqrt(1.0 - height * height)
    rays = np.column_stack([around * np.cos(_GOLDEN * number), around * np.sin(_GOLDEN * number), height])
    rays = np.concatenate([rays, np.eye(3), -np.eye(3)])
    columns = [machine.axes.index(letter) for letter in "XYZ" if letter in machine.axes]
    letters = ["XYZ".index(machine.axes[column]) for column in columns]
    kept = rays[:, letters]
    begin, step = np.zeros(len(rays)), 0.05 * max(1.0, *map(abs, machine.leg_sizes)) / 4.0
    allowed = np.ones(len(rays), bool)
    for _ in range(_STEPS):  # outwards until a place is not allowed
        ahead = begin + step
        allowed &= _check_places(machine, kept * ahead[:, None], columns)
        begin = np.where(allowed, ahead, begin)
        if not allowed.any():
            break
    reached = np.zeros((len(rays), 3))
    reached[:, letters] = kept * begin[:, None]
    home = np.zeros(3)
    home[letters] = machine.home[columns]
    bounds: Array = home + np.array([reached.min(axis=0), reached.max(axis=0)])
    return bounds


def _check_places(machine: Machine, offsets: Array, columns: list[int]) -> Array:
    poses = np.repeat(machine.home[None], len(offsets), axis=0)
    poses[:, columns] += offsets
    allowed: Array = machine.check(poses) == 0
    return allowed


def describe_outside(outside: Outside) -> str:
    """Describe in one line where path and workspace are, and the option that would bring the path's middle to home."""
    text = (
        f"the path lies outside the workspace: it spans {_describe_bounds(outside.path)}, and the tool can be within "
        f"{_describe_bounds(outside.workspace)} (mm, in the machine, at home's orientation); {format_option(outside)} "
        "brings its middle to home"
    )
    larger = np.ptp(outside.path, axis=0) > np.ptp(outside.workspace, axis=0)
    if larger.any():
        axes = " and ".join(letter for letter, is_larger in zip("XYZ", larger, strict=True) if is_larger)
        return f"{text}, but it is larger than the workspace in {axes}"
    if outside.broken is None:
        return text
    if not outside.broken:
        return f"{text}, where every record is allowed"
    return f"{text}, where {outside.broken:,} records are still off limits; {format_search(outside)} looks for better"


def format_option(outside: Outside) -> str:
    """Format the suggestion as the option of the command: ``--workpiece X=0,Y=0,Z=-1650``."""
    values = {axis: to_display(value, AXIS_UNITS[axis]) for axis, value in outside.workpiece.items()}
    return "--workpiece " + ",".join(f"{letter}={value:.10g}" for letter, value in values.items())


def format_search(outside: Outside) -> str:
    """Format the option that looks for a place anywhere in the workspace: ``--place X=-500:500,Y=-500:500,Z=-1900``."""
    half = 0.5 * (np.ptp(outside.workspace, axis=0) - np.ptp(outside.path, axis=0))
    ranges = []
    for letter, reach in zip("XYZ", half.tolist(), strict=True):
        middle = outside.workpiece[letter]
        ranges.append(
            f"{letter}={middle - reach:.0f}:{middle + reach:.0f}" if reach > 0.5 else f"{letter}={middle:.10g}"
        )
    return "--place " + ",".join(ranges)


def _describe_bounds(bounds: Array) -> str:
    spans = zip("XYZ", bounds.T, strict=True)
    return ", ".join(f"{letter} {low:,.0f} to {high:,.0f}" for letter, (low, high) in spans if low == low)
