"""``parakin studio``: every command on a page in the browser."""

from __future__ import annotations

import sys
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from ..errors import InputError
from ..studio.forms import FILE_NAME, FILE_NAME_WORDS, Completer, Form, Kind, list_forms
from .console import print_text
from .options import complete_machine, complete_machine_or_part, complete_problem, load_machine

_FIRST = "tricept"


def make_forms(app: App) -> dict[str, Form]:
    """Make the forms of all commands of an app but the studio itself."""
    named: dict[Completer, Kind] = {
        complete_machine: "machine",
        complete_machine_or_part: "machine",
        complete_problem: "file",
    }
    return list_forms(app, ("studio",), named)


def make_studio_command(app: App) -> Callable[..., int]:
    """Make the command, which offers all the others of an app."""

    def studio(
        name: Annotated[str, Parameter(completer=complete_machine)] = _FIRST,
        part: Path | None = None,
        /,
        *,
        port: int = 0,
        no_browser: bool = False,
    ) -> int:
        """A machine, its files and every command on a page in the browser, served to this computer only.

        The address has a random token, without which nothing is answered. Each page has files of its own, in a folder
        that is removed at the end; what is to be kept is downloaded. Ctrl-C ends it.

        Parameters
        ----------
        name
            The machine that is shown first: a shipped machine's name or a YAML file.
        part
            A CL file or a G-code program to begin with.
        port
            Where to listen; by default a free port is taken.
        no_browser
            Print the address and leave the browser alone.
        """
        from .. import machines
        from ..studio.server import serve

        load_machine(name)  # an error is told here and not on the page
        given = [path for path in (Path(name), part) if path is not None and path.is_file()]
        if part is not None and not part.is_file():
            raise InputError("no such file", str(part))
        for path in given:
            if not FILE_NAME.fullmatch(path.name):
                raise InputError(f"expected {FILE_NAME_WORDS}", str(path))
        start = {"machine": Path(name).name, "part": "" if part is None else part.name}
        forms = make_forms(app)

        def announce(address: str, way: Path) -> None:
            print_text(f"parakin studio: {address}\nCtrl-C ends it.")
            sys.stdout.flush()
            if not no_browser:
                webbrowser.open(way.as_uri())

        serve(forms, machines(), start, given, port, announce)
        return 0

    return studio
