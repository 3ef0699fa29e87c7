"""The feed planner: every trajectory sampled at 1 kHz against every limit, and closed forms."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from s_curves import s_curve_time
from shipped import load_shipped

import parakin as pk
from parakin.errors import InputError, PoseError
from parakin.machine import Machine
from parakin.toolpath.path import ToolPath
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.timing import joint_path, plan_trajectory
from parakin.toolpath.timing.corners import round_corners
from parakin.toolpath.timing.drive_limits import DriveLimits

INF = np.inf
BEYOND = 1.001  # times a limit
TOLERANCE, AXIS_TOLERANCE = 0.01, 1e-3
MIDDLE = {
    "hbg80_2d": (230, 230, 0), "hbg80_3d": (80, 80, -120), "hexapod": (0, 0, -950), "lambda6": (0, 0, 1400),
    "linear_delta": (0, 0, 280), "orthoglide": (0, 0, 0), "orthoglide5_head": (0, 0, -100),
    "orthoglide5_table": (0, 0, 0), "tricept": (0, 0, -1650),
}  # fmt: skip
everyone = pytest.mark.parametrize("name", sorted(MIDDLE))


def limited(machine, *, mm=(INF, INF, INF), rad=(INF, INF, INF), only=None):
    """The machine with these speeds, accelerations and jerks, of the joints ``only``; the others have none."""

    def drive(old):
        if old is None:
            return None
        values = (mm if old.unit == "mm" else rad) if only is None or old.name in only else (INF, INF, INF)
        return replace(old, speed=values[0], acceleration=values[1], jerk=values[2])

    spec = machine.spec
    legs = tuple(replace(leg, drives=tuple(drive(d) for d in leg.drives)) for leg in spec.legs)
    head, table = (tuple(replace(s, drive=drive(s.drive)) for s in steps) for steps in (spec.head, spec.table))
    return Machine(replace(spec, legs=legs, head=head, table=table))


def posted(machine, tip, axis=(0.0, 0.0, 1.0), feed=6000.0, rapid=False, seconds=None):
    n = len(tip)
    axis = np.broadcast_to(np.asarray(axis, float), (n, 3))
    feeds, rapids = np.broadcast_to(np.asarray(feed, float), n), np.broadcast_to(rapid, n)
    lines, spindle = np.arange(1, n + 1), np.full(n, np.nan)
    tip = np.asarray(tip, float)
    return post_path(machine, ToolPath("part.apt", tip, axis, lines, rapids, feeds, spindle, seconds=seconds))


def axis_of(b, c):
    return np.stack(np.broadcast_arrays(np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)), axis=-1)


def drawn(name, seed, jerk=False):
    """A random path and random limits: long and short motions, sharp and blunt corners, records that repeat."""
    rng = np.random.default_rng([seed, sorted(MIDDLE).index(name)])
    acceleration = 10.0 ** rng.uniform(2.3, 4.0)
    ramp = 10.0 ** rng.uniform(-2.5, -1.0) if jerk else 0.0
    limits = []
    for low, high, share in ((1.3, 2.7, 1.0), (-0.5, 0.7, 1.0 / 70.0)):
        a = acceleration * share
        limits.append((10.0 ** rng.uniform(low, high), a, a / ramp if ramp else INF))
    machine = limited(load_shipped(name), mm=limits[0], rad=limits[1])
    n = int(rng.integers(2, 14))
    strides = rng.normal(0.0, 10.0 ** rng.uniform(-1.0, 1.3), (n, 3))
    strides *= rng.choice([1.0, 0.01, 0.0], (n, 1), p=[0.8, 0.15, 0.05])
    tip = np.array(MIDDLE[name], float) + 25.0 * np.sin(np.cumsum(strides, axis=0) / 25.0)
    if "Z" not in machine.axes:
        tip[:, 2] = 0.0
    axis = (0.0, 0.0, 1.0)
    if "B" in machine.axes:
        b = 0.25 + 0.15 * np.sin(np.cumsum(rng.normal(0.0, 0.3, n)))
        axis = axis_of(b, np.cumsum(rng.normal(0.0, 0.2, n)))
    result = posted(machine, tip, axis, 10.0 ** rng.uniform(2.0, 4.3, n))
    assert not result.broken_record_count
    return result


def tips(machine, poses):
    return poses[:, [i for i, axis in enumerate(machine.axes) if axis in "XYZ"]]


def axes_of(machine, poses):
    """The tool's axis at each pose, Rz(C)·Ry(B)·Rx(A)·z."""
    a, b, c = (poses[:, machine.axes.index(k)] if k in machine.axes else np.zeros(len(poses)) for k in "ABC")
    x, y, z = np.sin(b) * np.cos(a), -np.sin(a), np.cos(b) * np.cos(a)
    return np.stack([np.cos(c) * x - np.sin(c) * y, np.sin(c) * x + np.cos(c) * y, z], 1)


