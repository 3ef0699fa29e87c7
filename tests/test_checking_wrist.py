"""Checking beside and on the wrist's pole, and parallel singularities on motions."""

import math
from dataclasses import replace

import numpy as np
import pytest
from motion_sampling import TURN, pose, posted_on, ranged
from shipped import load_shipped

from parakin.performance.singularities import compute_singularity_margins
from parakin.toolpath.checking.check import check_path
from parakin.toolpath.checking.motion_bisection import MotionBisection

# Head and table.


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head", "orthoglide5_table"])
def test_turns_counted_over_the_seam(name):
    machine = load_shipped(name)
    c = np.arange(0.0, 330.0, 10.0)
    poses = [pose(machine, B=20.0, C=angle) for angle in c]
    joint = list(machine.joints).index("c" if "c" in machine.joints else "theta1")
    turns = np.zeros(len(machine.joints))
    turns[joint] = -round(posted_on(machine, poses).joints[:, joint].mean() / TURN)
    posted = posted_on(machine, poses, turns=turns)
    values = posted.joints[:, joint]
    assert np.ptp(values) > math.radians(300.0)  # over ±180° somewhere
    assert check_path(posted).first is None
    # A range that ends within a motion, and one that holds all.
    name = machine.joints[joint]
    end = 0.5 * (values[20] + values[21])
    others = values.min(), values.max()
    ranges = (others[0] - 0.1, end) if values[-1] > values[0] else (end, others[1] + 0.1)
    tight = ranged(machine, {name: ranges})  # its joints are told on the turn of their ranges
    turns[joint] = round((values - posted_on(tight, poses).joints[:, joint]).mean() / TURN)
    checked = check_path(posted_on(tight, poses, turns=turns))
    assert checked.first.record == 21
    assert checked.first.begins == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("name", ["orthoglide5_head", "orthoglide5_table"])
def test_a_pole_is_crossed_without_a_swing(name):
    machine = load_shipped(name)
    b = np.array([6.0, 4.0, 1.5, -2.0, -4.0])
    poses = [pose(machine, B=angle, C=40.0) for angle in b]
    posted = posted_on(machine, poses)
    assert np.ptp(posted.joints[:, -2:], axis=0).max() < math.radians(15.0)
    assert check_path(posted).first is None


def test_beside_a_pole_the_swing_is_followed():
    machine = load_shipped("orthoglide5_head")
    poses = [pose(machine, B=5.0, C=0.0), pose(machine, B=1e-3, C=20.0), pose(machine, B=1e-3, C=140.0)]
    poses.append(pose(machine, B=5.0, C=160.0))
    assert check_path(posted_on(machine, poses)).first is None
    tight = ranged(machine, {"theta1": (math.radians(-10.0), math.radians(150.0))})
    first = check_path(posted_on(tight, poses)).first
    assert (first.record, first.limit) == (3, "theta1.max")
    assert first.begins == pytest.approx(0.5, abs=1e-6)


def test_upright_throughout():
    machine = load_shipped("orthoglide5_head")
    rng = np.random.default_rng(2)
    poses = np.tile(machine.home, (300, 1))
    poses[:, :3] += rng.uniform(-30.0, 30.0, (300, 3))
    assert check_path(posted_on(machine, poses)).first is None
    poses[:, 3] = rng.uniform(0.0, 1.5e-6, 300)  # rounding in the file
    bisection = MotionBisection(posted_on(machine, poses))
    bisection.check_motions(lambda fraction: None)
    assert not bisection.broken_motions.any()
    assert bisection.prover.boxes < 3 * 300


@pytest.mark.parametrize("c", [0.0, 40.0, -115.0])
def test_three_axis_work_on_a_table_at_its_pole(c):
    table = ranged(load_shipped("orthoglide5_table"), dict.fromkeys(("rho_x", "rho_y", "rho_z"), (150.0, 290.0)))
    rng = np.random.default_rng(8)
    ends = np.column_stack([rng.uniform(-90.0, 90.0, (200, 3)), np.zeros((200, 2))])
    joints = table.follow(np.vstack([pose(table, X=0.0, B=1e-3, C=c), ends]))[1:]
    posted = replace(posted_on(table, ends), joints=joints)
    posted = replace(posted, broken=np.atleast_1d(table.check(ends, joints)))
    checked = check_path(posted)
    share = np.linspace(0.0, 1.0, 501)[:, None, None]
    dense = (ends[:-1] + share * np.diff(ends, axis=0)).reshape(-1, 5)
    held = table.follow(np.vstack([pose(table, X=0.0, B=1e-3, C=c), dense]))[1:]
    margins = table.margins(dense, held).reshape(501, 199, -1)
    least, at_ends = margins.min(0), margins[[0, -1]].min(0)
    stray = ((at_ends >= 0.0) & (least < -1e-6)).any(1)
    unsure = ((at_ends >= 0.0) & (np.abs(least) <= 1e-3)).any(1)
    assert stray.any() and not stray.all()
    assert checked.broken_motions is not None and "untold" not in {offence.limit for offence in checked.offences}
    assert ((checked.broken_motions[1:] > 0) == stray)[~unsure & np.isfinite(margins).all((0, 2))].all()


