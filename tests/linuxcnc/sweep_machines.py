"""Run shipped machines under the real LinuxCNC, with drives that follow within 2 % of their limits.

``python sweep_machines.py [MACHINE ...]``, all without a name. Each is started, homed and moved by hand, runs its first
program and one through its hand box, and ends where it began. The table tells the greatest speed and acceleration of
any cycle over the joint's limit, and what did not hold.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from cycles import RISE, SPEED, check_joints, measure_use, write_move_away
from simulation import make_configuration, simulated
from stub import FIELDS, world

import parakin as pk
from parakin.controllers.linuxcnc.hand_box import find_hand_box
from parakin.controllers.linuxcnc.home_pose import find_home_pose

LIMITED = 0.02  # drives' limits above the description's
POSES, FEED = 6, 6000.0  # of the second program, mm/min
AGREE = 1e-6  # mm and degrees


def write_program(machine):
    """The first program, and from its end through poses of the hand box and back home, corners rounded."""
    box, home = find_hand_box(machine), find_home_pose(machine)
    poses = np.random.default_rng(3).uniform(box.low, box.high, (POSES, len(home)))
    rows = world(machine, np.vstack([poses, home]))
    blocks = [" ".join(f"{axis}{row[FIELDS.index(axis)]:.6f}" for axis in machine.axes) for row in rows]
    first = make_configuration(machine)[f"{machine.name}.ngc"].replace("\nM2\n", "\n")
    return "\n".join([first, "G64 P0.5", *(f"G1 {block} F{FEED:g}" for block in blocks), "M2", ""])


def run_machine(machine):
    """Run a machine; the cells of its row and what did not hold."""
    begin = perf_counter()
    program = write_program(machine)
    made, begin = perf_counter() - begin, perf_counter()
    with simulated(machine, LIMITED) as simulation:
        run = simulation.run({"by hand": [write_move_away(machine)], "program": "sweep.ngc"}, {"sweep.ngc": program})
    ran, wrong = perf_counter() - begin, []
    seen, home = run.seen, world(machine, find_home_pose(machine)[None])[0]
    if "told" in seen:
        return f"{made:.0f} s | {ran:.0f} s | {len(run.joints)} | |", [f"LinuxCNC said: {seen['told']}"]
    counted = slice(5 if machine.has_direction else 9)  # upright, it may have any C
    for when in ("home", "program", "at last"):
        off = np.abs(np.array(seen[when]) - home)[counted].max()
        if off > AGREE:
            wrong.append(f"{when}: {off:g} off home")
    speed, rise = measure_use(machine, run.joints)
    if speed > SPEED or rise > RISE:
        wrong.append("a joint beyond its limits")
    try:
        check_joints(machine, run.poses, run.joints)
    except AssertionError as error:
        wrong.append(f"joints: {error}".splitlines()[0])
    return f"{made:.0f} s | {ran:.0f} s | {len(run.joints)} | {speed:.3f} | {rise:.3f}", wrong


def main():
    print(
        "| machine | made in | ran for | cycles | speed | acceleration | |\n|---|---|---|---|---|---|---|", flush=True
    )
    failed = 0
    for name in sys.argv[1:] or pk.machines():
        try:
            cells, wrong = run_machine(pk.load(name))
        except Exception as error:
            cells, wrong = "| | | |", [f"{type(error).__name__}: {error}".replace("\n", " ")[-300:]]
        failed += bool(wrong)
        print(f"| {name} | {cells} | {'; '.join(wrong) or 'held'} |", flush=True)
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