def distance(points, line):
    """How far points are at most from a polyline."""
    start, way = line[:-1], np.diff(line, axis=0)
    square = np.maximum((way * way).sum(1), 1e-300)
    off = points[:, None] - start
    share = np.clip((off * way).sum(2) / square, 0.0, 1.0)
    return np.sqrt(((off - share[..., None] * way) ** 2).sum(2).min(1).max())


def strayed(machine, points):
    """How far joints are from those of the poses, in shares of the tolerances; head and table in either mode."""
    modes = [machine.mode]
    if machine.wrist is not None:
        modes = [machine.mode[:-1] + sign for sign in "+-"]
    turning = np.array(machine.joint_units) == "rad"
    off = [machine.inverse(points.poses, mode) - points.joints for mode in modes]
    turned = [np.where(turning, (d + np.pi) % (2.0 * np.pi) - np.pi, d) for d in off]
    shares = [np.abs(d) / np.where(turning, AXIS_TOLERANCE, TOLERANCE) for d in turned]
    return np.min([d.max(1) for d in shares], axis=0).max()


def hold(trajectory, rate=1000.0):
    """Every limit holds for the setpoints' differences, and the path is kept."""
    points, machine, path = trajectory.sample(rate), trajectory.posted.machine, trajectory.posted.path
    drives = DriveLimits.of(machine)
    for order, limit in ((1, drives.speed), (2, drives.acceleration), (3, drives.jerk)):
        differences = np.abs(np.diff(points.joints, order, axis=0)) * rate**order
        assert (differences <= BEYOND * limit).all()
    assert (np.abs(points.speeds) <= BEYOND * drives.speed).all()
    assert (np.abs(points.accelerations) <= BEYOND * drives.acceleration).all()
    feed = np.linalg.norm(np.diff(tips(machine, points.poses), axis=0), axis=1) * rate * 60.0
    first = np.searchsorted(trajectory.times, points.times[:-1], "right")  # the records around each span
    last = np.searchsorted(trajectory.times, points.times[1:], "left")
    most = [path.feed[a : b + 1].max() for a, b in zip(first, np.maximum(first, last), strict=True) if a < len(path)]
    assert (feed[: len(most)] <= BEYOND * np.array(most)).all()

    few = points.poses[:: max(1, len(points.poses) // 60)]
    assert distance(tips(machine, few), tips(machine, trajectory.posted.poses)) <= TOLERANCE
    if "B" in machine.axes:
        share = np.linspace(0.0, 1.0, 300)[:, None]
        straight = [
            p + share * (q - p) for p, q in zip(trajectory.posted.poses[:-1], trajectory.posted.poses[1:], strict=True)
        ]
        assert distance(axes_of(machine, few), axes_of(machine, np.concatenate(straight))) <= AXIS_TOLERANCE
    assert strayed(machine, points) < 2e-3

    for speeds in (points.speeds[0], trajectory.at(trajectory.seconds).speeds[0]):
        assert np.abs(speeds).max() < 1e-6
    assert np.abs(points.joints[-1] - trajectory.at(trajectory.seconds).joints[0]).max() < 1e-9
    assert sum(trajectory.binding_fractions.values()) == pytest.approx(1.0 if trajectory.seconds else 0.0)


@everyone
def test_every_limit_holds(name):
    for seed in range(26):
        result = drawn(name, seed)
        hold(
            plan_trajectory(
                result, corners=("round", "stop")[seed % 2], tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE
            )
        )


@everyone
def test_every_limit_holds_with_jerks(name):
    for seed in range(6):
        result = drawn(name, 100 + seed, jerk=True)
        trajectory = plan_trajectory(result, corners=("round", "stop")[seed % 2])
        hold(trajectory)
        drives = DriveLimits.of(result.machine)
        free = limited(result.machine, mm=(*drive_of(drives, result.machine, "mm"), INF),
                       rad=(*drive_of(drives, result.machine, "rad"), INF))  # fmt: skip
        without = plan_trajectory(replace(result, machine=free), corners=("round", "stop")[seed % 2])
        assert trajectory.seconds > 0.99 * without.seconds  # which is the quickest of constant s̈ over each step


def drive_of(drives, machine, unit):
    """Speed and acceleration of the first joint in this unit."""
    if unit not in machine.joint_units:
        return INF, INF
    index = machine.joint_units.index(unit)
    return drives.speed[index], drives.acceleration[index]


# Closed forms. The linear delta's carriages all move as its tool does along Z.


@pytest.mark.parametrize(("way", "feed"), [(100.0, 6000.0), (100.0, 600.0), (0.5, 6000.0), (100.0, 1e6), (0.5, 1e-4)])
def test_a_straight_motion_takes_the_time_of_its_trapezoid(way, feed):
    machine = limited(load_shipped("linear_delta"), mm=(1000.0, 2000.0, INF))
    trajectory = plan_trajectory(posted(machine, [[0, 0, 280], [0, 0, 280 + way]], feed=feed))
    a, v = 2000.0, min(feed / 60.0, 1000.0)
    expected = way / v + v / a if way > v * v / a else 2.0 * np.sqrt(way / a)
    assert trajectory.seconds == pytest.approx(expected, rel=2e-4)
    assert trajectory.seconds > expected * (1.0 - 1e-9)
    assert trajectory.times.tolist() == [0.0, trajectory.seconds]
    cruising = trajectory.at([trajectory.seconds / 2]).speeds[0]
    assert cruising == pytest.approx([min(v, np.sqrt(way * a))] * 3, rel=5e-3)


@pytest.mark.parametrize(("way", "feed"), [(100.0, 6000.0), (2.0, 6000.0), (0.01, 6000.0), (0.5, 0.01)])
def test_with_jerks_a_straight_motion_takes_the_time_of_its_s_curve(way, feed):
    v, a, j = feed / 60.0, 2000.0, 50_000.0
    machine = limited(load_shipped("linear_delta"), mm=(INF, a, j))
    trajectory = plan_trajectory(posted(machine, [[0, 0, 280], [0, 0, 280 + way]], feed=feed))
    least = s_curve_time(way, v, a, j)
    assert least < trajectory.seconds < 1.005 * least


def cartesian(**limits):
    """A machine whose joints are X, Y and Z but for a millionth: the Orthoglide with rods of half a kilometre."""
    return limited(pk.load("orthoglide", parameters={"cube": "400 m"}), **limits)


def circle(radius, count=721):
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    return radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], 1)