def test_joints_that_are_whole_turns_off():
    machine = load_shipped("orthoglide5_head")
    poses = [pose(machine, B=30.0, C=angle) for angle in (0.0, 20.0, 150.0, 160.0)]
    assert check_path(posted_on(machine, poses)).first is None
    turns = np.zeros((4, 5))
    turns[2:, 3] = -1.0
    checked = check_path(posted_on(machine, poses, turns=turns))
    assert [offence.limit for offence in checked.offences] == ["turns"]
    assert (checked.first.record, checked.broken_motion_count, checked.limits[-1]) == (2, 1, "turns")
    assert checked.limits[checked.broken_motions[2] - 1] == "turns"
    assert checked.first.value == pytest.approx(math.radians(130.0), abs=1e-9)
    text = "joint theta1 would turn by 130.0° from the record before, not by -230.0°"
    assert checked.first.text == text


def test_a_motion_of_whole_turns():
    machine = load_shipped("orthoglide5_head")
    poses = [pose(machine, B=30.0, C=angle) for angle in (0.0, -360.0, -350.0)]
    back = np.zeros((3, 5))
    back[1:, 3] = -1.0
    assert check_path(posted_on(machine, poses, turns=back)).first is None
    first = check_path(posted_on(machine, poses)).first
    assert (first.limit, first.record) == ("turns", 1)
    assert first.value == pytest.approx(-TURN, abs=1e-9)


def test_records_that_change_the_working_mode_far_from_the_pole():
    # The tip at (300, 0, -1600): the tool stands along the central leg at B = 10.6°, C = 180°; a motion at B = 21°
    # from C = 95° to 265° goes round that pole, while following the records alone leads across it.
    machine = load_shipped("tricept")
    ends = np.array([pose(machine, X=300.0, Z=-1600.0, B=21.0, C=c) for c in (95.0, 265.0)])
    checked = check_path(posted_on(machine, ends))
    assert [offence.limit for offence in checked.offences] == ["turns"]
    assert checked.broken_motion_count == 1
    assert "at once" in checked.first.text
    dense = posted_on(machine, ends[0] + np.linspace(0.0, 1.0, 400)[:, None] * (ends[1] - ends[0]))
    assert check_path(dense).first is None


# Singularities.


def test_a_parallel_singularity_is_found_where_the_rods_are_parallel():
    # Equal rods of l: along (l² - y²)^½, y and x, (l² - x²)^½; parallel on the circle x² + y² = l².
    machine = load_shipped("hbg80_2d")
    wide = ranged(machine, dict.fromkeys(machine.joints, (-9e3, 9e3)))
    rod = 400.0
    posted = posted_on(wide, [[200.0, 200.0], [300.0, 300.0], [310.0, 300.0], [250.0, 200.0]])
    assert posted.broken_record_count == 0
    checked = check_path(posted)
    assert [offence.limit for offence in checked.offences] == ["singularity"]
    first = checked.first
    assert (first.record, first.count, checked.broken_motion_count) == (1, 2, 2)
    assert 200.0 + 100.0 * first.begins == pytest.approx(rod / math.sqrt(2.0), abs=0.05)
    assert first.text == "the machine would pass a parallel singularity"
    assert check_path(posted_on(wide, [[200.0, 200.0], [282.0, 282.0], [200.0, 200.0]])).first is None


def test_parallel_singularities_are_those_of_a_dense_sample():
    machine = load_shipped("lambda6")  # singular about C = 0
    rng = np.random.default_rng(8)
    half = np.array([60.0, 60.0, 60.0, 0.2, 0.2, 0.5])
    poses = machine.home + rng.uniform(-1.0, 1.0, (80, 6)) * half - [0, 0, 0, 0, 0, 0.4]
    posted = posted_on(machine, poses)
    checked = check_path(posted)
    share = np.linspace(0.0, 1.0, 400)[:, None, None]
    margin = compute_singularity_margins(machine, poses[:-1] + share * np.diff(poses, axis=0))[:, :, 0]
    crossed = margin.min(0) * margin.max(0) < 0.0
    near = ~crossed & (np.abs(margin).min(0) < 1e-3)
    offence = {offence.limit: offence for offence in checked.offences}["singularity"]
    assert 5 < crossed.sum() < 60
    assert crossed.sum() <= offence.count <= crossed.sum() + near.sum()
    first = int(np.flatnonzero(crossed | near)[0])
    if crossed[first]:
        assert offence.record == first + 1
        place = float(share[int(np.argmax(margin[:, first] * margin[0, first] < 0.0)), 0, 0])
        assert offence.begins == pytest.approx(place, abs=5e-3)
