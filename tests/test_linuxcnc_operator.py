"""The real LinuxCNC in an operator's hands: jogs, MDI, stops, as they come."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from shipped import EVERYTHING, load_shipped

from parakin.controllers.linuxcnc.hand_box import find_hand_box

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from session import run_session
from simulation import CYCLE, simulated, why_not
from stub import FIELDS, inward, outward, pose, world

STEPS = 100 if EVERYTHING else 8  # of a random session

WHY_NOT = why_not()
pytestmark = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)


def operate(name, steps):
    """Do steps on a shipped machine; return it, what was seen, and the joints (n, joints) of every cycle once homed."""
    machine = load_shipped(name)
    with simulated(machine) as simulation:
        seen, rows = simulation.operate(steps)
    joints = rows[:, 2 + len(machine.axes) :]
    homed = int((joints != joints[0]).any(1).argmax()) + 1
    return machine, seen, joints[homed:]


def check_joints(machine, joints, seen):
    """No joint is beyond its range, or in jogs beyond its speed, and the pose that is shown is the commanded one."""
    low, high = (
        outward(machine, np.array([getattr(drive, end) for drive in machine.drives])) for end in ("low", "high")
    )
    assert ((joints >= low - 1e-6) & (joints <= high + 1e-6)).all()
    speed = outward(machine, np.array([drive.speed for drive in machine.drives]))
    assert (np.abs(np.diff(joints, axis=0)) <= 2.0 * CYCLE * speed + 1e-5).all()
    for step in seen:
        assert np.abs(np.array(step["position"]) - step["shown"]).max() < 1e-6, step
        given, at = pose(machine, np.array([step["position"]])), inward(machine, np.array([step["joints"]]))
        assert machine.check(given, at)[0] == 0, step


def test_a_mirror_pose_is_refused_and_jogs_stop_softly():
    steps = [["mdi", "G1 C5 F3000"], ["mdi", "G1 C-20 F3000"], ["mdi", "G1 C35 F3000"]]
    steps += [["jog", 5, -20, 1.5], ["jog", 5, 20, 0.5], ["jog", 0, 100, 2.0], ["jog", 0, -50, 0.5]]
    machine, seen, joints = operate("lambda6", steps)
    assert all(step["on"] for step in seen)
    check_joints(machine, joints, seen)
    c, x = ([step["position"][FIELDS.index(axis)] for step in seen] for axis in "CX")
    assert c[:2] == pytest.approx([5.0, 5.0])
    assert "kinematicsInverse" in seen[1]["said"][0]
    box = find_hand_box(machine)
    ends = world(machine, np.array([box.low, box.high]))
    assert ends[0, FIELDS.index("C")] - 0.01 < c[3] < 25.0  # it stopped at the box's end,
    assert c[4] > c[3] + 1.0  # and went back
    assert 100.0 < x[5] < ends[1, 0] + 0.01
    assert x[6] < x[5] - 10.0
    assert any("jog-stop" in word for word in seen[3]["said"])


def test_a_wrist_is_jogged_from_home_without_a_swing():
    steps = [
        ["jog", 1, 100, 1.0],
        ["jog", 1, -100, 1.0],
        ["jog", 4, 20, 1.0],
        ["jog", 4, -20, 1.0],
        ["jog", 5, 20, 0.5],
    ]
    machine, seen, joints = operate("tricept", steps)
    assert all(step["on"] for step in seen)
    check_joints(machine, joints, seen)
    speed = outward(machine, np.array([drive.speed for drive in machine.drives]))
    assert (np.abs(np.diff(joints, axis=0)) <= CYCLE * speed + 1e-5).all()
    assert seen[0]["position"][1] > 20.0


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_table", "hexapod"] if EVERYTHING else ["tricept"])
def test_a_random_session(name):
    seen, _, wrong = run_session(load_shipped(name), STEPS, 11)
    assert len(seen) == STEPS
    assert not wrong
