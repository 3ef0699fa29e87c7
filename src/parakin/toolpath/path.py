"""The neutral tool path: what every reader makes and every consumer takes."""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Event(NamedTuple):
    """A statement that is no motion: a stop, a tool change, coolant, a message.

    ``record`` is the index of the record that follows it, ``len(path)`` after the last one; ``line`` is 1-based.
    """

    record: int
    line: int
    text: str


class Note(NamedTuple):
    """A remark on the file for the user, at the first line it concerns (1-based; 0: the whole file)."""

    line: int
    text: str


@dataclass(frozen=True, eq=False)
class ToolPath:
    """A tool path as programmed, one record a tool position, n records.

    source : the file's name as the user gave it, for messages
    tip : (n, 3) mm, the tool tip in the workpiece frame W
    axis : (n, 3) unit vectors from the tip into the holder, in W
    line : (n,) int64, 1-based source line; points added on an arc or in a cycle carry its statement's line
    rapid : (n,) bool, the motion that ends at this record is in rapid
    feed : (n,) mm/min, the programmed feed in force, also on rapid records; NaN if none or unknown
    spindle : (n,) rev/min, NaN if unknown, 0 if switched off
    frame : (3, 4) rotation and origin (mm) of W in the machine frame M as the file gives it, or None
    dialect : "apt" (APT and CATIA), "nx" (Siemens NX) or "gcode" (RS274/NGC)
    units : the file's own length unit; everything here is in mm all the same
    tool : what is known of the first tool; lengths in mm: diameter, corner_radius, length; name, number, type ...
    events : statements that are no motion, in file order
    notes : remarks for the user, by line
    turns : (n, 3) rad, A, B, C as programmed, R = Rz(C)·Ry(B)·Rx(A) and axis = R·z; None where the file programs none
    seconds : (n,) s, the time the motion to this record takes where the file tells it and no feed does: by inverse time
        (G93), or by degrees per minute where only A, B and C move; NaN elsewhere, None where there is no such record
    """

    source: str
    tip: Floats
    axis: Floats
    line: NDArray[np.int64]
    rapid: NDArray[np.bool_]
    feed: Floats
    spindle: Floats
    frame: Floats | None = None
    dialect: Literal["apt", "nx", "gcode"] = "apt"
    units: Literal["mm", "inch"] = "mm"
    tool: dict[str, float | str] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    notes: tuple[Note, ...] = ()
    turns: Floats | None = None
    seconds: Floats | None = None

    def __len__(self) -> int:
        return len(self.line)
