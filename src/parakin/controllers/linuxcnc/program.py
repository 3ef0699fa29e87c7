"""A trajectory as G-code for LinuxCNC with the kinematics and the planner that parakin makes for it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import BinaryIO, NamedTuple

import numpy as np

from ...arguments import check_arguments
from ...arrays import Array, Flags, Indices, Writer
from ...errors import PoseError
from ...kinematics.wrist.pole_crossing import get_leg_signs
from ...kinematics.wrist.pole_thresholds import DISTINCT
from ...kinematics.wrist.pose_angles import find_nearest_direction, point_direction
from ...machine import Machine
from ...toolpath.linearise.poles import find_poles
from ...toolpath.posting.setup_texts import describe_setup
from ...toolpath.timing.trajectory import Trajectory
from ..event_commands import check_events
from ..event_lines import format_events
from ..gcode_text import CHUNK, format_blocks, format_comments, join_lines, to_display
from .approach import plan_approach
from .axis_ranges import TURNS
from .knots import Knots, choose_knots
from .planner import SIGNAL, name_planner

_ROUNDING = 1e-9  # s
_LEAST_RATE = 0.1  # mm/min, or degrees/min: LinuxCNC's interpreter takes slower motions in inverse time for this fast


class _Approach(NamedTuple):
    """The motions that lead to the first record: poses (k, axes), mm and rad, and the s (k,) that each takes."""

    poses: Array
    seconds: Array


@check_arguments
def make_linuxcnc_program(trajectory: Trajectory, *, forced: str | None = None) -> Writer:
    """Make the writer of a trajectory as a program for LinuxCNC 2.9 with :func:`parakin.make_linuxcnc_configuration`.

    Parameters
    ----------
    trajectory : of a path whose poses go straight from record to record
    forced : what is off limits, a line each, where the program is written all the same; its header says so

    Every motion is in the machine's own coordinates (G53), whatever offsets are in force, in inverse time (G93). The
    program begins with a slow motion to the first record. From there its points are knots of the trajectory, and
    ``M67 E63 Q1`` tells the configuration's planner to join them by a spline in the times that are given: it takes as
    long as the trajectory, and follows it within 1 µm.

    Raises :class:`PoseError` where LinuxCNC's kinematics can't follow: another working mode, or too many turns of C.
    """
    machine, posted = trajectory.posted.machine, trajectory.posted
    legs = posted.mode if machine.wrist is None else get_leg_signs(posted.mode)  # a wrist goes on in either mode
    if not machine.mode.startswith(legs):
        raise PoseError(f"mode {posted.mode!r}: LinuxCNC's kinematics of {machine.name} has {machine.mode!r} only")
    _refuse_turns(machine, posted.poses)
    first = trajectory.curve.corner[0], trajectory.joint_path.joints[0]
    approach = _Approach(*plan_approach(machine, *first, posted.mode))
    knots = choose_knots(trajectory)
    check_events(posted.path)

    def write(file: BinaryIO) -> None:
        for text in _format_program(trajectory, knots, approach, forced):
            file.write(text.encode("ascii"))

    return write


def _refuse_turns(machine: Machine, poses: Array) -> None:
    most = TURNS if machine.has_direction else 0.5
    for column in machine.turning_columns:
        turns = np.abs(poses[:, column]).max(initial=0.0) / (2.0 * np.pi)
        if turns > most + 1e-9:
            axis, turned = machine.axes[column], f"would turn {turns:.1f} times"
            raise PoseError(f"{axis} {turned}, in LinuxCNC's configuration it has {most:g} either way")


def _format_program(trajectory: Trajectory, knots: Knots, approach: _Approach, forced: str | None) -> Iterator[str]:
    machine, path = trajectory.posted.machine, trajectory.posted.path
    yield _format_head(trajectory, approach, forced)
    yield "G21 G90 G17 G40 G49\n"
    places = _place_records(trajectory, knots)
    events = format_events(path, [int(places[event.record - 1]) if event.record else -1 for event in path.events])
    yield join_lines(events.pop(-1, []))
    way = to_display(approach.poses, machine.axis_units)
    yield "G93 G61.1\n" + format_blocks("G53 G1 ", machine.axes, machine.axis_units, way, approach.seconds)
    yield f"M67 E{SIGNAL} Q1\nG61\n"
    yield from _format_motions(trajectory, knots, events)
    yield f"M67 E{SIGNAL} Q0\nM2\n"


def _format_head(trajectory: Trajectory, approach: _Approach, forced: str | None) -> str:
    posted = trajectory.posted
    machine = posted.machine
    remarks = [
        f"{posted.path.source} on {machine.name}, mode {posted.mode}; made by parakin for LinuxCNC",
        f"{trajectory.seconds:.3f} s from the first record on; "
        f"{approach.seconds.sum():.1f} s to it, from wherever the tool is",
        f"machine coordinates, {' '.join(machine.axes)} in mm and degrees; F is the inverse of minutes",
        f"for the planner {name_planner(machine)}, which takes the times from M67 E{SIGNAL} Q1 on as they are",
        *describe_setup(posted),
        *(f"OFF LIMITS: written with --force: {line}" for line in (forced or "").splitlines()),
    ]
    return join_lines(line for remark in remarks for line in format_comments(remark))


def _place_records(trajectory: Trajectory, knots: Knots) -> Indices:
    """Count the motions that lead to each record (n,)."""
    return np.searchsorted(knots.times, trajectory.times - _ROUNDING, "left")


def _stop_slow_tips(machine: Machine, rows: Array, seconds: Array, stands: Flags) -> None:
    """Stop the tip in motions (k,) that turn it and hardly move it; rows (k + 1, axes), mm and degrees as written.

    LinuxCNC tells a motion's rate by the tip's way, however small, and by the turn only where the tip stands. What
    is held back, less than 1e-5 mm in 6 ms, moves on with the next motion that is fast enough, or that ends where the
    trajectory ``stands`` (k + 1,).
    """
    tip, least = [column for column, axis in enumerate(machine.axes) if axis in "XYZ"], _LEAST_RATE / 60.0 * seconds
    steps = np.diff(rows, axis=0)
    ways, turns = (np.linalg.norm(steps[:, columns], axis=1) for columns in (tip, machine.turning_columns))
    may_hold = (turns > least) & ~stands[1:]
    for first in np.flatnonzero(may_hold & (ways > 0.0) & (ways <= least)).tolist():
        for motion in range(first, len(seconds)):
            way = np.linalg.norm(rows[motion + 1, tip] - rows[motion, tip])
            if not (may_hold[motion] and 0.0 < way <= least[motion]):
                break
            rows[motion + 1, tip] = rows[motion, tip]


def _keep_wrist(trajectory: Trajectory, times: Array, rows: Array) -> None:
    """Turn the tool in rows (k, axes), mm and degrees, so that its wrist stands as at ``times`` (k,); in place.

    Tips are rounded, and held back where they creep. Where a central leg carries the wrist, its pole moves with the
    tip, and beside it the first joint would turn by many times the angle that the pole moves by.
    """
    machine = trajectory.posted.machine
    pole = next((pole for pole in find_poles(machine, "pose", False) if pole.moves), None)
    if pole is None or machine.wrist is None:
        return
    poses = trajectory.at(times).poses
    near = np.flatnonzero(machine.wrist.find_free(poses, DISTINCT))
    columns, poses = machine.wrist.direction.pair, poses[near]
    angles = np.zeros((len(near), 3))
    angles[:, 1:] = poses[:, columns]
    axis = point_direction(*angles[:, 1:].T)
    projected = pole.project_axes(poses[:, :3], axis)
    axis = pole.find_axes(rows[near, :3], axis, projected, np.zeros(len(near)))
    poses[:, columns] = find_nearest_direction(axis, angles)[:, 1:]
    rows[near, columns] = to_display(poses, machine.axis_units)[:, columns]


def _format_motions(trajectory: Trajectory, knots: Knots, events: dict[int, list[str]]) -> Iterator[str]:
    """Yield the motions from knot to knot, the events before each by their number, and exact stops where it stands."""
    machine = trajectory.posted.machine
    rows, seconds = to_display(knots.poses, machine.axis_units), np.diff(knots.times)
    _stop_slow_tips(machine, rows, seconds, knots.stands)
    _keep_wrist(trajectory, knots.times, rows)
    rows = rows[1:]
    standing = set(np.flatnonzero(knots.stands[1:]).tolist())
    breaks = sorted({0, len(rows), *events, *standing, *(at + 1 for at in standing)})
    for begin, end in pairwise([*breaks, len(rows)]):
        yield join_lines(events.get(begin, []))
        yield "G61.1\n" if begin in standing else ""
        for start in range(begin, end, CHUNK):
            chunk = slice(start, min(start + CHUNK, end))
            yield format_blocks("G53 G1 ", machine.axes, machine.axis_units, rows[chunk], seconds[chunk])
        yield "G61\n" if begin in standing and end < len(rows) else ""
