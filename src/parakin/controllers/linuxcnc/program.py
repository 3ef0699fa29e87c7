"""A trajectory as G-code for LinuxCNC with the kinematics that parakin makes for it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import BinaryIO

import numpy as np

from ...arguments import check_arguments
from ...arrays import Array, Writer
from ...errors import PoseError
from ...kinematics.wrist import get_leg_signs
from ...machine import Machine
from ...toolpath.posting.setup_texts import describe_setup
from ...toolpath.timing.corners import check_tolerance
from ...toolpath.timing.trajectory import Trajectory
from ..controller import ControllerRun
from ..event_commands import check_events
from ..event_lines import format_events
from ..gcode_text import CHUNK, format_blocks, format_comments, join_lines, to_display
from .approach import plan_approach
from .axis_ranges import TURNS
from .axis_rates import choose_axis_rates
from .lost_time import note_lost_time
from .straight_motions import StraightMotions, build_straight_motions

_TURNING = 0.4  # fraction of the tolerance where two motions turn the tool: LinuxCNC blends them less well


@check_arguments
def make_linuxcnc_program(trajectory: Trajectory, *, forced: str | None = None, tolerance: float = 0.005) -> Writer:
    """Make the writer of a trajectory as a program for LinuxCNC 2.9 with :func:`parakin.make_linuxcnc_configuration`.

    Parameters
    ----------
    trajectory : of a path whose poses go straight from record to record
    forced : what is off limits, a line each, where the program is written all the same; its header says so
    tolerance : mm that LinuxCNC may cut corners by

    Every motion is in the machine's own coordinates (G53), whatever offsets are in force, and in inverse time (G93).
    Records at one place are written once; where the trajectory's speed changes points are added on the straight line.
    The program begins with a slow motion to the first record and from there takes
    :func:`predict_linuxcnc_seconds`.

    Raises :class:`PoseError` where LinuxCNC's kinematics can't follow: another working mode, or too many turns of C.
    """
    return _make_program(trajectory, _build_motions(trajectory), forced, tolerance)


@check_arguments
def predict_linuxcnc_seconds(trajectory: Trajectory) -> float:
    """Predict what LinuxCNC takes for a program from the first record on, s: the trajectory's time and more."""
    return _build_motions(trajectory).total_seconds


def build_linuxcnc_run(trajectory: Trajectory) -> ControllerRun:
    """Build LinuxCNC's motions for a trajectory once, for the time that they take and for the program."""
    motions = _build_motions(trajectory)
    return ControllerRun(
        lambda forced, tolerance: _make_program(trajectory, motions, forced, tolerance),
        motions.total_seconds,
        tuple(note_lost_time(trajectory, motions)),
    )


def _build_motions(trajectory: Trajectory) -> StraightMotions:
    return build_straight_motions(trajectory, *choose_axis_rates(trajectory.posted.machine))


def _make_program(trajectory: Trajectory, motions: StraightMotions, forced: str | None, tolerance: float) -> Writer:
    machine, posted = trajectory.posted.machine, trajectory.posted
    check_tolerance(tolerance, "tolerance")
    legs = posted.mode if machine.wrist is None else get_leg_signs(posted.mode)  # a wrist goes on in either mode
    if not machine.mode.startswith(legs):
        raise PoseError(f"mode {posted.mode!r}: LinuxCNC's kinematics of {machine.name} has {machine.mode!r} only")
    _refuse_turns(machine, posted.poses)
    blend = tolerance * (_TURNING if machine.turning_columns else 1.0)
    approach = plan_approach(machine, trajectory.curve.corner[0], trajectory.joint_path.joints[0], posted.mode)

    check_events(posted.path)

    def write(file: BinaryIO) -> None:
        for text in _format_program(trajectory, motions, approach, forced, f"G64 P{blend:g} Q0"):
            file.write(text.encode("ascii"))

    return write


def _refuse_turns(machine: Machine, poses: Array) -> None:
    most = TURNS if machine.has_direction else 0.5
    for column in machine.turning_columns:
        turns = np.abs(poses[:, column]).max(initial=0.0) / (2.0 * np.pi)
        if turns > most + 1e-9:
            axis, turned = machine.axes[column], f"would turn {turns:.1f} times"
            raise PoseError(f"{axis} {turned}, in LinuxCNC's configuration it has {most:g} either way")


def _format_program(
    trajectory: Trajectory, motions: StraightMotions, approach: tuple[Array, Array], forced: str | None, blend: str
) -> Iterator[str]:
    posted, path = trajectory.posted, trajectory.posted.path
    machine = posted.machine
    ends = to_display(motions.ends, machine.axis_units)
    way, times = to_display(approach[0], machine.axis_units), approach[1]
    head = [
        f"{path.source} on {machine.name}, mode {posted.mode}; made by parakin for LinuxCNC",
        f"{motions.total_seconds:.3f} s from the first record on; {times.sum():.1f} s to it, from wherever the tool is",
        f"machine coordinates, {' '.join(machine.axes)} in mm and degrees; F is the inverse of minutes",
        *describe_setup(posted),
        *(f"OFF LIMITS: written with --force: {line}" for line in (forced or "").splitlines()),
    ]
    yield join_lines(line for remark in head for line in format_comments(remark))
    yield "G21 G90 G17 G40 G49\n"
    reached = np.searchsorted(motions.piece, trajectory.curve.corner_of_record)  # how many motions lead to each record
    events = format_events(path, [int(reached[event.record - 1]) if event.record else -1 for event in path.events])
    yield join_lines(events.pop(-1, []))
    yield "G93 G61\n" + format_blocks("G53 G1 ", machine.axes, machine.axis_units, way, times) + blend + "\n"
    stops = np.flatnonzero(motions.halt[:-1]).tolist()
    halting = set(stops)
    breaks = sorted({0, len(ends), *events, *stops, *(at + 1 for at in stops)})
    for begin, end in pairwise([*breaks, len(ends)]):
        yield join_lines(events.get(begin, []))
        exact = begin in halting
        if exact:
            yield "G61\n"
        for start in range(begin, end, CHUNK):
            chunk = slice(start, min(start + CHUNK, end))
            yield format_blocks("G53 G1 ", machine.axes, machine.axis_units, ends[chunk], motions.seconds[chunk])
        if exact:
            yield blend + "\n"
    yield "M2\n"
