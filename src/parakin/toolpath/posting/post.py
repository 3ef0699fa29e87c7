"""A tool path on a machine: poses, joints, and the limits they break."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...errors import PoseError
from ...machine import Machine
from ..path import Floats, Note, ToolPath
from .frames import compose_frames, compute_poses
from .offences import judge_path
from .posted import Posted
from .working_mode import choose_branch, list_candidate_modes

Progress = Callable[[float], None]


def post_path(
    machine: Machine,
    path: ToolPath,
    *,
    workpiece: Floats | None = None,
    mode: str | None = None,
    progress: Progress | None = None,
) -> Posted:
    """Joints for every record of a tool path, and what keeps the machine from following it.

    Parameters
    ----------
    machine, path : as from :func:`parakin.load` and a reader of tool paths
    workpiece : transform (3, 4), mm, as from :func:`parakin.workpiece`; it is applied after the frame that the path
        itself brings: M ← workpiece ← path.frame ← W
    mode : working mode, one of ``machine.modes``; None: the default one, or that with head and table's other sign if
        fewer records break a limit in it, or as many and fewer motions in feed turn a joint by more than 90°
    progress : called now and then with the fraction done, 0 to 1

    Turns of joints are counted, and taken back in rapid motions where they have to be: see
    :func:`~.working_mode.choose_branch`.

    Raises :class:`PoseError` for a workpiece that is no transform, an unknown mode, or a motion of thousands of turns.
    A record that can't be reached raises nothing: it is an offence of the result.
    """
    say = progress or (lambda fraction: None)
    if workpiece is not None and (np.shape(workpiece) != (3, 4) or not np.isfinite(workpiece).all()):
        raise PoseError("workpiece: a transform of shape (3, 4) expected")
    frame = compose_frames(workpiece, path.frame)
    poses, own = compute_poses(machine, path.tip, path.axis, frame, path.turns)
    say(0.3)
    best, fewest = None, (0, 0)
    for tried in list_candidate_modes(machine, mode):
        taken = choose_branch(machine, path, poses, tried)
        say(0.7)
        found = judge_path(machine, taken.poses, taken.joints, path.line, tried, own)
        wrong = (int(np.count_nonzero(found.broken)), taken.flips)
        if best is None or wrong < fewest:
            best, fewest = (taken, found), wrong
        if wrong == (0, 0):
            break
    assert best is not None
    taken, found = best
    say(1.0)
    path = _noted(machine, path)
    return Posted(
        machine, path, taken.mode, frame, taken.poses, taken.joints,
        found.broken, found.limits, found.offences, found.first, found.worst, rewinds=taken.rewinds,
    )  # fmt: skip


def _noted(machine: Machine, path: ToolPath) -> ToolPath:
    """The path with a note if it turns the tool about its own axis, and the machine has no turn to do so."""
    if path.turns is None or {"A", "B", "C"} & set(machine.axes):
        return path
    turned = np.flatnonzero(np.abs(np.diff(path.turns, axis=0)).max(1, initial=0.0) > 0.0)
    note = f"A, B or C turns the tool, and {machine.name} can't: left out where it turns about the tool's own axis"
    if not len(turned) or any(known.text == note for known in path.notes):
        return path
    return replace(path, notes=(*path.notes, Note(int(path.line[turned[0] + 1]), note)))
