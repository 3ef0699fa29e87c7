"""What ``parakin post`` has to know of a controller."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..arrays import Writer
    from ..errors import PoseError
    from ..toolpath.linearise.deviation import Interpolation
    from ..toolpath.path import Note
    from ..toolpath.timing.trajectory import Trajectory


@dataclass(frozen=True)
class ControllerRun:
    """A trajectory as a controller runs it.

    make_program : from what of it is off limits (a line each, None: nothing), and how far (mm) the controller may cut
        corners, the writer of the program; raises :class:`parakin.PoseError` for a trajectory that the controller
        can't run
    seconds : what it takes from the first record on; None: as long as the trajectory
    notes : by line, why that is much longer than the trajectory; none where it is not
    """

    make_program: Callable[[str | None, float], Writer]
    seconds: float | None = None
    notes: tuple[Note, ...] = ()


def refuse_run(error: PoseError) -> ControllerRun:
    """Return the run of a trajectory that a controller can't run: its program is refused for a reason."""

    def make_program(forced: str | None, tolerance: float) -> Writer:
        raise error

    return ControllerRun(make_program)


@dataclass(frozen=True)
class Controller:
    """A controller that parakin writes programs for.

    title : its name for people
    interpolation : what it moves evenly between two records, the tool's ``pose`` or the ``joints``
    build_run : from a trajectory, how the controller runs it
    suffix : of a program's file
    """

    title: str
    interpolation: Interpolation
    build_run: Callable[[Trajectory], ControllerRun]
    suffix: str = ".ngc"
