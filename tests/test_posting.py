"""A tool path on a machine: frames by hand, limits at their lines, continuity, and the joint table read back."""

import csv
import errno
import io
import itertools
import math
from dataclasses import replace
from decimal import ROUND_HALF_EVEN, Decimal

import numpy as np
import pyarrow.parquet as pq
import pytest
from independent import transform
from shipped import NAMES, load_shipped

import parakin as pk
from parakin.export.tables import joints as table
from parakin.toolpath.path import ToolPath
from parakin.toolpath.posting.frames import build_frame_from_angles, compute_poses
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.reading.cl.reader import read_cl
from parakin.toolpath.reading.gcode.reader import read_gcode

DEGREE = math.pi / 180.0


def path_of(tip, axis=None, first_line=1):
    tip = np.atleast_2d(np.asarray(tip, dtype=float))
    n = len(tip)
    axis = np.tile([0.0, 0.0, 1.0], (n, 1)) if axis is None else np.asarray(axis, dtype=float)
    lines = np.arange(first_line, first_line + n)
    return ToolPath("part.cls", tip, axis, lines, np.zeros(n, bool), np.full(n, 1000.0), np.full(n, np.nan))


def axis_of(b, c):
    b, c = np.radians(b), np.radians(c)
    return np.stack(np.broadcast_arrays(np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)), axis=-1)


def home_of(machine):
    """Tool tip and axis at home."""
    home = dict(zip(machine.axes, machine.home.tolist(), strict=True))
    a, b, c = (home.get(letter, 0.0) for letter in "ABC")
    axis = build_frame_from_angles(0, 0, 0, a, b, c)[:, 2]
    if not {"A", "B", "C"} & set(machine.axes):  # such a machine may lie down
        for step in reversed(machine.spec.mounting):
            axis = transform(step.axis, step.value)[0, :3, :3] @ axis
    return np.array([home.get(letter, 0.0) for letter in "XYZ"]), axis


def small_part(machine):
    """A little square around home, in the plane where the machine works in one."""
    tip, axis = home_of(machine)
    corners = np.array([[0, 0, 0], [5, 0, 0], [5, 5, 1], [0, 5, 2], [0, 0, 0]], dtype=float)
    free = [letter in machine.axes for letter in "XYZ"]
    return path_of(tip + corners * free, np.tile(axis, (len(corners), 1)))


# Frames.


def test_option_goes_on_top_of_the_files_frame(tmp_path):
    # File: 90 deg about Z, origin (1, 2, 3): (1, 0, 0) -> (1, 3, 3). Option: 90 deg about Z, then (10, 20, 30).
    part = tmp_path / "part.aptsource"
    part.write_text("$$*CATIA0\n$$ 0 -1 0 1\n$$ 1 0 0 2\n$$ 0 0 1 3\nGOTO/1,0,0,0.6,0,0.8\n")
    posted = post_path(load_shipped("tricept"), read_cl(part), workpiece=pk.workpiece(X=10, Y=20, Z=30, C=90 * DEGREE))
    np.testing.assert_allclose(posted.poses[0, :3], [-3 + 10, 1 + 20, 3 + 30], atol=1e-12)
    # The axis (0.6, 0, 0.8) turns with both frames, by 180 deg.
    np.testing.assert_allclose(posted.poses[0, 3:], [math.atan2(0.6, 0.8), math.pi], atol=1e-12)
    alone = post_path(load_shipped("tricept"), read_cl(part))
    np.testing.assert_allclose(alone.poses[0, :3], [1, 3, 3], atol=1e-12)


@pytest.mark.parametrize("name", ["hexapod", "lambda6"])
def test_three_turns_give_the_axis_with_c_as_at_home(name):
    machine = load_shipped(name)
    rng = np.random.default_rng(7)
    axis = rng.normal(size=(200, 3))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    poses, own = compute_poses(machine, np.zeros((200, 3)), axis, build_frame_from_angles(0, 0, 0, 0, 0, 0))
    assert not own
    assert np.all(poses[:, 5] == machine.home[5])
    np.testing.assert_allclose([rotation(*pose[3:])[:, 2] for pose in poses], axis, atol=1e-12)
    assert np.max(np.abs(np.diff(poses[:, 4]))) <= math.pi + 1e-12


