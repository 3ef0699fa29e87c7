"""Prepare a job: a tool path on a machine that is linearised, checked everywhere, and timed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import NamedTuple

from ..arguments import check_arguments, check_positive
from ..arrays import Array, Progress
from ..displays import Displayed
from ..errors import PoseError
from ..machine import Machine
from .checking.check import check_path
from .linearise.deviation import Interpolation
from .linearise.linearise import linearise_path
from .linearise.rewinds import has_room_for_rewind
from .path import Note, ToolPath
from .placing.outside import Outside, find_outside
from .posting.post import post_path
from .posting.posted import Posted
from .posting.tool_lengths import fit_tool_lengths
from .timing import Corners, Trajectory, plan_trajectory
from .timing.lost_time import explain_lost_time, refuse_endless
from .timing.pole_jumps import refuse_pole_jumps
from .timing.stops import find_stops, sum_dwells

_INTERPOLATED = 0.85  # of the axis's tolerance: what the controller's interpolation may take
_MOST_BROKEN = 10_000  # programmed records off limits: what lies between them changes nothing, and takes minutes
_MOST_TIMED = 50_000  # records of a path that is off limits: no program is made of it, and its time would take minutes


class Tolerances(NamedTuple):
    """How far the tool may be off the programmed path.

    tip : mm
    axis : rad

    Of both a part is for the controller's interpolation and the rest for rounding corners. Most of the axis's is for
    the first, in which the path is led through poles: what it allows there no joint has to turn for.
    """

    tip: float = 0.01
    axis: float = 1e-3

    def share_with_interpolation(self, interpolation: Interpolation) -> Tolerances:
        """Return the part of both that each step of linearising may take.

        interpolation : what the controller moves evenly, ``pose`` or ``joints``

        The pose's angles change evenly in either case, as the trajectory has them, and the tip is on its line by then:
        where the joints go evenly, two steps share the tolerance of the axis.
        """
        return Tolerances(0.5 * self.tip, _INTERPOLATED * self.axis / (1 if interpolation == "pose" else 2))

    def share_with_corners(self) -> Tolerances:
        """Return the part of both that rounding corners may take."""
        return Tolerances(0.5 * self.tip, (1.0 - _INTERPOLATED) * self.axis)


@dataclass(frozen=True, eq=False)
class Job(Displayed):
    """A tool path made ready for a machine and its controller.

    programmed : the path as it came, on the machine
    posted : the path with the records that the controller's interpolation needs, checked between all of them
    trajectory : None where there is none
    unplanned : why there is no trajectory
    waits : s, that the program waits by its own words, besides the trajectory's time
    corner_tolerance : mm that corners may take the tip off the path
    outside : where the part would have to lie, if the path lies outside the workspace as a whole
    """

    programmed: Posted
    posted: Posted
    trajectory: Trajectory | None
    unplanned: str
    waits: float
    corner_tolerance: float
    outside: Outside | None = None

    @property
    def inserted(self) -> int:
        """How many records were added."""
        return len(self.posted.path) - len(self.programmed.path)

    @property
    def runs(self) -> bool:
        """Whether the machine can run the job: nothing is off limits, and it has a trajectory.

        Without one it can run too where the rates of its drives are unknown.
        """
        drives = self.posted.machine.drives
        rated = all(isfinite(drive.speed) or isfinite(drive.acceleration) for drive in drives)
        rated |= any(isfinite(drive.force) or isfinite(drive.power) for drive in drives)
        return self.posted.first is None and (self.trajectory is not None or not rated)

    @property
    def seconds(self) -> float | None:
        """The cycle time, s; None where there is no trajectory."""
        return None if self.trajectory is None else self.trajectory.seconds + self.waits

    def __repr__(self) -> str:
        time = "no time" if self.seconds is None else f"{self.seconds:.6g} s"
        state = "off limits" if self.posted.first is not None else time
        return f"<parakin job on {self.posted.machine.name}: {len(self.posted.path)} records, {state}>"


@check_arguments
def prepare(
    machine: Machine,
    path: ToolPath,
    *,
    workpiece: Array | None = None,
    mode: str | None = None,
    interpolation: Interpolation = "pose",
    tolerances: Tolerances = Tolerances(),  # noqa: B008  it never changes
    corners: Corners = "round",
    progress: Progress | None = None,
) -> Job:
    """Post a tool path, insert the points that its controller needs, check it everywhere, and plan its trajectory.

    Parameters
    ----------
    machine : which runs it, with its own limits, drives and tool
    path : as from :func:`parakin.read_path`; lengths of tools that change are fitted, as by
        :func:`parakin.fit_tool_lengths`
    workpiece : (3, 4), mm, as from :func:`parakin.workpiece`: where the part lies in the machine's frame. It is applied
        after the frame that the path itself brings: M ← workpiece ← path.frame ← W, (4) and (5) of FME Transactions 41
    mode : working mode, one of :attr:`Machine.modes`; None: the default one, or that with head and table's other sign
        if fewer records break a limit in it, or as many and fewer motions in feed turn a joint by more than 90°
    interpolation : what the controller moves evenly between two records, the tool's ``pose`` or the ``joints``
    tolerances : of tip and axis about the programmed path, for the controller's interpolation and for rounded corners
        together
    corners : ``round`` rounds them, ``stop`` stands still at each that turns by more than a degree
    progress : called now and then with the fraction done, 0 to 1

    Where no mode is given and the job does not run in the one that the records suggest, it is prepared with head and
    table's other sign, too, which is taken if it runs there.

    Raises :class:`PoseError` or :class:`InputError` for invalid arguments. What the machine can't do raises nothing: it
    is an offence of :attr:`Job.posted` or the reason in :attr:`Job.unplanned`.
    """
    for name, value, unit in zip(tolerances._fields, tolerances, ("mm", "rad"), strict=True):
        check_positive(f"tolerances.{name}", value, unit)
    report = progress or (lambda fraction: None)

    def prepare_in(mode: str | None) -> Job:
        return _prepare_in(machine, path, workpiece, mode, interpolation, tolerances, corners, report)

    job = prepare_in(mode)
    others = machine.head_modes(job.posted.mode)[1:] if mode is None else []
    if job.runs or job.outside is not None or not others:
        return job
    in_other_mode = prepare_in(others[0])
    return in_other_mode if in_other_mode.runs else job


def _prepare_in(
    machine: Machine,
    path: ToolPath,
    workpiece: Array | None,
    mode: str | None,
    interpolation: Interpolation,
    tolerances: Tolerances,
    corners: Corners,
    report: Progress,
) -> Job:
    """Prepare a job in a mode, or in the one that the records suggest."""

    def report_stage(begin: float, end: float) -> Progress:
        return lambda fraction: report(begin + (end - begin) * fraction)

    (tip, lean), rounded = tolerances.share_with_interpolation(interpolation), tolerances.share_with_corners()
    path = fit_tool_lengths(machine, path, workpiece=workpiece)
    programmed = post_path(machine, path, workpiece=workpiece, mode=mode, progress=report_stage(0.0, 0.1))
    posted, trajectory = programmed, None
    if programmed.broken_record_count > _MOST_BROKEN:
        unplanned = f"off limits at more than {_MOST_BROKEN:,} records, and not looked at between them"
    else:
        posted, unplanned = _linearise(programmed, interpolation, tip, lean, report_stage(0.1, 0.4))
        if has_room_for_rewind(posted):
            posted = _note_wound_up(posted)
        posted = check_path(posted, progress=report_stage(0.4, 0.6))
    if posted.first is not None and len(posted.path) > _MOST_TIMED:
        unplanned = unplanned or f"off limits, and more than {_MOST_TIMED:,} records"
    if not unplanned:
        try:
            trajectory = plan_trajectory(
                posted,
                corners=corners,
                tolerance=rounded.tip,
                axis_tolerance=rounded.axis,
                stops=find_stops(posted.path),
            )
            refuse_endless(trajectory)
            if interpolation == "pose":
                refuse_pole_jumps(trajectory.joint_path)
        except PoseError as error:
            trajectory, unplanned = None, str(error)
    explained = None if trajectory is None else explain_lost_time(trajectory)
    if explained is not None:
        posted = _add_note(posted, explained)
    report(1.0)
    outside = find_outside(programmed, path, workpiece)
    return Job(programmed, posted, trajectory, unplanned, sum_dwells(path), rounded.tip, outside)


def _linearise(
    programmed: Posted, interpolation: Interpolation, chord: float, lean: float, progress: Progress
) -> tuple[Posted, str]:
    """Insert the points that the controller needs; return the path with them, or as it is and the reason."""
    posted = programmed
    try:
        posted = linearise_path(
            posted, "pose", chord=chord, angle=lean, progress=lambda fraction: progress(fraction / 3.0)
        )
        if interpolation == "joints":
            posted = linearise_path(
                posted,
                "joints",
                chord=chord,
                angle=lean,
                progress=lambda fraction: progress((1.0 + 2.0 * fraction) / 3.0),
            )
    except PoseError as error:
        return posted, str(error)
    return posted, ""


def _note_wound_up(posted: Posted) -> Posted:
    """Note that a joint turns beyond its range, and what would help."""
    wrist = posted.machine.wrist
    assert wrist is not None
    joint = posted.machine.joints[wrist.first]
    text = f"{joint} turns beyond its range; a rewind takes whole turns back where a clearance is stated"
    return _add_note(posted, Note(int(posted.path.line[0]), text))


def _add_note(posted: Posted, note: Note) -> Posted:
    """Add a note to a posted path, before those that it has."""
    path = posted.path
    return replace(posted, path=replace(path, notes=(note, *path.notes)))
