"""The neutral tool path: every reader returns one, all further work starts from it, and records are inserted here."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np

from ..arrays import Array, Flags, Indices
from ..errors import quote


class Event(NamedTuple):
    """A statement without motion: a stop, a tool change, coolant, a message.

    record : the index of the record that follows it, ``len(path)`` after the last one
    line : 1-based
    text : as the file has it
    """

    record: int
    line: int
    text: str


class Note(NamedTuple):
    """A remark on the file for the user.

    line : the first one that it concerns, 1-based; 0: the whole file
    text : in one line
    """

    line: int
    text: str


class ToolUse(NamedTuple):
    """A tool, from a record on.

    record : the index of the first record with it
    line : where the file loads it, 1-based; 0 where it does not say
    data : what is known of it, as in :attr:`ToolPath.tool`; lengths in mm
    length_line : where the file tells its length, 0 where it does not
    changed : whether it is put into the spindle there; False for the file's first tool, and where only its length
        offset changes
    from_table : whether its set length is a tool table's, which goes before the file's
    length : mm that count, from the spindle's nose to the tip; NaN in a path as read
    """

    record: int
    line: int
    data: Mapping[str, float | str]
    changed: bool = False
    from_table: bool = False
    length_line: int = 0
    length: float = math.nan


@dataclass(frozen=True, eq=False)
class ToolPath:
    """A tool path as programmed, n records, each a tool position.

    source : the file's name as the user gave it, for messages
    tip : (n, 3) mm, the tool tip in the workpiece frame W
    axis : (n, 3) unit vectors from the tip into the holder, in W
    line : (n,) int64, 1-based source line; points added on an arc or in a cycle have the line of its statement
    rapid : (n,) bool, whether the motion that ends at this record is in rapid
    feed : (n,) mm/min, the programmed feed in force, also on rapid records; NaN if there is none or it is unknown
    spindle : (n,) rev/min, NaN if unknown, 0 if switched off
    frame : (3, 4) rotation and origin (mm) of W in the machine frame M as the file gives it, or None
    dialect : the CAM system that a CL file tells, "catia", "nx" (Siemens NX), "creo", "solidworks", "autodesk",
        "camplete" or "mastercam"; "apt" where it tells none; "gcode" (RS274/NGC)
    units : the file's own length unit; all lengths here are in mm
    tool : the known data of the first tool; lengths in mm: diameter, corner_radius, length of the cutter,
        body_length below the holder, set_length from the spindle's nose to the tip; name, number, type ...
    events : statements without motion, in file order
    notes : remarks for the user, by line
    turns : (n, 3) rad, A, B, C as programmed, R = Rz(C)·Ry(B)·Rx(A) and axis = R·z; None if the file programs none
    seconds : (n,) s, the time of the motion to this record where the file gives it in place of a feed: by inverse time
        (G93), or by degrees per minute where only A, B and C move; NaN elsewhere, None if there is no such record
    tools : all tools in the order of their records; empty where the file tells of none
    fitted_length : mm, the machine's own tool length that the path is fitted to: ``tip`` is then where the tip of a
        tool of that length has to be, and ``tools`` have the lengths that count; None for a path as read
    extension : (n,) mm, how much longer the tool is than ``fitted_length``: its own tip is at
        ``tip - extension * axis``; None where that is zero throughout
    exact : (n,) bool, whether the axis was computed, so that the least lean of it tells a direction, and not read, with
        the digits of a file; None where none was
    cutting_force : N on the tip wherever it cuts, along the machine's X, Y and Z; not in rapid. The feed keeps the
        drives' forces and powers with it
    """

    source: str
    tip: Array
    axis: Array
    line: Indices
    rapid: Flags
    feed: Array
    spindle: Array
    frame: Array | None = None
    dialect: Literal["apt", "catia", "nx", "creo", "solidworks", "autodesk", "camplete", "mastercam", "gcode"] = "apt"
    units: Literal["mm", "inch"] = "mm"
    tool: dict[str, float | str] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    notes: tuple[Note, ...] = ()
    turns: Array | None = None
    seconds: Array | None = None
    tools: tuple[ToolUse, ...] = ()
    fitted_length: float | None = None
    extension: Array | None = None
    exact: Flags | None = None
    cutting_force: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __len__(self) -> int:
        return len(self.line)

    def locate(self, record: int) -> str:
        """Name the place of a ``record``, 0-based, for messages: ``part.cls:12, record 3``."""
        return f"{self.source}:{int(self.line[record])}, record {record}"

    def __repr__(self) -> str:
        return f"<parakin tool path {quote(self.source)}: {len(self)} records, {self.dialect}>"


# What stands in a path once a record: its columns.
_COLUMNS = ("tip", "axis", "line", "rapid", "feed", "spindle", "turns", "seconds", "extension", "exact")


def insert_records(
    path: ToolPath, at: Indices, values: Mapping[str, Array | Indices | Flags | None], ahead: Indices | None = None
) -> ToolPath:
    """Insert m records into a path of n, before its records ``at`` (m,), ascending.

    Parameters
    ----------
    values : by name, columns of the new records, m rows each; None for one that the path does not have. In a column
        that is not named they are like the record they stand before, but no time is known of the motion to them
    ahead : (n + 1,) how many of the new records stand ahead of the events and tools at each old record, and at the
        end; by default all that are inserted before it
    """
    columns = {name: getattr(path, name) for name in _COLUMNS if getattr(path, name) is not None}
    new = {name: column[at] for name, column in columns.items()} | {"seconds": np.full(len(at), np.nan)} | dict(values)
    if ahead is None:
        ahead = np.searchsorted(at, np.arange(len(path) + 1), side="right")
    places = (np.arange(len(path) + 1) + ahead).tolist()
    return replace(
        path,
        **{name: np.insert(column, at, new[name], axis=0) for name, column in columns.items()},
        events=tuple(event._replace(record=places[event.record]) for event in path.events),
        tools=tuple(use._replace(record=places[use.record]) for use in path.tools),
    )


def select_records(path: ToolPath, records: Indices) -> ToolPath:
    """Select records of a path as positions: without the motions between them, their times, events, tools and notes."""
    columns = {name: getattr(path, name)[records] for name in _COLUMNS if getattr(path, name) is not None}
    return replace(path, **(columns | {"seconds": None}), events=(), notes=(), tools=())