# Continuity.


def test_c_and_theta1_are_continuous_through_upright():
    machine = load_shipped("tricept")
    lean = np.concatenate([np.linspace(10, 0, 41), np.zeros(9), np.linspace(0, 10, 41)])
    turn = np.where(np.arange(len(lean)) < 45, 170.0, -175.0)  # 15 deg apart, over the seam of atan2
    posted = post_path(machine, path_of(np.tile([0.0, 0.0, -1650.0], (len(lean), 1)), axis_of(lean, turn)))
    c = posted.poses[:, 4]
    np.testing.assert_allclose(c[:50], 170 * DEGREE, atol=1e-9)
    np.testing.assert_allclose(c[-40:], 185 * DEGREE, atol=1e-9)
    theta1 = posted.joints[:, list(machine.joints).index("theta1")]
    assert np.max(np.abs(np.diff(theta1))) < 16 * DEGREE
    assert posted.broken_record_count == 0


def test_upright_throughout_leaves_c_at_zero():
    posted = post_path(load_shipped("tricept"), path_of(np.tile([0.0, 0.0, -1650.0], (5, 1))))
    assert np.all(posted.poses[:, 3:] == 0.0)


@pytest.mark.parametrize(("start", "end"), [(-250, 430), (70, -610)])  # c goes 20 to 700 deg off; -340 to 340 will do
def test_turns_are_counted_into_the_drives_range(start, end):
    machine = load_shipped("orthoglide5_table")
    tip, _ = home_of(machine)
    turn = np.linspace(start, end, 1401)
    posted = post_path(machine, path_of(np.tile(tip, (len(turn), 1)), axis_of(5.0, turn)))
    c = posted.joints[:, list(machine.joints).index("c")]
    assert np.ptp(c) == pytest.approx(680 * DEGREE, abs=1e-6)
    assert np.max(np.abs(np.diff(c))) < 1 * DEGREE
    assert c.min() >= -360 * DEGREE
    assert c.max() <= 360 * DEGREE
    assert not any(offence.limit.startswith("c.") for offence in posted.offences)


# Limits.


def test_leg_too_long_is_told_with_its_line(tmp_path):
    # On the axis the struts are sqrt((R - r)² + p²) long with p = -Z - l1 - l2.
    part = tmp_path / "part.cls"
    part.write_text("FEDRAT/900,MMPM\nGOTO/0,0,-1650,0,0,1\nGOTO/0,0,-2050\nGOTO/0,0,-2060\nGOTO/0,0,-1650\n")
    posted = post_path(load_shipped("tricept"), read_cl(part))
    assert posted.broken.tolist() == [0, 1 + posted.limits.index("d1.max"), 1 + posted.limits.index("d1.max"), 0]
    assert posted.broken_record_count == 2
    length = math.hypot(250, 1610)
    worst = {offence.limit: offence for offence in posted.offences}["d2.max"]
    assert (worst.line, worst.record, worst.count, worst.unit) == (4, 2, 2, "mm")
    assert worst.value == pytest.approx(length)
    assert worst.excess == pytest.approx(length - 1520)
    assert worst.text == f"leg d2 would be {length:,.1f} mm, limit 1,520"
    assert (posted.first.limit, posted.first.line) == ("d1.max", 3)
    assert posted.first.value == pytest.approx(math.hypot(250, 1600))
    assert posted.worst.line == 4


def test_slight_excess_shows_enough_digits():
    z = -450 - math.sqrt(1520.0003**2 - 250**2)
    posted = post_path(load_shipped("tricept"), path_of([0, 0, z]))
    assert "would be 1,520.0003 mm, limit 1,520" in posted.offences[0].text


