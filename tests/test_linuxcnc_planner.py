"""The trajectory planner that LinuxCNC loads, cycle by cycle, against differences of the machine's own inverse."""

import ctypes
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from shipped import load_shipped

import parakin as pk
from parakin.controllers.linuxcnc.planner.planner_module import TIMED_SLACK
from parakin.kinematics.wrist.pole_thresholds import STANDING

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from planner import ANY_SPEED, CYCLE, Planner
from stub import world

MACHINES = ["linear_delta", "tricept", "hexapod", "lambda6", "orthoglide5_table"]
SPEED = 1.0002  # of a joint's limit: the way from sample to sample
RISE = 1.025  # a corner may add two hundredths of the acceleration in a cycle


@pytest.fixture(scope="module")
def planners(tmp_path_factory):
    made = {}

    def plan(name):
        if name not in made:
            made[name] = Planner(load_shipped(name), tmp_path_factory.mktemp(name))
        return made[name]

    return plan


def scatter(machine, count, seed=0):
    """Poses about home, off the pole, with what lies between them within the machine's limits."""
    rng, found = np.random.default_rng(seed), []
    turns = [i for i, unit in enumerate(machine.axis_units) if unit == "rad"]
    while len(found) < count:
        pose = np.array(machine.home)
        pose[:3] += rng.uniform(-150.0, 150.0, 3)
        pose[turns] += rng.uniform(-0.3, 0.3, len(turns))
        if machine.has_direction:
            pose[turns] = rng.uniform(0.1, 0.4), rng.uniform(-1.0, 1.0)
        shares = np.linspace(0.0, 1.0, 50)[:, None]
        if not machine.check(pose + shares * (found[-1] - pose if found else 0.0)).any():
            found.append(pose)
    return found


def follow(run):
    """The joints of every cycle, by the machine's own inverse."""
    return run.machine.follow(run.poses)


def measure_distance(points, corners):
    """How far points are from a polyline, mm."""
    starts, ways = corners[:-1], np.diff(corners, axis=0)
    share = ((points[:, None] - starts) * ways).sum(-1) / (ways**2).sum(-1)
    nearest = starts + np.clip(share, 0.0, 1.0)[..., None] * ways
    return np.linalg.norm(points[:, None] - nearest, axis=-1).min(axis=1)


@pytest.mark.parametrize("aside", [0.0, 5e-9, 1.5e-8, 1e-7, 1e-5, 1e-2])
@pytest.mark.parametrize("name", ["tricept", "hexapod", "orthoglide5_table"])
def test_a_turn_about_a_tip_that_hardly_moves_takes_its_time(planners, name, aside):
    """LinuxCNC tells mm/s from 1e-8 mm in X, Y or Z on (CART_FUZZ in its posemath.h), degrees/s below."""
    planner = planners(name)
    start = scatter(planner.machine, 1)[0]
    end = start + np.eye(len(start))[0] * aside
    end[4] += np.radians(6.0)
    planner.start(start)
    told = aside if aside >= 1e-8 else 6.0
    run = planner.run([lambda: planner.line_to(end, told / 2.0)], most=20_000)  # in 2 s, and the ramps
    assert run.left == 0 and 2.0 < run.seconds < 2.5
    np.testing.assert_allclose(run.poses[-1], end, atol=1e-9)
    speed, rise = run.measure_shares(follow(run))
    assert speed <= SPEED and rise <= RISE


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize(("stops", "tolerance"), [(True, 0.0), (False, 0.0), (False, 0.01), (False, 5.0)])
def test_lines_keep_every_joint_within_its_limits(planners, name, stops, tolerance):
    planner = planners(name)
    poses = scatter(planner.machine, 25)
    planner.start(poses[0])
    planner.set_corners(stops, tolerance)
    run = planner.run([lambda p=p: planner.line_to(p, 1000.0) for p in poses[1:]])
    speed, rise = run.measure_shares(follow(run))
    assert run.left == 0 and speed <= SPEED and rise <= RISE
    np.testing.assert_allclose(run.poses[-1], poses[-1], atol=1e-9)
    if len(planner.machine.axes) == 3:
        off = measure_distance(run.poses, np.array(poses))
        assert off.max() <= tolerance + 1e-9 and off.max() >= 0.1 * tolerance


