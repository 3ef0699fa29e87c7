"""Constraints and the parasitic motions that follow from them, against geometry that knows no closed form."""

from __future__ import annotations

import numpy as np
import pytest
from geometry import Description
from independent import orientation
from shipped import load_shipped

import parakin as pk
from parakin.performance.certified.proofs import make_pose_box, prove_no_singularity
from parakin.performance.singularities import compute_singularity_margins, list_margin_names

PRS = """\
name: prs
source: Sizes were drawn.
{mounting}motion: {motion}
parasitic: tx ty rz
constraints:
{constraints}legs:
  kind: slider
  joints: [q1, q2, q3]
  foot: {feet}
  platform: {corners}
  rail: [0, 0, 1]
  rod: 600 mm
  branch: "+"
  range: [-5 m, 5 m]
{rest}"""
TABLE = """\
head: [tz: -150 mm]
table: [tz: -400 mm, rz: {turn} deg, {slides}]
home: {{{home}}}
"""


def list_planes(plane_of, points, feet, normals):
    rows = zip(np.asarray(points).tolist(), np.asarray(feet).tolist(), np.asarray(normals).tolist(), strict=True)
    return "".join(
        f"  - {{plane_of: {plane_of}, platform: {in_mm(p)}, foot: {in_mm(f)}, normal: {n}}}\n" for p, f, n in rows
    )


def in_mm(point):
    return "[" + ", ".join(f"{x!r} mm" for x in point) + "]"


def draw_prs(rng, rest, motion="tx ty tz ry rx rz", mounting="", skew=0.05):
    """A 3-PRS whose planes and joints are all a little off: no symmetry is left."""
    angles = np.radians([90.0, 210.0, 330.0]) + rng.uniform(-skew, skew, 3)
    radial = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], 1)
    normals = np.stack([-np.sin(angles), np.cos(angles), rng.uniform(-skew, skew, 3)], 1)
    corners = 250.0 * radial + rng.uniform(-200.0, 200.0, (3, 3)) * skew
    return PRS.format(
        mounting=mounting,
        motion=motion,
        constraints=list_planes("base", corners, rng.uniform(-200.0, 200.0, (3, 3)) * skew, normals),
        feet="[" + ", ".join(in_mm(foot) for foot in (400.0 * radial).tolist()) + "]",
        corners="[" + ", ".join(in_mm(corner) for corner in corners.tolist()) + "]",
        rest=rest,
    )


def load_text(tmp_path, text):
    (tmp_path / "m.yaml").write_text(text, encoding="utf-8")
    return pk.load(tmp_path / "m.yaml")


def check_both_ways(machine, poses):
    """Planes and rods close, the direct problem leads back, and rates are those of the inverse."""
    joints = machine.inverse(poses)
    assert np.isfinite(joints).all()
    miss, tilt = Description.of(machine.spec).misses(poses, joints)
    assert miss.max() < 1e-8
    assert tilt.max() < 1e-11
    found = machine.forward(joints, near=poses)
    assert found.converged.all()
    assert np.abs(found.poses - poses).max() < 1e-7
    a, b = machine.jacobians(poses)
    rates = np.linalg.solve(b, a)
    for axis, step in enumerate(1e-4 * np.where(np.array(machine.axis_units) == "mm", 100.0, 1.0)):
        way = np.eye(len(machine.axes))[axis] * step
        slope = (machine.inverse(poses + way) - machine.inverse(poses - way)) / (2.0 * step)
        assert np.abs(rates[:, :, axis] - slope).max() < 1e-4 * np.abs(rates).max()


@pytest.mark.parametrize("seed", range(6))
def test_a_crooked_3_prs_over_a_crooked_table(seed, tmp_path):
    rng = np.random.default_rng(seed)
    slides = [f"{axis}: {{joint: s{axis}, range: [-2 m, 2 m]}}" for axis in rng.permutation(["tx", "ty"])]
    home = "X: 0, Y: 0, Z: 250 mm, B: 0, C: 0"
    table = TABLE.format(turn=rng.uniform(-90.0, 90.0), slides=", ".join(slides), home=home)
    machine = load_text(tmp_path, draw_prs(rng, table, rng.choice(["tx ty tz ry rx rz", "tz tx ty rx ry rz"])))
    assert machine.axes == tuple("XYZBC")
    poses = machine.home + rng.uniform(-1.0, 1.0, (200, 5)) * [200.0, 200.0, 100.0, 0.3, 3.0]
    poses[:, 3] = np.abs(poses[:, 3]) + 0.05
    check_both_ways(machine, poses)


