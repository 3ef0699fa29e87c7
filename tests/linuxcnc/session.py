"""A random session of an operator at the real LinuxCNC with limited drives: what is done, and what must hold after it.

``python session.py MACHINE STEPS SEED`` runs one, MACHINE a shipped machine or a YAML file, and prints what was wrong.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from time import perf_counter

import numpy as np
from simulation import CYCLE, simulated
from stub import FIELDS, inward, outward, pose, world

import parakin as pk
from parakin.controllers.linuxcnc.hand_box import find_hand_box
from parakin.controllers.linuxcnc.home_pose import find_home_pose

LIMITED = 0.02  # drives' limits above the description's
AGREE = 1e-6  # mm and degrees
HELD = 1e-2  # the same nearer to a wrist's pole than 8e-6 rad, where a joint is held
APART = 1e-4  # mm: the sampler writes six digits
STEP = 2.0  # of a joint's speed: the most in a cycle
FEEDS = 6e3, 6e4  # mm/min: the planner is to keep the joints' limits
STOPS = ("stop_at_once", "stop_amid")
LONGEST_STOP = 5.0  # s until the machine is on again: LinuxCNC's screens wait so long for a command that is not done


class Session:
    """The steps of a session, drawn one after the other."""

    def __init__(self, machine, seed):
        self.machine, self.rng, self.box = machine, np.random.default_rng(seed), find_hand_box(machine)
        self.columns = [FIELDS.index(axis) for axis in machine.axes]
        self.units = np.where(np.array(machine.axis_units) == "mm", 1.0, np.degrees(1.0))
        self.programs = {}

    def draw(self, count):
        kinds = [self.jog, self.jog, self.jog_joint, self.move, self.move, self.move_and_abort, self.move_and_stop]
        kinds += [self.run, self.run_and_abort, self.run_and_pause, self.override, self.stop, self.measure, self.switch]
        steps = []
        while len(steps) < count:
            steps += kinds[self.rng.integers(len(kinds))]()
        return steps[:count]

    def pick_sign(self):
        return float(self.rng.choice([-1.0, 1.0]))

    def pick_time(self, most=0.8):
        return round(float(self.rng.uniform(0.1, most)), 3)

    def jog(self):
        axis = int(self.rng.integers(len(self.columns)))
        speed = self.pick_sign() * self.rng.uniform(0.3, 1.0) * self.box.speed[axis] * self.units[axis]
        return [["jog", self.columns[axis], float(speed), self.pick_time()]]

    def jog_joint(self):
        joint = int(self.rng.integers(len(self.machine.joints)))
        speeds = outward(self.machine, np.array([[drive.speed for drive in self.machine.drives]]))[0]
        speed = self.pick_sign() * self.rng.uniform(0.02, 0.2) * speeds[joint]
        return [["jog_joint", joint, float(speed), self.pick_time()]]

    def write_move(self, word="G1"):
        row = world(self.machine, self.rng.uniform(self.box.low, self.box.high)[None])[0]
        places = " ".join(f"{FIELDS[column]}{row[column]:.4f}" for column in self.columns)
        return f"{word} {places} F{self.rng.uniform(*FEEDS):.0f}"

    def move(self):
        return [["mdi", self.write_move(str(self.rng.choice(["G0", "G1"])))]]

    def move_and_abort(self):
        return [["mdi", self.write_move(), self.pick_time()]]

    def move_and_stop(self):
        return [["stop_amid", "mdi", self.write_move(), self.pick_time()]]

    def write_program(self):
        name = f"session{len(self.programs)}.ngc"
        lines = [self.write_move() for _ in range(self.rng.integers(3, 9))]
        corners = str(self.rng.choice(["G61", "G64 P0.5", "G61.1"]))
        if self.rng.random() < 0.3:
            lines.insert(1, f"G43.1 Z{self.rng.uniform(-20.0, 20.0):.3f}")
        self.programs[name] = "\n".join(["G21 G90", corners, *lines, "M2", ""])
        return name

    def run(self):
        return [["program", self.write_program()]]

    def run_and_abort(self):
        return [["program", self.write_program(), self.pick_time(2.0)]]

    def run_and_pause(self):
        return [["pause_amid", self.write_program(), self.pick_time(1.5), self.pick_time(0.5)]]

    def override(self):
        return [["override", round(float(self.rng.uniform(0.4, 1.0)), 2)]]

    def stop(self):
        return [["stop_at_once", 0.2]]

    def measure(self):
        return [["mdi", f"G43.1 Z{self.rng.uniform(-20.0, 20.0):.3f}" if self.rng.random() < 0.7 else "G49"]]

    def switch(self):
        """Joint by joint a little way, and back by way of home; with more drives than freedoms it is refused."""
        machine = self.machine
        if machine.is_redundant:
            return [["mdi", "M429"], *self.jog_joint()]
        home = outward(machine, machine.inverse(find_home_pose(machine))[None])[0]
        back = " ".join(f"{machine.axes[i]}{home[i]:.6f}" for i in range(len(home)))
        axis = machine.axes[self.rng.integers(len(machine.axes))]
        steps = [["mdi", "M429"], ["mdi", f"G91 G1 {axis}{self.pick_sign()} F600"], ["mdi", "G90"]]
        return [*steps, *self.jog_joint(), ["mdi", f"G53 G1 {back} F6000"], ["mdi", "M428"]]


def run_session(machine, count, seed):
    """Run a session; return what was seen after each step, every cycle's joints once homed, and what did not hold."""
    session = Session(machine, seed)
    steps = session.draw(count)
    with simulated(machine, LIMITED) as simulation:
        seen, rows = simulation.operate(steps, session.programs, seconds=120 + 12 * count)
    joints = rows[:, 2 + len(machine.axes) :]
    joints = joints[int((joints != joints[0]).any(1).argmax()) + 1 :]
    wrong = [*check_steps(machine, seen), *check_joints(machine, joints, steps)]
    return seen, joints, [*wrong, *check_agreement(machine, joints)]


