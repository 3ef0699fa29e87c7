"""A tool path on a machine: what came in, the joints that follow, what breaks a limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Indices
from ...machine import Machine
from ..path import ToolPath


@dataclass(frozen=True)
class Offence:
    """One limit broken at one record, or on the motion to it.

    limit : the limit's name, as in :attr:`Machine.limits`, one of the path's own: ``tilt``, ``X``, ``Y``, ``Z``, or of
        its motions: ``turns``, ``singularity``, ``untold``
    text : one line without its place: ``leg d2 would be 1,533.2 mm, limit 1,520``
    record : 0-based
    line : the record's source line
    value : of the bounded quantity, mm or rad (``unit``); NaN where it does not exist
    bound : in the same unit
    unit : ``mm`` or ``rad``; ``1`` for a pure number
    excess : how far the value lies beyond the bound, in the same unit; infinite where there is no value
    count : how many records break this limit; once the whole path is checked also the motions that break it between
        records which keep it
    share : where on the motion from the record before the value is: 1 at the record itself
    begins : from where on that motion the limit is broken; equal to ``share`` where it was not searched
    """

    limit: str
    text: str
    record: int
    line: int
    value: float
    bound: float
    unit: str
    excess: float
    count: int
    share: float = 1.0
    begins: float = 1.0


@dataclass(frozen=True, eq=False)
class Posted:
    """A tool path on a machine, n records. Lengths are mm, angles rad.

    machine, path : what came in
    mode : working mode of the inverse
    frame : (3, 4) rotation and origin of the workpiece frame W in the machine frame M
    poses : (n, axes) in M; C (and B, where it has no range of its own) without jumps over ±180°
    joints : (n, joints) as the machine takes them: turns counted, NaN where the legs can't close
    broken : (n,) 0 where the record is allowed, else 1 + the index in ``limits`` of the first limit it breaks
    limits : the machine's, then the path's own
    offences : one for each broken limit, at its worst record or place; in the order in which the path breaks them
    first : where the path first breaks any limit; on a motion with the motion's worst value
    worst : of ``offences``, the one farthest off: a pose that can't be reached at all, else the greatest excess as a
        fraction of the limit's range
    checked : the motions between the records are checked, too: see :func:`parakin.toolpath.checking.check.check_path`
    broken_motions : (n,) 0 where the motion to a record breaks nothing but what its ends break, else 1 + the index in
        ``limits`` of a limit that it does; None where ``checked`` is not
    """

    machine: Machine
    path: ToolPath
    mode: str
    frame: Array
    poses: Array
    joints: Array
    broken: Indices
    limits: tuple[str, ...]
    offences: tuple[Offence, ...]
    first: Offence | None
    worst: Offence | None
    checked: bool = False
    broken_motions: Indices | None = None

    @property
    def broken_record_count(self) -> int:
        """How many records break a limit."""
        return int(np.count_nonzero(self.broken))

    @property
    def broken_motion_count(self) -> int:
        """How many motions break a limit that the records at both their ends keep."""
        return 0 if self.broken_motions is None else int(np.count_nonzero(self.broken_motions))

    def __repr__(self) -> str:
        broken = len(self.offences)
        return f"<parakin posted path on {self.machine.name}: {len(self.path)} records, {broken} limits broken>"
