"""From a tool path to all that a controller needs: linearised, checked everywhere, timed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Literal, TypeAlias

from ..errors import PoseError
from ..machine import Machine
from .checking.check import check_path
from .linearise.linearise import linearise_path
from .path import Floats, ToolPath
from .posting.post import post_path
from .posting.posted import Posted
from .timing import Corners, Trajectory, plan_trajectory
from .timing.stops import find_stops, sum_dwells

Progress = Callable[[float], None]
Target: TypeAlias = Literal["linuxcnc", "joints"]  # moves the tool straight; moves every joint evenly

TOLERANCE = 0.01  # mm
AXIS_TOLERANCE = 1e-3  # rad


@dataclass(frozen=True, eq=False)
class Job:
    """A tool path made ready for a machine and its controller.

    programmed : as it came, on the machine
    posted : with the records that the controller's interpolation needs, checked between all of them
    trajectory : None where there is none
    unplanned : why there is none
    waits : s, that the program waits by its own words, besides the trajectory's
    """

    programmed: Posted
    posted: Posted
    trajectory: Trajectory | None
    unplanned: str
    waits: float

    @property
    def inserted(self) -> int:
        """How many records were added."""
        return len(self.posted.path) - len(self.programmed.path)

    @property
    def runs(self) -> bool:
        """Whether the machine can run it: nothing is off limits, and nothing but unknown rates of its drives keeps it
        from having a trajectory."""
        rated = all(isfinite(drive.speed) or isfinite(drive.acceleration) for drive in self.posted.machine.drives)
        return self.posted.first is None and (self.trajectory is not None or not rated)

    @property
    def seconds(self) -> float | None:
        """The cycle time, None where there is no trajectory."""
        return None if self.trajectory is None else self.trajectory.seconds + self.waits


def prepare(
    machine: Machine,
    path: ToolPath,
    *,
    workpiece: Floats | None = None,
    mode: str | None = None,
    target: Target = "linuxcnc",
    tolerance: float = TOLERANCE,
    axis_tolerance: float = AXIS_TOLERANCE,
    corners: Corners = "round",
    progress: Progress | None = None,
) -> Job:
    """Post a tool path, insert the points its target needs, check it everywhere, and plan its trajectory.

    Parameters
    ----------
    machine, path, workpiece, mode : as for :func:`~.posting.post.post_path`
    target : what the controller interpolates: ``linuxcnc`` the tool's pose, ``joints`` the joints
    tolerance, axis_tolerance : mm and rad that tip and axis may be off the programmed path in all: half of each is for
        the controller's interpolation, half for rounding corners
    corners : ``round`` or ``stop``, as for :func:`~.timing.plan.plan_trajectory`
    progress : called now and then with the fraction done, 0 to 1

    Raises :class:`PoseError` or :class:`InputError` for what can't be asked. What the machine can't do raises nothing:
    it is an offence of :attr:`Job.posted` or the reason in :attr:`Job.unplanned`.
    """
    say = progress or (lambda fraction: None)

    def part(begin: float, end: float) -> Progress:
        return lambda fraction: say(begin + (end - begin) * fraction)

    programmed = post_path(machine, path, workpiece=workpiece, mode=mode, progress=part(0.0, 0.1))
    # The angles of the pose change evenly in either case, as the trajectory has them; the tip is on its line by then.
    steps = 1 if target == "linuxcnc" else 2
    lean = 0.5 * axis_tolerance / steps
    posted, trajectory, why = programmed, None, ""
    try:
        posted = linearise_path(posted, "pose", chord=0.5 * tolerance, angle=lean, progress=part(0.1, 0.2))
        if target == "joints":
            posted = linearise_path(posted, "joints", chord=0.5 * tolerance, angle=lean, progress=part(0.2, 0.4))
    except PoseError as error:
        why = str(error)
    posted = check_path(posted, progress=part(0.4, 0.6))
    if not why:
        try:
            trajectory = plan_trajectory(
                posted, corners=corners, tolerance=0.5 * tolerance, axis_tolerance=0.5 * axis_tolerance,
                stops=find_stops(posted.path),
            )  # fmt: skip
        except PoseError as error:
            why = str(error)
    say(1.0)
    return Job(programmed, posted, trajectory, why, sum_dwells(path))