@pytest.mark.parametrize("seed", range(6))
def test_a_crooked_exechon(seed, tmp_path):
    rng = np.random.default_rng(seed)
    normal = np.array([0.0, 1.0, 0.0]) + rng.uniform(-0.1, 0.1, 3)
    normals = [normal, normal, np.array([1.0, 0.0, 0.0]) + rng.uniform(-0.1, 0.1, 3)]
    feet = np.array([[-500.0, 0.0, 0.0], [500.0, 0.0, 0.0], [0.0, 550.0, 0.0]]) + rng.uniform(-30.0, 30.0, (3, 3))
    corners = np.array([[-160.0, 0.0, 130.0], [160.0, 0.0, 130.0], [0.0, 170.0, 130.0]])
    order = rng.permutation(3)
    planes = list_planes("platform", corners[order], feet[order], np.array(normals)[order])
    text = f"""\
name: exe
source: Sizes were drawn.
mounting: [ry: {rng.uniform(-40.0, 40.0)} deg, tx: 100 mm]
motion: tx ty tz rz ry rx
parasitic: rx ry rz
constraints:
{planes}legs:
  kind: length
  joints: [d1, d2, d3]
  foot: [{", ".join(in_mm(foot) for foot in feet.tolist())}]
  platform: [{", ".join(in_mm(corner) for corner in corners.tolist())}]
  range: [100 mm, 3 m]
head: [rz: {{joint: c, range: [-400 deg, 400 deg]}}, rx: {{joint: a, range: [-170 deg, 170 deg]}}, tz: -200 mm]
home: {{HOME}}
"""
    lean = np.radians(float(text.split("ry: ")[1].split(" deg")[0]))
    tip = np.array([100.0 * np.cos(lean) - 1200.0 * np.sin(lean), 0.0, -1200.0 * np.cos(lean) - 100.0 * np.sin(lean)])
    home = f"X: {tip[0]} mm, Y: 0, Z: {tip[2] - 200.0} mm, B: 0, C: 0"
    machine = load_text(tmp_path, text.replace("HOME", home))
    poses = machine.home + rng.uniform(-1.0, 1.0, (200, 5)) * [150.0, 150.0, 100.0, 0.3, 3.0]
    poses[:, 3] = np.abs(poses[:, 3]) + 0.05
    lead = machine.inverse(poses)[:, 4]
    check_both_ways(machine, poses[np.abs(lead) > 0.05])


def check_frames(machine, poses, turn_columns):
    """Planes hold, and the pose's own coordinates are those of the platform's frame."""
    d = Description.of(machine.spec)
    for pose in poses:
        placed = machine.place_platform(pose, machine.mode)
        rotation, origin = np.array(placed.rotation, float), np.array(placed.origin, float)
        assert np.abs(d.open_constraints(rotation[None], origin[None], np.zeros((1, 0)))).max() < 1e-10
        assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-13)
        c = np.arctan2(rotation[1, 0], rotation[0, 0])
        turns = {"C": c, **{axis: pose[machine.axes.index(axis)] for axis in turn_columns}}
        assert np.allclose(rotation, orientation(*(turns[axis] for axis in "ABC"))[0] if turn_columns else rotation)


@pytest.mark.parametrize("seed", range(3))
def test_a_crooked_3_prs_alone_has_the_axes_that_are_independent(seed, tmp_path):
    rng = np.random.default_rng(seed)
    rest = "head: [tx: 10 mm, tz: -150 mm]\nhome: {Z: -150 mm, A: 0, B: 0}\n"
    machine = load_text(tmp_path, draw_prs(rng, rest, "tx ty tz rz ry rx"))
    assert machine.axes == ("Z", "A", "B")
    poses = machine.home + rng.uniform(-1.0, 1.0, (50, 3)) * [100.0, 0.4, 0.4]
    check_frames(machine, poses, "AB")
    joints = machine.inverse(poses)
    found = machine.forward(joints, near=machine.home)
    assert found.converged.all()
    assert np.abs(found.poses - poses).max() < 1e-9
    a, b = machine.jacobians(poses)
    for axis, step in enumerate([1e-2, 1e-4, 1e-4]):
        way = np.eye(3)[axis] * step
        slope = (machine.inverse(poses + way) - machine.inverse(poses - way)) / (2.0 * step)
        assert np.abs(np.linalg.solve(b, a)[:, :, axis] - slope).max() < 1e-4
    assert all(len(each) for each in machine.list_assemblies(joints[:3]))


def test_the_exechon_without_its_wrist_moves_in_place(tmp_path):
    text = load_shipped("exechon").format_yaml()
    head, limits = text.index("head:"), text.index("limits:")
    text = text[:head] + "home: {X: 0, Y: 0, Z: -1200 mm}\n"
    assert limits > head
    machine = load_text(tmp_path, text)
    assert machine.axes == ("X", "Y", "Z")
    poses = machine.home + np.random.default_rng(1).uniform(-1.0, 1.0, (50, 3)) * 200.0
    check_frames(machine, poses, "")
    found = machine.forward(machine.inverse(poses))
    assert found.converged.all()
    assert np.abs(found.poses - poses).max() < 1e-9


def find_last(machine, way, margin):
    """Along a way from home, where a limit's margin falls to zero: the last pose at which it holds."""
    low, high = 0.0, 1.0
    column = machine.limits.index(margin)
    for _ in range(60):
        middle = 0.5 * (low + high)
        holds = machine.margins(machine.home + middle * np.array(way))[column] >= 0.0
        low, high = (middle, high) if holds else (low, middle)
    assert 0.0 < low < 1.0
    return machine.home + low * np.array(way)


