"""The whole state of a LinuxCNC that hangs, for its user interface in a test; it runs with LinuxCNC's own Python."""

import time
from pathlib import Path

WATCHED = 0.5  # s between two looks at the threads
PLAIN = (int, float, str, bool, tuple, list)


def dump(status):
    status.poll()
    names = [name for name in dir(status) if not name.startswith("_")]
    state = {name: repr(getattr(status, name)) for name in names if isinstance(getattr(status, name), PLAIN)}
    before = list_processes()
    time.sleep(WATCHED)
    return state | {"processes": before, "processes later": list_processes()}


def list_processes():
    """List this run's threads: name, where each waits, its state, and how often it has been switched to.

    Of the realtime threads, which belong to root, name, state and switches can be read.
    """
    processes = {}
    for folder in Path("/proc").glob("[0-9]*/task/[0-9]*"):
        lines = [read(folder / name) for name in ("comm", "wchan", "syscall")]
        kept = [line for line in read(folder / "status").splitlines() if line.startswith(("State", "voluntary"))]
        processes[str(folder)] = " ".join([*lines, *kept])
    return processes


def read(path):
    """Read what is there to be read."""
    try:
        return path.read_text().strip()
    except OSError:
        return "?"
