"""Tell whether values are of the kinds that annotations tell, and describe both in a few words."""

from __future__ import annotations

import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from numbers import Integral, Real
from os import PathLike
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike

from .errors import quote

_ARRAY_LIKE = set(get_args(ArrayLike)) or {ArrayLike}  # from NumPy 2.5 on an alias with a name, not a union
_NAMES = {
    float: "a number",
    int: "a whole number",
    bool: "True or False",
    str: "a text",
    Mapping: "a dict by names",
    np.ndarray: "an array of numbers",
    Callable: "a function",
}
_SOURCES = {
    "Machine": "from parakin.load",
    "Region": "from parakin.region",
    "ToolPath": "from parakin.read_path",
    "Trajectory": "such as the trajectory of a Job",
    "Posted": "such as the posted of a Job",
    "SampledField": "from parakin.sample_field",
}


def resolve_hints(function: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
    """Yield the parameters' annotations as types; those of names that only type checkers import stay texts."""
    for name, hint in function.__annotations__.items():
        if name != "return":
            try:
                yield name, eval(hint, function.__globals__) if isinstance(hint, str) else hint
            except NameError:
                yield name, hint


def _expand_alias(hint: Any) -> Any:
    """Expand an alias with a name, as NumPy's arrays have from 2.5 on, to what it stands for."""
    return hint if hint is ArrayLike else getattr(hint, "__value__", hint)


def accept_value(value: object, hint: Any) -> bool:
    """Tell whether a value is of the kind that an annotation tells; of unknown annotations all are."""
    hint = _expand_alias(hint)
    if isinstance(hint, str):
        names = {kind.__name__ for kind in type(value).__mro__} | ({"None"} if value is None else set())
        return not names.isdisjoint(name.strip() for name in hint.split("|"))
    origin = get_origin(hint)
    if hint is Any or hint == ArrayLike or isinstance(hint, TypeVar):
        return True
    if origin in (Union, types.UnionType):
        if set(get_args(hint)) >= _ARRAY_LIKE:  # its values are read where they are used
            return True
        return any(accept_value(value, option) for option in get_args(hint))
    if hint is None or hint is type(None):
        return value is None
    if origin is Literal:
        return isinstance(value, str) and value in get_args(hint)
    if hint is float:
        return isinstance(value, Real) and not isinstance(value, (bool, np.bool_)) and _is_float(value)
    if hint is int:
        return isinstance(value, Integral) and not isinstance(value, (bool, np.bool_))
    if hint is bool:
        return isinstance(value, (bool, np.bool_))
    if origin is np.ndarray:
        return _is_numeric(value)
    kind = origin or hint
    if origin in (Sequence, tuple):
        return _accept_elements(value, hint)
    if kind is Mapping:
        keys = get_args(hint)[:1]
        return isinstance(value, Mapping) and all(accept_value(key, kind) for kind in keys for key in value)
    return isinstance(value, kind) if isinstance(kind, type) else callable(value) if kind is Callable else True


def is_number_hint(hint: Any) -> bool:
    """Tell whether an annotation asks for a number, and not for a whole one or for other things too."""
    options = set(get_args(hint)) if get_origin(hint) in (Union, types.UnionType) else {hint}
    return float in options and options <= {float, type(None)}


def _is_float(value: Any) -> bool:
    """Tell whether a number is no integer beyond the floats; NaN is refused where the number is used."""
    try:
        float(value)
    except OverflowError:
        return False
    return True


def count_elements(value: Any) -> int | None:
    """Count the elements of a list or an array; None for what has none to count."""
    try:
        return len(value)
    except TypeError:
        return None


def _accept_elements(value: object, hint: Any) -> bool:
    """Tell whether a list or tuple has the elements that its annotation tells."""
    if (
        isinstance(value, (str, bytes))
        or not isinstance(value, (Sequence, np.ndarray))
        or count_elements(value) is None
    ):
        return False
    elements, hints = list(value), get_args(hint)
    if get_origin(hint) is tuple and Ellipsis not in hints:
        return len(elements) == len(hints) and all(map(accept_value, elements, hints))
    return all(accept_value(element, hints[0]) for element in elements) if hints else True


def _is_numeric(value: object) -> bool:
    try:
        return np.asarray(value).dtype.kind in "biuf"
    except (ValueError, TypeError, OverflowError):
        return False


def describe_hint(hint: Any) -> str:
    hint = _expand_alias(hint)
    origin = get_origin(hint)
    if origin in (Union, types.UnionType):
        return " or ".join(describe_hint(option) for option in get_args(hint))
    if origin is Literal:
        return " or ".join(repr(option) for option in get_args(hint))
    if hint is type(None):
        return "None"
    if isinstance(hint, str):
        return " or ".join(_add_source(name.strip()) for name in hint.split("|"))
    if origin in (Sequence, tuple):
        return "a list of " + " and ".join(dict.fromkeys(map(describe_hint, get_args(hint))))
    kind = origin or hint
    if kind in _NAMES:
        return _NAMES[kind]
    if kind is PathLike:
        return "a path"
    return _add_source(getattr(kind, "__name__", str(kind)))


def _add_source(name: str) -> str:
    """Name a class with its article, and where its objects come from."""
    article = "an" if name[0] in "AEIO" else "a"
    return f"{article} {name} ({_SOURCES[name]})" if name in _SOURCES else f"{article} {name}"


def describe_value(value: object) -> str:
    """Describe a value for a message, in a few words."""
    if value is None or isinstance(value, (bool, np.bool_, Real)):
        return str(value)
    if isinstance(value, str):
        return quote(value)
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    return f"a {type(value).__name__}"
