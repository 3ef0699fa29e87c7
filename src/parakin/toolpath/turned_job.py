"""Prepare a job whose turn about the tool's axis is chosen, and compare it with the job that keeps C as at home."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from ..arguments import check_arguments
from ..arrays import Array, Progress
from ..machine import Machine
from .job import Job, Tolerances, prepare
from .linearise.deviation import Interpolation
from .path import ToolPath
from .posting.posted import Posted
from .posting.range_use import measure_range_use
from .timing import Corners
from .tool_turn.choice import choose_tool_turn

_LEAN = 0.05  # of the axis tolerance: what even turns from record to record may take
_SAME = 0.01  # of a margin: as little more is no gain


@dataclass(frozen=True, eq=False)
class TurnedJob:
    """The better of two jobs on a path: with its turn about the tool's axis chosen, and with C as at home.

    job : the better one
    home : the job with C as at home
    low, high : rad, the range of the machine's C in ``job``
    margin, home_margin : the least margins at the records of both, over half their limit's range; NaN where the
        machine can't reach a record
    """

    job: Job
    home: Job
    low: float
    high: float
    margin: float
    home_margin: float

    @property
    def is_chosen(self) -> bool:
        """Whether the turn is not C as at home throughout."""
        return self.job is not self.home

    def __repr__(self) -> str:
        chosen = "chosen" if self.is_chosen else "as at home"
        return f"<parakin turned job: C {chosen}, margin {self.margin:.4g}, as at home {self.home_margin:.4g}>"


@check_arguments
def prepare_turned(
    machine: Machine,
    path: ToolPath,
    *,
    workpiece: Array | None = None,
    mode: str | None = None,
    interpolation: Interpolation = "pose",
    tolerances: Tolerances = Tolerances(),  # noqa: B008  it never changes
    corners: Corners = "round",
    progress: Progress | None = None,
) -> TurnedJob:
    """Prepare a job as :func:`parakin.prepare` does, whose turn about the tool's axis is chosen along the whole path.

    The turn is that of :func:`parakin.choose_tool_turn`. The job with C as at home is prepared too, and
    stays where it alone runs, or where the other leaves no more margin and takes no less time.

    machine, path, workpiece, mode : as for :func:`parakin.prepare`
    interpolation, tolerances, corners, progress : as there

    Raises :class:`PoseError` where the turn is not free, and as :func:`parakin.prepare` does.
    """
    report = progress or (lambda fraction: None)
    lean = _LEAN * tolerances.axis
    turn = choose_tool_turn(
        machine, path, workpiece=workpiece, mode=mode, lean=lean, progress=lambda fraction: report(0.2 * fraction)
    )

    def prepare_one(path: ToolPath, lean: float, begin: float, end: float) -> Job:
        return prepare(
            machine, path, workpiece=workpiece, mode=mode, interpolation=interpolation,
            tolerances=tolerances._replace(axis=tolerances.axis - lean), corners=corners,
            progress=lambda fraction: report(begin + (end - begin) * fraction),
        )  # fmt: skip

    home = job = prepare_one(path, 0.0, 0.2, 0.6)
    margin = home_margin = _find_least_margin(home.posted)
    if turn is not None:
        turned = prepare_one(turn.path, lean, 0.6, 1.0)
        turned_margin = _find_least_margin(turned.posted)
        if _is_better(turned, turned_margin, home, home_margin):
            job, margin = replace(turned, programmed=home.programmed), turned_margin
    report(1.0)
    c = job.posted.poses[:, machine.turning_columns[-1]]
    low, high = float(np.min(c, initial=inf)), float(np.max(c, initial=-inf))
    return TurnedJob(job, home, low, high, margin, home_margin)


def _find_least_margin(posted: Posted) -> float:
    return float(np.min(measure_range_use(posted)[1], initial=inf))


def _is_better(turned: Job, margin: float, home: Job, home_margin: float) -> bool:
    """Tell whether a job is better: it runs where the other does not, leaves more margin, or as much and is quicker."""
    if turned.runs != home.runs:
        return turned.runs
    if not abs(margin - home_margin) <= _SAME * home_margin:
        return margin > home_margin
    return turned.seconds is not None and home.seconds is not None and turned.seconds < home.seconds
