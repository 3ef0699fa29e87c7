"""All assemblies by homotopy: against closed forms, published counts, other programs, and roots in longer numbers."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from independent import orientation
from phcpack import PHC, describe_closures, match_points, measure_angles, track_by_phcpack
from shipped import NAMES, REPRESENTATIVES, load_shipped

import parakin as pk
from parakin.kinematics.assemblies import generic_member, homotopy_roots, path_tracking
from parakin.kinematics.assemblies.generic_member import (
    find_generic_member,
    measure_trace,
    read_stored_member,
    search_generic_member,
)
from parakin.kinematics.assemblies.homotopy_roots import find_coordinates, find_real_roots
from parakin.kinematics.assemblies.machine_quadrics import make_machine_quadrics
from parakin.kinematics.assemblies.path_tracking import PathEnds, find_meetings
from parakin.kinematics.assemblies.quadric_family import make_family
from parakin.kinematics.assemblies.root_boxes import prove_roots
from parakin.kinematics.assemblies.study import compute_study_points
from parakin.model.legs.column import Column

# P. Dietmaier, The Stewart-Gough platform of general geometry can have 40 real postures (1998): feet, platform, lengths
# in m, and all forty solutions are real.
FEET = [
    [0.0, 0.0, 0.0],
    [1.107915, 0.0, 0.0],
    [0.549094, 0.756063, 0.0],
    [0.735077, -0.223935, 0.525991],
    [0.514188, -0.526063, -0.368418],
    [0.590473, 0.094733, -0.205018],
]
CORNERS = [
    [0.0, 0.0, 0.0],
    [0.542805, 0.0, 0.0],
    [0.956919, -0.528915, 0.0],
    [0.665885, -0.353482, 1.402538],
    [0.478359, 1.158742, 0.107672],
    [-0.137087, -0.235121, 0.353913],
]
LENGTHS = [1000.0, 645.275, 1086.284, 1503.439, 1281.933, 771.071]


def platform(folder, feet, corners, home=(0.0, 0.0, 0.9, 0.3, 0.2, 0.1)):
    """Write a general six-strut platform, sizes in m, and load it."""
    lists = ["[" + ", ".join("[" + ", ".join(f"{v!r} m" for v in p) + "]" for p in points) + "]" for points in
             (np.asarray(feet).tolist(), np.asarray(corners).tolist())]  # fmt: skip
    values = ", ".join(f"{a}: {v} {'m' if a in 'XYZ' else 'rad'}" for a, v in zip("XYZABC", home, strict=True))
    path = folder / "platform.yaml"
    path.write_text(
        "name: platform\nsource: drawn\nmotion: tx ty tz rz ry rx\nlegs:\n  kind: length\n"
        f"  joints: [a, b, c, d, e, f]\n  foot: {lists[0]}\n  platform: {lists[1]}\n  range: [1 mm, 9 m]\n"
        f"home: {{{values}}}\n"
    )
    return pk.load(path)


def draw_platform(rng):
    return rng.uniform(-1.0, 1.0, (6, 3)), rng.uniform(-1.0, 1.0, (6, 3))


def test_the_published_platform_has_forty_real_poses(tmp_path):
    found = platform(tmp_path, FEET, CORNERS).assemblies(LENGTHS)
    assert (len(found), found.complex_count, found.infinite_count, found.lost_count) == (40, 0, 0, 0)
    assert found.complete == "all paths accounted for"
    assert np.isfinite(found.radii).all()
    assert found.radii[:, 0].max() < 1e-4


@pytest.mark.parametrize(
    ("motion", "count"),
    [
        ("tx ty rz", 6),  # Gosselin, Sefrioui and Richard, 1992
        ("tx ty tz", 2),  # three spheres
        ("rz ry rx", 8),  # Innocenti and Parenti-Castelli, 1993
        ("tx ty tz rz ry rx", 40),  # Ronga and Vust, 1992
    ],
)
@pytest.mark.parametrize("find", [find_generic_member, search_generic_member])
def test_families_have_as_many_solutions_as_is_published(motion, count, find):
    family, member = make_family(tuple(motion.split())), find(tuple(motion.split()))
    assert len(member.roots) == count
    rng = np.random.default_rng(5)
    assert measure_trace(family, member, rng) < 1e-9
    assert measure_trace(family, member._replace(roots=member.roots[1:]), rng) > 1e-4


def test_a_stored_member_is_taken_only_for_its_own_family(monkeypatch):
    free = ("tx", "ty", "tz", "rz", "ry", "rx")
    family, member = make_family(free), read_stored_member(free)
    values = np.einsum("ki,rij,kj->kr", member.roots, member.system, member.roots)
    assert np.abs(values).max() < 1e-12
    turned = family._replace(fixed=np.roll(family.fixed, 1, axis=2))
    monkeypatch.setattr(generic_member, "make_family", lambda motion: turned)
    assert read_stored_member(free) is None
    assert read_stored_member(("tx", "tz", "rx")) is None


@pytest.mark.parametrize("name", NAMES)
def test_every_shipped_machine_finds_the_pose_that_it_stands_in(name):
    """No root of a machine's own generic member may be missing, nor lie on paths through more general systems."""
    machine = load_shipped(name)
    poses = machine.home + np.random.default_rng(2).uniform(-1.0, 1.0, (60, len(machine.axes))) * np.where(
        np.array(machine.axis_units) == "mm", 60.0, 0.15
    )
    poses = poses[(machine.check(poses) == 0) & (machine.sides(poses) * machine.sides(machine.home[None]) > 0.0)][:6]
    assert len(poses) > 2
    joints = machine.inverse(poses)
    for pose, row, answer in zip(poses, joints, machine.list_assemblies(joints), strict=True):
        assert answer.complete != "not complete"
        back = machine.forward(row, near=pose)
        assert back.converged
        nearest = np.abs(answer.poses - back.poses).max(1).min()
        assert nearest < 1e-6