def test_out_of_reach_is_an_offence():
    machine = load_shipped("linear_delta")
    posted = post_path(machine, path_of([[0, 0, 280], [1000, 0, 280]]))
    assert np.isnan(posted.joints[1]).any()
    by_name = {offence.limit: offence for offence in posted.offences}
    off = math.hypot(1000, 350 - 60) - 700
    assert by_name["tower_a.reach"].excess == pytest.approx(off)
    assert by_name["tower_a.reach"].text == f"leg tower_a can't close: its rod would have to be {off:.1f} mm longer"
    assert posted.broken[0] == 0
    assert posted.worst.limit.endswith(".reach")


def test_tilt_of_a_machine_without_turns():
    posted = post_path(
        load_shipped("linear_delta"), path_of([[0, 0, 280]] * 3, axis_of([0, 12.3, 5e-4 * DEGREE], 40.0))
    )
    assert [posted.limits[b - 1] if b else "" for b in posted.broken] == ["", "tilt", ""]
    assert posted.first.text == "tool axis would lean 12.3°, the machine keeps it upright"
    assert posted.first.value == pytest.approx(12.3 * DEGREE)


def test_out_of_the_plane_of_a_planar_machine():
    posted = post_path(load_shipped("hbg80_2d"), path_of([[230, 230, 0], [230, 230, 5], [230, 230, 1e-7]]))
    assert [posted.limits[b - 1] if b else "" for b in posted.broken] == ["", "Z", ""]
    assert posted.first.text == "Z would be 5.0 mm, the machine works in Z = 0"


PLANAR = """\
source: three struts in a plane
motion: {motion}
legs:
  - {{kind: length, joints: [a], foot: [{a}], platform: [{p}], range: [50 mm, 2 m]}}
  - {{kind: length, joints: [b], foot: [{b}], platform: [{q}], range: [50 mm, 2 m]}}
  - {{kind: length, joints: [c], foot: [{c}], platform: [{r}], range: [50 mm, 2 m]}}
home: {home}
"""


def planar(folder, across):
    """A machine in X and Y that turns about Z, or the same upright: in X and Z, turning about Y."""
    points = [(-500, 0), (500, 0), (0, 800), (-60, 0), (60, 0), (0, 80)]
    put = (lambda x, y: f"{x} mm, {y} mm, 0 mm") if across == "Z" else (lambda x, y: f"{x} mm, 0 mm, {y} mm")
    axes = ("Y", "C", "tx ty rz") if across == "Z" else ("Z", "B", "tx tz ry")
    named = dict(zip("abcpqr", (put(*point) for point in points), strict=True))
    home = f"{{X: 10 mm, {axes[0]}: 300 mm, {axes[1]}: 5 deg}}"
    (path := folder / "planar.yaml").write_text(PLANAR.format(motion=axes[2], home=home, **named))
    return pk.load(path)


def test_planar_machine_that_turns_about_its_tool(tmp_path):
    machine = planar(tmp_path, "Z")
    posted = post_path(machine, path_of([[10, 300, 0]] * 3, axis_of([0, 20, 0], 70.0)))
    np.testing.assert_allclose(posted.poses, [[10, 300, 0]] * 3, atol=1e-12)
    assert [offence.limit for offence in posted.offences] == ["tilt"]
    assert posted.offences[0].value == pytest.approx(20 * DEGREE)


def test_upright_planar_machine_tilts_in_its_plane(tmp_path):
    machine = planar(tmp_path, "Y")
    posted = post_path(machine, path_of([[10, 0, 300]] * 3, axis_of([10, 15, 15], [0, 180, 90])))
    np.testing.assert_allclose(posted.poses[:2], [[10, 300, 10 * DEGREE], [10, 300, -15 * DEGREE]], atol=1e-12)
    assert [posted.limits[b - 1] if b else "" for b in posted.broken] == ["", "", "tilt"]
    assert posted.first.value == pytest.approx(15 * DEGREE)


