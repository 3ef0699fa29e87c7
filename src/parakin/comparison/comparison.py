"""Machines side by side: workspace, performance, accuracy, stiffness, and the time that a part takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TypeVar

import numpy as np

from ..accuracy.accuracy import Accuracy, analyse_accuracy
from ..accuracy.tolerances import Tolerance, read_tolerances
from ..arguments import check_arguments
from ..arrays import Array
from ..errors import PoseError
from ..machine import Machine
from ..performance.indices import Performance, compute_performance
from ..stiffness.stiffness import Stiffness, analyse_stiffness
from ..toolpath.job import Job, prepare
from ..toolpath.path import ToolPath
from ..toolpath.placing.placement import find_placements
from ..workspaces.certified.region import make_region
from ..workspaces.certified.workspace import Workspace, workspace
from ..workspaces.sampled.allowed_poses import SAMPLES, check_sample_count, sample_allowed_poses

_GAP = 0.03  # of the workspace's volume
_SECONDS = 10.0  # for a workspace

Answer = TypeVar("Answer")


@dataclass(frozen=True, eq=False)
class MachineFigures:
    """What is told of one machine; None for what was not asked for, and a reason for what it can't do.

    machine : the one that this is about
    workspace : at home's orientation
    performance : at poses all over the workspace, clear of singularities
    accuracy, stiffness : at the same poses
    job : the part at the best place found at which it runs
    """

    machine: Machine
    workspace: Workspace
    performance: Performance | str
    accuracy: Accuracy | str | None
    stiffness: Stiffness | str | None
    job: Job | str | None

    @property
    def reasons(self) -> dict[str, str]:
        """Why there is no answer, by what was asked."""
        answers = {"performance": self.performance, "accuracy": self.accuracy, "stiffness": self.stiffness}
        return {name: answer for name, answer in {**answers, "part": self.job}.items() if isinstance(answer, str)}

    def __repr__(self) -> str:
        return f"<parakin figures of {self.machine.name}>"


@dataclass(frozen=True, eq=False)
class Comparison:
    """Machines side by side.

    columns : the machines in their order
    """

    columns: tuple[MachineFigures, ...]

    def __repr__(self) -> str:
        return f"<parakin comparison of {', '.join(column.machine.name for column in self.columns)}>"


@check_arguments
def compare(
    machines: Sequence[Machine],
    *,
    tolerances: Sequence[tuple[str, str]] | None = None,
    drives: str | None = None,
    struts: Mapping[str, str] | str | None = None,
    path: ToolPath | None = None,
    samples: int = SAMPLES,
) -> Comparison:
    """Compare machines by their workspaces, indices, accuracy, stiffness, and the time that a part takes.

    machines : two or more
    tolerances : as for :func:`parakin.analyse_accuracy`; a machine leaves out those of which it has no number
    drives, struts : as for :func:`parakin.analyse_stiffness`: ``"100 N/um, 200 kNm/rad"``
    path : a part, which is placed anew on each machine, where its least margin is greatest; not turned
    samples : how many poses of each workspace are looked at

    Raises :class:`PoseError` for fewer than two machines, and for what none of them can do.
    """
    if len(machines) < 2:
        raise PoseError("machines: two at least expected")
    check_sample_count(samples)
    if struts is not None and drives is None:
        raise PoseError("struts: the drives' stiffness is missing")
    for tolerance in read_tolerances(tolerances) if tolerances is not None else ():
        if not any(_has(machine, tolerance) for machine in machines):
            raise PoseError(f"tolerance {tolerance.name}: none of the machines has such a number of this unit")
    columns = tuple(_measure(machine, tolerances, drives, struts, path, samples) for machine in machines)
    for name in ("performance", "accuracy", "stiffness"):
        answers = [getattr(column, name) for column in columns]
        if all(isinstance(answer, str) for answer in answers):
            raise PoseError(answers[0])
    return Comparison(columns)


def _measure(
    machine: Machine,
    tolerances: Sequence[tuple[str, str]] | None,
    drives: str | None,
    struts: Mapping[str, str] | str | None,
    path: ToolPath | None,
    samples: int,
) -> MachineFigures:
    volume = workspace(make_region(machine), _GAP, seconds=_SECONDS)
    poses = _answer(lambda: sample_allowed_poses(machine, samples))
    if isinstance(poses, str):
        return MachineFigures(machine, volume, poses, poses, poses, poses)
    own = [pair for pair in tolerances or () if _has(machine, read_tolerances([pair])[0])]
    return MachineFigures(
        machine,
        volume,
        _answer(lambda: compute_performance(machine, poses)),
        None if tolerances is None else _answer(lambda: analyse_accuracy(machine, own or tolerances, poses)),
        None if drives is None else _answer(lambda: analyse_stiffness(machine, drives, struts, poses)),
        None if path is None else _answer(lambda: _place(machine, path, poses)),
    )


def _answer(ask: Callable[[], Answer]) -> Answer | str:
    """Find the answer to a question, or say why there is none."""
    try:
        return ask()
    except PoseError as error:
        return str(error)


def _has(machine: Machine, tolerance: Tolerance) -> bool:
    """Tell whether a machine has a number of a tolerance's name and unit."""
    named = [p for p in machine.parameters if fnmatchcase(p.name, tolerance.name) or p.group == tolerance.name]
    return any(p.unit == tolerance.unit for p in named)


def _place(machine: Machine, path: ToolPath, poses: Array) -> Job:
    """Prepare a part at the best of the places at which it runs; about where the tool can be.

    Raises :class:`PoseError` where it runs at none.
    """
    columns = [i for i, axis in enumerate(machine.axes) if axis in "XYZ"]
    bounds = {machine.axes[i]: (float(np.min(poses[:, i])), float(np.max(poses[:, i]))) for i in columns}
    placements = find_placements(machine, path, bounds)
    for placement in placements:
        job = prepare(machine, path, workpiece=placement.workpiece, mode=placement.mode)
        if job.runs:
            return job
    raise PoseError(f"the part runs at none of {len(placements)} places: {placements[0].limit} is off limits")