def test_a_lost_path_is_tracked_once_more_another_way(tmp_path, monkeypatch):
    machine = platform(tmp_path, *draw_platform(np.random.default_rng(9)))
    joints = machine.inverse(machine.home)
    expected = machine.assemblies(joints)
    starts = []

    def lose_one(first, last, points, tolerance=path_tracking.LENIENT):
        ends = path_tracking.track_members(first, last, points, tolerance)
        if not starts:
            ends.reached[0, 7] = 0.9
            ends.points[0, 7] = points[7]
        starts.append(first)
        return ends

    monkeypatch.setattr(homotopy_roots, "track_members", lose_one)
    found = machine.assemblies(joints)
    assert found.lost_count == 0 and found.complete == "all paths accounted for"
    np.testing.assert_allclose(found.poses, expected.poses, atol=1e-9)
    assert len(starts) == 2 and np.abs(starts[0] - starts[1]).max() > 0.1


def test_paths_side_by_side_end_in_known_roots():
    """xᵢ² = bᵢ: the eight paths of a system are as many as the lanes, and those of the next one take these up."""
    rng = np.random.default_rng(6)
    values = np.exp(2j * np.pi * rng.uniform(size=(2, 5, 3))) * rng.uniform(0.5, 2.0, (2, 5, 3))
    values[0] = values[0, 0]
    first, last = np.zeros((2, 5, 3, 4, 4), complex)
    for systems, own in zip((first, last), values, strict=True):
        for i in range(3):
            systems[:, i, i + 1, i + 1], systems[:, i, 0, 0] = 1.0, -own[:, i]
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    ends = path_tracking.track_members(first, last, np.column_stack([np.ones(8), signs * np.sqrt(values[0, 0])]))
    assert (ends.reached == 1.0).all() and not find_meetings(ends).any()
    places = ends.points[:, :, 1:] / ends.points[:, :, :1]
    np.testing.assert_allclose(places**2, np.broadcast_to(values[1][:, None], places.shape), atol=1e-9)
    assert np.abs(np.linalg.norm(ends.points, axis=2) - 1.0).max() < 1e-12