@pytest.mark.parametrize("name", NAMES)
def test_every_machine_takes_a_small_part(name):
    machine = load_shipped(name)
    path = small_part(machine)
    posted = post_path(machine, path)
    assert posted.broken_record_count == 0, [offence.text for offence in posted.offences]
    assert not machine.check(posted.poses, posted.joints).any()
    assert np.isfinite(posted.joints).all()
    assert np.max(np.abs(np.diff(posted.joints, axis=0))) < 60  # mm, for steps of 5
    check = io.BytesIO()
    table.make_joint_csv(posted)(check)
    assert check.getvalue().count(b"\n") == len(path) + 1


@pytest.mark.parametrize("name", NAMES)
def test_no_machine_is_silent_about_what_it_cant_do(name):
    machine = load_shipped(name)
    posted = post_path(machine, path_of([[5000, 5000, 9000]] * 3, axis_of(150.0, [0, 50, 100])))
    assert posted.broken.all()
    assert posted.offences
    assert all("nan" not in offence.text for offence in posted.offences)


def test_counts_agree_with_the_margins():
    machine = load_shipped("hexapod")
    rng = np.random.default_rng(3)
    tip, axis = home_of(machine)
    n = 70_000  # more than the block in which margins are held
    posted = post_path(machine, path_of(tip + rng.normal(size=(n, 3)) * 250, np.tile(axis, (n, 1))))
    margins = machine.margins(posted.poses, posted.joints)
    counts = {name: int(c) for name, c in zip(machine.limits, (margins < 0).sum(0), strict=True) if c}
    assert {offence.limit: offence.count for offence in posted.offences} == counts
    assert posted.first.record == np.flatnonzero((margins < 0).any(1))[0]
    for offence in posted.offences:
        column = margins[:, machine.limits.index(offence.limit)]
        assert offence.excess == pytest.approx(-column.min())
        assert offence.record == column.argmin()


def test_unknown_mode():
    with pytest.raises(pk.PoseError, match="mode 'x'"):
        post_path(load_shipped("tricept"), path_of([0, 0, -1650]), mode="x")


# The table.


def table_of(posted):
    file = io.BytesIO()
    table.make_joint_csv(posted)(file)
    return list(csv.DictReader(io.StringIO(file.getvalue().decode())))


def test_csv_reads_back_within_its_digits():
    machine = load_shipped("tricept")
    rng = np.random.default_rng(5)
    n = 40_000  # several batches
    tip = rng.uniform([-300, -300, -2300], [300, 300, -1500], (n, 3))
    posted = post_path(machine, path_of(tip, axis_of(rng.uniform(0, 40, n), rng.uniform(-180, 180, n)), first_line=17))
    rows = table_of(posted)
    assert len(rows) == n
    for names, units, values in (
        (machine.axes, machine.axis_units, posted.poses),
        (machine.joints, machine.joint_units, posted.joints),
    ):
        for column, (name, unit) in enumerate(zip(names, units, strict=True)):
            head, factor, digits = (f"{name} [deg]", 180 / math.pi, 8) if unit == "rad" else (f"{name} [mm]", 1.0, 6)
            read = np.array([float(row[head]) for row in rows])
            assert np.max(np.abs(read - values[:, column] * factor)) <= 0.5001 * 10.0**-digits
    assert [int(row["record"]) for row in rows] == list(range(n))
    assert [int(row["line"]) for row in rows] == list(range(17, 17 + n))
    assert [row["broken"] for row in rows] == [posted.limits[b - 1] if b else "" for b in posted.broken]
    assert 0 < posted.broken_record_count < n


