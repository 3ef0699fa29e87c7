"""Run LinuxCNC with its servo thread ahead of all others, as on a realtime kernel, which this computer may not have.

On an ordinary kernel that thread has the priority of any other, in a session of its own, where being nice says nothing.
On two busy cores it stood still for up to 0.7 s, and now and then for longer than LinuxCNC waits until motion takes a
command; what is not taken by then is dropped, be it to switch on or to end a jog.
"""

from __future__ import annotations

import os
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from threading import Thread

SERVO = "rtapi_app:T#0"
PRIORITY = 50
OFTEN = 0.05  # s between two looks


def run_linuxcnc(command, folder, seconds):
    """Run a command in a folder, killed after a time; the completed process, with what it has said."""
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, cwd=folder, text=True, **pipes) as process:
        watch = Thread(target=_hurry_servo_thread, args=(process,))
        watch.start()
        try:
            told = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
        finally:
            watch.join()
    return subprocess.CompletedProcess(command, process.returncode, *told)


def _hurry_servo_thread(process):
    """Put the servo thread of a process's descendants ahead as soon as it is there."""
    while process.poll() is None:
        threads = _list_threads(process.pid)
        for thread in threads:
            with suppress(ProcessLookupError):
                os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(PRIORITY))
        if threads:
            return
        time.sleep(OFTEN)


def _list_threads(ancestor):
    """List the servo threads below a process."""
    parents, threads = {}, []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            name, _, rest = (folder / "stat").read_text().partition("(")[2].rpartition(")")
            parents[int(folder.name)] = int(rest.split()[1])
            if name == "rtapi_app":
                names = {int(task.name): (task / "comm").read_text().strip() for task in (folder / "task").iterdir()}
                threads += [(int(folder.name), task) for task, word in names.items() if word == SERVO]
        except OSError:  # it has ended
            continue
    return [task for pid, task in threads if ancestor in _list_ancestors(parents, pid)]


def _list_ancestors(parents, pid):
    ancestors = []
    while pid in parents:
        pid = parents[pid]
        ancestors.append(pid)
    return ancestors