def test_struts_lengths_alone_change_along_paths(tmp_path):
    """Of each strut's quadric that is |e|², and the first system still has all roots of the machine's own member."""
    machine = platform(tmp_path, *draw_platform(np.random.default_rng(9)))
    closures = make_machine_quadrics(machine.model)
    own = closures.own_member
    systems = closures.make_systems(machine.inverse(machine.home)[None])
    first, last = path_tracking.align_closures(own.system, systems, closures.fixed_count, closures.steady)
    np.testing.assert_array_equal(last, systems)
    changes = np.abs(last - first)[0]
    assert (changes[1:, range(4), range(4)] > 0.0).all() and (changes > 0.0).sum() == 24
    assert np.abs(np.einsum("ki,rij,kj->kr", own.roots, first[0], own.roots)).max() < 1e-11


def test_paths_that_crowd_at_infinity_are_not_lost():
    """Of RUS legs' forty twelve end there, several in one place: some arrive, some stop at t = 0.98."""
    machine = load_shipped("rus6")
    joints = machine.inverse(machine.home) * (1.0 + 0.002 * np.random.default_rng(1).normal(size=(20, 6)))
    for found in machine.list_assemblies(joints):
        assert (len(found) + found.complex_count, found.infinite_count, found.lost_count) == (28, 12, 0)
        assert found.complete == "all paths accounted for"


def test_roots_close_to_a_singularity_are_told_apart():
    """Two points a ten thousandth of a radian apart are two roots; to the eleventh figure the same they are one."""
    rng = np.random.default_rng(3)
    point, aside = np.linalg.qr(rng.normal(size=(8, 2)))[0].T.astype(complex)
    for angle, meet in ((1e-4, False), (1e-11, True)):
        other = 1j * (np.cos(angle) * point + np.sin(angle) * aside)
        ends = PathEnds(np.stack([point, other])[None], np.ones((1, 2)))
        assert find_meetings(ends).tolist() == [[meet, meet]]


def test_a_batch_has_the_answers_of_its_rows():
    machine = load_shipped("hexapod")
    joints = machine.inverse(machine.home) + np.random.default_rng(4).uniform(-20.0, 20.0, (5, 6))
    joints[3] = np.nan
    answers = machine.list_assemblies(joints)
    assert [len(answer) for answer in answers] == [len(machine.assemblies(row)) for row in joints]
    for row, answer in zip(joints, answers, strict=True):
        np.testing.assert_array_equal(answer.poses, machine.assemblies(row).poses)
        if len(answer):
            np.testing.assert_allclose(machine.inverse(answer.poses), np.tile(row, (len(answer), 1)), atol=1e-6)
    assert machine.list_assemblies(np.empty((0, 6))) == []
    with pytest.raises(pk.PoseError, match="rows of shape"):
        machine.list_assemblies(joints[0])


def test_general_platforms_have_forty_and_the_true_pose_is_among_them(tmp_path):
    rng = np.random.default_rng(6)
    for _ in range(12):
        pose = np.append(rng.uniform(-0.5, 0.5, 2), [rng.uniform(0.8, 2.0), *rng.uniform(-0.6, 0.6, 3)])
        machine = platform(tmp_path, *draw_platform(rng), home=pose)
        found = machine.assemblies(machine.inverse(machine.home))
        assert len(found) + found.complex_count == 40
        assert (found.infinite_count, found.lost_count, len(found) % 2) == (0, 0, 0)
        assert np.abs(found.poses - machine.home).max(1).min() < 1e-6
        assert np.isfinite(found.radii).all()


