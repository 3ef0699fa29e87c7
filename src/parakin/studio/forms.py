"""Forms of the commands for a page: what each parameter is, and the command line from what was filled in."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from cyclopts import App
from cyclopts.argument import Argument

from ..errors import InputError, quote

# A file's name without its folder: nothing outside the page's own folder is read or written. matplotlib would take
# its settings from there.
FILE_NAME = re.compile(r"(?!(?i:matplotlibrc)\Z)\w[\w.()+,@ -]{0,79}")
FILE_NAME_WORDS = "a plain file name of letters, digits, blanks and . ( ) + , @ _ -, other than matplotlibrc"
_NUMBER = re.compile(r"-?\.?\d")
_LONGEST = 2000  # characters of a value
_HIDDEN = {"--json"}

Kind = Literal["machine", "file", "flag", "choice", "text"]


Completer = Callable[..., Any]


@dataclass(frozen=True)
class Field:
    """A parameter of a command: its name on the line, how it is filled in, and whether it may be given again."""

    name: str
    kind: Kind
    required: bool
    help: str
    default: str
    choices: tuple[str, ...] = ()
    many: bool = False

    @property
    def is_positional(self) -> bool:
        """Whether it stands on the line without its name."""
        return not self.name.startswith("-")


@dataclass(frozen=True)
class Form:
    """A command with its parameters."""

    command: str
    help: str
    fields: tuple[Field, ...]


def list_forms(app: App, left_out: Sequence[str], kinds: Mapping[Completer, Kind]) -> dict[str, Form]:
    """List the forms of an app's commands by their names, but for those left out.

    kinds : of parameters that are texts, by the functions that complete them in a shell: names of machines and of files
    """
    names = [name for name in app if not name.startswith("-") and name not in left_out]
    return {name: _make_form(name, app[name], kinds) for name in names}


def _make_form(name: str, command: App, kinds: Mapping[Completer, Kind]) -> Form:
    arguments = [a for a in command.assemble_argument_collection(parse_docstring=True) if a.name not in _HIDDEN]
    text = (command.help or "").strip().partition("\n")[0]
    return Form(name, text, tuple(_make_field(argument, kinds) for argument in arguments))


def _make_field(argument: Argument, kinds: Mapping[Completer, Kind]) -> Field:
    default = argument.field_info.default
    shown = default if isinstance(default, str | int | float | Path) and not isinstance(default, bool) else ""
    return Field(
        argument.name,
        _find_kind(argument, kinds),
        bool(argument.required),
        " ".join((argument.parameter.help or "").split()),
        str(shown),
        tuple(argument.get_choices() or ()),
        argument.token_count()[1],
    )


def _find_kind(argument: Argument, kinds: Mapping[Completer, Kind]) -> Kind:
    completer = argument.parameter.completer
    if completer is not None and completer in kinds:
        return kinds[completer]
    if Path in _list_types(argument.hint):
        return "file"
    if argument.hint is bool:
        return "flag"
    return "choice" if argument.get_choices() else "text"


def _list_types(hint: Any) -> set[Any]:
    """List the types in a type hint, those of lists and unions too."""
    return {hint}.union(*(_list_types(inner) for inner in get_args(hint) if not isinstance(inner, str)))


def write_line(form: Form, values: Mapping[str, Any]) -> list[str]:
    """Write the words of a command line, without the program's name, from values by the fields' names.

    A value is a text, a list of texts for fields that may be given again, or true for a flag. Raises
    :class:`InputError` for one that no field has, or that a field can't have.
    """
    unknown = set(values) - {field.name for field in form.fields}
    if unknown:
        raise InputError(f"{form.command}: no parameter {quote(min(unknown))}")
    words = [form.command]
    for field in form.fields:
        for value in _list_values(form, field, values.get(field.name)):
            if field.kind == "flag":
                words.append(field.name)
            else:
                words.append(value if field.is_positional else f"{field.name}={value}")
    return words


def _list_values(form: Form, field: Field, value: Any) -> list[str]:
    """List the texts of a field's value, checked; none for what was left empty."""
    if field.kind == "flag":
        if value not in (None, True, False):
            raise InputError(f"{form.command} {field.name}: true or false expected")
        return ["true"] if value else []
    texts = value if isinstance(value, list) else [] if value is None else [value]
    if not all(isinstance(text, str) and len(text) <= _LONGEST and text.isprintable() for text in texts):
        raise InputError(f"{form.command} {field.name}: a text of at most {_LONGEST} characters expected")
    given = [text.strip() for text in texts if text.strip()]
    if field.many and field.is_positional:
        given = [word for text in given for word in text.split()]
    if len(given) > 1 and not field.many:
        raise InputError(f"{form.command} {field.name}: one value expected")
    if field.required and not given:
        raise InputError(f"{form.command}: {field.name} is missing")
    for text in given:
        if field.kind in ("machine", "file") and not FILE_NAME.fullmatch(text) and text != field.default:
            raise InputError(f"{form.command} {field.name}: {quote(text)} is not {FILE_NAME_WORDS}")
        if field.is_positional and text.startswith("-") and not _NUMBER.match(text):
            raise InputError(f"{form.command} {field.name}: {quote(text)} would be read as an option")
        if field.kind == "choice" and text not in field.choices:
            raise InputError(f"{form.command} {field.name}: one of {', '.join(field.choices)} expected")
    return given