def check_steps(machine, seen):
    """Say what a step left wrong: machine off without a stop, another pose shown, a limit broken."""
    for number, step in enumerate(seen):
        words = f"step {number} {step['step']}, {step['said']}: "
        if not step["on"]:
            yield words + "the machine is off"
            continue
        if step["step"][0] in STOPS and step["seconds"] > LONGEST_STOP:
            yield words + f"it took {step['seconds']:.1f} s"
        off = np.abs(np.array(step["position"]) - step["shown"]).max()
        given, joints = pose(machine, np.array([step["position"]])), inward(machine, np.array([step["joints"]]))
        held = machine.wrist is not None and not step["identity"] and machine.wrist.find_free(given, 1.2e-5)[0]
        if not off < (HELD if held else AGREE):
            yield words + f"commanded and shown differ by {off:g}"
        if not step["identity"] and not step["tool"] and machine.check(given, joints)[0] != 0:
            yield words + f"limit {machine.limits[machine.check(given, joints)[0] - 1]} is broken"


def check_joints(machine, joints, steps):
    """Say where a joint left its range, or stepped farther than it can where nothing was stopped."""
    low, high = (outward(machine, np.array([[getattr(d, end) for d in machine.drives]]))[0] for end in ("low", "high"))
    beyond = ((joints < low - AGREE) | (joints > high + AGREE)).any(1)
    if beyond.any():
        yield f"{beyond.sum()} cycles beyond a joint's range"
    speed = outward(machine, np.array([[drive.speed for drive in machine.drives]]))[0]
    fast = (np.abs(np.diff(joints, axis=0)) > STEP * CYCLE * speed + 1e-5).any(1).sum()
    stops = sum(step[0] in STOPS for step in steps)  # then the commands become the feedback's
    if fast > stops:
        yield f"{fast} cycles in which a joint steps too far, {stops} stops"


def check_agreement(machine, joints):
    """Say where joints of more drives than freedoms were sent apart."""
    if machine.is_redundant:
        residual = machine.forward(inward(machine, np.unique(joints, axis=0)), near=machine.home).residual
        if not residual.max() < APART:
            yield f"joints that are {residual.max():g} mm apart"


def main():
    name, count, seed, begin = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), perf_counter()
    machine = pk.load(name)
    seen, joints, wrong = run_session(machine, count, seed)
    said = Counter(" ".join(step["said"])[:90] for step in seen)
    took = f"{perf_counter() - begin:.0f} s"
    print(f"{Path(name).stem}, seed {seed}: {len(seen)} steps, {len(joints)} cycles, {len(wrong)} wrong, {took}")
    print("\n".join([*wrong, *(f"{count:5d} x {words}" for words, count in said.most_common(12))]))


if __name__ == "__main__":
    main()