def test_a_circle_at_the_feed_that_its_centripetal_acceleration_allows():
    radius, a = 50.0, 1000.0
    slow = plan_trajectory(posted(cartesian(mm=(INF, a, INF)), circle(radius), feed=60.0 * 0.8 * np.sqrt(a * radius)))
    middle = np.linspace(0.2, 0.8, 100) * slow.seconds
    speed = np.linalg.norm(slow.at(middle).speeds, axis=1)
    assert speed == pytest.approx(0.8 * np.sqrt(a * radius), rel=1e-3)
    assert slow.binding_fractions["feed"] > 0.8
    fast = plan_trajectory(posted(cartesian(mm=(INF, a, INF)), circle(radius), feed=1e6))
    crossing = fast.times[[180, 360, 540]]  # where the path runs along one of the axes, the other one only turns it
    speed = np.linalg.norm(fast.at(crossing).speeds, axis=1)
    assert speed == pytest.approx(np.sqrt(a * radius), rel=1e-2)
    assert fast.binding_fractions.get("feed", 0.0) < 0.01
    hold(slow), hold(fast)


def test_without_accelerations_only_the_feed_counts():
    tip = np.array([[0, 0, 0], [30, 0, 0], [30, 40, 0], [30, 40, 0], [0, 0, 0]], float)
    feed = np.array([100.0, 600.0, 1200.0, 1.0, 3000.0])
    trajectory = plan_trajectory(posted(limited(load_shipped("orthoglide")), tip, feed=feed))
    assert np.diff(trajectory.times) == pytest.approx([3.0, 2.0, 0.0, 1.0], abs=1e-9)
    assert trajectory.binding_fractions == {"feed": pytest.approx(1.0)}
    assert trajectory.at([1.5, 4.0]).poses == pytest.approx(np.array([[15.0, 0.0, 0.0], [30.0, 20.0, 0.0]]), abs=1e-9)
    with pytest.raises(PoseError, match=r":2, record 1: on the way to it nothing limits the motion: no feed"):
        plan_trajectory(posted(limited(load_shipped("orthoglide")), tip, feed=np.nan))