@pytest.mark.parametrize("name", [name for name in REPRESENTATIVES if name not in ("hexapod", "tricept", "pentapod")])
def test_closed_forms_find_the_same(name):
    machine = load_shipped(name)
    rng = np.random.default_rng(7)
    spread = np.where(np.array(machine.axis_units) == "mm", 60.0, 0.15)
    for pose in machine.home + rng.uniform(-1.0, 1.0, (8, len(machine.axes))) * spread:
        joints = machine.inverse(pose)
        if not np.isfinite(joints).all():
            continue
        roots = find_real_roots(machine.model, joints[None])[0]
        assert roots.lost_count == 0
        frames = [
            machine.model.structure.frame(c) for c in find_coordinates(machine.model, roots.points, joints).tolist()
        ]
        origins = np.array([np.asarray(origin, float) for _, origin in frames])
        closed = machine.assemblies(joints)
        assert len(closed) + closed.untold_count == len(origins)
        own = [machine.model.structure.place_with_joints(list(p), joints[machine.model.leg_count :]).origin
               for p in closed.poses.tolist()]  # fmt: skip
        for origin in np.array(own, float):
            assert np.nanmin(np.linalg.norm(origins - origin, axis=1)) < 1e-6


def test_no_root_is_lost_on_the_way_to_a_machines_own_member(tmp_path):
    """A platform on whose way from the family's member one of forty paths is lost; PHCpack finds all of them."""
    rng = np.random.default_rng(1008)
    for _ in range(64):
        pose = np.append(rng.uniform(-0.5, 0.5, 2), [rng.uniform(0.8, 2.0), *rng.uniform(-0.6, 0.6, 3)])
        feet, corners = draw_platform(rng)
    machine = platform(tmp_path, feet, corners, home=pose)
    found = machine.assemblies(machine.inverse(machine.home))
    assert len(found) + found.complex_count == 40


COLUMNS = """\
name: columns
source: drawn
motion: tx ty tz rz ry rx
legs:
  kind: column
  joints: [[a, h], [b, i], [c, j]]
  radius: 500 mm
  rod: 450 mm
  branch: "-"
  platform: {circle: 150 mm, at: [90 deg, 210 deg, 330 deg]}
  range: [[-720 deg, 720 deg], [-1 m, 2 m]]
home: {X: 10 mm, Y: 20 mm, Z: 600 mm, A: 5 deg, B: 4 deg, C: 10 deg}
"""


def test_columns_on_a_ring_close_there(tmp_path):
    """Every pose's joints lie in the columns' radial planes, a rod's length from the slides; home is one of them."""
    (tmp_path / "columns.yaml").write_text(COLUMNS)
    machine = pk.load(tmp_path / "columns.yaml")
    joints = machine.inverse(machine.home)
    found = machine.assemblies(joints)
    assert found.complete == "all paths accounted for"
    assert np.isfinite(found.radii).all()
    assert np.abs(found.poses - machine.home).max(1).min() < 1e-8
    at = np.radians([90.0, 210.0, 330.0])
    corners = 150.0 * np.column_stack([np.cos(at), np.sin(at), np.zeros(3)])
    points = found.poses[:, None, :3] + np.einsum("nij,kj->nki", orientation(*found.poses[:, 3:].T), corners)
    radial = points[..., 0] * np.cos(joints[:3]) + points[..., 1] * np.sin(joints[:3])
    across = points[..., 1] * np.cos(joints[:3]) - points[..., 0] * np.sin(joints[:3])
    assert np.abs(across).max() < 1e-8
    assert np.abs(np.hypot(500.0 - radial, points[..., 2] - joints[3:]) - 450.0).max() < 1e-8


