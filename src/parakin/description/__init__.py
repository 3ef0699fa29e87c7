"""Machine files: YAML of some twenty lines that becomes a :class:`~parakin.model.spec.Spec`.

All errors of a file are found in one pass and reported as ``file:line: what, and what was expected``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Annotated, Any, SupportsFloat

from pydantic import PlainValidator, ValidationError, ValidationInfo

from ..errors import InputError, InputErrors, quote, suggest
from ..model.parts import Limits
from ..model.spec import Spec
from ..units import Quantity, QuantityError, UnreadSizeError, evaluate_expression, is_reserved
from .document import Value, YamlMap, YamlText, read_document
from .groups import Legs
from .sections import TRANSFORMS, HomeSection, LimitsSection, Mounting, Section, Steps
from .values import Context, Prose, Word, describe, get_context, is_word

__all__ = ["line_of", "machine_file", "read_machine", "shipped"]

_MACHINES = Path(__file__).parent.parent / "machines"


def shipped() -> dict[str, Path]:
    """The machine files that come with the package, by name."""
    return {path.stem: path for path in sorted(_MACHINES.glob("*.yaml"))}


def machine_file(name: str | PathLike[str]) -> Path:
    """The file of a machine, by its shipped name or by the path of a file of one's own.

    Raises :class:`InputError` for a plain word that is no shipped name and no file.
    """
    known = shipped()
    if str(name) in known:
        return known[str(name)]
    if isinstance(name, str) and is_word(name) and not Path(name).exists():
        raise InputError(f"unknown machine {quote(name)}{suggest(name, known)}")
    return Path(name)


def line_of(path: str | PathLike[str], key: str) -> int:
    """The line of a top-level key of a machine file; 1 if it has none."""
    document, _ = read_document(Path(path), fspath(path))
    keys = document if isinstance(document, YamlMap) else {}
    return next((found.line for found in keys if isinstance(found, YamlText) and found == key), 1)


def read_machine(path: str | PathLike[str], parameters: Mapping[str, float | str] | None = None) -> Spec:
    """A machine's description from its file.

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
        The file says something it can't mean; every error with its line, in the order of the lines.
    """
    source = fspath(path)
    document, errors = read_document(Path(path), source)
    if not isinstance(document, YamlMap):
        raise InputError(f"expected keys such as name, motion and legs, got {describe(document)}", source, 1)
    context = Context(source, {}, errors)
    context.sizes = _sizes(document.get("sizes"), parameters or {}, context)
    try:
        machine = _Machine.model_validate(document, context=context)
    except ValidationError as error:
        context.errors += [_placed(details, source) for details in error.errors(include_url=False)]
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
        legs=tuple(leg for group in machine.legs for leg in group.legs()),
        home=machine.home.pose(),
        sizes={name: size.value for name, size in context.sizes.items() if size is not None},
        mounting=machine.mounting,
        head=machine.head,
        table=machine.table,
        limits=machine.limits.limits() if machine.limits else Limits(),
    )


def _motion(value: object, info: ValidationInfo) -> tuple[str, ...]:
    words = value.split() if isinstance(value, YamlText) else []
    if not words:
        raise ValueError(f"expected words such as tx ty rz, got {describe(value)}")
    for word in words:
        if word not in TRANSFORMS:
            raise ValueError(f"unknown word {quote(word)}{suggest(word, TRANSFORMS)}")
    get_context(info).motion = tuple(words)
    return tuple(words)


class _Machine(Section):
    """The whole file, in the order in which its keys are read: later ones may name what earlier ones define."""

    name: Word | None = None
    title: Prose | None = None
    source: Prose
    sizes: Any = None  # read beforehand: everything else is written in them
    mounting: Mounting = ()
    motion: Annotated[tuple[str, ...], PlainValidator(_motion)]
    legs: Legs
    head: Steps = ()
    table: Steps = ()
    limits: LimitsSection | None = None
    home: HomeSection


def _placed(details: Any, source: str) -> InputError:
    """pydantic's account of one error, with the line of the value it was found in."""
    names = [part for part in details["loc"] if isinstance(part, str)]
    line = getattr(details["input"], "line", 1)
    if details["type"] == "missing":
        where = f" in {names[-2]}" if len(names) > 1 else ""
        return InputError(f"missing key {quote(names[-1])}{where}", source, line)
    error = details.get("ctx", {}).get("error")
    message = str(error) if error else details["msg"]
    return InputError(f"{names[-1]}: {message}" if names else message, source, getattr(error, "line", line))


def _sizes(value: Value | None, parameters: Mapping[str, float | str], context: Context) -> dict[str, Quantity | None]:
    """The file's sizes with the parameters in their places; None for one that could not be read."""
    sizes: dict[str, Quantity | None] = {}
    if value is not None and not isinstance(value, YamlMap):
        context.report(f"sizes: expected a mapping of names and quantities, got {describe(value)}", value.line)
    elif value is not None:
        for name, content in value.items():
            if not is_word(name):
                context.report(
                    f"size {quote(name)} is no name, expected a plain word (letters, digits, _; at most 40)", name.line
                )
                continue
            sizes[str(name)] = None
            try:
                size = _size(name, content, sizes)
                sizes[str(name)] = _parameter(name, parameters[name], size, sizes) if name in parameters else size
            except UnreadSizeError:
                pass
            except QuantityError as error:
                context.report(f"{name}: {error}", content.line)
            except InputError as error:
                context.errors.append(error)
    for name in parameters:
        if name not in sizes:
            end = suggest(name, sizes, "none: this file has no sizes" if not sizes else "")
            context.errors.append(InputError(f"unknown size {quote(name)}{end}", "parameters"))
    return sizes


def _size(name: YamlText, content: Value, sizes: Mapping[str, Quantity | None]) -> Quantity:
    if is_reserved(name):
        raise QuantityError("a unit or a function has this name, expected another for a size")
    if not isinstance(content, YamlText):
        raise QuantityError(f"expected a quantity such as 350 mm, got {describe(content)}")
    return evaluate_expression(content, {k: v for k, v in sizes.items() if k != name})


def _parameter(name: str, value: float | str, own: Quantity, sizes: Mapping[str, Quantity | None]) -> Quantity:
    """A value given from outside for a size, of the same kind as the file's ``own``."""
    if isinstance(value, str):
        try:
            given = evaluate_expression(value, {k: v for k, v in sizes.items() if k != name})
        except QuantityError as error:
            raise InputError(f"{name}: {error}", "parameters") from None
        if given.dimension != own.dimension:
            raise InputError(f"{name}: {quote(value)} is {given.what}, expected {own.what}", "parameters")
        return given
    if isinstance(value, bool) or not isinstance(value, SupportsFloat) or not math.isfinite(float(value)):
        raise InputError(f"{name}: expected a finite number or text with a unit, got {quote(value)}", "parameters")
    return Quantity(float(value), own.dimension)