def test_rapid_and_seconds():
    machine = limited(load_shipped("linear_delta"), mm=(500.0, INF, INF))
    tip = np.array([[0, 0, 280], [0, 0, 380], [0, 0, 280], [0, 0, 270]], float)
    seconds = np.array([np.nan, np.nan, 4.0, np.nan])
    trajectory = plan_trajectory(
        posted(machine, tip, feed=[600, 600, np.nan, 600], rapid=[False, True, False, False], seconds=seconds)
    )
    assert np.diff(trajectory.times) == pytest.approx([0.2, 4.0, 1.0])
    assert set(trajectory.binding_fractions) == {"feed", "tower_a.speed"}


# Corners.


def square(machine, **how):
    tip = np.array([[0, 0, 0], [20, 0, 0], [20, 20, 0], [0.1, 20, 0.0], [0, 0, 0]], float)
    return plan_trajectory(posted(machine, tip), **how)


def test_corners_are_stopped_at():
    machine = limited(load_shipped("orthoglide"), mm=(INF, 2000.0, INF))
    trajectory = square(machine, corners="stop")
    at = trajectory.at(trajectory.times)
    assert np.abs(at.speeds).max() < 1e-6
    assert at.joints == pytest.approx(trajectory.posted.joints, abs=1e-9)
    assert [trajectory.names[trajectory.binding[i]] for i in (0, -1)] == ["start/stop"] * 2
    rounded = square(machine)
    assert np.linalg.norm(rounded.at(rounded.times[1:-1]).speeds, axis=1).min() > 1.0
    assert rounded.seconds < trajectory.seconds
    one = square(machine, stops=[2])
    assert np.abs(one.at(one.times[2]).speeds).max() < 1e-6 < np.abs(one.at(one.times[1]).speeds).max()
    assert rounded.seconds < one.seconds < trajectory.seconds


def test_a_corner_is_as_far_off_as_it_may_be():
    machine = limited(load_shipped("orthoglide"), mm=(INF, 2000.0, INF))
    for tolerance in (0.1, 0.01, 0.001):
        trajectory = square(machine, tolerance=tolerance)
        off = np.linalg.norm(trajectory.at(trajectory.times[1:-1]).poses - trajectory.posted.poses[1:-1], axis=1)
        assert (off <= tolerance).all() and (off > 0.98 * tolerance).all()