def test_numbers_print_as_decimals():
    machine = load_shipped("linear_delta")
    values = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        1e-7,
        -4e-7,
        5e-7,
        0.000001,
        -0.1,
        99.999999,
        999999.9999996,
        1e9,
        -1e9,
        123.456789,
        100.0,
    ]
    rng = np.random.default_rng(11)
    values += (rng.normal(size=3000) * 10.0 ** rng.integers(-7, 9, 3000)).tolist()
    posted = post_path(machine, path_of([[value, 0.0, 0.0] for value in values]))
    for row, value in zip(table_of(posted), values, strict=True):
        text = row["X [mm]"]
        exact = Decimal(value * 1e6).quantize(Decimal(1), ROUND_HALF_EVEN).scaleb(-6)
        assert Decimal(text) == exact
        assert text == (f"{exact:.6f}".rstrip("0").rstrip(".") if exact else "0")


def test_unreachable_records_have_empty_fields():
    posted = post_path(load_shipped("linear_delta"), path_of([[0, 0, 280], [1000, 0, 280]]))
    good, lost = table_of(posted)
    assert good["broken"] == ""
    assert float(good["tower_a [mm]"]) > 0
    assert lost["tower_a [mm]"] == ""
    assert lost["broken"].endswith(".reach")


def test_parquet_holds_the_same():
    machine = load_shipped("linear_delta")
    posted = post_path(machine, path_of([[0, 0, 280], [1000, 0, 280], [5, 0, 280]], first_line=4))
    file = io.BytesIO()
    table.make_joint_parquet(posted)(file)
    read = pq.read_table(io.BytesIO(file.getvalue()))
    assert read.column_names == table.name_joint_columns(posted)
    assert read["X [mm]"].to_pylist() == [0.0, 1000.0, 5.0]
    assert read["line"].to_pylist() == [4, 5, 6]
    assert read["tower_a [mm]"].to_pylist()[1] is None
    assert read["tower_a [mm]"].to_pylist()[2] == posted.joints[2, 0]
    assert read["broken"].to_pylist() == [None, posted.limits[posted.broken[1] - 1], None]


# Files.


def failing(error):
    def write(file):
        file.write(b"half of it")
        raise error

    return write


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), OSError(errno.ENOSPC, "No space left on device"), ValueError("x")]
)
def test_files_appear_whole_or_not_at_all(tmp_path, error):
    (tmp_path / "a.csv").write_text("before")
    expected = pk.InputError if isinstance(error, OSError) else type(error)
    with pytest.raises(expected):
        pk.write_files(tmp_path, {"a.csv": b"after", "b.csv": failing(error), "c.csv": "c"})
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
    assert (tmp_path / "a.csv").read_text() == "before"


def test_written_files_are_the_users(tmp_path):
    (plain := tmp_path / "plain").write_text("")
    paths = pk.write_files(tmp_path / "new" / "folder", {"a": "grün", "b": lambda file: file.write(b"b")})
    assert [path.read_bytes() for path in paths] == ["grün".encode(), b"b"]
    assert paths[0].stat().st_mode == plain.stat().st_mode


def test_a_folder_that_cant_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "taken").mkdir()
    (tmp_path / "pipe").symlink_to("/dev/null")
    below = tmp_path / "file" / "below"
    for folder, name in ((below, "a"), (tmp_path / "file", "a"), (tmp_path, "taken"), (tmp_path, "pipe")):
        with pytest.raises(pk.InputError):
            pk.write_files(folder, {name: b""})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "pipe", "taken"]


@pytest.mark.parametrize("name", ["orthoglide5_head", "tricept"])
def test_c_and_the_wrist_stay_continuous_over_the_pole(name):
    m = load_shipped(name)
    lean = np.linspace(-0.21, 0.2, 12)
    axis = np.column_stack([np.sin(lean), np.zeros(12), np.cos(lean)])
    tip = np.tile(m.home[:3], (12, 1))
    zero = np.zeros(12)
    path = ToolPath("swing.apt", tip, axis, np.arange(1, 13), zero > 1, zero + 1e3, zero, None, "apt", "mm", {}, (), ())
    posted = post_path(m, path)
    b, c = posted.poses[:, 3], posted.poses[:, 4]
    assert np.abs(np.diff(c)).max() < 1e-9
    assert np.abs(np.diff(b)).max() < 0.04
    assert np.abs(np.diff(posted.joints[:, 3:], axis=0)).max() < 0.06
    k = np.column_stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)])
    assert np.abs(k - axis).max() < 1e-12
    assert not posted.offences


