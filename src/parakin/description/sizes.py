"""Read the sizes of a machine file, with parameters in place of some of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import SupportsFloat

from ..errors import InputError, quote, suggest
from ..units import Quantity, QuantityError, UnreadSizeError, evaluate_expression, is_reserved
from .document import Value, YamlMap, YamlText
from .values import ReadingContext, describe_value, is_word


def read_sizes(
    value: Value | None, parameters: Mapping[str, float | str], context: ReadingContext
) -> dict[str, Quantity | None]:
    """Read the file's sizes, each with its parameter if there is one; None for a size that could not be read."""
    sizes: dict[str, Quantity | None] = {}
    if value is not None and not isinstance(value, YamlMap):
        context.report(f"sizes: expected a mapping of names and quantities, got {describe_value(value)}", value.line)
    elif value is not None:
        for name, content in value.items():
            if not is_word(name):
                context.report(
                    f"size {quote(name)} is no name, expected a plain word (letters, digits, _; at most 40)", name.line
                )
                continue
            sizes[str(name)] = None
            try:
                size = _read_size(name, content, sizes)
                sizes[str(name)] = _read_parameter(name, parameters[name], size, sizes) if name in parameters else size
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


def _read_size(name: YamlText, content: Value, sizes: Mapping[str, Quantity | None]) -> Quantity:
    if is_reserved(name):
        raise QuantityError("a unit or a function has this name, expected another for a size")
    if not isinstance(content, YamlText):
        raise QuantityError(f"expected a quantity such as 350 mm, got {describe_value(content)}")
    return evaluate_expression(content, {k: v for k, v in sizes.items() if k != name})


def _read_parameter(name: str, value: float | str, size: Quantity, sizes: Mapping[str, Quantity | None]) -> Quantity:
    """Read a value given in place of a size; it must be of the same kind as the file's ``size``."""
    if isinstance(value, str):
        try:
            given = evaluate_expression(value, {k: v for k, v in sizes.items() if k != name})
        except QuantityError as error:
            raise InputError(f"{name}: {error}", "parameters") from None
        if given.dimension != size.dimension:
            raise InputError(f"{name}: {quote(value)} is {given.what}, expected {size.what}", "parameters")
        return given
    if isinstance(value, bool) or not isinstance(value, SupportsFloat) or not math.isfinite(float(value)):
        raise InputError(f"{name}: expected a finite number or text with a unit, got {quote(value)}", "parameters")
    return Quantity(float(value), size.dimension)
