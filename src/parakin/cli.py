"""The command line: ``parakin COMMAND``. Exit codes: 0 done, 2 malformed input, 3 off limits or no solution."""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
from collections.abc import Sequence

from cyclopts import App, CycloptsError, Parameter

from .commands.atlas import atlas
from .commands.design import design
from .commands.kinematics import forward, inverse
from .commands.linuxcnc import linuxcnc
from .commands.machines import machines, show
from .commands.post import post
from .commands.workspace import workspace
from .errors import ParakinError
from .version import __version__

_MALFORMED = 2
_INTERRUPTED = 130
_BROKEN_PIPE = 141

app = App(
    name="parakin",
    help="Design, analyse and program parallel kinematic machine tools.",
    version=__version__,
    default_parameter=Parameter(negative=""),
    suppress_keyboard_interrupt=False,  # main says so in one line
)
for command in (post, inverse, forward, linuxcnc, machines, show, workspace, atlas, design):
    app.command(command)
app.register_install_completion_command()


def _exit_on_signal(number: int, frame: object) -> None:
    raise SystemExit(128 + number)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; return the exit code."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a terminal may not know the sign for degrees
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _exit_on_signal)  # so that half-written files are removed
    try:
        words = list(sys.argv[1:] if arguments is None else arguments)
        code = app(words, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
    except ParakinError as error:
        print(error, file=sys.stderr)
        return _MALFORMED
    except CycloptsError as error:
        print(f"parakin: {' '.join(str(error).split())}", file=sys.stderr)
        return _MALFORMED
    except RuntimeError as error:
        if "no locator available" not in str(error):
            raise
        print(
            "parakin: nowhere to keep the compiled kernels; set NUMBA_CACHE_DIR to a folder of yours", file=sys.stderr
        )
        return _MALFORMED
    except MemoryError:
        print("parakin: not enough memory", file=sys.stderr)
        return _MALFORMED
    except KeyboardInterrupt:
        print("parakin: interrupted", file=sys.stderr)
        return _INTERRUPTED
    except BrokenPipeError:
        # The interpreter flushes stdout once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _BROKEN_PIPE
    return code if isinstance(code, int) else 0


if __name__ == "__main__":
    sys.exit(main())