# Turns as a G-code program gives them.


def rotation(a, b, c):
    return build_frame_from_angles(0.0, 0.0, 0.0, a, b, c)[:, :3]


def turned_path(machine, turns, tip=None):
    turns = np.radians(np.atleast_2d(np.asarray(turns, dtype=float)))
    axis = np.array([rotation(*row)[:, 2] for row in turns])
    tip = home_of(machine)[0] if tip is None else np.asarray(tip, dtype=float)
    return replace(path_of(np.tile(tip, (len(turns), 1)), axis), turns=turns)


@pytest.mark.parametrize("name", ["hexapod", "lambda6"])
def test_three_turns_as_programmed(name):
    machine = load_shipped(name)
    way = np.linspace(0.0, 1.0, 60)[:, None]
    path = turned_path(machine, [3.0, -2.0, -200.0] + way * [5.0, 4.0, 900.0])
    for x, angle in ((0.0, 0.0), (3.0, 40.0 * DEGREE), (0.0, math.pi)):
        posted = post_path(machine, path, workpiece=pk.workpiece(X=x, C=angle))
        assert (posted.poses[:, 3:] == path.turns + [0.0, 0.0, angle]).all()  # to the last digit, turn for turn


def test_three_turns_in_a_tilted_frame():
    machine, rng = load_shipped("hexapod"), np.random.default_rng(8)
    ends = np.cumsum(rng.uniform(-150, 150, (30, 3)), axis=0)
    share = np.linspace(0.0, 1.0, 41)[:-1, None]
    fine = np.vstack([a + share * (b - a) for a, b in itertools.pairwise(ends)] + [ends[-1:]])
    workpiece = pk.workpiece(A=35 * DEGREE, B=-50 * DEGREE, C=25 * DEGREE)
    few, many = (post_path(machine, turned_path(machine, t), workpiece=workpiece) for t in (ends, fine))
    frame = few.frame[:, :3]
    for posted in (few, many):
        for pose, turns in zip(posted.poses, posted.path.turns, strict=True):
            np.testing.assert_allclose(rotation(*pose[3:]), frame @ rotation(*turns), atol=4e-15)
    # A motion of many degrees ends where the same motion in small steps does, turns counted.
    np.testing.assert_allclose(few.poses[:, 3:], many.poses[::40, 3:], atol=1e-9)
    assert np.abs(np.diff(many.poses[:, 3:], axis=0)).max() < 1.6  # beside B of 90 deg


def test_a_frame_tilted_by_a_rounding_changes_no_turn_count():
    machine = load_shipped("hexapod")
    path = turned_path(machine, [[1.0, 100.0, 700.0], [2.0, 100.0, -1000.0], [400.0, 95.0, -1000.0]])
    workpieces = [pk.workpiece(A=a * DEGREE, C=30 * DEGREE) for a in (0, 1e-7)]
    plain, tilted = (post_path(machine, path, workpiece=workpiece).poses[:, 3:] for workpiece in workpieces)
    np.testing.assert_allclose(tilted, plain, atol=1e-7)
    assert (tilted != plain).any()


