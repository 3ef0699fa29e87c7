"""The tools of a G-code program with the lengths in force: by tool length offsets, or by the tool table."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...path import ToolUse
from ..tools import ToolLog
from .offsets import LengthOffset

_SAME_LENGTH = 1e-6  # mm


def list_tool_uses(
    log: ToolLog, offsets: Sequence[LengthOffset], table: Mapping[int, float] | None
) -> tuple[ToolUse, ...]:
    """List the tools of a program, one more wherever the length in force changes.

    Where the program switches offsets of known length (G43), a point is given for the length in force, zero without
    one. Under tool centre point control (G43.4), and where no offset is known, it is the tip of the tool itself, whose
    length the table tells.
    """
    if any(offset.keeps_tip for offset in offsets):
        return tuple(_take_tip_length(use, offsets, table) for use in _list_changes(log))
    known = [offset for offset in offsets if not math.isnan(offset.length)]
    if not any(offset.length != 0.0 for offset in known):
        return log.list_uses(table if log.uses else None)
    uses = list[ToolUse]()
    changes = {use.record: use for use in _list_changes(log)}
    lengths = {offset.record: offset for offset in offsets}
    use, length = changes[0], LengthOffset(0, 0, 0.0, keeps_tip=False, from_table=True)
    for record in sorted({*changes, *lengths}):
        loaded = changes.get(record)
        use, length = loaded or use, lengths.get(record, length)
        data = {key: value for key, value in use.data.items() if key != "set_length"}
        if not math.isnan(length.length):
            data["set_length"] = length.length
        line = use.line if loaded is not None and use.line else length.line
        uses.append(ToolUse(record, line, data, loaded is not None and use.changed, length.from_table, length.line))
    return tuple(uses)


def find_other_lengths(
    uses: Sequence[ToolUse], cuts: NDArray[np.bool_], find_length: Callable[[float], float]
) -> Iterator[tuple[int, str]]:
    """Find the tools that an offset gives another length than their own; yield line and remark.

    Rapid motions without an offset are the rule between a tool's change and its G43, cuts without one are not.

    cuts : of each record whether it is a cut
    find_length : of a tool's number its own length, NaN if not known
    """
    ends = [use.record for use in uses[1:]] + [len(cuts)]
    for use, end in zip(uses, ends, strict=False):
        number, given = use.data.get("number"), use.data.get("set_length")
        if not isinstance(number, float) or not isinstance(given, float) or not (given or cuts[use.record : end].any()):
            continue
        own = find_length(number)
        if abs(own - given) > _SAME_LENGTH:
            fate = f"goes with an offset of {given:g} mm" if given else "cuts without an offset"
            yield max(use.line, use.length_line), f"tool {number:g} {fate}, and not with its own, {own:g} mm"


def _list_changes(log: ToolLog) -> list[ToolUse]:
    """List the tools of a log, with one at the first record."""
    return log.uses if log.uses and log.uses[0].record == 0 else [ToolUse(0, 0, {}), *log.uses]


def _take_tip_length(use: ToolUse, offsets: Sequence[LengthOffset], table: Mapping[int, float] | None) -> ToolUse:
    """Give a tool the length of the first offset of tool centre point control after its change, or the table's."""
    own = next((offset for offset in offsets if offset.keeps_tip and offset.record >= use.record), None)
    number = use.data.get("number")
    if own is not None and not math.isnan(own.length):
        data = {**use.data, "set_length": own.length}
        return use._replace(data=data, from_table=own.from_table, length_line=own.line)
    if table is not None and isinstance(number, float) and table.get(int(number)):
        return use._replace(data={**use.data, "set_length": float(table[int(number)])}, from_table=True)
    return use