def draw_pieces(rng, count, most):
    """Lengths of pieces that grow, shrink and jump, neighbours by up to ``most`` times."""
    return np.exp(np.cumsum(rng.choice([0.0, 0.05, 1.0], count) * rng.uniform(-1.0, 1.0, count) * np.log(most)))


def round_records(path):
    return round_corners(path, "round", TOLERANCE, AXIS_TOLERANCE, np.zeros(len(path.path), bool), True)


def test_an_arc_of_uneven_pieces_bends_as_an_arc():
    """Its second derivative is 1/R all along; with vertices on the records it was 0.3 to 1.9 times that."""
    radius, pieces = 200.0, draw_pieces(np.random.default_rng(4), 60, 3.0)
    at = np.append(0.0, np.cumsum(pieces / pieces.max()))[:, None] / radius
    tip = radius * np.hstack([np.sin(at), np.cos(at) - 1.0, 0.0 * at])
    curve = round_records(posted(load_shipped("orthoglide"), tip))
    bends = np.linalg.norm(curve.bend[2:-2], axis=1) * radius
    assert bends.min() > 0.97 and bends.max() < 1.03
    np.testing.assert_allclose(curve.poses(np.arange(2, 58), np.zeros(56)), tip[2:58], rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("name", ["orthoglide", "orthoglide5_table"])
def test_a_rounded_path_keeps_to_its_tolerances_whatever_its_pieces(name):
    """At each length it is no farther from the polyline there, and its slope is continuous."""
    machine, rng, share = load_shipped(name), np.random.default_rng(8), np.linspace(0.0, 1.0, 11)
    for scale in np.geomspace(0.01, 3.0, 12):
        pieces = scale * draw_pieces(rng, 80, 5.0)[:, None]
        heading = np.cumsum(rng.normal(0.0, rng.choice([0.01, 0.1]), (80, 3)), axis=0)
        tip = MIDDLE[name] + np.cumsum(pieces * np.sin(heading), axis=0).clip(-50.0, 50.0)
        b, c = 0.3 + 0.1 * np.sin(0.02 * np.cumsum(pieces)), 0.02 * np.cumsum(pieces * np.sin(heading[:, :1]))
        path = posted(machine, tip, axis_of(b, c) if "B" in machine.axes else (0.0, 0.0, 1.0))
        curve = round_records(path)
        piece = np.repeat(np.arange(len(curve.length)), len(share))
        along = np.tile(share, len(curve.length))
        poses = curve.poses(piece, along * curve.length[piece])
        straight = curve.corner[piece] + along[:, None] * np.diff(curve.corner, axis=0)[piece]
        assert np.linalg.norm((poses - straight)[:, :3], axis=1).max() < TOLERANCE
        if "B" in machine.axes:
            off = axis_of(poses[:, 3], poses[:, 4]) - axis_of(straight[:, 3], straight[:, 4])
            assert np.linalg.norm(off, axis=1).max() < AXIS_TOLERANCE
        least = 1e-5 * curve.length[:-1].min()
        inner = np.arange(len(curve.length) - 1)
        ends = [curve.poses(inner, curve.length[:-1] - by) for by in (least, 0.0)]
        begins = [curve.poses(inner + 1, np.full(len(inner), by)) for by in (0.0, least)]
        np.testing.assert_allclose(ends[1], begins[0], rtol=0.0, atol=1e-11)
        rounded = ~curve.parted[1:-1]
        jump = (begins[1] - begins[0] - ends[1] + ends[0])[rounded] / least
        assert np.abs(jump).max(initial=0.0) < 1e-5 + 2.0 * least * np.abs(curve.bend).max()


@pytest.mark.parametrize("creep", [1e-5, 1e-4, 1e-3])
def test_a_creeping_step_beside_a_long_one_needs_no_shorter_rows(creep):
    """Straight, round a corner and back, upright and out of a tilt: the corners' roundings are as long as the step."""
    machine = limited(load_shipped("hexapod"), mm=(500.0, 10_000.0, INF))
    for angle in np.radians([1.0, 90.0, 180.0]):
        for tilt in (0.0, 0.04):
            way = np.array([0.8 * np.sin(angle), 0.6 * np.sin(angle), np.cos(angle)])
            tip = MIDDLE["hexapod"] + np.vstack([[0.0, 0.0, -0.4], np.outer([0.0, creep, 2.0 * creep, 0.4], way)])
            trajectory = plan_trajectory(posted(machine, tip, axis_of(np.array([tilt, 0, 0, 0, 0]), 0.7), 3000.0))
            step = trajectory.joint_path.step
            assert len(step) < 40
            assert step[step > 0.0].min() > 0.01 * creep
            hold(trajectory)


@pytest.mark.parametrize("name", ["hexapod", "orthoglide"])
@pytest.mark.parametrize(
    ("creep", "angle", "way", "feed"),
    [(2e-5, 5.0, 0.4, 10_000.0), (1e-4, 60.0, 0.4, 1000.0), (2e-4, 90.0, 3.0, 1000.0), (1e-3, 150.0, 0.4, 1000.0)],
)
def test_rounding_a_creeping_step_takes_no_longer_than_stopping_at_it(name, creep, angle, way, feed):
    turned = np.array([0.8 * np.sin(np.radians(angle)), 0.6 * np.sin(np.radians(angle)), np.cos(np.radians(angle))])
    tip = MIDDLE[name] + np.vstack([[0.0, 0.0, -way], np.outer([0.0, creep, creep + way], turned)])
    result = posted(load_shipped(name), tip, feed=feed)
    assert plan_trajectory(result).seconds < 1.002 * plan_trajectory(result, stops=(1, 2)).seconds


def test_an_upright_tool_that_creeps_between_stands_takes_its_time():
    """Four stands some 1e-5 mm apart on a table's pole, where nothing turns: 36 ms each, which no program took."""
    tip = np.zeros((6, 3))
    tip[:, :2] = [[-0.5, 0.0], [0.0, 0.0], [1e-5, 0.0], [1e-5, 5e-6], [5e-6, 5e-6], [-0.5, 0.2]]
    result = posted(load_shipped("orthoglide5_table"), tip, feed=90.0)
    way = np.linalg.norm(tip[1] - tip[0]) + np.linalg.norm(tip[5] - tip[4])
    assert plan_trajectory(result, stops=(1, 2, 3, 4)).seconds < way / 1.5 + 0.04


def test_steps_beside_a_coarse_one_are_cut_where_they_are_longer_than_its_parts():
    steps, fractions = joint_path._divide_steps(np.array([1, 4, 5]), np.array([1e-9, 1.0, 0.3, 0.0, 4.0, 1.0, 2.0]))
    assert steps.tolist() == [1, 1, 1, 2, 4, 4, 4, 5, 5, 5, 6]
    assert fractions.tolist() == [0.25, 0.5, 0.75, 0.5, 0.25, 0.5, 0.75, 0.25, 0.5, 0.75, 0.5]


def test_a_motion_of_one_step_between_two_stands_takes_its_time(monkeypatch):
    machine = limited(load_shipped("linear_delta"), mm=(INF, 2000.0, INF))
    tip = np.array([[0.0, 0.0, 300.0 + k % 2] for k in range(6)])
    monkeypatch.setattr(joint_path, "ENOUGH", 0)  # as on paths of millions of records
    trajectory = plan_trajectory(posted(machine, tip), corners="stop")
    assert trajectory.seconds == pytest.approx(5 * 2.0 * np.sqrt(1.0 / 2000.0), rel=1e-3)
    hold(trajectory)


def test_a_straight_line_of_many_records_is_one_line():
    machine = limited(load_shipped("linear_delta"), mm=(INF, 2000.0, INF))
    z = np.linspace(280.0, 380.0, 1000)
    tip = np.stack([0 * z, 0 * z, z], 1)
    for corners in ("round", "stop"):
        many, one = (plan_trajectory(posted(machine, rows), corners=corners).seconds for rows in (tip, tip[[0, -1]]))
        assert many == pytest.approx(one, rel=1e-3)


def test_the_path_may_lead_over_a_pole_or_beside_it():
    machine = limited(load_shipped("tricept"), mm=(500.0, 5000.0, INF), rad=(3.0, 30.0, INF))
    x = np.linspace(-30.0, 30.0, 21)
    tip = np.stack([x, 0 * x, 0 * x - 1650.0], 1)
    for lean in (0.0, 1e-5, 1e-3, 1e-2):
        axis = np.stack([np.sin(x / 100.0), 0 * x + lean, np.cos(x / 100.0)], 1)
        hold(plan_trajectory(posted(machine, tip, axis / np.linalg.norm(axis, axis=1)[:, None])))


# Against itself.


@everyone
def test_more_is_quicker(name):
    result = drawn(name, 7)
    drives = DriveLimits.of(result.machine)
    before = plan_trajectory(result).seconds
    for factors in ((1.5, 1.0), (1.5, 1.5), (3.0, 3.0)):
        limits = {unit: (*np.array(drive_of(drives, result.machine, unit)) * factors, INF) for unit in ("mm", "rad")}
        seconds = plan_trajectory(replace(result, machine=limited(result.machine, **limits))).seconds
        assert seconds <= before * (1.0 + 1e-3)
        before = seconds
    assert before < plan_trajectory(result).seconds


# Results and refusals.


def test_setpoints_are_a_table():
    trajectory = square(limited(load_shipped("orthoglide"), mm=(INF, 2000.0, INF)))
    points = trajectory.sample(500.0)
    assert points.columns[:5] == ("time", "rho_x", "rho_y", "rho_z", "rho_x.speed")
    assert points.columns[-4:] == ("rho_z.acceleration", "X", "Y", "Z")
    assert points.table.shape == (len(points.times), len(points.columns))
    assert trajectory.seconds <= points.times[-1] < trajectory.seconds + 1.0 / 500.0
    outside = trajectory.at([-1.0, trajectory.seconds + 1.0])
    assert outside.joints == pytest.approx(trajectory.posted.joints[[0, -1]], abs=1e-9)
    assert not outside.speeds.any() and not outside.accelerations.any()


def test_one_place_takes_no_time():
    trajectory = plan_trajectory(posted(load_shipped("linear_delta"), [[0, 0, 280]] * 3))
    assert trajectory.seconds == 0.0 and trajectory.times.tolist() == [0.0] * 3 and trajectory.binding_fractions == {}
    assert trajectory.sample(1000.0).joints == pytest.approx(trajectory.posted.joints[:1])


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"corners": "cut"}, "corners: 'round' or 'stop' expected, not 'cut'"),
        ({"tolerance": 0.0}, "tolerance: more than 0 expected, not 0.0"),
        ({"axis_tolerance": float("nan")}, "axis_tolerance: more than 0 expected, not nan"),
        ({"stops": [5]}, "stops: records from 0 to 4 expected, not 5"),
    ],
)
def test_what_is_refused(how, message):
    with pytest.raises(PoseError) as caught:
        square(load_shipped("orthoglide"), **how)
    assert str(caught.value) == message


