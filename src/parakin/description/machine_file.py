"""Find and read machine files: YAML of some twenty lines that becomes a :class:`~parakin.model.spec.Spec`.

All errors of a file are found in one pass and reported as ``file:line: what is wrong, and what was expected``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Annotated, Any

from pydantic import PlainValidator, ValidationError, ValidationInfo

from ..errors import InputError, InputErrors, quote, suggest
from ..model.elements import Limits, Unit
from ..model.spec import Spec
from ..units import ANGLE, LENGTH, Dimension
from .bodies import BodiesSection
from .document import YamlMap, YamlText, parse_document, read_document, read_text
from .groups import Legs
from .sections import (
    TRANSFORMS,
    ConstraintValue,
    FileSection,
    HomeSection,
    LimitsSection,
    ListOf,
    Mounting,
    Steps,
)
from .sizes import read_sizes
from .values import Prose, ReadingContext, WordValue, describe_value, get_context, is_word

_UNITS: dict[Dimension, Unit] = {LENGTH.dimension: "mm", ANGLE.dimension: "rad"}
_PLAIN = re.compile(r"[\w.(][\w.+*/() °-]*")  # a value that YAML needs no quotes for
_MACHINES = Path(__file__).parent.parent / "machines"


def list_shipped_machines() -> dict[str, Path]:
    """List the machine files that come with the package, by name."""
    return {path.stem: path for path in sorted(_MACHINES.glob("*.yaml"))}


def find_machine_file(name: str | PathLike[str]) -> Path:
    """Find the file of a machine, by its shipped name or by the path of the user's own file.

    Raises :class:`InputError` for an empty name, and for a plain word that is no shipped name and no file.
    """
    if name == "":
        raise InputError("an empty name; expected a machine's, or a file's", "name")
    known = list_shipped_machines()
    if str(name) in known:
        return known[str(name)]
    if isinstance(name, str) and is_word(name) and not Path(name).exists():
        raise InputError(f"unknown machine {quote(name)}{suggest(name, known)}")
    return Path(name)


def find_key_line(path: str | PathLike[str], key: str) -> int:
    """Find the line of a top-level key of a machine file; 1 if it has none."""
    document, _ = read_document(Path(path), fspath(path))
    keys = document if isinstance(document, YamlMap) else {}
    return next((name.line for name in keys if isinstance(name, YamlText) and name == key), 1)


def write_sizes(path: Path, sizes: Mapping[str, str]) -> str:
    """Write a machine file's text with other values of its sizes, all else as it stands there."""
    source = fspath(path)
    text = read_text(path, source)
    document, _ = parse_document(text, source)
    given = document.get("sizes") if isinstance(document, YamlMap) else None
    for name, content in reversed(list(given.items()) if isinstance(given, YamlMap) else []):
        if name in sizes:
            value = sizes[name] if _PLAIN.fullmatch(sizes[name]) else f'"{sizes[name]}"'
            text = text[: content.place.start] + value + text[content.place.stop :]
    return text


def read_machine(path: str | PathLike[str], parameters: Mapping[str, float | str] | None = None) -> Spec:
    """Read a machine's description from its file.

    Parameters
    ----------
    path : the YAML file
    parameters : values that replace entries of the file's ``sizes``: a number in mm or rad, whichever the size is, or
        text with a unit (``"13.78 in"``)

    Raises
    ------
    InputError
        The file can't be read, or ``parameters`` don't fit it.
    InputErrors
        The file is not valid; every error with its line, in the order of the lines.
    """
    source = fspath(path)
    document, errors = read_document(Path(path), source)
    if not isinstance(document, YamlMap):
        raise InputError(f"expected keys such as name, motion and legs, got {describe_value(document)}", source, 1)
    context = ReadingContext(source, {}, errors)
    context.sizes = read_sizes(document.get("sizes"), parameters or {}, context)
    try:
        machine = _MachineSection.model_validate(document, context=context)
    except ValidationError as error:
        context.errors += [_convert_error(details, source) for details in error.errors(include_url=False)]
    else:
        name = machine.name or Path(path).stem
        if not is_word(name):
            context.report(f'file name {quote(name)} is not a plain word, expected a key "name" with one', 1)
    if context.errors:
        unique = {str(e): e for e in context.errors}.values()  # a value for all joints of a leg is read once for each
        raise InputErrors(sorted(unique, key=lambda e: e.line or 0))
    return Spec(
        name=str(name),
        title=machine.title or str(name),
        source=machine.source,
        motion=machine.motion,
        legs=tuple(leg for group in machine.legs for leg in group.build_legs()),
        home=machine.home.get_pose(),
        sizes={name: size.value for name, size in context.sizes.items() if size is not None},
        size_units={
            name: _UNITS[size.dimension]
            for name, size in context.sizes.items()
            if size is not None and size.dimension in _UNITS
        },
        mounting=machine.mounting,
        head=machine.head,
        table=machine.table,
        limits=machine.limits.build_limits() if machine.limits else Limits(),
        parasitic=machine.parasitic,
        constraints=machine.constraints,
        bodies=machine.bodies.build() if machine.bodies else {},
    )


def _read_words(value: object) -> tuple[str, ...]:
    words = value.split() if isinstance(value, YamlText) else []
    if not words:
        raise ValueError(f"expected words such as tx ty rz, got {describe_value(value)}")
    for word in words:
        if word not in TRANSFORMS:
            raise ValueError(f"unknown word {quote(word)}{suggest(word, TRANSFORMS)}")
    return tuple(words)


def _read_motion(value: object, info: ValidationInfo) -> tuple[str, ...]:
    get_context(info).motion = _read_words(value)
    return _read_words(value)


def _read_parasitic(value: object, info: ValidationInfo) -> tuple[str, ...]:
    words, context = _read_words(value), get_context(info)
    for word in words:
        if context.motion is not None and word not in context.motion:
            raise ValueError(f"{quote(word)} is not in the motion {' '.join(context.motion)}")
    context.parasitic = words
    return words


class _MachineSection(FileSection):
    """The whole file, in the order in which its keys are read: later ones may name what earlier ones define."""

    name: WordValue | None = None
    title: Prose | None = None
    source: Prose
    sizes: Any = None  # read beforehand: all other values may use them
    mounting: Mounting = ()
    motion: Annotated[tuple[str, ...], PlainValidator(_read_motion)]
    parasitic: Annotated[tuple[str, ...], PlainValidator(_read_parasitic)] = ()
    legs: Legs
    constraints: Annotated[tuple[ConstraintValue, ...], ListOf] = ()  # of rods that stand on what a leg moves
    head: Steps = ()
    table: Steps = ()
    limits: LimitsSection | None = None
    bodies: BodiesSection | None = None
    home: HomeSection


def _convert_error(details: Any, source: str) -> InputError:
    """Convert pydantic's account of one error, with the line of the value it was found in."""
    names = [key for key in details["loc"] if isinstance(key, str)]
    line = getattr(details["input"], "line", 1)
    if details["type"] == "missing":
        where = f" in {names[-2]}" if len(names) > 1 else ""
        return InputError(f"missing key {quote(names[-1])}{where}", source, line)
    error = details.get("ctx", {}).get("error")
    message = str(error) if error else details["msg"]
    return InputError(f"{names[-1]}: {message}" if names else message, source, getattr(error, "line", line))
