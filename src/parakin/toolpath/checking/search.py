"""Where motions break limits that their ends keep, by bracketing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...kinematics.wrist import FLIP
from ..path import Floats
from ..posting.posted import Posted
from .ledger import Jump, Ledger, Tally
from .motions import EITHER, Indices, Motions, Places
from .runs import blocks, unproved
from .sections import Flags, Parts, Prover

AT_ONCE = 1 << 13  # motions, or parts, cut together
MOST_CUTS = 1 << 16  # of one motion
_MOST = 1.5 * np.pi  # rad: farther from one end of a part to the other no joint goes but by a miscounted turn


class Search:
    """The bracketing of one path. Columns are the machine's limits, then ``turns``, ``singular`` and ``undecided``."""

    def __init__(self, posted: Posted):
        self.posted = posted
        self.motions = Motions(posted)
        self.prover = Prover(self.motions)
        self.limits = len(posted.machine.limits)
        self.turns, self.singular, self.undecided = (self.limits + i for i in range(3))
        self.floor = -self.prover.tolerance
        self.tallies = [Tally() for _ in range(self.limits + 3)]
        self.jump: Jump | None = None  # the first
        self.broken_motions = np.zeros(len(posted.path), np.int64)

    def run(self, say: Callable[[float], None]) -> None:
        """Check every motion; fills ``tallies`` and ``broken_motions``.

        ``broken_motions`` (n,) is 1 + the column of a limit that the motion to a record breaks, though its ends keep
        it.
        """
        count = len(self.posted.path)
        for records in blocks(count):
            left = unproved(self.prover, records, self.floor, whole=True)
            for start in range(0, len(left), AT_ONCE):
                self._examine(left[start : start + AT_ONCE])
            say(min(1.0, (records[-1] + 1) / count))

    def whole(self, motion: Indices) -> Parts:
        """Whole motions."""
        n = len(motion)
        ends = self.motions.at_records(motion - 1), self.motions.at_records(motion)
        return Parts(np.arange(n), motion, np.zeros(n), np.ones(n), *ends)

    def between(self, parts: Parts, share: Floats) -> Places:
        """Places within parts, the joints going on from those at their ends."""
        q0, q1 = parts.start.joints, parts.end.joints
        part = ((share - parts.a) / (parts.b - parts.a))[:, None]
        guess = np.where(np.isfinite(q1), q0 + part * (q1 - q0), q0)
        s0, s1 = parts.start.sign, parts.end.sign
        sign = np.where(s0 == EITHER, s1, np.where((s1 == EITHER) | (s1 == s0), s0, EITHER))
        return self.motions.at(parts.motion, share, guess, sign.astype(np.int8))

    def _examine(self, motion: Indices) -> None:
        """Bracket motions until everything that their ends keep is proved of them, or found broken."""
        motion = motion[self.reached(motion - 1) & self.reached(motion)]
        parts = self.whole(motion)
        across = Motions.over_the_pole(parts.start, parts.end)
        need = np.ones((len(parts), self.limits + 3), bool)
        need[:, self.undecided] = False
        need[:, : self.limits] = (parts.start.margins >= 0.0) & (parts.end.margins >= 0.0)
        need[:, : self.limits] &= ~(across[:, None] & self.motions.of_serial)
        ledger = Ledger.of(need)
        stack = [(parts, ledger.need.copy())]  # the last ones first: little is kept
        while stack:
            parts, still = stack.pop()
            if len(parts) > AT_ONCE:
                half = np.arange(len(parts)) < len(parts) // 2
                stack += [(parts.take(~half), still[~half]), (parts.take(half), still[half])]
                continue
            self._prove(parts, still, ledger)
            fine = self.prover.finest(parts)
            self._jumps(parts.take(fine & still[:, self.turns]), ledger)
            going = (still & ledger.need[parts.number]).any(1) & ~fine
            self._spend(parts.number[going], ledger)
            going &= ledger.need[parts.number].any(1)
            parts, still = parts.take(going), still[going]
            if len(parts):
                share = 0.5 * (parts.a + parts.b)
                there = self.between(parts, share)
                self._see(parts, share, there.margins, ledger)
                stack.append((parts.halved(share, there), np.tile(still, (2, 1))))
        self._count(motion, ledger)

    def _prove(self, parts: Parts, still: Flags, ledger: Ledger) -> None:
        """Leave in ``still`` what is not proved of parts."""
        bounds = self.prover.over(parts)
        still &= ledger.need[parts.number]
        still[:, : self.limits] &= ~(bounds.least >= self.floor)
        still[:, self.turns] &= ~bounds.counted
        rows = np.flatnonzero(still[:, self.singular])
        some = parts.take(rows)
        still[rows, self.singular] = ~self.prover.regular(some)
        rows, some = rows[still[rows, self.singular]], some.take(still[rows, self.singular])
        passed = self.passed(self.motions.sides(some.start), self.motions.sides(some.end))
        ledger.found(some.number[passed], self.singular, some.b[passed])

    def _spend(self, number: Indices, ledger: Ledger) -> None:
        """Count the cuts of motions, and give up those that are cut too often."""
        np.add.at(ledger.cuts, number, 1)
        spent = np.flatnonzero((ledger.cuts > MOST_CUTS) & ledger.need.any(1))
        ledger.found(spent, self.undecided, np.ones(len(spent)))
        ledger.need[spent] = False

    def reached(self, records: Indices) -> Flags:
        return np.asarray(np.isfinite(self.posted.joints[records]).all(1))

    def _jumps(self, parts: Parts, ledger: Ledger) -> None:
        """Whether joints jump on parts that can't be cut."""
        change = parts.end.joints - parts.start.joints
        for i in self.motions.turning:
            for row in np.flatnonzero(np.abs(change[:, i]) > _MOST).tolist():
                self._found_jump(parts, row, i, float(change[row, i]), None, ledger)
        if self.motions.wrist is None:
            return
        first, second = self.motions.wrist.pair
        for row in np.flatnonzero(Motions.over_the_pole(parts.start, parts.end)).tolist():
            beside = 0.5 * abs(float(change[row, second]))
            if beside > FLIP:
                self._found_jump(parts, row, first, float(change[row, first]), beside, ledger)

    def _found_jump(self, parts: Parts, row: int, joint: int, by: float, beside: float | None, ledger: Ledger) -> None:
        motion = int(parts.motion[row])
        if self.jump is None or motion < self.jump.motion:
            told = float(self.posted.joints[motion, joint] - self.posted.joints[motion - 1, joint])
            self.jump = Jump(motion, float(parts.b[row]), joint, by, told, beside)
        ledger.found(parts.number[[row]], self.turns, parts.b[[row]])

    def _see(self, parts: Parts, share: Floats, margins: Floats, ledger: Ledger) -> None:
        """What places within parts tell."""
        nothing = np.isnan(margins)
        beyond = margins < self.floor
        beyond[nothing.any(1) & ~beyond.any(1), :1] = True
        margins = np.where(nothing, -np.inf, margins)
        beyond &= ledger.need[parts.number, : self.limits]
        for column in np.flatnonzero(beyond.any(0)).tolist():
            rows = np.flatnonzero(beyond[:, column])
            ledger.found(parts.number[rows], column, share[rows])
            self.tallies[column].see(parts.motion[rows], share[rows], margins[rows, column])
        lost = parts.number[nothing.any(1)]  # where a leg can't close, nothing else can be asked for
        ledger.need[lost] = False
        ledger.broken[lost, self.singular] = False

    def _count(self, motion: Indices, ledger: Ledger) -> None:
        for column in np.flatnonzero(ledger.broken.any(0)).tolist():
            rows = np.flatnonzero(ledger.broken[:, column])
            tally = self.tallies[column]
            tally.count += len(rows)
            if tally.motion < 0:
                tally.motion, tally.share = int(motion[rows[0]]), float(ledger.share[rows[0], column])
            fresh = motion[rows][self.broken_motions[motion[rows]] == 0]
            self.broken_motions[fresh] = 1 + column

    def passed(self, one: Floats, two: Floats) -> Flags:
        """Where two determinants tell of a singularity between their places, or next to one of them."""
        near = self.motions.next_to_singular
        with np.errstate(invalid="ignore"):
            return np.asarray((one * two < 0.0) | (np.abs(one) <= near) | (np.abs(two) <= near))
