"""Files of design problems, YAML: a machine, its free numbers, a box of poses, and what is wanted."""

from __future__ import annotations

from os import fspath
from pathlib import Path
from typing import TYPE_CHECKING

from ..description.document import Value, YamlList, YamlMap, YamlText, read_document
from ..description.importing.configuration_text import check_beside
from ..description.values import is_word
from ..errors import InputError, InputErrors, PoseError, quote, suggest
from ..model.geometric_parameters import suggest_parameter
from ..units import ANGLE, AXIS_UNITS, LENGTH, QuantityError, QuantityKind, parse_quantity
from .options import YAML_ENDINGS, load_machine

if TYPE_CHECKING:
    from ..arrays import Array, AxisRange
    from ..machine import Machine
    from ..synthesis.problem import DesignProblem
    from ..toolpath.path import ToolPath

_POSES = ("box", "cylinder", "poses")
_KEYS = (
    "machine", "free", *_POSES, "shift", "bounds", "strokes", "drives", "struts", "tolerances", "within", "part",
    "workpiece", "minimise", "maximise",
)  # fmt: skip
_KEYS_OF_ARGUMENTS = {"path": "part", "fit_strokes": "strokes"}
_STROKES = ("keep", "fit")
_CYLINDER = ("along", "diameter")


def read_design_problem(path: Path) -> DesignProblem:
    """Read a design problem.

    Raises :class:`InputError` with file and line.
    """
    source = fspath(path)
    document, errors = read_document(path, source, "a design problem")
    if errors:
        raise InputErrors(errors)
    reader = _ProblemReader(source)
    top = reader.read_map(document, "a design problem", _KEYS)
    for keys in (("machine",), ("free",), _POSES, ("minimise", "maximise")):
        if not any(key in top for key in keys):
            raise InputError(f"key {' or '.join(keys)} is missing", source, 1)
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
        from ..synthesis.problem import DesignProblem
        from ..synthesis.wants import WANTS

        machine = self._load(self.read_text(top["machine"], "machine"))
        numbers = {p.name: ANGLE if p.unit == "rad" else LENGTH for p in machine.parameters}
        free = self.read_map(top["free"], "free")
        for name in free:
            if name not in numbers:
                raise self.fail(f"free: unknown {quote(name)}{suggest_parameter(name, machine.parameters)}", name)
        shift = self.read_map(top["shift"], "shift") if "shift" in top else {}
        bounds = (
            self.read_map(top["bounds"], "bounds", tuple(name for name in WANTS if WANTS[name].bounded))
            if "bounds" in top
            else {}
        )
        strokes = self.read_text(top["strokes"], "strokes") if "strokes" in top else "keep"
        if strokes not in _STROKES:
            raise self.fail(f"strokes: {quote(strokes)}{suggest(strokes, _STROKES)}", top["strokes"])
        try:
            return DesignProblem(
                machine,
                {str(key): self.read_range(value, key, numbers[key]) for key, value in free.items()},
                self._read_axes(machine, top["box"], "box") if "box" in top else {},
                self._read_names(top, "minimise"),
                {str(key): self.read_range(value, key, LENGTH) for key, value in shift.items()},
                {str(key): self.read_value(value, key, WANTS[key].kind) for key, value in bounds.items()},
                strokes == "fit",
                self._read_names(top, "maximise"),
                self._read_cylinder(machine, top["cylinder"]) if "cylinder" in top else None,
                self._read_poses(machine, top["poses"]) if "poses" in top else (),
                self._read_words(top, "drives"),
                self._read_words(top, "struts"),
                self._read_tolerances(top, "tolerances"),
                self._read_part(top["part"]) if "part" in top else None,
                self._read_workpiece(top["workpiece"]) if "workpiece" in top else None,
                self._read_tolerances(top, "within"),
            )
        except PoseError as error:
            key, colon, message = str(error).partition(":")
            key = _KEYS_OF_ARGUMENTS.get(key, key)
            line = next((own.line for own in top if own == key), 1)
            raise InputError(f"{key}{colon}{message}", self.source, line) from None

    def _read_names(self, top: YamlMap, key: str) -> list[str]:
        if key not in top:
            return []
        names = top[key] if isinstance(top[key], YamlList) else [top[key]]
        return [str(self.read_text(name, key)) for name in names]

    def _read_words(self, top: YamlMap, key: str) -> dict[str, str] | str | None:
        """Read a text for all, or texts by names."""
        if key not in top:
            return None
        if isinstance(top[key], YamlMap):
            words = self.read_map(top[key], key)
            return {str(name): str(self.read_text(value, name)) for name, value in words.items()}
        return str(self.read_text(top[key], key))

    def _read_tolerances(self, top: YamlMap, key: str) -> dict[str, str] | None:
        words = self._read_words(top, key)
        if isinstance(words, str):
            raise self.fail(f"{key}: a mapping expected, such as {{feet: 0.05 mm}}", top[key])
        return words

    def _read_part(self, value: Value) -> ToolPath:
        """Read a tool path, whose file stands beside the problem's."""
        from ..toolpath.reading.detect import read_path

        name = self.read_text(value, "part")
        file = self._find_beside(name, "part")
        try:
            return read_path(file)
        except InputErrors:
            raise
        except InputError as error:
            raise error if error.line is not None else self.fail(f"part: {error}", name) from None

    def _read_workpiece(self, value: Value) -> Array:
        from ..toolpath.posting.frames import workpiece

        axes = self.read_map(value, "workpiece", tuple(AXIS_UNITS))
        kinds = {"mm": LENGTH, "rad": ANGLE}
        return workpiece(
            **{str(axis): self.read_value(own, axis, kinds[AXIS_UNITS[axis]]) for axis, own in axes.items()}
        )

    def _read_poses(self, machine: Machine, value: Value) -> list[dict[str, AxisRange | float]]:
        if not isinstance(value, YamlList):
            raise self.fail("poses: a list expected", value)
        return [self._read_axes(machine, axes, "a pose") for axes in value]

    def _read_cylinder(self, machine: Machine, value: Value) -> dict[str, AxisRange | float | str]:
        whole = self.read_map(value, "cylinder", (*_CYLINDER, *machine.axes))
        said: dict[str, AxisRange | float | str] = {}
        for key, ends in whole.items():
            if key in machine.axes:
                said[str(key)] = self._read_axis(machine, key, ends)
            else:
                length = key == "diameter"
                said[str(key)] = self.read_value(ends, key, LENGTH) if length else str(self.read_text(ends, key))
        return said

    def _read_axes(self, machine: Machine, value: Value, what: str) -> dict[str, AxisRange | float]:
        axes = self.read_map(value, what, machine.axes)
        return {str(axis): self._read_axis(machine, axis, ends) for axis, ends in axes.items()}

    def _read_axis(self, machine: Machine, axis: str, value: Value) -> AxisRange | float:
        kind = ANGLE if machine.axis_units[machine.axes.index(axis)] == "rad" else LENGTH
        return (self.read_range if isinstance(value, YamlList) else self.read_value)(value, axis, kind)

    def _find_beside(self, name: YamlText, key: str) -> Path:
        folder = Path(self.source).parent
        return check_beside(folder / name, (folder,), key, self.source, name.line)

    def _load(self, name: YamlText) -> Machine:
        """Load a shipped machine, or one whose file stands beside the problem's."""
        is_file = name.endswith(YAML_ENDINGS) or not is_word(name)
        chosen = fspath(self._find_beside(name, "machine")) if is_file else str(name)
        try:
            return load_machine(chosen)
        except InputErrors:
            raise
        except InputError as error:
            raise error if error.line is not None else self.fail(error.message, name) from None
