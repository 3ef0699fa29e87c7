"""The command line: ``parakin COMMAND``. Exit codes: 0 done, 2 malformed input, 3 off limits or no solution."""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
import warnings
from collections.abc import Sequence
from contextlib import suppress

from cyclopts import App, CycloptsError, MissingArgumentError, Parameter, UnusedCliTokensError

from .commands.accuracy import accuracy
from .commands.assemblies import assemblies
from .commands.atlas import atlas
from .commands.calibrate import calibrate
from .commands.compare import compare
from .commands.console import print_remark
from .commands.design import design
from .commands.export import export
from .commands.forces import forces
from .commands.import_ import import_machine
from .commands.kinematics import forward, inverse
from .commands.linuxcnc import linuxcnc
from .commands.machines import machines, show
from .commands.options import INTERRUPTED
from .commands.page import page
from .commands.post import post
from .commands.reach import reach
from .commands.stiffness import stiffness
from .commands.studio import make_studio_command
from .commands.sweep import sweep
from .commands.workspace import workspace
from .errors import InputError, ParakinError, PoseError, join_words, quote
from .version import __version__

_MALFORMED = 2
_BROKEN_PIPE = 141
_COMPLETE = "__complete"  # by which a shell's completion calls

app = App(
    name="parakin",
    help="Design, analyse and program parallel kinematic machine tools.",
    version=__version__,
    default_parameter=Parameter(negative=""),
    suppress_keyboard_interrupt=False,  # main says so in one line
)
ANALYSES = (assemblies, reach, workspace, atlas, accuracy, stiffness, forces, compare, calibrate, design, sweep)
for command in (post, inverse, forward, *ANALYSES, linuxcnc, machines, show, page, export):
    app.command(command)
app.command(import_machine, name="import")
app.command(make_studio_command(app))
app.register_install_completion_command()


def _exit_on_signal(number: int, frame: object) -> None:
    raise SystemExit(128 + number)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; return the exit code."""
    closed = _replace_closed_streams()
    warnings.showwarning = _show_warning
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a terminal may not know the sign for degrees
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _exit_on_signal)  # so that half-written files are removed
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        if words[:1] != [_COMPLETE]:  # there the last word may be empty, as it is typed so far
            _check_words(words)
        code = app(words, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
    except PoseError as error:
        print_remark(_name_option(error, app[words[0]]))
        return _MALFORMED
    except ParakinError as error:
        print_remark(str(error))
        return _MALFORMED
    except UnusedCliTokensError as error:
        values = join_words([*map(quote, error.unused_tokens or ())])
        print_remark(f"parakin: {words[0]} takes no more values, got {values}")
        return _MALFORMED
    except MissingArgumentError as error:
        print_remark(f"parakin: {' '.join(str(error).split())}{_explain_hyphen(words, error.keyword)}")
        return _MALFORMED
    except CycloptsError as error:
        print_remark(f"parakin: {' '.join(str(error).split())}")
        return _MALFORMED
    except MemoryError:
        print_remark("parakin: not enough memory")
        return _MALFORMED
    except KeyboardInterrupt:
        print_remark("parakin: interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        _discard_output()
        return _BROKEN_PIPE
    except OSError as error:  # errors of files come as ParakinError
        _discard_output()
        what = f"{error.filename}" if error.filename else "the output can't be written"
        print_remark(f"parakin: {what}: {error.strerror or error}")
        return _MALFORMED
    if closed:
        print_remark("parakin: the output can't be written: it is closed")
        return _MALFORMED
    return code if isinstance(code, int) else 0


def _check_words(words: Sequence[str]) -> None:
    """Refuse an empty word, as an unset variable of a shell leaves it: as a file's name it would be this folder."""
    for k, word in enumerate(words):
        option, equals, value = word.partition("=")
        if not word or (equals and not value and option.startswith("-")):
            behind = f"behind {words[k - 1]}" if k and not word else f"for {option}" if word else "in front"
            raise InputError(f"an empty value {behind}; expected a file, a name or a value", "parakin")


def _explain_hyphen(words: Sequence[str], option: str | None) -> str:
    """Tell how to write a negative value, which is taken for an option, where one stands behind an option."""
    value = words[words.index(option) + 1 :][:1] if option in words else []
    return f" A negative value is written {option}={value[0]}" if value and value[0][1:2].isdigit() else ""


def _name_option(error: PoseError, command: App) -> str:
    """Write a refusal with the command's option in place of the argument that it begins with."""
    name = error.argument
    for argument in command.assemble_argument_collection():
        if argument.field_info.name == name and argument.name.startswith("--"):
            return argument.name + str(error).removeprefix(name)
    return str(error)


def _replace_closed_streams() -> bool:
    """Redirect closed output streams to nowhere; return whether stdout was closed."""
    closed = sys.stdout is None
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115  open to the end
    return closed


def _discard_output() -> None:
    """Redirect stdout to nowhere, since the interpreter flushes it once more when it ends."""
    with suppress(OSError, ValueError):  # a stream that is no file
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _show_warning(message: Warning | str, *place: object, **more: object) -> None:
    print_remark(f"parakin: {' '.join(str(message).split())}")


if __name__ == "__main__":
    sys.exit(main())
