#!/usr/bin/python3
"""An operator's session on a screen of its own (Xvfb), with pictures: started in a configuration's folder.

task.json has the name of the ini file, the number of joints, and steps as operator_ui.py knows them; besides these
"picture" takes one of the whole screen into a file, "window" one of the machine's window, "wait" waits, and "widgets"
notes HAL's pins. seen.json tells what came of it.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

DISPLAY = ":77"
SIZE = "1920x850x24"
TITLES = {"axis": "AXIS|axis", "gmoccapy": "gmoccapy"}
SETTLED = 2.0  # s for the windows to be drawn


def wait(ready, seconds, what):
    end = time.monotonic() + seconds
    while not ready():
        if time.monotonic() > end:
            raise TimeoutError(what)
        time.sleep(0.2)


def find_window(title):
    found = subprocess.run(["xdotool", "search", "--name", title], capture_output=True, text=True).stdout.split()
    return found[-1] if found else None


def take_picture(window, file):
    subprocess.run(["import", "-silent", "-window", window, file], check=True)


def read_pins():
    shown = subprocess.run(["halcmd", "-s", "show", "pin"], capture_output=True, text=True, check=True).stdout
    rows = [line.split() for line in shown.splitlines()]
    return {row[4]: row[3] for row in rows if len(row) > 4}


def work(task, seen):
    from operator_ui import Operator

    title = f"{task['machine']}: the machine"
    wait(lambda: find_window(title), 60, "the machine's window")
    wait(lambda: find_window(TITLES[task["screen"]]), 60, task["screen"])
    time.sleep(SETTLED)
    operator = Operator(task["joints"])
    for word, *arguments in task["steps"]:
        if word == "picture":
            take_picture("root", *arguments)
        elif word == "window":
            take_picture(find_window(title), *arguments)
        elif word == "wait":
            time.sleep(*arguments)
        elif word == "pins":
            seen["pins"] = read_pins()
        elif word == "start":
            operator.program(*arguments)
        else:
            getattr(operator, word)(*arguments)
            operator.stands()
    operator.status.poll()
    seen["said"], seen["most speed"] = operator.said, operator.status.max_velocity


def main():
    task, seen = json.loads(Path("task.json").read_text()), {}
    os.environ["DISPLAY"] = DISPLAY
    screen = subprocess.Popen(["Xvfb", DISPLAY, "-screen", "0", SIZE, "-nolisten", "tcp"])
    started = [screen]
    try:
        time.sleep(1.0)
        with Path("linuxcnc.log").open("w") as log:
            cnc = subprocess.Popen(["linuxcnc", task["ini"]], stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        started.append(cnc)
        time.sleep(3.0)
        work(task, seen)
    except Exception as error:
        seen["failed"] = repr(error)
        raise
    finally:
        Path("seen.json").write_text(json.dumps(seen))
        for process in reversed(started):
            process.terminate()
    return 0


if __name__ == "__main__":
    sys.exit(main())
