#!/usr/bin/python3
"""LinuxCNC's user interface in a test, for an operator's session: one step after the other, whatever LinuxCNC says.

LinuxCNC starts this in the folder of its ini file, with its own Python. task.json has the steps, each a word and
its arguments; seen.json tells for every step what LinuxCNC said and how the machine stood after it. A step that does
not come to rest in time ends the session, with the whole state.
"""

import json
import subprocess
import time
from pathlib import Path

import linuxcnc
from hang_dump import dump

MOST = 200.0  # s for a step: a program may be slowed by the override
TRAILS = 1e-7  # mm and degrees
PATIENCE = 1.0  # s for a mode to be in force
LATE = 1.0  # s for the feedback to come to the command
REST = 0.15  # s for which the machine must stand
FLICKER = 1e-8  # mm and degrees: in joint mode the position is found anew in every cycle, and its last digits change
DRAINING = 0.3  # s for the sampler's last rows


class Operator:
    def __init__(self, joints):
        self.command, self.status, self.errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
        self.joints, self.said, self.pressing = joints, [], None

    def sees(self, ready, seconds):
        """Whether the status is ``ready`` within a time."""
        end = time.monotonic() + seconds
        while True:
            self.status.poll()
            self.listen()
            if ready(self.status) or time.monotonic() > end:
                return ready(self.status)
            time.sleep(0.01)

    def wait(self, ready):
        if not self.sees(ready, MOST):
            raise TimeoutError

    def listen(self):
        told = self.errors.poll()
        while told:
            self.said.append(told[1].strip())
            told = self.errors.poll()

    def tell(self, word, *arguments):
        getattr(self.command, word)(*arguments)
        self.command.wait_complete()

    def ask(self, ready, *commands):
        """Ask for a mode or state until it is in force, as an operator does who sees that it is not.

        While anything moves LinuxCNC's motion takes no other mode, and before its task has seen that the emergency
        stop is reset, it is not switched on; neither is said. On a busy computer the status may be older than that.
        """
        end = time.monotonic() + MOST
        while time.monotonic() < end:
            for word, argument in commands:
                self.tell(word, argument)
            if self.sees(ready, PATIENCE):
                return
        raise TimeoutError

    def take_mode(self, mode):
        self.ask(lambda s: s.task_mode == mode, ("mode", mode))

    def switch_on(self):
        self.wait(lambda s: s.joints == self.joints)
        states = [("state", linuxcnc.STATE_ESTOP_RESET), ("state", linuxcnc.STATE_ON)]
        self.ask(lambda s: s.task_state == linuxcnc.STATE_ON, *states)

    def home(self):
        self.joint_mode()
        self.tell("home", -1)
        self.wait(lambda s: all(s.homed[: self.joints]))

    def joint_mode(self):
        self.take_mode(linuxcnc.MODE_MANUAL)
        self.ask(lambda s: s.motion_mode == linuxcnc.TRAJ_MODE_FREE, ("teleop_enable", 0))

    def world_mode(self):
        self.take_mode(linuxcnc.MODE_MANUAL)
        self.ask(
            lambda s: s.motion_mode == linuxcnc.TRAJ_MODE_TELEOP or s.task_state != linuxcnc.STATE_ON,
            ("teleop_enable", 1),
        )

    def jog(self, axis, speed, seconds):
        """Jog an axis by its number, mm/s or degrees/s."""
        self.world_mode()
        self._jog(0, axis, speed, seconds)

    def jog_joint(self, joint, speed, seconds):
        self.joint_mode()
        self._jog(1, joint, speed, seconds)

    def _jog(self, is_joint, number, speed, seconds):
        self.command.jog(linuxcnc.JOG_CONTINUOUS, is_joint, number, speed)
        time.sleep(seconds)
        self.command.jog(linuxcnc.JOG_STOP, is_joint, number)

    def mdi(self, block, seconds=None):
        """Run a block; with seconds abort it after these."""
        self.take_mode(linuxcnc.MODE_MDI)
        self.command.mdi(block)
        self._run_out(seconds)

    def program(self, name, seconds=None):
        path = str(Path(name).resolve())
        self.take_mode(linuxcnc.MODE_AUTO)
        self.tell("program_open", path)
        self.wait(lambda s: s.file == path)
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        self._run_out(seconds)

    def _run_out(self, seconds):
        if self.pressing is not None:
            time.sleep(self.pressing)
            self.stop_at_once(0.2)
            return
        time.sleep(0.1 if seconds is None else seconds)
        if seconds is not None:
            self.abort()

    def abort(self):
        self.tell("abort")

    def override(self, share):
        self.tell("feedrate", share)

    def stop_at_once(self, seconds):
        """Press the emergency stop in the middle of a step, and switch on again."""
        self.tell("state", linuxcnc.STATE_ESTOP)
        time.sleep(seconds)
        self.switch_on()

    def stop_amid(self, word, *arguments):
        """Begin a move, press the emergency stop amid it, and switch on again."""
        *given, seconds = arguments
        self.pressing = seconds
        getattr(self, word)(*given)
        self.pressing = None

    def pause_amid(self, name, seconds, pause):
        """Run a program with a pause."""
        self.program(name)
        time.sleep(seconds)
        self.command.auto(linuxcnc.AUTO_PAUSE)
        time.sleep(pause)
        self.command.auto(linuxcnc.AUTO_RESUME)

    def interrupt(self, pin):
        """Open the emergency stop's contact, a HAL pin, until LinuxCNC has stopped, and close it again."""
        subprocess.run(["halcmd", "setp", pin, "0"], check=True)
        self.wait(lambda s: s.task_state == linuxcnc.STATE_ESTOP)
        subprocess.run(["halcmd", "setp", pin, "1"], check=True)

    def is_off(self):
        self.status.poll()
        return self.status.task_state != linuxcnc.STATE_ON

    def stands(self):
        """Wait until the machine stands, or is off."""
        since, last = time.monotonic(), None
        end = since + MOST
        while time.monotonic() < end:
            self.status.poll()
            self.listen()
            here = (*self.status.position, *self.status.joint_position)
            moved = last is None or max(abs(a - b) for a, b in zip(here, last, strict=True)) > FLICKER
            busy = self.status.interp_state != linuxcnc.INTERP_IDLE or not self.status.inpos
            if moved or (busy and not self.is_off()):
                since, last = time.monotonic(), here
            if time.monotonic() > since + REST:
                return
            time.sleep(0.01)
        raise TimeoutError

    def trails(self):
        """Whether the position by the feedback is not the commanded one."""
        pairs = zip(self.status.position, self.status.actual_position, strict=True)
        return max(abs(a - b) for a, b in pairs) > TRAILS

    def describe(self):
        s, end = self.status, time.monotonic() + LATE
        s.poll()
        while (
            time.monotonic() < end
            and max(abs(a - b) for a, b in zip(s.position, s.actual_position, strict=True)) > 1e-7
        ):
            time.sleep(0.01)  # on a busy computer the status may have been older than the rest that was waited for
            s.poll()
        return {
            "on": s.task_state == linuxcnc.STATE_ON,
            "position": list(s.position),
            "shown": list(s.actual_position),
            "joints": list(s.joint_position[: self.joints]),
            "told": [joint["output"] for joint in s.joint[: self.joints]],
            "said": self.said,
            "tool": s.tool_offset[2],
            "identity": read_pin("kins.identity") == "TRUE",
        }


def read_pin(name):
    """Read a pin of HAL."""
    return subprocess.run(["halcmd", "getp", name], capture_output=True, text=True).stdout.strip()


def work(task, seen):
    operator = Operator(task["joints"])
    operator.switch_on()
    operator.home()
    for step in task["steps"]:
        operator.said, begin = [], time.monotonic()
        try:
            getattr(operator, step[0])(*step[1:])
            operator.stands()
            seconds = time.monotonic() - begin
            seen["steps"].append({"step": step, "seconds": seconds} | operator.describe())
            if operator.is_off():
                step = ["switch on"]
                operator.switch_on()
        except TimeoutError:
            seen["hung"] = {"step": step, "said": operator.said, "sent": operator.command.serial}
            seen["hung"]["state"] = dump(operator.status)
            return


def main():
    task, seen = json.loads(Path("task.json").read_text()), {"steps": []}
    with Path("samples.txt").open("w") as file, subprocess.Popen(["halsampler"], stdout=file) as sampler:
        try:
            work(task, seen)
        finally:
            time.sleep(DRAINING)
            sampler.terminate()
            Path("seen.json").write_text(json.dumps(seen))


if __name__ == "__main__":
    main()
