"""The real LinuxCNC in an operator's hands: tool lengths, joints one by one, and singularities in the way."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.performance.singularities import compute_singularity_margins

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from simulation import CYCLE, simulated, why_not
from stub import FIELDS, inward, outward, pose

WHY_NOT = why_not()
pytestmark = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)

HEXAGLIDE = Path(__file__).parent / "machines" / "hexaglide.yaml"
LIMITED = 0.02  # drives' limits above the description's


def operate(machine, steps, programs=None):
    """Do steps on a machine with limited drives; what was seen after each, and all cycles' joints once homed."""
    with simulated(machine, LIMITED) as simulation:
        seen, rows = simulation.operate(steps, programs)
    joints = rows[:, 2 + len(machine.axes) :]
    for step in seen:
        assert step["on"], step
        assert np.abs(np.array(step["position"]) - step["shown"]).max() < 1e-6, step
    return seen, joints[int((joints != joints[0]).any(1).argmax()) + 1 :]


def point_tool(row):
    """The tool's axis Rz(C)·Ry(B)·z of a row X Y Z A B C, degrees."""
    b, c = np.radians(row[4:6])
    return np.array([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)])


def check_pose(machine, own, step):
    """The joints put the machine's own tip at a pose (axes,), as the library has it."""
    there = machine.forward(inward(machine, np.array([step["joints"]])), near=own[None])
    assert there.converged.all()
    assert np.abs(there.poses[0] - own)[:3].max() < 1e-6, step
    tools = [point_tool(np.degrees([0.0, 0.0, 0.0, 0.0, *row[3:]])) for row in (there.poses[0], own)]
    assert np.abs(tools[0] - tools[1]).max() < 1e-9, step


def test_a_tilted_tools_length_counts_along_the_tool():
    tilted, upright = "G1 X10 Y20 Z-1650 B20 C30 F9000", "G1 X40 Y20 Z-1650 B0 C30"
    steps = [[40.0, "G43.1 Z40"], [40.0, tilted], [-30.0, "G43.1 Z-30"], [-30.0, "G1 X30"], [-30.0, upright]]
    steps += [[70.0, "G43.1 Z70"], [70.0, "G91 G1 X5"], [70.0, "G90 G1 X45 B20"], [0.0, "G49"]]
    steps.insert(2, [40.0, "jog", 0, 20, 1])
    machine = load_shipped("tricept")
    words = [["mdi", *step] if step[0] != "jog" else step for step in (step[1:] for step in steps)]
    seen, _ = operate(machine, words)
    assert not any(step["said"] for step in seen)
    for step, (length, *_) in zip(seen, steps, strict=True):
        row = np.array(step["position"])
        own = pose(machine, row[None])[0]
        own[:3] = row[:3] + length * (point_tool(row) - [0.0, 0.0, 1.0])
        check_pose(machine, own, step)
    for number in (3, 6, 9):  # the length changes, the joints stay
        assert seen[number]["joints"] == pytest.approx(seen[number - 1]["joints"], abs=1e-9)


def test_a_program_that_takes_a_place_from_before_the_length_changed_is_refused():
    first = "G21 G90\nG1 X0 Y0 Z-1650 B20 C30 F3000\nG43.1 Z50\n"
    programs = {"stale.ngc": f"{first}G1 X10\nM2\n", "named.ngc": f"{first}G1 X10 Y10 Z-1640\nG1 X0\nM2\n"}
    programs |= {"waits.ngc": f"{first}M66 E0 L0\nG1 X10\nM2\n", "relative.ngc": f"{first}G91 G1 X1 Y1 Z1\nG90\nM2\n"}
    steps = [step for name in programs for step in (["program", name], ["mdi", "G49"])]
    programs["after.ngc"] = "G21 G91\nG1 X1 Y2 Z3 F3000\nG90\nM2\n"
    steps += [["mdi", "G1 B20 C30 F3000"], ["mdi", "G43.1 Z50"], ["program", "after.ngc"]]
    (*seen, told, moved), _ = operate(load_shipped("tricept"), steps, programs)
    said = [" ".join(step["said"]) for step in seen[::2]]
    assert "line 4 goes on from where the tool was" in said[0] and not said[1] and not said[2]
    assert "line 4 goes on from where the tool was" in said[3]
    assert seen[2]["position"][:3] == pytest.approx([0.0, 10.0, -1640.0 + 50.0], abs=1e-6)
    assert not moved["said"]  # from the hands, before a program, the new place is known
    assert np.subtract(moved["position"], told["position"])[:3] == pytest.approx([1.0, 2.0, 3.0], abs=1e-6)


