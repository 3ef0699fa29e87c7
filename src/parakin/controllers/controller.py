"""What ``parakin post`` has to know of a controller."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ..arrays import Writer
    from ..toolpath.linearise.deviation import Interpolation
    from ..toolpath.path import Note
    from ..toolpath.timing.trajectory import Trajectory


class ControllerTime(NamedTuple):
    """What a controller takes for a trajectory.

    seconds : from the first record on
    notes : by line, why that is much longer than the trajectory; none where it is not
    """

    seconds: float
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True)
class Controller:
    """A controller that parakin writes programs for.

    title : its name for people
    interpolation : what it moves evenly between two records, the tool's ``pose`` or the ``joints``
    make_program : from a trajectory, what of it is off limits (a line each, None: nothing), and how far (mm) the
        controller may cut corners, the writer of the program; raises :class:`parakin.PoseError` for a trajectory that
        the controller can't run
    predict_time : how long the controller takes from the first record on; None: as long as the trajectory
    suffix : of a program's file
    """

    title: str
    interpolation: Interpolation
    make_program: Callable[[Trajectory, str | None, float], Writer]
    predict_time: Callable[[Trajectory], ControllerTime] | None = None
    suffix: str = ".ngc"
