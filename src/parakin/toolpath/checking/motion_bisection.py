"""Bisection of motions: each is halved until every limit that its ends keep is proved on it, or broken at a point."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Flags, Indices, Progress
from ...kinematics.wrist.pole_thresholds import FLIP
from ..posting.posted import Posted
from .ledger import Doubt, Jump, Ledger, Tally
from .margin_bounds import MotionProver
from .motion_runs import find_unproved_motions, split_into_blocks
from .motion_sections import Sections
from .motions import MotionPoints, PathMotions, find_pole_crossings, merge_wrist_modes

SECTIONS_AT_ONCE = 1 << 13
MOST_CUTS = 1 << 16  # greatest number of cuts of one motion; after them it stays undecided
PATH_CUTS, MOTION_CUTS = 1 << 18, 64  # of a path, and for each motion of it; then all that is left stays undecided
_STILL_TURNS = np.radians(1.0)  # a joint that turns by more on a section is what keeps it from being proved
_MOST_TURN = 1.5 * np.pi  # rad: only a joint whose turns are counted wrong goes farther on the shortest section


class MotionBisection:
    """The bisection of a posted path's motions.

    Columns are the machine's limits, then ``turns``, ``singular`` and ``undecided``.

    floor : (limits,) what a margin has to reach to count as kept
    tallies : one for each column
    jump : the first joint that can't go on from record to record
    doubt : of the first motion that was given up, what is not proved
    cuts_left : how many cuts the whole path may still take
    broken_motions : (n,) 1 + a column that the motion to a record breaks though its ends keep it, else zero
    """

    def __init__(self, posted: Posted):
        self.posted = posted
        self.motions = PathMotions(posted)
        self.prover = MotionProver(self.motions)
        self.limits = len(posted.machine.limits)
        self.turns, self.singular, self.undecided = (self.limits + i for i in range(3))
        self.floor = -self.prover.tolerance
        self.tallies = [Tally() for _ in range(self.limits + 3)]
        self.jump: Jump | None = None
        self.doubt: Doubt | None = None
        self.broken_motions = np.zeros(len(posted.path), np.int64)
        self.cuts_left = PATH_CUTS + MOTION_CUTS * len(posted.path)

    def check_motions(self, report: Progress) -> None:
        """Check every motion; fills ``tallies``, ``jump`` and ``broken_motions``."""
        count = len(self.posted.path)
        for records in split_into_blocks(count):
            unproved = find_unproved_motions(self.prover, records, self.floor, whole=True)
            for start in range(0, len(unproved), SECTIONS_AT_ONCE):
                self._bisect_motions(unproved[start : start + SECTIONS_AT_ONCE])
            report(min(1.0, (records[-1] + 1) / count))

    def select_motions(self, motion: Indices) -> Sections:
        """Return whole motions as sections."""
        n = len(motion)
        first, last = self.motions.get_record_points(motion - 1), self.motions.get_record_points(motion)
        return Sections(np.arange(n), motion, np.zeros(n), np.ones(n), first, last)

    def find_reachable(self, motion: Indices) -> Flags:
        """Find motions with joints at both ends."""
        joints = self.posted.joints
        return np.asarray(np.isfinite(joints[motion - 1]).all(1) & np.isfinite(joints[motion]).all(1))

    def compute_inner_points(self, sections: Sections, share: Array) -> MotionPoints:
        """Compute points within sections, at shares of their motions; joints go on from those at the ends."""
        q0, q1 = sections.first.joints, sections.last.joints
        fraction = ((share - sections.begin) / (sections.end - sections.begin))[:, None]
        guess = np.where(np.isfinite(q1), q0 + fraction * (q1 - q0), q0)
        wrist_modes = merge_wrist_modes(sections.first.wrist_modes, sections.last.wrist_modes)
        return self.motions.compute_points(sections.motion, share, guess, wrist_modes)

    def find_passed_singularities(self, one: Array, two: Array) -> Flags:
        """Find where determinants at two points tell of a parallel singularity between them, or next to one of them."""
        near = self.motions.singular_determinant
        with np.errstate(invalid="ignore"):
            return np.asarray((one * two < 0.0) | (np.abs(one) <= near) | (np.abs(two) <= near))

    def _bisect_motions(self, motion: Indices) -> None:
        """Halve motions until every limit that their ends keep is proved on them, broken, or given up."""
        motion = motion[self.find_reachable(motion)]
        sections = self.select_motions(motion)
        ledger = Ledger.open_for(self._list_proofs(sections))
        stack = [(sections, ledger.unproved.copy())]  # the last ones first: little is kept
        while stack:
            sections, unproved = stack.pop()
            if len(sections) > SECTIONS_AT_ONCE:
                half = np.arange(len(sections)) < len(sections) // 2
                stack += [(sections.select(rows), unproved[rows]) for rows in (~half, half)]
                continue
            self._prove_sections(sections, unproved, ledger)
            finest = self.prover.find_finest(sections)
            self._find_jumps(sections.select(finest & unproved[:, self.turns]), ledger)
            going = (unproved & ledger.unproved[sections.number]).any(1) & ~finest
            sections, unproved = sections.select(going), unproved[going]
            if self._count_cuts(sections, unproved, ledger):
                rows = np.flatnonzero(ledger.unproved[sections.number].any(1))
                sections, unproved = sections.select(rows), unproved[rows]
            if len(sections):
                share = sections.middle
                points = self.compute_inner_points(sections, share)
                self._mark_broken_limits(sections, share, points.margins, ledger)
                stack.append((sections.halve(share, points), np.tile(unproved, (2, 1))))
        self._tally_motions(motion, ledger)

    def _list_proofs(self, motions: Sections) -> Flags:
        """List what is to be proved of whole motions, (n, columns): all that both ends keep, turns, no singularity."""
        unproved = np.ones((len(motions), self.limits + 3), bool)
        unproved[:, self.undecided] = False
        unproved[:, : self.limits] = (motions.first.margins >= 0.0) & (motions.last.margins >= 0.0)
        over_pole = find_pole_crossings(motions.first, motions.last)
        unproved[:, : self.limits] &= ~(over_pole[:, None] & self.motions.wrist_limits)
        return unproved

    def _prove_sections(self, sections: Sections, unproved: Flags, ledger: Ledger) -> None:
        """Clear in ``unproved`` (n, columns) what is proved of sections, in place; note singularities passed."""
        bounds = self.prover.bound_sections(sections)
        unproved &= ledger.unproved[sections.number]
        unproved[:, : self.limits] &= ~(bounds.least >= self.floor)
        unproved[:, self.turns] &= ~bounds.counted
        rows = np.flatnonzero(unproved[:, self.singular])
        doubtful = sections.select(rows)
        unproved[rows, self.singular] = ~self.prover.prove_regular(doubtful)
        doubtful = doubtful.select(unproved[rows, self.singular])
        determinants = (
            self.motions.compute_determinants(doubtful.first),
            self.motions.compute_determinants(doubtful.last),
        )
        passed = self.find_passed_singularities(*determinants)
        ledger.mark_broken(doubtful.number[passed], self.singular, doubtful.end[passed])

    def _count_cuts(self, sections: Sections, unproved: Flags, ledger: Ledger) -> bool:
        """Count the cuts of motions; those cut too often stay undecided, and all where the path is: tell if any do."""
        np.add.at(ledger.cuts, sections.number, 1)
        self.cuts_left -= len(sections)
        given_up = np.flatnonzero(((ledger.cuts > MOST_CUTS) | (self.cuts_left < 0)) & ledger.unproved.any(1))
        if not len(given_up):
            return False
        rows = np.flatnonzero(np.isin(sections.number, given_up))
        if self.doubt is None and len(rows):
            rows = rows[sections.number[rows] == sections.number[rows].min()]
            self.doubt = self._find_doubt(sections.select(rows), unproved[rows])
        ledger.mark_broken(given_up, self.undecided, np.ones(len(given_up)))
        ledger.unproved[given_up] = False
        return True

    def _find_doubt(self, sections: Sections, unproved: Flags) -> Doubt:
        """Find what keeps sections of a motion from being proved: a joint that turns far, or a limit that is near."""
        turning = self.motions.turning_joints
        turn = np.abs(sections.last.joints - sections.first.joints)[:, turning]
        row, number = divmod(int(turn.argmax()), len(turning)) if turning else (0, -1)
        margins = np.minimum(sections.first.margins, sections.last.margins)
        left = np.where(unproved[:, : self.limits], margins, np.inf)
        near, column = divmod(int(left.argmin()), self.limits)
        turns = number >= 0 and turn[row, number] > _STILL_TURNS
        known = bool(np.isfinite(left[near, column]))
        return Doubt(
            int(sections.motion[0]),
            float(sections.begin[row if turns else near]),
            turning[number] if turns else None,
            float(turn[row, number]) if turns else 0.0,
            column if known else None,
            float(left[near, column]),
        )

    def _find_jumps(self, sections: Sections, ledger: Ledger) -> None:
        """Find turning joints that jump on sections too short to be cut."""
        change = sections.last.joints - sections.first.joints
        for i in self.motions.turning_joints:
            for row in np.flatnonzero(np.abs(change[:, i]) > _MOST_TURN).tolist():
                self._mark_jump(sections, row, i, float(change[row, i]), None, ledger)
        if self.motions.wrist is None:
            return
        first, second = self.motions.wrist.pair
        for row in np.flatnonzero(find_pole_crossings(sections.first, sections.last)).tolist():
            off_axis = 0.5 * abs(float(change[row, second]))
            if off_axis > FLIP:
                self._mark_jump(sections, row, first, float(change[row, first]), off_axis, ledger)

    def _mark_jump(
        self, sections: Sections, row: int, joint: int, change: float, off_axis: float | None, ledger: Ledger
    ) -> None:
        motion = int(sections.motion[row])
        if self.jump is None or motion < self.jump.motion:
            counted = float(self.posted.joints[motion, joint] - self.posted.joints[motion - 1, joint])
            self.jump = Jump(motion, float(sections.end[row]), joint, change, counted, off_axis)
        ledger.mark_broken(sections.number[[row]], self.turns, sections.end[[row]])

    def _mark_broken_limits(self, sections: Sections, share: Array, margins: Array, ledger: Ledger) -> None:
        """Note the limits that margins (n, limits) at shares within sections break."""
        missing = np.isnan(margins)
        beyond = margins < self.floor
        beyond[missing.any(1) & ~beyond.any(1), :1] = True
        margins = np.where(missing, -np.inf, margins)
        beyond &= ledger.unproved[sections.number, : self.limits]
        for column in np.flatnonzero(beyond.any(0)).tolist():
            rows = np.flatnonzero(beyond[:, column])
            ledger.mark_broken(sections.number[rows], column, share[rows])
            self.tallies[column].add_margins(sections.motion[rows], share[rows], margins[rows, column])
        unreachable = sections.number[missing.any(1)]  # where a leg can't close, nothing else can be proved
        ledger.unproved[unreachable] = False
        ledger.broken[unreachable, self.singular] = False

    def _tally_motions(self, motion: Indices, ledger: Ledger) -> None:
        """Count the broken motions of a ledger in the tallies."""
        for column in np.flatnonzero(ledger.broken.any(0)).tolist():
            rows = np.flatnonzero(ledger.broken[:, column])
            tally = self.tallies[column]
            tally.count += len(rows)
            if tally.motion < 0:
                tally.motion, tally.share = int(motion[rows[0]]), float(ledger.share[rows[0], column])
            fresh = motion[rows][self.broken_motions[motion[rows]] == 0]
            self.broken_motions[fresh] = 1 + column
