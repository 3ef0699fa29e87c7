"""A tool path on a machine: poses, joints, and the limits they break."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arrays import Array, Progress
from ...errors import PoseError
from ...machine import Machine
from ..path import Note, ToolPath
from .frames import compose_frames, compute_poses
from .offences import judge_path
from .path_samples import sample_path
from .posted import Posted
from .tool_lengths import fit_tool_lengths
from .working_mode import follow_working_mode, list_candidate_modes


def post_path(
    machine: Machine,
    path: ToolPath,
    *,
    workpiece: Array | None = None,
    mode: str | None = None,
    progress: Progress | None = None,
) -> Posted:
    """Compute the joints for every record of a tool path, and find what keeps the machine from following it.

    Parameters
    ----------
    machine, path : as from :func:`parakin.load` and a reader of tool paths
    workpiece : transform (3, 4), mm, as from :func:`parakin.workpiece`; it is applied after the frame that the path
        itself brings: M ← workpiece ← path.frame ← W
    mode : working mode, one of ``machine.modes``; None: the default one, or that with head and table's other sign if
        fewer records break a limit in it, or as many and fewer motions in feed turn a joint by more than 90°
    progress : called now and then with the fraction done, 0 to 1

    Turns of joints are counted: see :func:`~.working_mode.follow_working_mode`.

    Raises :class:`PoseError` for an invalid workpiece, an unknown mode, or a motion of thousands of turns. A record
    that can't be reached raises nothing: it is an offence of the result.
    """
    report = progress or (lambda fraction: None)
    if workpiece is not None and (np.shape(workpiece) != (3, 4) or not np.isfinite(workpiece).all()):
        raise PoseError("workpiece: a transform of shape (3, 4) expected")
    path = fit_tool_lengths(machine, path, workpiece=workpiece)
    frame = compose_frames(workpiece, path.frame)
    poses, path_limits = compute_poses(machine, path.tip, path.axis, frame, path.turns, path.exact)
    report(0.3)
    best, fewest = None, (0, 0)
    candidates = list_candidate_modes(machine, mode)
    sampled = sample_path(machine, path, frame, candidates[0], poses)
    for candidate in candidates:
        solution = follow_working_mode(machine, path, sampled, candidate)
        report(0.7)
        judgement = judge_path(machine, solution.poses, solution.joints, path.line, candidate, path_limits)
        faults = (int(np.count_nonzero(judgement.broken)), solution.wide_turns)
        if best is None or faults < fewest:
            best, fewest = (solution, judgement), faults
        if faults == (0, 0):
            break
    assert best is not None
    solution, judgement = best
    report(1.0)
    return Posted(
        machine, _note_lost_turns(machine, path), solution.mode, frame, solution.poses, solution.joints,
        judgement.broken, judgement.limits, judgement.offences, judgement.first, judgement.worst,
    )  # fmt: skip


def _note_lost_turns(machine: Machine, path: ToolPath) -> ToolPath:
    """Add a note to a path that turns the tool about its own axis if the machine has no turn to do so."""
    if path.turns is None or machine.turning_columns:
        return path
    turned = np.flatnonzero(np.abs(np.diff(path.turns, axis=0)).max(1, initial=0.0) > 0.0)
    text = f"A, B or C turns the tool, and {machine.name} can't: left out where it turns about the tool's own axis"
    if not len(turned) or any(note.text == text for note in path.notes):
        return path
    return replace(path, notes=(*path.notes, Note(int(path.line[turned[0] + 1]), text)))