def test_a_path_that_the_machine_cannot_follow_is_refused_with_its_place():
    machine = limited(load_shipped("orthoglide"), mm=(INF, 2000.0, INF))
    tip = np.array([[0, 0, 0], [0, 400, 0], [0, 0, 0]], float)
    with pytest.raises(PoseError, match=r"part.apt:2, record 1: the machine can't take this pose"):
        plan_trajectory(posted(machine, tip))
    with pytest.raises(PoseError, match=r"part.apt:2, record 1: more than 0 expected for the feed"):
        plan_trajectory(posted(machine, tip / 10.0, feed=[100.0, 0.0, 100.0]))
    with pytest.raises(PoseError, match="rate: more than 0 expected, not 0"):
        plan_trajectory(posted(machine, tip / 10.0)).sample(0)


def test_jerks_of_a_machine_file(tmp_path):
    file = tmp_path / "rpr3.yaml"
    text = """source: drawn up for this test
motion: tx ty rz
legs:
  kind: length
  joints: [d1, d2, d3]
  foot: {circle: 500 mm, at: [90 deg, 210 deg, 330 deg]}
  platform: {circle: 120 mm, at: [60 deg, 180 deg, 300 deg]}
  range: [250 mm, 650 mm]
  jerk: [100 m/s3, 5e4 mm/s^3, 2 m/s³]
home: {X: 0 mm, Y: 0 mm, C: 0 deg}
"""
    file.write_text(text, encoding="utf-8")
    assert [drive.jerk for drive in pk.load(file).spec.drives] == [1e5, 5e4, 2e3]
    file.write_text(text.replace("2 m/s³", "2 m/s2"), encoding="utf-8")
    with pytest.raises(InputError, match=r':9: jerk: "2 m/s2" is an acceleration, expected a jerk'):
        pk.load(file)


