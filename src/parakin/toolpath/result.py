"""A tool path on a machine: what came in, the joints that follow, what breaks a limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..machine import Machine
from .program import Floats, ToolPath


@dataclass(frozen=True)
class Offence:
    """One limit broken at one record.

    limit : the limit's name, as in :attr:`Machine.limits`, or one of the path's own: ``tilt``, ``X``, ``Y``, ``Z``
    text : one line without its place: ``leg d2 would be 1,533.2 mm, limit 1,520``
    record : 0-based
    line : the record's source line
    value : of the bounded quantity, mm or rad (``unit``); NaN where it does not exist
    bound : in the same unit
    unit : ``mm`` or ``rad``; ``1`` for a pure number
    excess : how far the value lies beyond the bound, in the same unit; infinite where there is no value
    count : how many records break this limit
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
    offences : one for each broken limit, at its worst record; in the order of the first records that break them
    first : the first record that breaks any limit
    worst : of ``offences``, the one farthest off: a pose that can't be reached at all, else the greatest excess as a
        share of the limit's range
    """

    machine: Machine
    path: ToolPath
    mode: str
    frame: Floats
    poses: Floats
    joints: Floats
    broken: NDArray[np.int64]
    limits: tuple[str, ...]
    offences: tuple[Offence, ...]
    first: Offence | None
    worst: Offence | None

    @property
    def off(self) -> int:
        """How many records break a limit."""
        return int(np.count_nonzero(self.broken))
