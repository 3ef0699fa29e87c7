"""Files of design problems, YAML: a machine, its free numbers, a box of poses, and what is wanted."""

from __future__ import annotations

from os import fspath
from pathlib import Path
from typing import TYPE_CHECKING

from ..description.document import Value, YamlList, YamlMap, YamlText, read_document
from ..errors import InputError, InputErrors, PoseError, quote, suggest
from ..units import ANGLE, LENGTH, NUMBER, QuantityError, QuantityKind, parse_quantity
from .options import load_machine

if TYPE_CHECKING:
    from ..arrays import AxisRange
    from ..machine import Machine
    from ..synthesis.problem import DesignProblem

_KEYS = ("machine", "free", "box", "shift", "bounds", "strokes", "minimise")
_STROKES = ("keep", "fit")


def read_design_problem(path: Path) -> DesignProblem:
    """Read a design problem.

    Raises :class:`InputError` with file and line.
    """
    source = fspath(path)
    document, errors = read_document(path, source)
    if errors:
        raise InputErrors(errors)
    reader = _ProblemReader(source)
    top = reader.read_map(document, "a design problem", _KEYS)
    for key in ("machine", "free", "box", "minimise"):
        if key not in top:
            raise InputError(f"key {key} is missing", source, 1)
    return reader.make_problem(top)


class _ProblemReader:
    """Reads the values of a file, whose errors have its name and their line."""

    def __init__(self, source: str):
        self.source = source

    def fail(self, message: str, value: Value) -> InputError:
        return InputError(message, self.source, value.line)

    def read_map(self, value: Value, what: str, known: tuple[str, ...] = ()) -> YamlMap:
        if not isinstance(value, YamlMap):
            raise self.fail(f"{what}: a mapping expected", value)
        for key in value:
            if known and key not in known:
                raise self.fail(f"unknown key {quote(key)}{suggest(key, known)}", key)
        return value

    def read_text(self, value: Value, what: str) -> YamlText:
        if not isinstance(value, YamlText):
            raise self.fail(f"{what}: a word expected", value)
        return value

    def read_value(self, value: Value, what: str, kind: QuantityKind) -> float:
        try:
            return parse_quantity(self.read_text(value, what), kind)
        except QuantityError as error:
            raise self.fail(f"{what}: {error}", value) from None

    def read_range(self, value: Value, what: str, kind: QuantityKind) -> AxisRange:
        if not isinstance(value, YamlList) or len(value) != 2:
            raise self.fail(f"{what}: a range [low, high] expected", value)
        low, high = (self.read_value(end, what, kind) for end in value)
        if low > high:
            raise self.fail(f"{what}: a range that rises expected", value)
        return low, high

    def make_problem(self, top: YamlMap) -> DesignProblem:
        from ..synthesis.problem import QUANTITIES, DesignProblem

        machine = self._load(self.read_text(top["machine"], "machine"))
        numbers = {p.name: ANGLE if p.unit == "rad" else LENGTH for p in machine.parameters}
        free = self.read_map(top["free"], "free", tuple(numbers))
        shift = self.read_map(top["shift"], "shift") if "shift" in top else {}
        bounds = self.read_map(top["bounds"], "bounds", QUANTITIES) if "bounds" in top else {}
        strokes = self.read_text(top["strokes"], "strokes") if "strokes" in top else "keep"
        if strokes not in _STROKES:
            raise self.fail(f"strokes: {quote(strokes)}{suggest(strokes, _STROKES)}", top["strokes"])
        names = top["minimise"] if isinstance(top["minimise"], YamlList) else [top["minimise"]]
        minimise = [str(self.read_text(name, "minimise")) for name in names]
        ranges = {str(key): self.read_range(value, key, numbers[key]) for key, value in free.items()}
        try:
            return DesignProblem(
                machine,
                ranges,
                self._read_box(machine, top["box"]),
                minimise,
                {str(key): self.read_range(value, key, LENGTH) for key, value in shift.items()},
                {
                    str(key): self.read_value(value, key, NUMBER if "amplification" in key else LENGTH)
                    for key, value in bounds.items()
                },
                strokes == "fit",
            )
        except PoseError as error:
            key = str(error).split(":")[0]
            line = next((own.line for own in top if own == key), 1)
            raise InputError(str(error), self.source, line) from None

    def _read_box(self, machine: Machine, value: Value) -> dict[str, AxisRange | float]:
        kinds = {
            axis: ANGLE if u == "rad" else LENGTH for axis, u in zip(machine.axes, machine.axis_units, strict=True)
        }
        box: dict[str, AxisRange | float] = {}
        for axis, ends in self.read_map(value, "box", machine.axes).items():
            is_range = isinstance(ends, YamlList)
            box[str(axis)] = (self.read_range if is_range else self.read_value)(ends, axis, kinds[axis])
        return box

    def _load(self, name: YamlText) -> Machine:
        beside = Path(self.source).parent / name
        try:
            return load_machine(fspath(beside) if name.endswith((".yaml", ".yml")) else name)
        except InputErrors:
            raise
        except InputError as error:
            raise error if error.line is not None else self.fail(error.message, name) from None
