"""More records on a posted path, so that a controller's interpolation keeps the tool on the programmed one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...errors import PoseError
from ..path import Floats, Note, ToolPath
from ..posting.posted import Posted
from ..timing.corners import check_tolerance
from .cuts import Cuts, Places, cuts, parts_of
from .deviation import FOUND, SHARES, Tube, Under
from .interpolation import Flags, Indices, Programmed, denser
from .pole_passes import notes_of, posted_again, through_the_poles
from .rewinds import spelled_out

Progress = Callable[[float], None]
_GLANCE: Floats = np.array([0.31, 0.67])  # neither a bulge nor an S hides from both, nor whole turns
_EVIDENT = 0.2  # of the tolerance: where no more is found there, no more is to be feared between
_ROUNDS = 12
_BLOCK = 1 << 16  # motions


def linearise_path(
    posted: Posted, under: Under, *, chord: float = 0.01, angle: float = 1e-3, progress: Progress | None = None
) -> Posted:
    """A posted path with the fewest records added that keep the tool on the programmed path between them.

    Parameters
    ----------
    posted : as from :func:`~..posting.post.post_path`
    under : what the controller moves evenly from record to record: ``pose``, every coordinate of the pose, or
        ``joints``, every joint
    chord, angle : mm and rad that the tool's tip and axis may be off: see :class:`~.tube.Tube`
    progress : called now and then with the fraction done, 0 to 1

    Rapid motions are kept to their lines too. What is added stands on the programmed path, with the line and feed of
    the record that its motion leads to, and is posted again; every motion of the result is then looked at anew. A
    motion to or from a record that the machine can't take is left as it is, for it is an offence already; one that
    leads out of reach in between gets one record there, an offence of the result. Where a rapid motion turns back by
    whole turns, the turning itself is kept to under ``joints``.

    A pass of the tool's axis through a pole, where a turning axis of head, table or (under ``pose``) C is free, is led
    through the pole itself if the axis misses it by less than the tolerance, and the angle does not swing then: see
    :func:`~.through.through_the_poles`. A pass on which it swings by more than 45° is told by a note of the path.

    Raises :class:`PoseError` for an invalid tolerance, for a motion between opposite tool axes, and for one that
    can't be kept however many records are added; both with their line.
    """
    check_tolerance(chord, "chord")
    check_tolerance(angle, "angle")
    if under not in ("pose", "joints"):
        raise PoseError(f"under: 'pose' or 'joints' expected, not {under!r}")
    say = progress or (lambda fraction: None)
    posted = spelled_out(posted) if under == "joints" else posted
    path = posted.path
    tube = Tube(posted.machine, Programmed(path, posted.frame), under, chord, angle)
    through = through_the_poles(tube, posted, np.flatnonzero(_sound(posted)))
    posted, places = through.posted, through.places
    doubtful = _sound(posted)
    for attempt in range(_ROUNDS):
        off = exceeding(tube, posted, places, np.flatnonzero(doubtful))
        say(1.0 - 0.5 ** (attempt + 1))
        if not len(off):
            say(1.0)
            return _noted(posted, [*notes_of(through, posted, places), *_unkept(posted, under)])
        found = _cuts(tube, posted, places, off)
        before, posted = posted, posted_again(posted, denser(posted.path, found.motion, found.share))
        places = places.cut(found.motion, found.share)
        doubtful = _changed(before, posted, found.motion) & _sound(posted)
    raise _hopeless(posted.path, int(off[0]))


def exceeding(tube: Tube, posted: Posted, places: Places, motion: Indices) -> Indices:
    """Which of some motions of a posted path leave the tolerances."""
    found = [np.empty(0, np.int64)]
    for start in range(0, len(motion), _BLOCK):
        some = motion[start : start + _BLOCK]
        some = some[tube.worst(parts_of(posted, places, some), _GLANCE) > _EVIDENT]
        found.append(some[tube.worst(parts_of(posted, places, some), SHARES) > FOUND])
    return np.concatenate(found)


def _cuts(tube: Tube, posted: Posted, places: Places, motion: Indices) -> Cuts:
    """Cuts of motions that leave the tolerances; in the middle where the search finds none."""
    found = cuts(tube, posted, places, motion)
    if len(found.stuck):
        raise _hopeless(posted.path, int(found.stuck.min()))
    left = np.setdiff1d(motion, found.motion)
    motions, shares = np.concatenate([found.motion, left]), np.concatenate([found.share, np.full(len(left), 0.5)])
    order = np.lexsort((shares, motions))
    return Cuts(motions[order], shares[order], found.stuck)


def _hopeless(path: ToolPath, record: int) -> PoseError:
    line = int(path.line[record])
    return PoseError(f"{path.source}:{line}: no number of points keeps the tool within its tolerances")


def _noted(posted: Posted, notes: list[Note]) -> Posted:
    """With notes added, but those on a pass that has one already."""
    told = {(note.line, _subject(note)) for note in posted.path.notes}
    new = tuple(note for note in notes if (note.line, _subject(note)) not in told)
    return replace(posted, path=replace(posted.path, notes=(*posted.path.notes, *new))) if new else posted


def _unkept(posted: Posted, under: Under) -> list[Note]:
    """Notes on motions that turn back by whole turns: evenly moved joints lead the tip off its line there."""
    text = "the rapid motion turns back by whole turns, and the tool's tip leaves its line on it"
    return [Note(int(posted.path.line[record]), text) for record in posted.rewinds if under == "joints"]


def _subject(note: Note) -> str:
    return note.text.partition("beside")[2].partition(" swings")[0]


def _sound(posted: Posted) -> Flags:
    """(n,) records to which a motion leads that is looked at: both its ends can be taken, and it does not turn back
    by whole turns on it."""
    taken: Flags = np.isfinite(posted.poses.sum(axis=1) + posted.joints.sum(axis=1))
    sound = np.concatenate([np.zeros(min(len(taken), 1), np.bool_), taken[1:] & taken[:-1]])
    sound[list(posted.rewinds)] = False
    return sound


def _changed(before: Posted, after: Posted, motion: Indices) -> Flags:
    """(n,) motions that are not what they were before records were put into some."""
    count = len(before.path)
    stood = np.cumsum(np.bincount(motion, minlength=count)) + np.arange(count)
    same = _same(after.poses, before.poses, stood) & _same(after.joints, before.joints, stood)
    changed = np.ones(len(after.path), bool)
    changed[stood[1:]] = (np.diff(stood) > 1) | ~(same[1:] & same[:-1])
    return changed


def _same(rows: Floats, old: Floats, stood: Indices) -> Flags:
    off: Flags = np.zeros(len(old), np.bool_)
    for column in range(old.shape[1]):
        off |= ~(np.abs(rows[stood, column] - old[:, column]) < 1e-12)
    return ~off
