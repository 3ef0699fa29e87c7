#!/usr/bin/python3
"""LinuxCNC's user interface in a test: switch on, home, move by hand, run a program, ask for what must be refused.

LinuxCNC starts this in the folder of its ini file, with its own Python. task.json says what to do, seen.json what came
of it, and samples.txt has every cycle's axes and joints.
"""

import json
import subprocess
import time
from pathlib import Path

import linuxcnc
from hang_dump import dump

MOST = 45.0  # s for a step in which nothing moves
REST = 0.05  # s
REFUSED = 0.1  # s for the rest of what is said to a refused block
UNDONE = -1  # LinuxCNC's answer to waiting, after 5 s
DRAINING = 0.3  # s for the sampler's last rows


class ToldError(Exception):
    """What LinuxCNC told its user."""


class Patience:
    """With a machine that stands still; one that moves does not hang, be its program as long as it may."""

    def __init__(self, status):
        self.status, self.position, self.end = status, None, 0.0

    def look(self):
        """Poll the status; raise TimeoutError where the machine has stood for too long."""
        self.status.poll()
        if self.status.position != self.position:
            self.position, self.end = self.status.position, time.monotonic() + MOST
        elif time.monotonic() > self.end:
            raise TimeoutError


class Machine:
    def __init__(self):
        self.command, self.status, self.errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()

    def wait(self, ready):
        """Until ``ready(status)``."""
        patience = Patience(self.status)
        while True:
            patience.look()
            told = self.errors.poll()
            if told:
                raise ToldError(told[1].strip())
            if ready(self.status):
                return
            time.sleep(0.005)

    def tell(self, word, *arguments):
        getattr(self.command, word)(*arguments)
        self.command.wait_complete()

    def position(self):
        """Where it has come to rest: for a moment there is nothing more to do."""
        since = 0.0
        while time.monotonic() < since + REST or not since:
            self.wait(self.is_idle)
            since = since or time.monotonic()
            time.sleep(0.005)
            self.status.poll()
            if not self.is_idle(self.status):
                since = 0.0
        return list(self.status.position)

    @staticmethod
    def is_idle(status):
        return status.interp_state == linuxcnc.INTERP_IDLE and status.inpos and not status.queue

    def switch_on(self, joints):
        self.wait(lambda s: s.joints == joints)  # the first answers are zero
        self.tell("state", linuxcnc.STATE_ESTOP_RESET)
        self.tell("state", linuxcnc.STATE_ON)
        self.wait(lambda s: s.task_state == linuxcnc.STATE_ON)

    def home(self, joints):
        self.tell("mode", linuxcnc.MODE_MANUAL)
        self.tell("teleop_enable", 0)
        self.tell("home", -1)
        self.wait(lambda s: all(s.homed[:joints]))
        return self.by_hand("G21 G90 G49 G54 G94 G61")

    def by_hand(self, block):
        self.tell("mode", linuxcnc.MODE_MDI)
        self.command.mdi(block)
        patience = Patience(self.status)
        while self.command.wait_complete() == UNDONE:
            patience.look()
        return self.position()

    def try_by_hand(self, block):
        """Where a block leads, or why LinuxCNC refuses it; where that switches the machine off it is an error."""
        try:
            return self.by_hand(block)
        except ToldError as told:
            self.status.poll()
            if self.status.task_state != linuxcnc.STATE_ON:
                raise
            time.sleep(REFUSED)
            while self.errors.poll():  # there may be more than one
                pass
            return str(told)

    def program(self, name, during=()):
        """Run a program; ``during`` it, at times in s, words to LinuxCNC with their arguments."""
        path = str(Path(name).resolve())
        self.tell("mode", linuxcnc.MODE_AUTO)
        self.wait(lambda s: s.task_mode == linuxcnc.MODE_AUTO)
        self.tell("program_open", path)
        self.wait(lambda s: s.file == path)  # on a busy computer wait_complete may give up before
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        self.wait(lambda s: s.interp_state != linuxcnc.INTERP_IDLE)
        start = time.monotonic()
        for at, word, *arguments in during:
            while time.monotonic() < start + at:
                self.wait(lambda s: True)
                time.sleep(0.002)
            getattr(self.command, word)(*(getattr(linuxcnc, a) if isinstance(a, str) else a for a in arguments))
        return self.position()

    def refusal(self, block):
        """What LinuxCNC says to a move that must not begin."""
        answer = self.try_by_hand(block)
        return answer if isinstance(answer, str) else "went there"


def work(machine, task, seen):
    joints = task["joints"]
    machine.switch_on(joints)
    seen["home"] = machine.home(joints)
    seen["by hand"] = [machine.try_by_hand(block) for block in task.get("by hand", ())]
    machine.tell("feedrate", task.get("override", 1.0))
    if "program" in task:
        seen["program"] = machine.program(task["program"], task.get("during", ()))
    seen["refused"] = {block: machine.refusal(block) for block in task.get("refused", ())}
    seen["at last"] = machine.position()


def main():
    task, seen, machine = json.loads(Path("task.json").read_text()), {}, Machine()
    with Path("samples.txt").open("w") as file, subprocess.Popen(["halsampler"], stdout=file) as sampler:
        try:
            work(machine, task, seen)
        except ToldError as told:
            seen["told"] = str(told)
        except TimeoutError:
            seen["hung"] = {"sent": machine.command.serial, "state": dump(machine.status)}
        time.sleep(DRAINING)
        sampler.terminate()
    Path("seen.json").write_text(json.dumps(seen))


main()
