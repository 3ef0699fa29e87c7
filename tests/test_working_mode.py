"""Turns and working modes along a path: against every count of turns there is, and against motions cut up finely."""

import math
from importlib.resources import files

import numpy as np
import pytest
from random_paths import PathMaker
from shipped import load_shipped

import parakin as pk
from parakin.toolpath.path import ToolPath
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.programmed_path import compute_tool_axes

DEGREE = math.pi / 180.0
TURN = 360.0 * DEGREE


def path_of(tip, axis, rapid=None, turns=None, lines=None):
    n = len(axis)
    tip = np.broadcast_to(np.asarray(tip, float), (n, 3)).copy()
    rapid = np.zeros(n, bool) if rapid is None else np.asarray(rapid, bool)
    lines = np.arange(1, n + 1) if lines is None else np.asarray(lines)
    return ToolPath("part", tip, axis, lines, rapid, np.full(n, 1000.0), np.full(n, np.nan), turns=turns)


def axis_of(b, c):
    b, c = np.radians(b), np.radians(c)
    return np.stack(np.broadcast_arrays(np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)), axis=-1)


def joint(machine, name):
    return list(machine.joints).index(name)


def changed(tmp_path, name, old, new):
    """A shipped machine with other words in its file."""
    text = (files("parakin") / "machines" / f"{name}.yaml").read_text(encoding="utf-8")
    assert old in text
    (file := tmp_path / f"{name}.yaml").write_text(text.replace(old, new), encoding="utf-8")
    return pk.load(file)


def even(machine, posted, record, parts=2000):
    """The joints' way from a record to the next where the pose goes evenly, each unwound."""
    share = np.linspace(0.0, 1.0, parts)[:, None]
    begin, end = posted.poses[record - 1], posted.poses[record]
    joints = machine.inverse(begin + share * (end - begin), posted.mode)
    turning = [i for i, unit in enumerate(machine.joint_units) if unit == "rad"]
    joints[:, turning] = np.unwrap(joints[:, turning], axis=0)
    return joints[-1] - joints[0]


def leads_to(posted, path):
    """Poses have the path's tips and axes, and the joints are the machine's for these poses, but for whole turns."""
    machine, (b, c) = posted.machine, posted.poses[:, 3:].T
    k = np.stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)], axis=1)
    np.testing.assert_allclose(k, path.axis, atol=1e-12)
    np.testing.assert_allclose(posted.poses[:, :3], path.tip, atol=1e-12)
    off = posted.joints - machine.inverse(posted.poses, posted.mode)
    for column, unit in enumerate(machine.joint_units):
        if unit == "rad":
            off[:, column] -= TURN * np.round(off[:, column] / TURN)
    np.testing.assert_allclose(off, 0.0, atol=1e-9)


def spirals(starts, stops, b=20.0, tip=(0.0, 0.0, 0.0), step=5.0, aside=20.0):
    """Stretches of feed, each at a height and in a rapid above it, with C from start to stop in degrees."""
    c, z, rapid, lines = [], [], [], []
    for start, stop in zip(starts, stops, strict=True):
        count = max(2, round(abs(stop - start) / step))
        way = np.linspace(start, stop, count)
        c += [start, *way, stop]  # over the part, down in rapid, feed, up in rapid; then on to the next
        z += [30.0, *np.zeros(count), 30.0]
        rapid += [True, True, *[False] * (count - 1), True]
    lines = np.arange(1, len(c) + 1)
    tips = np.zeros((len(c), 3)) + tip
    tips[:, 2] += z
    tips[:, 0] += (
        np.where(np.arange(len(c)) % 2, 1.0, -1.0) * (np.array(z) > 0) * aside
    )  # the way between is the longest
    return path_of(tips, axis_of(b, np.array(c)), rapid, lines=lines)


# Turns.


def test_no_turn_is_taken_back_where_one_count_serves():
    machine = load_shipped("orthoglide5_table")
    path = spirals([-245, 50], [50, 445])  # the plate stands at 90 deg - C
    posted = post_path(machine, path)
    assert posted.broken_record_count == 0
    assert np.abs(np.diff(posted.poses[:, 4])).max() < 6 * DEGREE


def test_a_path_without_rapids_breaks_as_few_records_as_can_be():
    machine = load_shipped("orthoglide5_table")
    c = np.concatenate([np.linspace(0, 900, 181), np.full(100, 900.0)])
    path = path_of(machine.home[:3], axis_of(10.0, c))
    posted = post_path(machine, path)
    fewest = {}
    for mode in ("++++", "+++-"):
        angle = np.unwrap(machine.inverse(posted.poses, mode)[:, joint(machine, "c")])
        fewest[mode] = min(int((np.abs(angle + n * TURN) > TURN + 1e-12).sum()) for n in range(-5, 6))
    assert posted.broken_record_count == min(fewest.values()) > 0
    assert post_path(machine, path, mode="++++").broken_record_count == fewest["++++"] > posted.broken_record_count