def test_a_leg_that_closes_on_another_surface_has_no_method(tmp_path, monkeypatch):
    (tmp_path / "columns.yaml").write_text(COLUMNS)
    machine = pk.load(tmp_path / "columns.yaml")
    monkeypatch.setattr(Column, "closures", lambda leg, p, q: [p[0] * p[1] - q[0], p[0] * p[0] - q[1]])
    with pytest.raises(pk.NoMethodError, match="no sphere and no plane"):
        machine.assemblies(machine.inverse(machine.home))


def test_boxes_hold_the_root_in_longer_numbers(tmp_path):
    machine = platform(tmp_path, FEET, CORNERS)
    quadrics = make_machine_quadrics(machine.model)
    roots = find_real_roots(machine.model, np.array([LENGTHS]))[0].points
    system = quadrics.make_systems(np.array([LENGTHS]))[0].real
    widths = prove_roots(np.broadcast_to(system, (len(roots), *system.shape)), roots)
    assert np.isfinite(widths).all()
    long = system.astype(np.longdouble)
    for root, width in zip(roots, widths, strict=True):
        x, inverse = root.astype(np.longdouble), np.linalg.inv(np.vstack([2.0 * system @ root, root]))
        for _ in range(30):  # Newton's method with a kept matrix: the residual alone has to be exact
            value = np.append((long @ x) @ x, np.longdouble(root @ root) - np.longdouble(1.0) + 0.0)
            value[-1] = (x - root.astype(np.longdouble)) @ root
            x = x - inverse.astype(np.longdouble) @ value
        assert np.abs(x - root).max() <= width
        moved = root + 20.0 * width * np.linalg.svd(np.vstack([2.0 * system @ root, root]))[2][-1]
        assert not prove_roots(system[None], moved[None])[0] <= 5.0 * width  # a point beside it is no root to rounding


def test_joints_at_a_singularity_have_a_double_root(tmp_path):
    """Two rods and a strut in a plane, and a pose on the curve det A = 0, found by bisection."""
    machine = platform(tmp_path, FEET, CORNERS)
    poses = machine.assemblies(LENGTHS).poses
    sides = machine.sides(poses)
    low, high = poses[np.argmax(sides > 0.0)], poses[np.argmax(sides < 0.0)]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if machine.sides(middle[None])[0] > 0.0 else (low, middle)
    found = machine.assemblies(machine.inverse(low))
    near = np.abs(found.poses - low).max(1) < 1.0
    assert near.any()
    assert len(found) + found.complex_count + found.lost_count + found.infinite_count >= 38


@pytest.mark.parametrize(("name", "off"), [("hexapod", 1e-4), ("hexapod", 2e-6), ("rpr3", 1e-4)])
def test_two_poses_beside_a_singularity_are_two_and_no_continuum(name, off):
    """Poses a fraction of the way off a change of det A's sign, and their counterparts beyond, twice as far away."""
    machine = load_shipped(name)
    rng = np.random.default_rng(3)
    mm = np.array(machine.axis_units) == "mm"
    told = 0
    for _ in range(12):
        way = rng.normal(size=len(mm)) * np.where(mm, 1000.0, 1.0)
        poses = machine.home + np.linspace(0.0, 1.0, 60)[:, None] * way
        same = machine.sides(poses) * machine.sides(machine.home[None]) > 0.0
        count = int(np.argmin(same))
        if same.all() or not np.isfinite(machine.inverse(poses[: count + 1])).all():
            continue
        low, high = (count - 1) / 59.0, count / 59.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            side = machine.sides((machine.home + middle * way)[None]) * machine.sides(machine.home[None])
            low, high = (middle, high) if side[0] > 0.0 else (low, middle)
        pose = machine.home + (low - off) * way
        found = machine.assemblies(machine.inverse(pose))
        apart = np.abs(found.poses - pose).max(1)
        told += apart.min() < 1e-6
        assert (apart < 1.0).sum() in (0, 2)  # none where angles beyond 90° are written otherwise
    assert told >= 6


def make_hexagon(angles):
    return np.column_stack([np.cos(np.radians(angles)), np.sin(np.radians(angles)), np.zeros(6)])