def test_a_time_far_over_the_feeds_is_explained_at_its_line(tmp_path):
    """The second cut turns the wrist by half a turn on 1 mm: 90 deg/s take two seconds, its feed asks for 6 ms."""
    words = ["GOTO/0.0,0.0,-1650.0,0.5,0.0,0.8660254", "GOTO/200.0,0.0,-1650.0,0.5,0.0,0.8660254"]
    turned = [
        f"GOTO/{200.0 + 0.05 * k:.3f},0.0,-1650.0,{0.5 * np.cos(a):.7f},{0.5 * np.sin(a):.7f},0.8660254"
        for k, a in enumerate(np.radians(np.arange(0.0, 181.0, 9.0)))
    ]
    (tmp_path / "part.apt").write_text("\n".join(["UNITS/MM", "FEDRAT/10000,MMPM", *words, *turned, "FINI", ""]))
    job = pk.prepare(load_shipped("tricept"), pk.read_path(tmp_path / "part.apt"))
    assert job.seconds > 3.0
    note = next(note for note in job.posted.path.notes if "its feeds ask for" in note.text)
    assert note.line > 4 and "theta1" in note.text
    slow = (Path(pk.__file__).parent / "machines" / "tricept.yaml").read_text(encoding="utf-8")
    (tmp_path / "slow.yaml").write_text(slow.replace("speed: 90 deg/s", "speed: 0.09 deg/s"), encoding="utf-8")
    job = pk.prepare(pk.load(tmp_path / "slow.yaml"), pk.read_path(tmp_path / "part.apt"))
    note = next(note for note in job.posted.path.notes if "its feeds ask for" in note.text)
    # 180 deg at 0.09 deg/s, without an exponent; on a line 9 deg
    assert 2000.0 <= float(re.findall(r"takes ([0-9,]+) s", note.text)[0].replace(",", "")) < 5000.0
    assert float(re.findall(r"here, ([0-9,]+) s", note.text)[0].replace(",", "")) >= 100.0
    (tmp_path / "part.apt").write_text("\n".join(["UNITS/MM", "FEDRAT/10000,MMPM", *turned[:4], "FINI", ""]))
    job = pk.prepare(load_shipped("tricept"), pk.read_path(tmp_path / "part.apt"))
    assert job.seconds < 1.0  # short paths too
    assert any("its feeds ask for" in note.text for note in job.posted.path.notes)
    (tmp_path / "part.apt").write_text("\n".join(["UNITS/MM", "FEDRAT/600,MMPM", *words, "FINI", ""]))
    job = pk.prepare(load_shipped("tricept"), pk.read_path(tmp_path / "part.apt"))
    assert not any("its feeds ask for" in note.text for note in job.posted.path.notes)