def test_turns_against_every_count_there_is():
    machine = load_shipped("orthoglide5_table")
    column, rng = joint(machine, "c"), np.random.default_rng(4)
    for _ in range(12):
        ends = np.cumsum(rng.uniform(-400, 500, 5))
        posted = post_path(machine, spirals(ends[:-1], ends[1:], step=29.0))
        best = {}
        for mode in ("++++", "+++-"):
            angle = np.unwrap(machine.inverse(posted.poses, mode)[:, column])
            best[mode] = min(int((np.abs(angle + TURN * turns) > TURN + 1e-12).sum()) for turns in range(-6, 7))
        assert posted.mode == min(best, key=best.get)
        assert posted.broken_record_count == best[posted.mode]


def test_the_count_nearest_to_home():
    machine = load_shipped("orthoglide5_table")
    column = joint(machine, "c")
    path = path_of(machine.home[:3], axis_of(10.0, np.linspace(-170, -350, 40)))
    angle = np.unwrap(machine.inverse(post_path(machine, path).poses)[:, column])
    spans = [(float(np.abs(angle + n * TURN).max()), n) for n in range(-2, 3)]
    np.testing.assert_allclose(post_path(machine, path).joints[:, column], angle + min(spans)[1] * TURN, atol=1e-12)
    assert min(spans)[0] < 352 * DEGREE


# Turns as a program gives them.


@pytest.mark.parametrize("name", ["orthoglide5_table", "orthoglide5_head", "tricept"])
@pytest.mark.parametrize("c", [300.0, -350.0, 170.0])
def test_a_turn_programmed_in_one_motion_is_made(name, c):
    machine = load_shipped(name)
    few = np.radians([[0.0, 20.0, 0.0], [0.0, 25.0, c], [0.0, 25.0, c + 10.0]])
    share = np.linspace(0.0, 1.0, 1001)[:, None]
    many = np.vstack([few[0] + share * (few[1] - few[0]), few[2:]])
    posted, fine = (post_path(machine, path_of(machine.home[:3], compute_tool_axes(t), turns=t)) for t in (few, many))
    assert posted.poses[:, 3:].tolist() == few[:, 1:].tolist()
    way, finely = posted.joints - posted.joints[0], fine.joints - fine.joints[0]
    np.testing.assert_allclose(way, finely[[0, 1000, 1001]], atol=1e-9)
    assert posted.broken_record_count == 0


def test_too_many_turns_are_refused():
    turns = np.array([[0.0, 0.3, 0.0], [0.0, 0.3, 1e6]])
    machine = load_shipped("tricept")
    with pytest.raises(pk.PoseError, match="record 1 makes 159,155 turns"):
        post_path(machine, path_of(machine.home[:3], compute_tool_axes(turns), turns=turns))


# Working modes.


def test_the_other_mode_where_the_default_breaks_a_limit(tmp_path):
    machine = changed(tmp_path, "orthoglide5_head", "range: [-100 deg, 100 deg]", "range: [-100 deg, 10 deg]")
    path = path_of(machine.home[:3], axis_of(30.0, np.linspace(0, 200, 30)))
    posted = post_path(machine, path)
    assert posted.mode == machine.mode[:-1] + "-"
    assert posted.broken_record_count == 0
    leads_to(posted, path)
    given = post_path(machine, path, mode=machine.mode)
    assert given.mode == machine.mode
    assert given.broken_record_count == 30


def test_the_default_mode_where_both_serve():
    machine = load_shipped("orthoglide5_head")
    path = path_of(machine.home[:3], axis_of(30.0, np.linspace(0, 200, 30)))
    assert post_path(machine, path).mode == machine.mode
    assert post_path(machine, path, mode=machine.mode[:-1] + "-").broken_record_count == 0


def test_the_other_mode_where_it_spares_a_flip(tmp_path):
    # From a lean of -5 to 20 deg over the upright: with theta2 above 0 first it would have to go to -20 then.
    machine = changed(tmp_path, "orthoglide5_head", "range: [-100 deg, 100 deg]", "range: [-10 deg, 100 deg]")
    path = path_of(machine.home[:3], axis_of(np.linspace(-5, 20, 12), 0.0))
    default = post_path(machine, path, mode=machine.mode)
    assert default.broken_record_count == 0
    column = joint(machine, "theta1")
    assert np.abs(np.diff(default.joints[:, column])).max() > 170 * DEGREE
    posted = post_path(machine, path)
    assert posted.mode == machine.mode[:-1] + "-"
    assert posted.broken_record_count == 0
    assert np.abs(np.diff(posted.joints[:, column])).max() < 1e-6


def test_legs_keep_their_modes():
    machine = load_shipped("hbg80_2d")
    path = path_of([900.0, 230.0, 0.0], np.tile([0.0, 0.0, 1.0], (3, 1)))
    posted = post_path(machine, path)
    assert posted.mode == machine.mode
    assert posted.broken_record_count == 3


def test_a_job_that_runs_in_one_mode_only_is_prepared_in_that(tmp_path):
    machine = load_shipped("tricept")
    maker = PathMaker(machine, 106)
    maker.widest *= 2.5
    (tmp_path / "part.cls").write_text(maker.make(), encoding="ascii")
    path = pk.read_path(tmp_path / "part.cls")
    assert post_path(machine, path).mode == "+"
    assert not pk.prepare(machine, path, mode="+").runs
    assert pk.prepare(machine, path, mode="-").runs
    assert pk.prepare(machine, path).runs
