"""The tools of a file: what its statements say of each, from which record on, and the lengths that a table gives."""

from collections.abc import Mapping

from ..path import ToolUse
from .text import refuse

_LENGTHS = {"length", "body_length", "set_length"}
_SIZES = _LENGTHS | {"diameter", "corner_radius"}


class ToolLog:
    """Keep the tools of a file. Statements between the same two records speak of one tool."""

    def __init__(self) -> None:
        self.uses: list[ToolUse] = []
        self._group: dict[str, float | str] = {}  # what the statements since the last record say
        self._group_record = -1
        self._group_line = 0  # where they tell the tool's length

    @property
    def data(self) -> dict[str, float | str]:
        """What is known of the first tool."""
        return dict(self.uses[0].data) if self.uses else {}

    @property
    def diameter(self) -> float | None:
        """The diameter of the tool in use, mm; None where it is not known."""
        diameter = self.uses[-1].data.get("diameter") if self.uses else None
        return diameter if isinstance(diameter, float) and diameter > 0.0 else None

    def scale_lengths(self, factor: float) -> None:
        """Read the sizes told so far in another unit."""
        self._group = _scale_sizes(self._group, factor)
        self.uses = [use._replace(data=_scale_sizes(use.data, factor)) for use in self.uses]

    def tell(self, record: int, line: int, data: Mapping[str, float | str], *, loads: bool = False) -> bool:
        """Take what a statement before a record says of a tool; return whether it is another one than before.

        loads : whether the statement puts the tool into the spindle
        """
        lengths = _LENGTHS & data.keys()
        if any(float(data[key]) < 0.0 for key in _SIZES & data.keys()):
            refuse("a tool's length or diameter below zero")
        if record != self._group_record:
            self._group, self._group_record, self._group_line = {}, record, 0
        self._group |= data
        told_at = line if lengths else 0
        self._group_line = told_at or self._group_line
        if not self.uses:
            self.uses.append(ToolUse(record, line, dict(data), changed=loads and record > 0, length_line=told_at))
            return False
        use = self.uses[-1]
        if record == use.record or record == 0:
            self.uses[-1] = use._replace(
                line=line if loads else use.line, data={**use.data, **data}, length_line=told_at or use.length_line
            )
        elif self._is_another(use, data, loads=loads):
            self.uses.append(ToolUse(record, line, dict(self._group), changed=True, length_line=self._group_line))
            return True
        else:
            self.uses[-1] = use._replace(data={**data, **use.data}, length_line=use.length_line or told_at)
        return False

    def _is_another(self, use: ToolUse, data: Mapping[str, float | str], *, loads: bool) -> bool:
        if loads:
            return any(use.data.get(key) != value for key, value in data.items())
        return any(use.data.get(key, value) != value for key, value in data.items())

    def list_uses(self, table: Mapping[int, float] | None) -> tuple[ToolUse, ...]:
        """List the tools, with the lengths of a table in place of the file's.

        Refuses a tool that is not in the table, or has no length there while others have.
        """
        if table is None or not any(table.values()):  # as in a machine's own table, whose kinematics knows the length
            return tuple(self.uses)
        uses = []
        for use in self.uses:
            number = use.data.get("number")
            if not isinstance(number, float):
                refuse("a tool without a number, which the tool table can't tell; expected LOADTL/number", use.line)
            if number not in table:
                refuse(f"tool {number:g} is not in the tool table; expected its length there", use.line)
            if not table[int(number)]:
                refuse(f"tool {number:g} has length 0 in the tool table; expected it from the spindle's nose", use.line)
            uses.append(use._replace(data={**use.data, "set_length": float(table[int(number)])}, from_table=True))
        return tuple(uses)


def _scale_sizes(data: Mapping[str, float | str], factor: float) -> dict[str, float | str]:
    return {name: float(value) * factor if name in _SIZES else value for name, value in data.items()}
