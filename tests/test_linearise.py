"""Linearised paths held against the programmed ones by dense sampling, written anew with SciPy's rotations."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dense_deviations import DEGREE, UNDER, axis_of, path_of, within
from scipy.spatial.transform import Rotation
from shipped import load_shipped

import parakin as pk
from parakin.toolpath.linearise.linearise import linearise_path
from parakin.toolpath.linearise.path_records import divide_motions
from parakin.toolpath.path import Event
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.programmed_path import ProgrammedPath


def a_path(name):
    """A few long motions for a machine."""
    machine = load_shipped(name)
    if name == "linear_delta":
        return machine, path_of([[-100, 0, 280], [100, 0, 280], [20, 90, 350], [20, 90.5, 350], [0, -100, 250]])
    tip = {
        "tricept": [0, 0, -1650],
        "hexapod": [0, 0, -950],
        "lambda6": [0, 0, 1400],
        "orthoglide5_head": [0, 0, -100],
        "orthoglide5_table": [0, 0, 0],
    }[name]
    shift = np.array([[-30, 20, 0], [40, 30, 10], [40.2, 30, 10], [10, -30, -5], [10, -30, -5], [-20, -10, 5]], float)
    most = 1.0 if machine.axes[3:] == ("B", "C") else 0.4
    axis = axis_of(most * np.array([20, 35, 34, 25, 30, 15]), np.array([10, 50, 52, 100, 60, 130]))
    return machine, path_of(tip + shift, axis)


# Not lambda6: with C = 0, as a tool axis alone has it, its platform is at a singularity.
NAMES = ["tricept", "orthoglide5_head", "orthoglide5_table", "hexapod", "linear_delta"]


def without(posted, result, j):
    """A result with one record left out, posted anew."""
    path = result.path
    fields = ("tip", "axis", "line", "rapid", "feed", "spindle")
    less = replace(path, frame=None, **{name: np.delete(getattr(path, name), j, axis=0) for name in fields})
    return post_path(posted.machine, less, workpiece=posted.frame, mode=posted.mode)


# Within both tolerances, with the fewest points.


@UNDER
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("chord", "angle"), [(0.05, 1e-3), (0.005, 1e-2), (0.02, 1e-4)])
def test_the_tool_stays_within_both_tolerances(name, under, chord, angle):
    machine, path = a_path(name)
    posted = post_path(machine, path)
    assert np.isfinite(posted.joints).all()
    result = linearise_path(posted, under, chord=chord, angle=angle)
    assert within(posted, result, under, chord, angle) <= 1.0
    assert (within(posted, posted, under, chord, angle) > 1.0) == (len(result.path) > len(path))


@UNDER
def test_lambda6_as_a_program_turns_it(under):
    machine = load_shipped("lambda6")
    turns = np.radians([[5, -5, 30], [-8, 6, 45], [10, 10, 20]])
    posted = post_path(machine, turned([[0, 0, 1400], [60, -40, 1420], [-50, 30, 1390]], turns))
    result = linearise_path(posted, under, chord=0.02)
    assert within(posted, result, under, 0.02, 1e-3) <= 1.0
    assert (len(result.path) > 3) == (under == "joints")


@pytest.mark.parametrize(
    ("name", "under"),
    [(name, under) for name in ("tricept", "orthoglide5_table") for under in ("pose", "joints")]
    + [("hexapod", "joints")],
)
def test_no_point_can_be_spared(name, under):
    chord, angle = 0.05, 1e-4 if under == "pose" else 1e-3
    machine, path = a_path(name)
    posted = post_path(
        machine, replace(path, **{f: getattr(path, f)[:2] for f in ("tip", "axis", "line", "rapid", "feed", "spindle")})
    )
    result = linearise_path(posted, under, chord=chord, angle=angle)
    count = len(result.path) - 2
    assert count > 1
    for j in range(1, count + 1):
        assert within(posted, without(posted, result, j), under, chord, angle) > 1.0
    even = divide_motions(posted.path, np.ones(count - 1, int), np.arange(1, count) / count)
    assert within(posted, post_path(machine, even), under, chord, angle) > 1.0


def test_a_long_line_of_a_linear_delta():
    machine = load_shipped("linear_delta")
    posted = post_path(machine, path_of([[-100, 0, 280], [100, 0, 280]]))
    assert linearise_path(posted, "pose") is posted
    counts = []
    for chord in (0.1, 0.01, 0.001):
        result = linearise_path(posted, "joints", chord=chord)
        assert within(posted, result, "joints", chord, 1e-3) <= 1.0
        counts.append(len(result.path) - 1)
    # a tolerance a hundredth as wide takes ten times as many parts
    assert counts[2] == pytest.approx(10 * counts[0], rel=0.1)


@UNDER
def test_a_dense_path_needs_nothing(under):
    machine = load_shipped("tricept")
    t = np.linspace(0.0, 2.0, 400)
    path = path_of(np.column_stack([40 * np.cos(t), 40 * np.sin(t), -1650 + t]), axis_of(20 + t, 50 * t))
    posted = post_path(machine, path)
    assert linearise_path(posted, under, chord=0.01, angle=1e-3) is posted


# Programs that turn the tool themselves.


def turned(tip, turns, **others):
    turns = np.asarray(turns, float)
    return path_of(tip, Rotation.from_euler("xyz", turns).apply([0.0, 0.0, 1.0]), turns=turns, **others)


@UNDER
@pytest.mark.parametrize("angles", [None, {"A": 12 * DEGREE, "B": -7 * DEGREE, "C": 20 * DEGREE}])
def test_turns_of_a_program(under, angles):
    machine = load_shipped("tricept")
    z = 0.0 if angles else -1650.0
    workpiece = pk.workpiece(Z=-1650, **angles) if angles else None
    turns = np.radians([[0, 20, 10], [0, 25, 200], [0, 25, 200], [0, -15, 230], [0, -15, 0]])
    posted = post_path(
        machine, turned([[20, 0, z], [-20, 30, z], [20, 30, z], [0, 10, z], [0, 10, z]], turns), workpiece=workpiece
    )
    assert np.isfinite(posted.joints).all()
    result = linearise_path(posted, under, chord=0.03, angle=2e-3)
    assert within(posted, result, under, 0.03, 2e-3) <= 1.0
    if workpiece is None and under == "pose":
        assert len(result.path) == 5  # B and C are the pose's own


def test_whole_turns_in_one_motion_hide_nothing():
    machine = load_shipped("orthoglide5_table")
    start = np.radians([[0, 10, 0]])
    for whole in (1, 2, 3):
        turns = np.vstack([start, start + [0, 0, whole * 2 * math.pi]])
        # The poses are not the turns.
        posted = post_path(machine, turned([[0, 0, 0], [5, 0, 0]], turns), workpiece=pk.workpiece(B=20 * DEGREE))
        result = linearise_path(posted, "pose", angle=5e-3)
        assert within(posted, result, "pose", 0.01, 5e-3) <= 1.0
        assert len(result.path) > 10 * whole


# What is carried over.


def test_lines_feeds_events_and_times():
    machine = load_shipped("linear_delta")
    path = path_of(
        [[-100, 0, 280], [100, 0, 280], [100, 0.1, 280], [0, 60, 300]],
        events=(Event(0, 9, "M3"), Event(1, 10, "M8"), Event(2, 11, "M0"), Event(4, 20, "M2")),
        seconds=np.array([math.nan, 4.0, math.nan, 2.0]),
    )
    path = replace(
        path,
        rapid=np.array([True, False, True, False]),
        feed=np.array([math.nan, 500.0, 600.0, 700.0]),
        spindle=np.arange(4.0),
    )
    path = replace(path, line=np.array([10, 11, 12, 15]), tool={"number": 3.0})
    posted = post_path(machine, path, workpiece=pk.workpiece(X=1, Y=2, Z=3))
    result = linearise_path(posted, "joints")
    new = result.path
    assert np.array_equal(result.frame, posted.frame)
    assert (new.source, new.tool, new.units, new.frame) == (path.source, path.tool, path.units, None)
    counts = np.bincount(new.line, minlength=16)
    assert counts[10] == 1 and counts[11] > 20 and counts[12] == 1 and counts[15] > 5
    for line, record in ((11, 1), (15, 3)):
        assert np.all(new.feed[new.line == line] == path.feed[record])
        assert np.all(new.spindle[new.line == line] == record)
        assert not new.rapid[new.line == line].any()
        taken = new.seconds[new.line == line]
        assert taken.sum() == pytest.approx(path.seconds[record])
        ends = np.flatnonzero(new.line == line)
        steps = np.linalg.norm(new.tip[ends] - new.tip[ends - 1], axis=1)
        np.testing.assert_allclose(taken / steps, taken.sum() / steps.sum(), rtol=1e-6)
    places = [event.record for event in new.events]
    assert places == [0, 1, counts[10] + counts[11], len(new)]  # before the motion, and behind the last record
    kept = np.isin(np.arange(len(new)), [0, counts[11], counts[11] + 1, len(new) - 1])
    np.testing.assert_array_equal(new.tip[kept], path.tip)


def test_the_file_s_own_frame_stays():
    frame = np.column_stack([Rotation.from_euler("z", 40, degrees=True).as_matrix(), [10.0, -5.0, 280.0]])
    posted = post_path(
        load_shipped("linear_delta"), path_of([[-80, 0, 0], [80, 0, 0]], frame=frame), workpiece=pk.workpiece(X=1, Y=1)
    )
    result = linearise_path(posted, "joints")
    assert within(posted, result, "joints", 0.01, 1e-3) <= 1.0


def test_rapid_motions_are_kept_to_their_lines():
    posted = post_path(
        load_shipped("linear_delta"), replace(path_of([[-100, 0, 280], [100, 0, 280]]), rapid=np.ones(2, bool))
    )
    assert len(linearise_path(posted, "joints").path) > 20


# What can't be done.


def test_paths_with_nothing_to_do():
    machine = load_shipped("tricept")
    for tip in (np.empty((0, 3)), [[0, 0, -1650]]):
        posted = post_path(machine, path_of(np.reshape(tip, (-1, 3))))
        for under in ("pose", "joints"):
            assert linearise_path(posted, under) is posted


@UNDER
@pytest.mark.parametrize("name", ["orthoglide5_head", "orthoglide5_table", "tricept"])
def test_an_upright_tool_stays_on_the_pole(name, under):
    machine = load_shipped(name)
    posted = post_path(machine, path_of(machine.home[:3] + np.array([[0, 0, 0], [0.5, 0, 0], [0.5, 0.5, 0]])))
    result = linearise_path(posted, under)
    assert within(posted, result, under, 0.01, 1e-3) <= 1.0
    is_carried = machine.structure.carries_pole and under == "pose"  # C goes round beside the pole, and theta1 stands
    assert len(result.path) <= (8 if is_carried else 3) and not result.path.notes


@UNDER
def test_records_out_of_reach_are_left_alone(under):
    posted = post_path(
        load_shipped("linear_delta"), path_of([[-100, 0, 280], [0, 0, 280], [2000, 0, 280], [0, 0, 280], [0, 100, 280]])
    )
    result = linearise_path(posted, under)
    counts = np.bincount(result.path.line)
    assert counts[12] == counts[13] == 1  # there and back
    if under == "joints":
        assert counts[11] > 1 and counts[14] > 1
    assert [offence.limit for offence in result.offences] == [offence.limit for offence in posted.offences]


def test_a_motion_out_of_reach_in_between_is_an_offence():
    machine = pk.load(str(Path(__file__).parent / "machines" / "sector.yaml"))
    posted = post_path(machine, path_of([[234, -112, 0], [254, 170, 0]]))
    assert np.isfinite(posted.joints).all()
    assert not np.isfinite(machine.inverse(0.5 * (posted.poses[0] + posted.poses[1]))).all()
    result = linearise_path(posted, "joints")
    assert result.broken_record_count > posted.broken_record_count
    lost = np.flatnonzero(~np.isfinite(result.joints).all(axis=1))
    assert len(lost) == 1 and result.path.line[lost[0]] == 11
    assert result.offences[0].line == 11
    assert len(linearise_path(posted, "pose").path) == 2


def test_opposite_axes_are_refused_with_their_line():
    path = path_of([[0, 0, -950], [10, 0, -950]], [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    posted = post_path(load_shipped("hexapod"), path)
    if np.isfinite(posted.joints).all():
        with pytest.raises(pk.PoseError, match=r"part\.cls:11: the tool axis turns to its opposite"):
            linearise_path(posted, "pose")
    with pytest.raises(pk.PoseError, match=r"part\.cls:11: the tool axis turns to its opposite"):
        ProgrammedPath(path).interpolate(np.array([1]), np.array([0.5]))


@pytest.mark.parametrize("bad", [{"chord": 0.0}, {"chord": math.nan}, {"angle": -1.0}, {"angle": math.inf}])
def test_bad_tolerances(bad):
    posted = post_path(load_shipped("tricept"), path_of([[0, 0, -1650]]))
    with pytest.raises(pk.PoseError, match=next(iter(bad))):
        linearise_path(posted, "pose", **bad)
    with pytest.raises(pk.PoseError, match="under"):
        linearise_path(posted, "both")


# The programmed path.


@pytest.mark.parametrize("size", [1e-13, 1e-9, 1e-5, 0.1, 3.0])
def test_great_circles_great_and_small(size):
    a = np.array([0.36, -0.48, 0.8])
    side = np.cross(a, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    b = math.cos(size) * a + math.sin(size) * side
    share = np.linspace(0.0, 1.0, 11)
    axis = ProgrammedPath(path_of(np.zeros((2, 3)), [a, b])).interpolate(np.ones(11, int), share)[1]
    np.testing.assert_allclose(np.linalg.norm(axis, axis=1), 1.0, atol=1e-15)
    np.testing.assert_allclose((axis - a) @ side, np.sin(share * size), rtol=1e-2 if size < 1e-12 else 1e-6, atol=1e-17)