def test_joints_are_moved_one_by_one_and_the_pose_is_right_after():
    machine = load_shipped("tricept")
    steps = [["mdi", "G1 B20 C30 F3000"], ["mdi", "M429"], ["mdi", "G53 G1 X1215 F600"], ["jog", 1, 20, 1]]
    steps += [["jog_joint", 2, 5, 1], ["mdi", "M430"], ["mdi", "M428"], ["mdi", "G1 X0 F6000"]]
    seen, joints = operate(machine, steps)
    columns = [FIELDS.index(axis) for axis in machine.axes]
    for step in seen[1:5]:  # every axis shows the joint of its number
        assert np.array(step["position"])[columns] == pytest.approx(step["joints"], abs=1e-9)
    assert seen[2]["joints"][0] == pytest.approx(1215.0)
    assert seen[3]["joints"][1] > seen[2]["joints"][1] + 15.0
    assert "NO THIRD" in " ".join(seen[5]["said"])
    for step in seen[6:]:
        check_pose(machine, pose(machine, np.array([step["position"]]))[0], step)
    assert seen[6]["joints"] == pytest.approx(seen[4]["joints"], abs=1e-9)
    speed = outward(machine, np.array([drive.speed for drive in machine.drives]))
    assert (np.abs(np.diff(joints, axis=0)) <= CYCLE * speed + 1e-5).all()


def test_a_hexaglide_stops_before_a_singularity_and_is_driven_out_joint_by_joint():
    machine = pk.load(str(HEXAGLIDE))
    home = compute_singularity_margins(machine, machine.home)[0]
    turn = np.array(machine.home)
    turn[4] = np.radians(3.3)  # beyond a singularity
    assert compute_singularity_margins(machine, turn)[0] * home < 0.0
    steps = [["mdi", "G1 B2.5 F600"], ["jog", 4, 3, 1.0], ["jog", 4, -3, 0.5], ["mdi", "G1 B10"]]
    steps += [["mdi", "G1 A0 B0 C12"], ["jog", 5, 3, 1.0], ["jog", 5, -3, 0.5], ["mdi", "G1 C0"]]
    steps += [["jog_joint", 0, -80, 1.5], ["jog_joint", 0, 40, 0.5], ["mdi", "M429"], ["jog", 0, -100, 1.0]]
    steps += [["jog", 0, 40, 1.0], ["mdi", "M428"], ["mdi", "G1 B0"]]
    seen, joints = operate(machine, steps)
    b, c = ([step["position"][column] for step in seen] for column in (4, 5))
    assert (
        2.5 < b[1] < 3.2 and b[2] < b[1] - 1.0 and abs(b[3] - b[2]) < 1e-9 and 12.0 < c[5] < 13.6 and c[6] < c[5] - 1.0
    )
    assert "kinematicsInverse" in seen[3]["said"][0]
    for number in (1, 5, 8, 11):
        assert any("jog-stop" in word for word in seen[number]["said"]), seen[number]
    poses = pose(machine, np.array([seen[k]["position"] for k in (*range(10), 13, 14)]))
    assert (compute_singularity_margins(machine, poses)[:, 0] / home > 0.02).all()
    given = inward(machine, np.array([seen[k]["joints"] for k in (*range(10), 13, 14)]))
    assert np.abs(machine.inverse(poses) - given).max() < 1e-6
    speed = outward(machine, np.array([drive.speed for drive in machine.drives]))
    assert (np.abs(np.diff(joints, axis=0)) <= CYCLE * speed + 1e-5).all()
