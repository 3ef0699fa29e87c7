"""The job of ``parakin post``: a part placed, rewound where that is allowed, and prepared."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from math import isfinite
from typing import TYPE_CHECKING, Literal, NamedTuple

from ..controllers import Target, load_controller
from ..errors import InputError
from .region_options import parse_length
from .workpiece import parse_bounds

if TYPE_CHECKING:
    from ..arrays import Array
    from ..controllers.controller import ControllerRun
    from ..machine import Machine
    from ..toolpath.job import Job, Tolerances
    from ..toolpath.linearise.deviation import Interpolation
    from ..toolpath.linearise.rewinds import Rewind
    from ..toolpath.path import ToolPath
    from ..toolpath.placing.placement import Placement
    from ..toolpath.turned_job import TurnedJob
    from .console import ProgressBar


@dataclass(frozen=True)
class JobOptions:
    """The options that say how a part is prepared; ``rewind`` and ``clearance`` are mm."""

    mode: str | None
    tolerances: Tolerances
    target: Target | None
    corners: Literal["round", "stop"]
    rewind: float | None
    clearance: float | None
    turn: Literal["home", "free"] = "home"

    @property
    def interpolation(self) -> Interpolation:
        """What the controller moves evenly."""
        return load_controller(self.target).interpolation if self.target else "pose"

    @property
    def lean(self) -> float:
        """The rad by which the path's axis may be moved when it is led through poles."""
        return self.tolerances.share_with_interpolation(self.interpolation).axis

    @property
    def rewinds(self) -> bool:
        """Whether turns of a joint may be taken back."""
        return self.rewind is not None or self.clearance is not None


class PreparedPart(NamedTuple):
    """A job with the placement, rewinds and turn that were found for it, and how its controller runs it."""

    job: Job
    placement: Placement | None
    rewinds: tuple[Rewind, ...]
    run: ControllerRun | None
    turned: TurnedJob | None = None

    @property
    def controller_seconds(self) -> float | None:
        """What the controller takes with the program's waits, s; None where it takes as long as the trajectory."""
        seconds = None if self.run is None else self.run.seconds
        return None if seconds is None else seconds + self.job.waits


def check_clearance(rewind: float | None, clearance: float | None) -> None:
    """Raise :class:`InputError` for values that are none of their options."""
    if rewind is not None and not (rewind > 0.0 and isfinite(rewind)):
        raise InputError("expected a length above zero, in mm", "--rewind")
    if clearance is not None and not isfinite(clearance):
        raise InputError("expected a height, in mm", "--clearance")


def check_turn(machine: Machine, path: ToolPath, turn: Literal["home", "free"]) -> None:
    """Raise :class:`InputError` where the turn about the tool's axis is not free and should be chosen."""
    from ..toolpath.tool_turn.choice import find_refusal

    refusal = find_refusal(machine, path) if turn == "free" else ""
    if refusal:
        raise InputError(refusal, "--turn")


def prepare_part(
    machine: Machine,
    path: ToolPath,
    workpiece: Array | None,
    place: str | None,
    options: JobOptions,
    progress: ProgressBar,
) -> PreparedPart:
    """Prepare a part on a workpiece, or at the best placement within ``place`` at which the whole job runs.

    Placements in the mode with head and table's other sign are searched where it runs at none of those found first.
    Where it runs nowhere, it is prepared at the best of all.
    """
    if place is None:
        return _prepare_in_modes(machine, path, workpiece, options, progress)
    from ..toolpath.placing.placement import bound_near_home, find_placements
    from ..toolpath.tool_turn.turned_placement import find_turned_placements

    saying = progress.stage("placing the part", 0.1, 0.3)
    find = find_turned_placements
    if options.turn == "home":
        find = partial(find_placements, rewinds=options.rewinds, angle=options.lean)
    near = None if "=" in place else parse_length(place, "--place")
    bounds = parse_bounds(place) if near is None else bound_near_home(machine, path, near)
    prepared, modes = list[PreparedPart](), [options.mode]
    while modes:
        mode = modes.pop()
        placements = find(machine, path, bounds, mode=mode, progress=saying)
        for placement in placements:
            prepared_part = _prepare_at(machine, path, placement.workpiece, placement.mode, options, progress)
            prepared_part = prepared_part._replace(placement=placement)
            if prepared_part.job.runs:
                return prepared_part._replace(placement=placement.measure(prepared_part.job.posted))
            prepared.append(prepared_part)
        if mode is None:
            searched = {placement.mode for placement in placements}
            modes = [other for other in machine.head_modes(machine.mode) if other not in searched]
    return prepared[0]


def _prepare_in_modes(
    machine: Machine, path: ToolPath, workpiece: Array | None, options: JobOptions, progress: ProgressBar
) -> PreparedPart:
    """Prepare a part in the mode asked for; without one, if it is rewound and does not run, in the other one, too."""
    prepared = _prepare_at(machine, path, workpiece, options.mode, options, progress)
    others = machine.head_modes(prepared.job.posted.mode)[1:] if options.mode is None and options.rewinds else []
    if prepared.job.runs or prepared.job.outside is not None or not others:
        return prepared
    in_other_mode = _prepare_at(machine, path, workpiece, others[0], options, progress)
    return in_other_mode if in_other_mode.job.runs else prepared


def _prepare_at(
    machine: Machine,
    path: ToolPath,
    workpiece: Array | None,
    mode: str | None,
    options: JobOptions,
    progress: ProgressBar,
) -> PreparedPart:
    from ..toolpath.job import Job, prepare
    from ..toolpath.turned_job import prepare_turned

    controller = load_controller(options.target) if options.target else None
    rewinds: tuple[Rewind, ...] = ()
    if options.rewinds:
        from ..toolpath.linearise.rewinds import Clearance, rewind_path

        clearance = Clearance(options.rewind, options.clearance)
        rewound = rewind_path(machine, path, clearance, workpiece=workpiece, mode=mode, angle=options.lean)
        path, rewinds, mode = rewound.path, rewound.rewinds, rewound.mode
    prepare_job = partial(
        prepare_turned if options.turn == "free" else prepare, machine, path, workpiece=workpiece, mode=mode,
        tolerances=options.tolerances, interpolation=options.interpolation, corners=options.corners,
        progress=progress.stage("checking and timing", 0.3, 0.7),
    )  # fmt: skip
    prepared = prepare_job()
    job, turned = (prepared, None) if isinstance(prepared, Job) else (prepared.job, prepared)
    if controller is None or job.trajectory is None:
        return PreparedPart(job, None, rewinds, None, turned)
    run = controller.build_run(job.trajectory)
    path = replace(job.posted.path, notes=(*run.notes, *job.posted.path.notes))
    job = replace(job, posted=replace(job.posted, path=path))
    return PreparedPart(job, None, rewinds, run, turned)
