"""The travel left along a line: never more than dense samples of it allow, and no less but for a tolerance."""

import json
from pathlib import Path

import numpy as np
import pytest
from shipped import REPRESENTATIVES, load_shipped

import parakin as pk
from parakin.cli import main
from parakin.errors import PoseError
from parakin.kinematics.travel import FARTHEST, SINGULARITY

OWN = [str(Path(__file__).parent / "machines" / f"{name}.yaml") for name in ("hexaglide", "swing", "arm", "balls")]
SAMPLES = 2000
WITHIN = {"mm": 1e-5, "rad": 1e-7}


def draw_poses(machine, count, seed):
    """Random poses within all limits, on home's side of the singularities."""
    rng = np.random.default_rng(seed)
    size = 0.35 * np.median(machine.leg_sizes)
    spread = np.array([size if unit == "mm" else 0.7 for unit in machine.axis_units])
    poses = machine.home + rng.uniform(-1.0, 1.0, (40 * count, len(spread))) * spread * rng.random((40 * count, 1))
    poses = poses[machine.check(poses) == 0]
    same = np.sign(machine.sides(poses)) == np.sign(machine.sides(machine.home[None]))
    return poses[same][:count]


def find_first_broken(machine, poses):
    """The first pose of a path that is off limits, and its limit, or beyond a singularity; None where there is none."""
    joints = machine.follow(poses)
    broken = machine.check(poses, joints)
    sides = np.sign(np.linalg.det(leg_rows(machine, poses, joints)))
    beyond = np.flatnonzero((broken > 0) | (sides != sides[0]))
    if not len(beyond):
        return None
    return beyond[0], machine.limits[broken[beyond[0]] - 1] if broken[beyond[0]] else SINGULARITY


def leg_rows(machine, poses, joints):
    a = machine.twist_rates(poses, joints, whole=False)[0]
    size = a.shape[1] if machine.wrist is None else machine.leg_count
    return a[:, :size, :size]


