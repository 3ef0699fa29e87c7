"""What commands have in common: options, and values as a user writes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError, InputErrors

if TYPE_CHECKING:
    from ..arrays import Array
    from ..machine import Machine

OFF_LIMITS = 3  # exit code


def machine_names(context: Any) -> list[str]:
    from .. import machines

    return [name for name in machines() if name.startswith(context.incomplete)]


Name = Annotated[str, Parameter(completer=machine_names)]
Sizes = Annotated[
    list[str] | None, Parameter(name="--set", help="A size of the machine, with its unit: R=360mm. May be given again.")
]
Mode = Annotated[
    str | None, Parameter(allow_leading_hyphen=True, help="Working mode: a sign for each choice of the inverse.")
]
Json = Annotated[bool, Parameter(name="--json", help="Print one JSON object and nothing else.")]


def machine_of(name: str, sizes: Sequence[str] | None = None) -> Machine:
    """The machine of a command: a shipped name or a file, with sizes ``NAME=VALUE`` in the place of its own."""
    from .. import load

    given: dict[str, str] = {}
    for text in sizes or ():
        size, equals, value = (part.strip() for part in text.partition("="))
        if not (size and equals and value):
            raise InputError(f'"{text}": expected NAME=VALUE, such as R=360mm', "--set")
        if size in given:
            raise InputError(f"{size} is given twice", "--set")
        given[size] = value
    try:
        return load(name, given)
    except InputErrors as errors:
        raise InputErrors([_at_option(error) for error in errors.errors]) from None
    except InputError as error:
        raise _at_option(error) from None


def _at_option(error: InputError) -> InputError:
    return InputError(error.message, "--set") if error.source == "parameters" else error


def row(values: Sequence[str], names: Sequence[str], units: Sequence[str], default: Array | None, source: str) -> Array:
    """One row of values in mm and rad, from ``10 -20`` in the names' order or from ``X=10 Z=-20``.

    What isn't named comes from ``default``. Plain numbers are mm and degrees.
    """
    import numpy as np

    from ..errors import quote, suggest
    from ..toolpath.posting.frames import parse_value

    named = ["=" in value for value in values]
    wanted = " ".join(names)
    if any(named) and not all(named):
        raise InputError(f"values with a name and without one are mixed, expected either {wanted} or names", source)
    if not all(named) and len(values) != len(names):
        raise InputError(f"{len(values)} value{'s' * (len(values) != 1)}, expected {len(names)}: {wanted}", source)
    by_name = dict(zip(names, units, strict=True))
    spelled = {name.lower(): name for name in names}
    result = np.full(len(names), np.nan) if default is None else np.array(default, dtype=np.float64)
    given = [v.partition("=")[::2] for v in values] if all(named) else list(zip(names, values, strict=True))
    seen: set[str] = set()
    for word, text in given:
        name = spelled.get(word.strip().lower())
        if name is None:
            raise InputError(f"unknown {quote(word.strip())}{suggest(word.strip(), names)}", source)
        if name in seen:
            raise InputError(f"{name} is given twice", source)
        seen.add(name)
        result[list(names).index(name)] = parse_value(name, text.strip(), source, by_name[name])
    missing = [name for name, value in zip(names, result.tolist(), strict=True) if value != value]
    if missing:
        raise InputError(f"no value for {', '.join(missing)}, expected {wanted}", source)
    return result