def test_turns_through_b_of_90_degrees():
    machine = load_shipped("hexapod")
    b = np.array([80.0, 88.0, 90.0 - 1e-9, 90.0, 91.0, 100.0, 90.0, 89.0])
    path = turned_path(machine, np.column_stack([np.full(8, 10.0), b, np.full(8, 20.0)]))
    posted = post_path(machine, path, workpiece=pk.workpiece(A=1e-8 * DEGREE))
    np.testing.assert_allclose(posted.poses[:, 3:], path.turns, atol=1e-7)
    for pose, turns in zip(posted.poses, path.turns, strict=True):
        np.testing.assert_allclose(rotation(*pose[3:]), posted.frame[:, :3] @ rotation(*turns), atol=1e-9)


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head", "orthoglide5_table"])
def test_b_and_c_as_programmed(name):
    machine = load_shipped(name)
    path = turned_path(machine, [[0, 10, 400], [0, 5, 420], [0, 0, 500], [0, -8, 500], [0, -12, 480]])
    posted = post_path(machine, path, workpiece=pk.workpiece(C=-15 * DEGREE))
    assert (posted.poses[:, 3:] == path.turns[:, 1:] + [0.0, -15.0 * DEGREE]).all()
    tilted = post_path(machine, path, workpiece=pk.workpiece(C=-15 * DEGREE, A=2 * DEGREE))  # from the axis
    b, c = tilted.poses[:, 3:].T
    k = np.column_stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)])
    np.testing.assert_allclose(k, path.axis @ tilted.frame[:, :3].T, atol=1e-12)
    with_a = turned_path(machine, [[8, 0, 10], [9, 0, 300], [10, 0, 720]])
    posted = post_path(machine, with_a)
    b, c = posted.poses[:, 3:].T
    k = np.column_stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)])
    np.testing.assert_allclose(k, with_a.axis, atol=1e-12)
    np.testing.assert_allclose(c - c[0], np.radians([0, 290, 710]), atol=1e-9)  # evenly about Z, so the turns count


def test_a_tool_may_spin_where_it_is_round():
    machine = load_shipped("linear_delta")
    assert post_path(machine, turned_path(machine, [[0, 0, 0], [0, 0, 200], [0, 0, 900]])).broken_record_count == 0
    posted = post_path(machine, turned_path(machine, [[0, 0, 0], [0, 3, 200], [1, 0, 0]]))
    assert [posted.limits[b - 1] if b else "" for b in posted.broken] == ["", "tilt", "tilt"]


def test_planar_machines_turn_as_programmed(tmp_path):
    machine = planar(tmp_path, "Z")
    path = turned_path(machine, [[0, 0, 5], [0, 0, -20], [0, 0, 12]], [10, 300, 0])
    posted = post_path(machine, path, workpiece=pk.workpiece(C=3 * DEGREE))
    np.testing.assert_array_equal(posted.poses[:, 2], path.turns[:, 2] + 3 * DEGREE)
    origin = replace(path, tip=np.zeros((3, 3)))
    little = pk.workpiece(X=10, Y=300, A=0.001 * DEGREE, C=3 * DEGREE)  # A is within what may lean
    nearly = post_path(machine, origin, workpiece=little)
    assert nearly.broken_record_count == 0
    np.testing.assert_allclose(nearly.poses[:, 2], path.turns[:, 2] + 3 * DEGREE, atol=1e-8)
    machine = planar(tmp_path, "Y")
    path = turned_path(machine, [[0, 5, 0], [0, -20, 0], [0, 12, 0], [0, 12, 50], [3, 12, 0]], [10, 0, 300])
    posted = post_path(machine, path)
    np.testing.assert_allclose(posted.poses[:3, 2], path.turns[:3, 1], atol=1e-15)
    assert [posted.limits[b - 1] if b else "" for b in posted.broken] == ["", "", "", "tilt", "tilt"]


def test_gcode_from_its_file_to_the_hexapod(tmp_path):
    (part := tmp_path / "part.ngc").write_text("G21 G90\nG0 X0 Y0 Z-950\nG1 A5 B-3 C12.5 F500\nG1 X10 C372.5\nM2\n")
    posted = post_path(load_shipped("hexapod"), read_gcode(part))
    np.testing.assert_allclose(np.degrees(posted.poses[:, 3:]), [[0, 0, 0], [5, -3, 12.5], [5, -3, 372.5]], atol=1e-12)
