"""Homing: directions and orders that keep a machine whole, against geometry; what can't be homed so is refused."""

from __future__ import annotations

import shutil
import sys
from dataclasses import replace
from math import sqrt
from pathlib import Path

import numpy as np
import pytest
from geometry import Description
from shipped import load_shipped

import parakin as pk
from parakin.controllers.linuxcnc.homing import find_homing, proof
from parakin.controllers.linuxcnc.homing.homing_plan import pace_return
from parakin.controllers.linuxcnc.homing.proof import prove_homing
from parakin.controllers.linuxcnc.homing.starts import compute_regularity, sample_starts
from parakin.controllers.linuxcnc.homing.walk import begin_walk, walk_joints
from parakin.controllers.linuxcnc.model_header import LEAST_REGULARITY
from parakin.model.geometric_parameters import replace_ranges
from parakin.performance.singularities import compute_singularity_margins

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from stub import Stub, outward, pose


def changed(tmp_path, name, old, new):
    """A shipped machine with a line of its file changed."""
    text = (Path(pk.__file__).parent / "machines" / f"{name}.yaml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / f"{name}.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return pk.load(path)


def test_starts_are_whole_machines():
    m = load_shipped("hexapod")
    starts = sample_starts(m)
    assert len(starts.poses) == 1000
    assert (m.check(starts.poses) == 0).all()
    miss, _ = Description.of(m.spec).misses(starts.poses, starts.joints)
    assert miss.max() < 1e-9
    assert np.ptp(starts.poses, axis=0)[:3].min() > 200.0
    assert compute_regularity(m, starts.poses).min() >= 2.0 * LEAST_REGULARITY
    assert compute_regularity(m, m.home[None]) == pytest.approx(1.0)


def test_constraint_singularities_count():
    """Exechon far beyond its limits, where what guides the platform is nearly singular and its drives are not."""
    m = load_shipped("exechon")
    rng = np.random.default_rng(0)
    poses = m.home + rng.uniform(-1.0, 1.0, (20_000, 5)) * [1500.0, 1500.0, 1500.0, 3.0, 3.0]
    poses = poses[np.isfinite(m.inverse(poses)).all(1)]
    margins, home = (compute_singularity_margins(m, rows) for rows in (poses, m.home[None]))
    constraint, others = margins[:, -1] / home[0, -1], margins[:, :4] / [home[0, 0], 1.0, 1.0, 1.0]
    least = constraint < others.min(1)
    assert least.any()
    assert compute_regularity(m, poses[least]) == pytest.approx(constraint[least])
    assert compute_regularity(m, poses[~least]) == pytest.approx(others[~least].min(1))


def test_the_tricept_pulls_its_struts_in():
    """Up is away from the work: the platform hangs below, and all struts are shortest at 934 mm."""
    plan = find_homing(load_shipped("tricept"))
    assert [(j.switch, j.direction, j.sequence) for j in plan.joints[:3]] == [(934.0, -1.0, 1)] * 3
    assert plan.unsafe is None
    assert 0.3 < plan.least < 1.0
    theta1, theta2 = plan.joints[3:]
    assert theta1.switch is None  # two turns: a switch can't tell which
    assert (theta2.switch, theta2.sequence) == (pytest.approx(-2.0 * np.pi / 3.0), 2)


@pytest.mark.parametrize("name", ["linear_delta", "quickstep"])
def test_that_no_start_comes_to_a_singularity_is_proved(name):
    """Slides that start anywhere, and up to 10 mm late, keep the side of det A."""
    m = load_shipped(name)
    plan, starts = find_homing(m), sample_starts(m)
    assert plan.proved
    switches, signs = (np.array([getattr(joint, key) for joint in plan.joints]) for key in ("switch", "direction"))
    begin, poses = starts.joints[:200], starts.poses[:200]
    left = np.abs(switches - begin)
    late = np.random.default_rng(2).uniform(0.0, 10.0, left.shape)
    for ahead in np.linspace(0.0, left.max() + 10.0, 20):
        solution = m.forward(begin + signs * np.clip(ahead - late, 0.0, left), near=poses)
        assert solution.converged.all()
        poses = solution.poses
        assert (m.sides(poses) * m.sides(m.home[None]) > 0.0).all()


def test_what_may_come_to_a_singularity_is_not_proved(monkeypatch):
    """From 0.1 % of the starts the slides of HBG80 do; joints that move without any order come everywhere."""
    m = load_shipped("hbg80_2d")
    for side in ("low", "high"):
        assert not prove_homing(m, {i: getattr(drive, side) for i, drive in enumerate(m.drives)}, np.ones(2))
    assert not find_homing(load_shipped("tricept")).proved
    m = load_shipped("linear_delta")
    switches = {i: drive.high for i, drive in enumerate(m.drives)}
    assert not prove_homing(m, switches | {1: m.drives[1].high - 20.0}, np.ones(3))  # it may stand beyond the switch
    monkeypatch.setattr(proof, "_SLACK", 1000.0)
    assert not prove_homing(m, switches, np.ones(3))


def test_joints_of_a_sequence_arrive_together():
    m = load_shipped("tricept")
    plan, home = find_homing(m), m.inverse(m.home)
    speeds = pace_return(m, plan)
    seconds = [abs(home[i] - plan.joints[i].switch) / speeds[i] for i in range(3)]
    assert max(seconds) == pytest.approx(min(seconds), rel=0.2)  # LinuxCNC's home lies off the wrist's pole
    assert speeds[:3].max() == pytest.approx(0.05 * 500.0)


def test_the_orthoglide_goes_where_its_rods_meet():
    """With all slides at their high ends the rods can't meet: those ends lie on a circle wider than a rod is long."""
    m = load_shipped("orthoglide")
    rod = m.spec.sizes["L"]
    high = m.drives[0].high
    assert high * sqrt(2.0 / 3.0) > rod
    plan = find_homing(m)
    assert [j.direction for j in plan.joints] == [-1.0] * 3
    starts = sample_starts(m)
    walk = walk_joints(m, begin_walk(m, starts), dict.fromkeys(range(3), high), np.full(3, 50.0), patient=True)
    assert not walk.kept.any()


def test_a_walk_that_loses_no_leg_stays_closed():
    m = load_shipped("linear_delta")
    starts = sample_starts(m)
    ends = {0: 1300.0, 1: 1300.0, 2: 1300.0}
    walk = walk_joints(m, begin_walk(m, starts), ends, np.full(3, 50.0), patient=False)
    assert walk.kept.all()
    assert np.array_equal(walk.joints, np.full_like(walk.joints, 1300.0))
    # All carriages level: the platform is on the axis of the towers.
    assert np.abs(walk.poses - walk.poses[0]).max() < 1e-6
    assert np.abs(walk.poses[:, :2]).max() < 1e-6
    reach = sqrt(700.0**2 - (350.0 - 60.0) ** 2)
    assert walk.poses[0, 2] == pytest.approx(1300.0 - reach - 80.0)


def test_the_page_tells_a_share_of_all_starts_without_an_exponent():
    page = pk.make_linuxcnc_configuration(load_shipped("five_bar"), "mesa-7i96s")["five_bar.md"]
    assert "Home switches will not do: from 100 % of 1000 sampled poses" in page


@pytest.mark.parametrize("name", ["hexapod", "hbg80_2d"])
def test_no_switches_where_homing_can_do_harm(name):
    plan = find_homing(load_shipped(name))
    assert all(joint.switch is None for joint in plan.joints)
    assert 0.0 < plan.unsafe < 0.1
    assert plan.ambiguous == 0.0


@pytest.mark.skipif(not shutil.which("gcc"), reason="there is no gcc to build a kinematics module with")
@pytest.mark.parametrize("name", ["hexapod", "lambda6", "hbg80_2d"])
def test_linuxcnc_finds_the_pose_that_encoders_tell(name, tmp_path):
    """Where nothing moves to home, the kinematics has joints of any pose, and a guess of zeros."""
    m = load_shipped(name)
    starts = sample_starts(m)
    rows, codes = Stub(tmp_path).built(m).forward(outward(m, starts.joints), np.zeros((len(starts.poses), 9)))
    assert (codes == 0).all()
    turns = np.where(np.array(m.axis_units) == "rad", 2.0 * np.pi, np.inf)
    off = pose(m, rows) - starts.poses
    off = np.where(np.isfinite(turns), off - np.round(off / turns) * np.where(np.isfinite(turns), turns, 0.0), off)
    assert np.abs(off).max() < 1e-6


def test_harmful_switches_are_refused(tmp_path):
    m = changed(tmp_path, "hexapod", "  jerk: 250 m/s3", "  jerk: 250 m/s3\n  homing: 660 mm")
    with pytest.raises(pk.InputError, match="expected absolute encoders"):
        find_homing(m)


def test_switches_are_where_the_file_says(tmp_path):
    m = changed(tmp_path, "linear_delta", "  jerk: 500 m/s3", "  jerk: 500 m/s3\n  homing: [690 mm, 690 mm, 700 mm]")
    plan = find_homing(m)
    assert [(j.switch, j.direction) for j in plan.joints] == [(690.0, -1.0), (690.0, -1.0), (700.0, -1.0)]
    m = changed(tmp_path, "linear_delta", "  jerk: 500 m/s3", "  jerk: 500 m/s3\n  homing: absolute")
    assert all(joint.switch is None for joint in find_homing(m).joints)


def test_the_same_in_every_run():
    one, two = (find_homing(load_shipped("linear_delta")) for _ in range(2))
    assert replace(one) == two


def test_fitted_ranges_keep_near_switches_and_drop_far_ones(tmp_path):
    m = changed(tmp_path, "linear_delta", "  jerk: 500 m/s3", "  jerk: 500 m/s3\n  homing: 690 mm")
    spec = replace_ranges(m.spec, {"tower_a": (700.0, 900.0), "tower_b": (720.0, 900.0)})
    assert [leg.drives[0].homing for leg in spec.legs] == [690.0, None, 690.0]
