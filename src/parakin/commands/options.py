"""The options that commands share, and the machine they name."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError, InputErrors, PoseError, quote

if TYPE_CHECKING:
    from ..machine import Machine

OFF_LIMITS = 3  # exit code
INTERRUPTED = 130  # exit code: as shells have it, 128 and SIGINT's number
YAML_ENDINGS = (".yaml", ".yml")  # of machine files and design problems


def complete_machine(context: Any) -> list[str]:
    """List the shipped machines and the machine files that begin with what is typed, for the shell's completion."""
    from .. import machines

    shipped = [name for name in machines() if name.startswith(context.incomplete)]
    return shipped + list_files(context.incomplete, YAML_ENDINGS)


def complete_machine_or_part(context: Any) -> list[str]:
    """List the shipped machines and the files that begin with what is typed, for the shell's completion."""
    return list(dict.fromkeys([*complete_machine(context), *list_files(context.incomplete)]))


def complete_problem(context: Any) -> list[str]:
    """List the families of closed form and the files that begin with what is typed, for the shell's completion."""
    from ..performance.design import DESIGNS

    families = [name for name in DESIGNS if name.startswith(context.incomplete)]
    return families + list_files(context.incomplete, YAML_ENDINGS)


def list_files(begin: str, endings: Sequence[str] = ()) -> list[str]:
    """List the files whose paths begin so, those in folders that begin so too; only of some endings where there are."""
    name = begin.rpartition("/")[2]
    place = begin.removesuffix(name)
    folder = Path(place or ".")
    found = [path for pattern in ("*", "*/*") for path in folder.glob(escape(name) + pattern)]
    files = [path.relative_to(folder).as_posix() for path in found if path.is_file()]
    shown = [file for file in sorted(files) if name or not file.startswith(".")]
    return [place + file for file in shown if not endings or file.endswith(tuple(endings))]


Name = Annotated[str, Parameter(completer=complete_machine)]
Sizes = Annotated[
    list[str] | None, Parameter(name="--set", help="A size of the machine, with its unit: R=360mm. May be given again.")
]
Mode = Annotated[
    str | None, Parameter(allow_leading_hyphen=True, help="Working mode: a sign for each choice of the inverse.")
]
OutputPath = Annotated[Path | None, Parameter(name=["--output", "-o"])]  # each command says what it writes there
Json = Annotated[bool, Parameter(name="--json", help="Print one JSON object and nothing else.")]


def require_ending(path: Path | None, endings: Sequence[str], option: str = "--output") -> None:
    """Refuse a file that a command can't write, by its ending."""
    if path is not None and path.suffix.lower() not in endings:
        raise InputError(f"{quote(str(path))}: expected a file name that ends in {', '.join(endings)}", option)


@contextmanager
def tell_options(**options: str) -> Iterator[None]:
    """Tell what a call refuses by the options that gave its arguments: ``count: ...`` as ``--plan: ...``.

    options : by the names of the arguments; those that an option of the same name gives need none
    """
    try:
        yield
    except PoseError as error:
        if error.argument not in options:
            raise
        raise InputError(re.sub(r"^\w+:? ?", "", str(error)), options[error.argument]) from None


def load_machine(name: str, sizes: Sequence[str] | None = None) -> Machine:
    """Load the machine of a command, a shipped name or a file, with sizes ``NAME=VALUE`` that replace its own."""
    from .. import load

    try:
        return load(name, split_sizes(sizes))
    except InputErrors as errors:
        raise InputErrors([_name_option(error) for error in errors.errors]) from None
    except InputError as error:
        raise _name_option(error) from None


def split_sizes(sizes: Sequence[str] | None) -> dict[str, str]:
    """Split ``NAME=VALUE`` of ``--set`` into values by their names."""
    parameters: dict[str, str] = {}
    for text in sizes or ():
        size, equals, value = (word.strip() for word in text.partition("="))
        if not (size and equals and value):
            raise InputError(f'"{text}": expected NAME=VALUE, such as R=360mm', "--set")
        if size in parameters:
            raise InputError(f"{size} is given twice", "--set")
        parameters[size] = value
    return parameters


def _name_option(error: InputError) -> InputError:
    return InputError(error.message, "--set") if error.source == "parameters" else error