def test_stopped_lines_take_the_least_time(tmp_path):
    """Against the trajectory of the same path with stops, which is the time-optimal one without limits of jerk."""
    text = (Path(pk.__file__).parent / "machines" / "linear_delta.yaml").read_text(encoding="utf-8")
    (tmp_path / "machine.yaml").write_text(re.sub(r"\n *jerk:.*", "", text), encoding="utf-8")
    machine = pk.load(tmp_path / "machine.yaml")
    planner, poses = Planner(machine, tmp_path), scatter(machine, 12, seed=3)
    planner.start(poses[0])
    planner.set_corners(stops=True)
    run = planner.run([lambda p=p: planner.line_to(p, ANY_SPEED) for p in poses[1:]])
    blocks = [f"G1 X{x:.6f} Y{y:.6f} Z{z:.6f} F1000000" for x, y, z in poses]
    (tmp_path / "path.ngc").write_text("\n".join(["G21 G90 G94", *blocks, "M2", ""]))
    job = pk.prepare(machine, pk.read_path(tmp_path / "path.ngc"), corners="stop")
    assert run.seconds == pytest.approx(job.trajectory.seconds, rel=0.01)


@pytest.mark.parametrize("name", MACHINES)
def test_overrides_and_pauses_keep_the_limits(planners, name):
    planner = planners(name)
    poses = scatter(planner.machine, 20, seed=1)
    scales = np.random.default_rng(2).choice([0.0, 0.1, 0.3, 1.0, 1.0, 1.2], 4000)

    def act(cycle):
        if cycle % 700 in (350, 500):
            planner.library.set_pause(int(cycle % 700 == 350))

    planner.start(poses[0])
    planner.set_corners(tolerance=0.5)
    run = planner.run(
        [lambda p=p: planner.line_to(p, 500.0) for p in poses[1:]], lambda cycle: scales[cycle // 120 % 4000], act
    )
    speed, rise = run.measure_shares(follow(run))
    assert run.left == 0 and speed <= SPEED and rise <= RISE
    np.testing.assert_allclose(run.poses[-1], poses[-1], atol=1e-9)


def test_a_pause_stands_still_and_an_abort_ends_there(planners):
    planner = planners("tricept")
    poses = scatter(planner.machine, 6, seed=4)

    def act(cycle):
        if cycle == 300:
            planner.library.set_pause(1)
        if cycle == 900:
            planner.library.set_abort()

    planner.start(poses[0])
    run = planner.run([lambda p=p: planner.line_to(p, 500.0) for p in poses[1:]], act=act)
    moving = (np.diff(run.poses, axis=0) != 0.0).any(axis=1)
    assert moving[250:300].all() and not moving[700:].any() and len(run.poses) < 910
    assert run.measure_shares(follow(run))[1] <= RISE


def test_arcs_and_helices_stay_on_their_circle(planners):
    planner = planners("linear_delta")
    start = np.array(planner.machine.home)
    far, up = start + [-40.0, 0.0, 0.0], start + [0.0, 0.0, 15.0]
    centre = start + [-20.0, 0.0, 0.0]
    planner.start(start)
    arcs = [(far, 1, 0), (start, 1, 0), (start, 1, -1), (up, 1, 1)]  # half, half, back a turn, two turns and up
    run = planner.run([lambda a=a: planner.arc_to(a[0], centre, [0.0, 0.0, a[1]], a[2], 100.0) for a in arcs])
    np.testing.assert_allclose(np.hypot(*(run.poses[:, :2] - centre[:2]).T), 20.0, atol=1e-9)
    np.testing.assert_allclose(run.poses[-1], up, atol=1e-9)
    turned = np.unwrap(np.arctan2(run.poses[:, 1] - centre[1], run.poses[:, 0] - centre[0]))
    assert turned[-1] - turned[0] == pytest.approx(2.0 * np.pi * (1 - 1 + 2))
    speed, rise = run.measure_shares(follow(run))
    assert speed <= SPEED and rise <= RISE


def test_short_lines_of_a_circle_run_at_their_feed(planners):
    """Points 0.05 mm apart: with a tolerance, and exactly through them."""
    planner = planners("linear_delta")
    centre = np.array(planner.machine.home)
    angles = np.linspace(0.0, 2.0 * np.pi, 2500)
    poses = centre + 20.0 * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    for tolerance in (0.0, 0.01):
        planner.start(poses[0])
        planner.set_corners(tolerance=tolerance)
        run = planner.run([lambda p=p: planner.line_to(p, 40.0) for p in poses[1:]])
        assert run.seconds == pytest.approx(2.0 * np.pi * 20.0 / 40.0, rel=0.01)
        assert run.measure_shares(follow(run))[1] <= RISE
        assert abs(np.hypot(*(run.poses[:, :2] - centre[:2]).T) - 20.0).max() <= 2e-5


def test_what_it_can_not_do_is_said_with_the_line(planners):
    planner, home = planners("linear_delta"), np.array(planners("linear_delta").machine.home)
    planner.start(home)
    assert planner.line_to(home + [5000.0, 0.0, 0.0], 100.0) == -1 and "line 1 leaves the workspace" in planner.told
    assert planner.library.add_tap(np.zeros(9).ctypes.data_as(ctypes.c_void_p)) == -1
    assert "line 7: rigid tapping" in planner.told
    planner.library.set_synchronized(ctypes.c_double(1.0))
    assert planner.line_to(home + [1.0, 0.0, 0.0], 100.0) == -1 and "in step with the spindle" in planner.told


def test_a_joint_that_would_jump_at_the_pole_is_refused(planners):
    """Upright a wrist's first joint is free; to tilt across it would have to turn at once."""
    planner = planners("tricept")
    home = np.array(planner.machine.home)
    beside = home.copy()
    beside[[1, 3, 4]] += 50.0, np.radians(20.0), np.radians(70.0)
    planner.start(home)
    run = planner.run([lambda: planner.line_to(beside, 100.0)])
    assert planner.library.has_error() and "line 1: a joint would jump" in planner.told
    assert run.measure_shares(follow(run))[0] <= SPEED and np.abs(run.poses[-1] - home).max() < 3e-3


@pytest.mark.parametrize("turn", [90.0, -200.0, 31.0])
@pytest.mark.parametrize("name", ["tricept", "orthoglide5_table"])
def test_a_joint_slows_down_before_its_wrist_is_held(name, turn, planners):
    """On its pole a wrist's first joint stands; a motion that turns it on the way there has to stop it before."""
    planner = planners(name)
    pole, beside = np.array(planner.machine.home), np.array(planner.machine.home)
    assert planner.machine.wrist.find_free(pole[None], 1e-6)[0]
    beside[[3, 4]] += np.radians(10.0), np.radians(turn)
    planner.start(beside)
    run = planner.run([lambda: planner.line_to(pole, 1e6)])
    assert np.abs(run.poses[-1] - pole).max() < 1e-12 and not planner.told
    wrist, joints = planner.machine.wrist, follow(run)
    held = np.abs(joints[:, wrist.second]) < STANDING
    joints[held, wrist.first] = joints[~held, wrist.first][-1]
    speed, rise = run.measure_shares(joints)
    assert 2 < held.sum() < 100 and speed <= SPEED and rise <= RISE


def test_timed_motions_keep_the_limits_in_single_block_and_as_they_go_on(planners):
    """Each comes to rest where the trajectory runs on; then all that is left starts from rest amid it."""
    planner = planners("hexapod")
    home, acceleration = np.array(planner.machine.home), planner.machine.drives[0].acceleration
    pulse, amplitude, knot = 60.0, 0.9 * acceleration / 60.0**2, np.pi / 12.0 / 60.0  # rad/s, mm, s
    t = knot * np.arange(6, 25)  # from the greatest speed to where it stands
    ends = home + np.outer(amplitude * np.cos(pulse * t), [0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    planner.start(ends[0])
    planner.set_signal(63, 1.0)
    step = np.linalg.norm(np.diff(ends, axis=0)[:, :3], axis=1)
    motions = [lambda k=k: planner.line_to(ends[k + 1], step[k] / knot) for k in range(len(step))]
    for part in ([motions[0]], [motions[1]], motions[2:]):
        run = planner.run(part)
        speed, rise = run.measure_shares(follow(run))
        assert not run.left and speed <= SPEED and rise <= TIMED_SLACK + RISE - 1.0
        planner.pose = run.poses[-1]
    assert np.abs(run.poses[-1] - ends[-1]).max() < 1e-9
    planner.set_signal(63, 0.0)


def test_motions_wait_for_the_spindle_and_write_outputs_as_they_begin(planners):
    planner, home = planners("linear_delta"), np.array(planners("linear_delta").machine.home)
    planner.start(home)
    planner.set_corners(tolerance=1.0)
    written = []

    def third():
        planner.library.set_output(2, 1)
        return planner.line_to(home + [0.0, 30.0, 0.0], 50.0, waits=True)

    def act(cycle):
        planner.library.set_spindle(int(cycle > 3000))
        written.append(planner.library.get_written(0))

    run = planner.run(
        [lambda: planner.line_to(home + [30.0, 0.0, 0.0], 50.0), lambda: planner.line_to(home, 50.0), third], act=act
    )
    y = run.poses[2:-2, 1] - home[1]
    assert (y[:3000] == 0.0).all() and y[3100] > 1.0 and y[-1] == pytest.approx(30.0)
    begun = int(np.argmax(y > 0.0))
    assert written[begun - 3] != 201 and written[begun + 3] == 201


def measure_deviation(poses, way):
    """How far the poses of the cycles are from a way over time that began at an unknown time, from 1.5 s on."""
    clock = CYCLE * np.arange(len(poses))[1500:]
    return minimize_scalar(lambda late: np.abs(poses[1500:] - way(clock - late)).max(), bounds=(0.0, 0.5)).fun


@pytest.mark.parametrize("name", ["linear_delta", "tricept", "hexapod"])
def test_timed_motions_take_the_time_that_is_told(planners, name):
    """A smooth way with given times, whose joints stay within their limits: the spline is it, at any override."""
    planner, machine = planners(name), planners(name).machine
    a, b = scatter(machine, 2, seed=5)
    seconds, step = 3.0, 0.02
    times = np.arange(0.0, seconds + 0.5 * step, step)

    def way(t):
        """From rest to rest by a polynomial of fifth order."""
        u = np.clip(np.asarray(t) / seconds, 0.0, 1.0)[:, None]
        return a + (b - a) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)

    points = way(times)
    rows = world(machine, points)
    lengths = np.linalg.norm(np.diff(rows, axis=0)[:, :3], axis=1)
    assert (lengths > 1e-6).all()
    for scale in (1.0, 0.5):
        planner.start(a)
        planner.set_signal(63, 1.0)
        planner.set_corners(tolerance=0.1)
        motions = [lambda p=p, v=v: planner.line_to(p, v) for p, v in zip(points[1:-1], lengths / step, strict=False)]

        def last():
            planner.set_corners(stops=True)
            return planner.line_to(points[-1], lengths[-1] / step)

        run = planner.run([*motions, last], lambda cycle, scale=scale: scale)
        planner.set_signal(63, 0.0)
        assert run.seconds == pytest.approx(seconds / scale, abs=0.02)
        if scale == 1.0:
            assert measure_deviation(run.poses, way) < 2e-3
        speed, rise = run.measure_shares(follow(run))
        assert speed <= SPEED and rise <= RISE