def find_end(machine, pose, direction, far):
    """The first share of a line that is off limits, by samples that close in on it, and what is broken there."""
    coarse = shares = np.linspace(0.0, far, SAMPLES)
    name = None
    for _ in range(4):
        found = find_first_broken(machine, pose + shares[:, None] * direction)
        if found is None:
            break
        row, name = found
        if row == 0:
            return 0.0, name
        low, high = shares[[row - 1, row]]
        shares = np.concatenate([coarse[coarse < low], np.linspace(low, high, SAMPLES // 4)])
    return (np.inf, None) if name is None else (high, name)


@pytest.mark.parametrize("name", [*REPRESENTATIVES, *OWN], ids=lambda name: Path(name).stem)
def test_travel_is_what_samples_allow(name):
    machine = pk.load(name)
    reached = 0
    count = 1 if name == "rus6" else 4  # bounds of its cranks are wide, and its ways take a thousand steps each
    for pose in draw_poses(machine, count, 3):
        for axis, unit in zip(machine.axes, machine.axis_units, strict=True):
            travel = machine.travel(pose, axis)
            direction = np.array([float(axis == other) for other in machine.axes])
            for end, sign in ((travel.ahead, 1.0), (travel.back, -1.0)):
                far = min(1.02 * end.distance + 10.0 * WITHIN[unit], FARTHEST[unit])
                sampled, name = find_end(machine, pose, sign * direction, far)
                assert end.distance <= sampled
                assert end.pose == pytest.approx(pose + sign * end.distance * direction, abs=1e-9)
                if end.limit == SINGULARITY:  # it keeps off by 1e-4 of home's determinant
                    rows = np.array([end.pose, machine.home])
                    size = np.abs(np.linalg.det(leg_rows(machine, rows, machine.inverse(rows))))
                    assert size[0] < 1.001e-4 * size[1]
                elif end.limit is not None:
                    assert sampled - end.distance < WITHIN[unit]
                    assert end.limit.split(".")[0] == name.split(".")[0]  # over a pole either side may come first
                reached += end.limit is not None
    assert reached > 5


def test_ends_in_closed_form():
    """The hexapod's platform goes down until its struts, all alike there, are 1310 mm long."""
    machine = load_shipped("hexapod")
    travel = machine.travel(machine.home, "Z")
    feet = np.array([[-22.95, 13.25], [22.95, 13.25], [0.0, -26.5]]) * 25.4
    joints = np.array([[-1.0, 11.5], [10.459, -4.884], [9.459, -6.616]]) * 25.4
    flat = np.array([np.linalg.norm(feet[i] - joints[j]) for i, j in ((0, 0), (1, 1), (2, 2))])
    assert travel.back.distance == pytest.approx(np.sqrt(1310.0**2 - flat**2).min() - 800.0, abs=1e-6)
    assert travel.ahead.distance == pytest.approx(800.0 - np.sqrt(660.0**2 - flat**2).max(), abs=1e-6)


def test_any_direction_and_turns_are_counted():
    machine = load_shipped("tricept")
    pose = machine.home + np.array([0.0, 0.0, 0.0, 0.5, 0.0])
    travel = machine.travel(pose, [0.0, 0.0, 0.0, 0.0, 1.0])
    assert [travel.ahead.limit, travel.back.limit] == ["theta1.max", "theta1.min"]
    # theta1 stands at 180° of ±360°, and turns as C does where the tool's tip is below the central leg
    assert travel.ahead.distance == pytest.approx(np.pi, abs=1e-8)
    assert travel.back.distance == pytest.approx(3.0 * np.pi, abs=1e-8)
    one, both = machine.travel(pose, "X"), machine.travel(pose, {"X": 2.0})
    assert both.ahead.distance == pytest.approx(one.ahead.distance / 2.0, abs=1e-6)
    assert both.ahead.limit == one.ahead.limit


def test_a_way_over_the_pole_goes_on():
    """Through the wrist's pole, where its first joint is free, the strut that ends the way is met."""
    machine = load_shipped("tricept")
    pose = machine.home - np.array([100.0, 0.0, 0.0, 0.0, 0.0])
    travel = machine.travel(pose, "X")
    at_home = machine.travel(machine.home, "X")
    assert travel.ahead.limit == at_home.ahead.limit == "d2.max"
    assert travel.ahead.distance == pytest.approx(at_home.ahead.distance + 100.0, abs=1e-5)


def test_off_limits_and_on_a_limit():
    machine = load_shipped("orthoglide")
    off = machine.travel([200.0, 0.0, 0.0], "X")
    assert off.ahead.distance == off.back.distance == 0.0
    assert off.ahead.limit == "rho_x.max"
    end = machine.travel(machine.home, "X").ahead
    back = machine.travel(end.pose, "X")
    assert back.ahead.distance < 1e-6
    assert back.back.distance > 200.0


@pytest.mark.parametrize("axis", ["Q", "", [1.0, 2.0], [0.0] * 6, {"X": 0.0}, None, [np.nan] * 6, 3])
def test_bad_directions(axis):
    with pytest.raises(PoseError) as error:
        load_shipped("hexapod").travel(load_shipped("hexapod").home, axis)
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize("name", ["hexapod", "orthoglide5_table"])
def test_directions_at_random(name):
    machine = load_shipped(name)
    rng = np.random.default_rng(8)
    spread = np.array([1.0 if unit == "mm" else 0.002 for unit in machine.axis_units])
    for pose in draw_poses(machine, 8, 4):
        direction = rng.normal(size=len(spread)) * spread
        end = machine.travel(pose, direction).ahead
        sampled, name = find_end(machine, pose, direction, 1.02 * end.distance)
        assert end.distance <= sampled < end.distance + 1e-5
        assert end.limit == name


def run(capsys, *words):
    code = main(["reach", *words])
    return code, *capsys.readouterr()


def test_command(capsys):
    code, out, err = run(capsys, "orthoglide", "--at", "X=10", "--json")
    answer = json.loads(out)
    assert (code, err, answer["schema"]) == (0, "", "parakin.reach/1")
    assert [line["along"] for line in answer["travel"]] == ["X", "Y", "Z"]
    ahead = load_shipped("orthoglide").travel([10.0, 0.0, 0.0], "X").ahead
    assert answer["travel"][0]["ahead"] == {
        "distance": ahead.distance, "limit": "rho_x.max", "pose": {"X": ahead.pose[0], "Y": 0.0, "Z": 0.0},
    }  # fmt: skip
    code, out, _ = run(capsys, "orthoglide", "--at", "10,0,0")
    told = float(out.splitlines()[1].split()[4])
    assert ahead.distance - 1e-4 < told <= ahead.distance
    code, out, _ = run(capsys, "hexapod", "--along", "X=1,C=1")
    assert (code, len(out.splitlines())) == (0, 2)
    assert run(capsys, "orthoglide", "--at", "X=200")[0] == 3
    for words in (["--at", "Q=1"], ["--at", "1,2"], ["--along", "X"], ["--along", "X=0"], ["--mode", "?"]):
        code, out, err = run(capsys, "orthoglide", *words)
        assert (code, out, len(err.splitlines())) == (2, "", 1)


def test_a_direction_of_zeros_is_refused_by_its_option(capsys):
    assert main(["reach", "tricept", "--along", "X=0"]) == 2
    assert capsys.readouterr().err == '--along: "X=0": a direction that is not zero expected\n'
    assert main(["reach", "tricept", "--along", "X=1e-300"]) == 2  # it never ended
    assert capsys.readouterr().err == "axis: a direction of at least 1e-06 mm or rad expected\n"


def test_a_turning_joint_goes_on_over_half_a_turn():
    """The columns' ranges lie alike about their middles, 50° to either side, and one of them goes over -180°."""
    machine = load_shipped("eclipse")
    travel = machine.travel(machine.home, "C")
    assert np.degrees([travel.ahead.distance, travel.back.distance]) == pytest.approx([50.0, 50.0], abs=1e-6)
    assert np.degrees(machine.inverse(machine.home - np.radians([0, 0, 0, 0, 0, 40.0]))[1]) == pytest.approx(-190.0)


def test_an_arm_whose_zero_points_elsewhere_has_the_same_workspace(tmp_path):
    """Angles counted from the other side, in ranges moved by half a turn, over ±180° or not."""
    machine = load_shipped("five_bar")
    text = (Path(pk.__file__).parent / "machines" / "five_bar.yaml").read_text()
    text = text.replace("zero: [1, 0, 0]", "zero: [-1, 0, 0]")
    text = text.replace("[60 deg, 220 deg]", "[-120 deg, 40 deg]").replace("[-40 deg, 120 deg]", "[140 deg, 300 deg]")
    (tmp_path / "turned.yaml").write_text(text)
    turned = pk.load(tmp_path / "turned.yaml")
    poses = np.random.default_rng(5).uniform([-700.0, -100.0], [700.0, 700.0], (20_000, 2))
    allowed = machine.check(poses) == 0
    np.testing.assert_array_equal(allowed, turned.check(poses) == 0)
    joints = machine.inverse(poses[allowed])
    np.testing.assert_allclose(turned.inverse(poses[allowed]), joints + [-np.pi, np.pi], atol=1e-12)
    assert (joints > np.pi).any()