REGULAR, SEMI_REGULAR = make_hexagon([0, 60, 120, 180, 240, 300]), make_hexagon([-10, 10, 110, 130, 230, 250])
UNEVEN = np.column_stack([np.random.default_rng(1).uniform(-1.0, 1.0, (6, 2)), np.zeros(6)])  # on no conic


@pytest.mark.parametrize("turn", [0.0, 0.6])
@pytest.mark.parametrize("feet", [REGULAR, SEMI_REGULAR], ids=["regular", "semi-regular"])
def test_similar_hexagons_on_a_conic_are_singular_everywhere(feet, turn, tmp_path):
    """O. Ma and J. Angeles, Architecture singularities of platform manipulators, 1991."""
    with pytest.warns(pk.errors.SingularHomeWarning, match="architecturally singular"):
        machine = platform(tmp_path, feet, 0.6 * feet @ orientation(*np.array([[0.0], [0.0], [turn]]))[0].T)
    with pytest.raises(pk.NoMethodError, match="continuum"):
        machine.assemblies(machine.inverse(machine.home))


def test_similar_hexagons_on_no_conic_are_not(tmp_path):
    machine = platform(tmp_path, UNEVEN, 0.6 * UNEVEN + [0.1, 0.2, 0.0])
    found = machine.assemblies(machine.inverse(machine.home))
    assert found.complete == "all paths accounted for" and np.abs(found.poses - machine.home).max(1).min() < 1e-6


@pytest.mark.parametrize("off", [1e-2, 1e-3, 1e-4, 1e-5])
def test_a_platform_that_is_nearly_singular_everywhere_tells_no_count_that_it_has_not(off, tmp_path):
    """Similar hexagons with corners a little off, m: its own pose is among the answers, or these are not complete."""
    for seed in range(3):
        corners = 0.6 * SEMI_REGULAR + off * np.random.default_rng(seed).normal(size=(6, 3))
        machine = platform(tmp_path, SEMI_REGULAR, corners, home=(0.2, -0.1, 0.9, 0.2, -0.3, 0.1))
        try:
            found = machine.assemblies(machine.inverse(machine.home))
        except pk.NoMethodError as error:
            assert "nearly" in str(error) and off < 1e-3
            continue
        assert len(found) + found.complex_count + found.infinite_count + found.lost_count == 40
        if off > 1e-3 or found.complete != "not complete":
            assert found.lost_count == 0 and np.abs(found.poses - machine.home).max(1).min() < 1e-6


@pytest.mark.skipif(PHC is None, reason="PHCpack is not installed")
@pytest.mark.parametrize("seed", [None, 8], ids=["Dietmaier's", "drawn"])
def test_phcpack_finds_the_same_poses(seed, tmp_path):
    """``sweep_platforms.py`` asks PHCpack for platforms by the thousand, and for complex solutions too."""
    feet, corners, lengths = np.array(FEET), np.array(CORNERS), np.array(LENGTHS)
    if seed:
        feet, corners = draw_platform(np.random.default_rng(seed))
        turn, place = orientation(0.3, -0.2, 0.5).reshape(3, 3), [0.2, -0.1, 1.3]
        lengths = 1000.0 * np.linalg.norm(place + corners @ turn.T - feet, axis=1)
    points, _ = track_by_phcpack(tmp_path, describe_closures(feet, corners, lengths / 1000.0))
    assert len(points) == 40
    real = points[measure_angles(points, points.conj()).diagonal() < 1e-9]
    found = platform(tmp_path, feet, corners).assemblies(lengths)
    assert len(found) == len(real) >= (2 if seed else 40)
    turns = np.array([orientation(*pose[3:]).reshape(3, 3) for pose in found.poses])
    assert match_points(compute_study_points(turns, found.poses[:, :3] / 1000.0), real) < 1e-9
