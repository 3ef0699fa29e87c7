"""Insert records into a posted path, so that a controller's interpolation keeps the tool on the programmed path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arrays import Array, Flags, Indices, Progress
from ...errors import PoseError
from ..path import Note, ToolPath
from ..posting.posted import Posted
from ..programmed_path import ProgrammedPath
from ..timing.corners import check_tolerance
from .deviation import ALLOWED, SHARES, Deviation, Interpolation
from .path_cuts import PathCuts, PathPositions, find_cuts, select_spans
from .path_records import divide_motions, repost_path
from .pole_passes import lead_through_poles
from .pole_swings import note_swings_of_passes

_GLANCE: Array = np.array([0.31, 0.67])  # of a motion: neither a bulge nor an S hides from both, nor whole turns
_EVIDENT = 0.2  # of the tolerance: where no more is measured at _GLANCE, the whole motion keeps to the tolerance
_UNMOVED = 1e-12  # mm and rad: what is rounding
_ROUNDS = 12
_MOTIONS_AT_ONCE = 1 << 16


def linearise_path(
    posted: Posted,
    under: Interpolation,
    *,
    chord: float = 0.01,
    angle: float = 1e-3,
    progress: Progress | None = None,
) -> Posted:
    """Insert the fewest records into a posted path that keep the tool on the programmed path between them.

    Parameters
    ----------
    posted : as from :func:`~..posting.post.post_path`
    under : what the controller moves evenly from record to record: ``pose``, every coordinate of the pose, or
        ``joints``, every joint
    chord, angle : mm and rad that the tool's tip and axis may be off: see :class:`~.deviation.Deviation`
    progress : called now and then with the fraction done, 0 to 1

    Rapid motions are kept to their lines too. An inserted record stands on the programmed path, with the line and feed
    of the record that its motion leads to, and is posted again; every motion of the result is then measured anew. A
    motion to or from a record that the machine can't reach is left as it is, for it is an offence already; one that
    leads out of reach in between gets one record there, an offence of the result.

    A pass of the tool's axis over a pole, where a turning axis of head, table or (under ``pose``) C is free, is led
    through the pole itself if the axis misses it by less than the tolerance, and the angle does not swing then: see
    :func:`~.pole_passes.lead_through_poles`. A pass on which it swings by more than 45° gets a note of the path.

    Raises :class:`PoseError` for an invalid tolerance, for a motion between opposite tool axes, and for one that can't
    be kept however many records are inserted; the last two name their line.
    """
    check_tolerance(chord, "chord")
    check_tolerance(angle, "angle")
    if under not in ("pose", "joints"):
        raise PoseError(f"under: 'pose' or 'joints' expected, not {under!r}")
    report = progress or (lambda fraction: None)
    deviation = Deviation(posted.machine, ProgrammedPath(posted.path, posted.frame), under, chord, angle)
    led = lead_through_poles(deviation, posted, np.flatnonzero(find_sound_motions(posted)))
    posted, positions = led.posted, led.positions
    doubtful = find_sound_motions(posted)
    for attempt in range(_ROUNDS):
        deviating = find_deviating_motions(deviation, posted, positions, np.flatnonzero(doubtful))
        report(1.0 - 0.5 ** (attempt + 1))
        if not len(deviating):
            report(1.0)
            swings = [*led.notes, *note_swings_of_passes(led.passes, posted, positions)]
            return _add_notes(posted, swings)
        cuts = _cut_motions(deviation, posted, positions, deviating)
        before, posted = posted, repost_path(posted, divide_motions(posted.path, cuts.motion, cuts.share))
        positions = positions.insert(cuts.motion, cuts.share)
        doubtful = _find_changed_motions(before, posted, cuts.motion) & find_sound_motions(posted)
    raise _make_hopeless_error(posted.path, int(deviating[0]))


def find_deviating_motions(deviation: Deviation, posted: Posted, positions: PathPositions, motion: Indices) -> Indices:
    """Find the motions, among some of a posted path, on which the tool leaves the tolerances."""
    deviating = [np.empty(0, np.int64)]
    for start in range(0, len(motion), _MOTIONS_AT_ONCE):
        block = motion[start : start + _MOTIONS_AT_ONCE]
        block = block[deviation.measure_spans(select_spans(posted, positions, block), _GLANCE) > _EVIDENT]
        measured = deviation.measure_spans(select_spans(posted, positions, block), SHARES)
        deviating.append(block[measured > ALLOWED])
    return np.concatenate(deviating)


def _cut_motions(deviation: Deviation, posted: Posted, positions: PathPositions, motion: Indices) -> PathCuts:
    """Cut motions that leave the tolerances; in the middle where the search finds no cut."""
    cuts = find_cuts(deviation, posted, positions, motion)
    if len(cuts.stuck):
        raise _make_hopeless_error(posted.path, int(cuts.stuck.min()))
    uncut = np.setdiff1d(motion, cuts.motion)
    motions, shares = np.concatenate([cuts.motion, uncut]), np.concatenate([cuts.share, np.full(len(uncut), 0.5)])
    return PathCuts.sort(motions, shares, cuts.stuck)


def _make_hopeless_error(path: ToolPath, record: int) -> PoseError:
    line = int(path.line[record])
    return PoseError(f"{path.source}:{line}: no number of points keeps the tool within its tolerances")


def _add_notes(posted: Posted, notes: list[Note]) -> Posted:
    """Add notes to the path, but none on a pole pass that has one already."""
    known = {(note.line, _find_subject(note)) for note in posted.path.notes}
    new = tuple(note for note in notes if (note.line, _find_subject(note)) not in known)
    return replace(posted, path=replace(posted.path, notes=(*posted.path.notes, *new))) if new else posted


def _find_subject(note: Note) -> str:
    """Find which pole and angle a note on a swing is about; empty for another note."""
    return note.text.partition("beside")[2].partition(" swings")[0]


def find_sound_motions(posted: Posted) -> Flags:
    """Find the motions (n,), by the record they lead to, both ends of which are reachable."""
    reachable: Flags = np.isfinite(posted.poses.sum(axis=1) + posted.joints.sum(axis=1))
    return np.concatenate([np.zeros(min(len(reachable), 1), np.bool_), reachable[1:] & reachable[:-1]])


def _find_changed_motions(before: Posted, after: Posted, motion: Indices) -> Flags:
    """Find the motions (n,) of a path that changed when records were inserted into some motions of the one before."""
    count = len(before.path)
    kept = np.cumsum(np.bincount(motion, minlength=count)) + np.arange(count)  # where the old records are now
    same = _find_same_rows(after.poses[kept], before.poses) & _find_same_rows(after.joints[kept], before.joints)
    changed = np.ones(len(after.path), bool)
    changed[kept[1:]] = (np.diff(kept) > 1) | ~(same[1:] & same[:-1])
    return changed


def _find_same_rows(rows: Array, others: Array) -> Flags:
    """Find rows (n, k) that are those of others; a row with NaN is not."""
    same: Flags = np.ones(len(rows), np.bool_)
    for column in range(rows.shape[1]):
        same &= np.abs(rows[:, column] - others[:, column]) < _UNMOVED
    return same