def test_where_the_constraints_fail_their_margin_is_zero(tmp_path):
    """Planes that all pass the middle on one side: the platform has to turn, and tilted it can't turn far enough."""
    angles = np.radians([90.0, 210.0, 330.0])
    radial = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], 1)
    normals = np.stack([-np.sin(angles), np.cos(angles), 0.0 * angles], 1)
    text = PRS.format(
        mounting="",
        motion="tx ty tz rx ry rz",
        constraints=list_planes("base", 250.0 * radial, 200.0 * normals, normals),
        feet="[" + ", ".join(in_mm(foot) for foot in (400.0 * radial).tolist()) + "]",
        corners="[" + ", ".join(in_mm(corner) for corner in (250.0 * radial).tolist()) + "]",
        rest="table: [tx: {joint: x, range: [-2 m, 2 m]}, ty: {joint: y, range: [-2 m, 2 m]}]\n"
        "home: {X: 0, Y: 0, Z: 0, B: 0, C: 0}\n",
    )
    machine = load_text(tmp_path, text)
    names = list_margin_names(machine)
    assert names[-1] == "constraint"
    end = find_last(machine, [0.0, 0.0, 0.0, 1.4, 0.0], "constraints.reach")
    poses = machine.home + np.linspace(0.0, 1.0, 9)[:, None] * (end - machine.home)
    margins = compute_singularity_margins(machine, poses)[:, -1]
    assert margins[0] > 0.1
    assert (np.diff(margins) < 0.0).all()
    assert abs(margins[-1]) < 1e-5
    assert np.isnan(machine.inverse(end + [0.0, 0.0, 0.0, 1e-6, 0.0])).all()
    ahead = prove_no_singularity(make_pose_box(pk.region(machine), {"B": (0.0, 0.9 * end[3])}), "constraint")
    assert ahead.verdict == "proved"
    over = prove_no_singularity(make_pose_box(pk.region(machine), {"B": (0.0, end[3] + 0.01)}), "constraint")
    assert over.verdict == "refuted"


def test_the_exechon_reaches_its_constraint_singularity():
    """Where the centre sees the third foot at right angles to the others' line, one turn is free (Thales)."""
    machine = load_shipped("exechon")
    half = 0.5 * machine.spec.sizes["c"]
    way = np.append(np.linspace(-1200.0, -half - 1e-3, 9), -half)
    poses = np.array([[0.0, half, z - machine.spec.sizes["tool"], 0.0, 0.0] for z in way])
    margins = compute_singularity_margins(machine, poses)[:, -1]
    assert (margins[:-2] > 0.3).all()
    assert margins[-2] < 1e-4
    assert not margins[-1] > 1e-9


LIES = [
    ("parasitic: tx ty rz", "parasitic: tx ty", "for 4 independent words of motion"),
    ("parasitic: tx ty rz", "parasitic: tx ty tx", "for 4 independent words of motion"),
    ("parasitic: tx ty rz", "parasitic: tx rz ty rw", "unknown word"),
    (
        "  - {plane_of: base, platform: [0, r, 0], foot: [0, 0, 0], normal: [1, 0, 0]}\n",
        "",
        "2 of them, and 3 parasitic",
    ),
    ("parasitic: tx ty rz", "parasitic: tz ry rz", "two translations and rz"),
    ("motion: tx ty tz rx ry rz", "motion: tx ty tz rz ry", "is not in the motion|all six words|rings about the tool"),
    ("motion: tx ty tz rx ry rz", "motion: tx ty tz rz rx ry", "the last turn of the motion"),
    ("plane_of: base", "plane_of: table", "unknown body that carries the plane"),
    ("normal: [1, 0, 0]", "normal: [0, 0, 0]", "the zero vector"),
    ("normal: [1, 0, 0]", "norm: [1, 0, 0]", "unknown key"),
    ("  - tx: {joint: table_x", "  - tz: {joint: table_x", "slides move along the parasitic translations"),
    ("  - tz: -tool\n", "  - ty: -tool\n", "the tool stands on the platform's z"),
    ("  - tz: -tool\n", "  - rz: {joint: c, range: [-1 rad, 1 rad]}\n", "rz ry rx are parasitic"),
    ("  cones:", "  passive: {rz: [-1 rad, 1 rad]}\n  cones:", "passive rz is parasitic"),
]


@pytest.mark.parametrize(("old", "new", "message"), LIES)
def test_what_has_no_closed_form_is_refused_in_a_line(old, new, message, tmp_path):
    from parakin.description import list_shipped_machines

    text = list_shipped_machines()["sprint_z3"].read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(pk.ParakinError, match=message) as caught:
        load_text(tmp_path, text.replace(old, new, 1))
    assert all(len(line) < 300 for line in str(caught.value).splitlines())


def test_planes_of_the_platform_without_a_common_normal_are_refused(tmp_path):
    text = load_shipped("exechon").format_yaml().replace("normal: [0.0, 1.0, 0.0]", "normal: [0.1, 1.0, 0.0]", 1)
    with pytest.raises(pk.ParakinError, match="two must have one normal"):
        load_text(tmp_path, text)
