"""Passes over and beside a pole: led through it within tolerance, or noted with their swing."""

import math

import numpy as np
import pytest
from dense_deviations import UNDER, axis_of, path_of, programmed, tools, within
from scipy.spatial.transform import Rotation
from shipped import load_shipped

import parakin as pk
from parakin.toolpath.linearise.linearise import linearise_path
from parakin.toolpath.linearise.pole_steps import PoleSteps
from parakin.toolpath.linearise.pole_swings import note_swings
from parakin.toolpath.linearise.poles import find_poles
from parakin.toolpath.posting.post import post_path


def across(name, miss, count, span=20.0):
    """Tips and axes over the pole of a head or table, missing it by ``miss`` rad."""
    x = np.tan(np.radians(np.linspace(-span, span, count)))
    axis = Rotation.from_euler("z", 30, degrees=True).apply(
        np.column_stack([x, np.full(count, math.tan(miss)), np.ones(count)])
    )
    tip = np.array(
        {"orthoglide5_head": [0, 0, -100.0], "orthoglide5_table": [0, 0, 0.0], "tricept": [0, 0, -1650.0]}[name]
    )
    return path_of(
        tip + np.linspace(-5, 5, count)[:, None] * [1.0, 0.0, 0.0], axis / np.linalg.norm(axis, axis=1)[:, None]
    )


def swing(posted):
    return np.degrees(np.ptp(posted.joints[:, posted.machine.wrist.first]))


@UNDER
@pytest.mark.parametrize("count", [2, 5, 201])
@pytest.mark.parametrize("miss", [0.0, 5e-5, 4e-4, 9e-4])
@pytest.mark.parametrize("name", ["orthoglide5_head", "orthoglide5_table"])
def test_a_pass_within_the_tolerance_is_led_through_the_pole(name, under, count, miss):
    posted = post_path(load_shipped(name), across(name, miss, count))
    result = linearise_path(posted, under, chord=0.05)
    assert within(posted, result, under, 0.05, 1e-3) <= 1.0
    assert swing(result) < 8.0
    assert not result.path.notes
    assert result.broken_record_count == 0


@UNDER
@pytest.mark.parametrize("count", [2, 201])
@pytest.mark.parametrize("miss", [2e-3, 0.014])
def test_a_pass_beside_the_pole_is_told(under, count, miss):
    posted = post_path(load_shipped("orthoglide5_head"), across("orthoglide5_head", miss, count))
    result = linearise_path(posted, under, chord=0.05)
    assert within(posted, result, under, 0.05, 1e-3) <= 1.0
    assert swing(result) > 170.0
    (note,) = result.path.notes
    assert note.line == posted.path.line[1 if count == 2 else 101] or note.line == posted.path.line[100]
    around = 2.0 * math.degrees(math.atan(math.tan(0.05) / miss))  # while the axis turns by 0.05 rad to either side
    off = f"{math.degrees(miss):.2g}"
    head, _, told = note.text.partition(": theta1 swings ")
    assert head == f"the tool axis passes {off}° beside the head's pole"
    assert float(told.removesuffix("°")) == pytest.approx(around, abs=4.0)
    assert linearise_path(result, under, chord=0.05).path.notes == (note,)  # once


@UNDER
def test_the_wrist_of_a_tricept(under):
    """Its pole is the platform's normal, and stands apart from B = 0."""
    machine = load_shipped("tricept")
    joints = machine.inverse([60.0, -50.0, -1620.0, 0.3, 0.7])
    ends = np.array([joints, joints])
    ends[0, 3:], ends[1, 3:] = np.radians([25.0, -18.0]), np.radians([25.0, 18.0])
    poses = machine.forward(ends, near=[60.0, -50.0, -1620.0, 0.3, 0.7]).poses
    tip, axis = tools(machine, poses)
    tip[:] = tip.mean(0)
    for count, most in ((2, 4.0), (300, 4.0)):
        k = programmed(path_of(tip, axis), 1, np.linspace(0, 1, count))[1]
        posted = post_path(machine, path_of(np.tile(tip[0], (count, 1)), k))
        result = linearise_path(posted, under, chord=0.02, angle=3e-3)
        assert within(posted, result, under, 0.02, 3e-3) <= 1.0
        assert swing(result) < most
        assert not [note for note in result.path.notes if "theta1" in note.text]


def test_jitter_about_the_pole_is_stilled():
    machine = load_shipped("orthoglide5_head")
    rng = np.random.default_rng(5)
    axis = np.column_stack([rng.uniform(-4e-4, 4e-4, (80, 2)), np.ones(80)])
    path = path_of(
        np.column_stack([np.linspace(-20, 20, 80), np.zeros(80), np.full(80, -100.0)]),
        axis / np.linalg.norm(axis, axis=1)[:, None],
    )
    posted = post_path(machine, path)
    assert swing(posted) > 90.0
    result = linearise_path(posted, "joints")
    assert within(posted, result, "joints", 0.01, 1e-3) <= 1.0
    assert swing(result) < 8.0
    assert not result.path.notes


def test_a_corner_on_the_pole_is_told():
    path = across("orthoglide5_head", 0.0, 3)
    path.axis[2] = axis_of(20.0, 120.0)  # came along 210 deg, goes on along 120
    posted = post_path(load_shipped("orthoglide5_head"), path)
    result = linearise_path(posted, "joints", chord=0.05)
    assert within(posted, result, "joints", 0.05, 1e-3) <= 1.0
    assert [note.text for note in result.path.notes] == [
        "theta1 turns by 90° at the head's pole, the tool held 0.0069° beside it; the tip stands still"
    ]


def test_a_step_longer_than_the_travel_over_which_a_swing_is_measured():
    pole = find_poles(load_shipped("tricept"), "pose", False)[0]
    first, last = np.array([[-0.15, 0.005]]), np.array([[0.15, 0.005]])
    zero, one = np.zeros(1), np.ones(1)
    steps = PoleSteps(np.array([1]), zero, one, first, last, np.array([False]), 0.005 * one, 0.5 * one)
    path = path_of(np.zeros((2, 3)), np.tile([0.0, 0.0, 1.0], (2, 1)))
    (note,) = note_swings(pole, path, steps, [])
    turn = 2.0 * math.degrees(math.atan(0.15 / 0.005))  # over 0.3 of travel, of which 0.1 counts
    assert f"theta1 swings {turn / 3.0:.0f}°" in note.text


def test_a_pass_that_is_refused_leaves_its_neighbours_holds(tmp_path):
    # C turns by 43° on the pole without the holds, and the pass between them is bent by 20°.
    file = tmp_path / "holds.cls"
    file.write_text(
        "TOOL PATH/STAR\nFEDRAT/1000.0,MMPM\n"
        "GOTO/27.508648,0.224312,24.507783,0.123051,0.078926,0.989257\n"
        "GOTO/28.379296,0.236486,22.023002,0.000000,0.000000,1.000000\n"
        "GOTO/28.378924,0.227038,22.023831,0.106611,0.412754,0.904582\n"
        "GOTO/28.378924,0.227038,22.023831,-0.000009,-0.000005,1.000000\n"
        "GOTO/28.378468,0.228268,22.021668,-0.039888,-0.035276,0.998581\nFINI\n"
    )
    machine = load_shipped("orthoglide5_table")
    job = pk.prepare(machine, pk.read_path(file))
    assert job.posted.first is None
    assert job.trajectory is not None
