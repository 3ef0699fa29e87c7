"""LinuxCNC's kinematics of every machine, against the library and the geometry; and the files around it."""

from __future__ import annotations

import ctypes
import json
import re
import shutil
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from drawn import FAMILIES, draw, machine_of
from geometry import Description
from shipped import CONFIGURED, REPRESENTATIVES, load_shipped
from test_conformance import SPREAD, everyone, poses_about, signed
from test_forward import CLOSE, allowed, garbage, legs_regularity, nudged

import parakin as pk
from parakin.cli import main
from parakin.controllers.linuxcnc.config import write_hal
from parakin.controllers.linuxcnc.hand_box import find_hand_box
from parakin.controllers.linuxcnc.home_pose import find_home_pose
from parakin.controllers.linuxcnc.kinematics_module import write_module
from parakin.kinematics.closure_roots import find_roots
from parakin.kinematics.wrist.pose_angles import find_nearest_direction
from parakin.performance.singularities import compute_singularity_margins, list_margin_names

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from ini_file import read_ini
from simulation import make_configuration
from stub import Stub, inward, outward, pose, world

COUNT = 100_000
representatives = pytest.mark.parametrize("m", [load_shipped(name) for name in REPRESENTATIVES], ids=REPRESENTATIVES)
configured = pytest.mark.parametrize("m", [load_shipped(name) for name in CONFIGURED], ids=CONFIGURED)
ENDS = (
    "_guard.c",
    "_tp.c",
    "_kins.c",
    "_model.h",
    "_rates.hal",
    "_screen.hal",
    "_screen.py",
    "_axis.py",
    ".ini",
    ".hal",
)
ENDS += (".tbl", ".ngc", ".md", "_m428.ngc", "_m429.ngc", "_m430.ngc")


@pytest.fixture(scope="module")
def modules(tmp_path_factory):
    """The kinematics module of every machine, built when asked for."""
    if not shutil.which("gcc"):
        pytest.skip("there is no gcc to build a kinematics module with")
    stub, known = Stub(tmp_path_factory.mktemp("kins")), {}

    def module_of(machine):
        if machine.name not in known:
            known[machine.name] = stub.built(machine)
        return known[machine.name]

    return module_of


def beyond_the_drives(m, poses, joints):
    """The least margin of all limits but the drives' own ranges, (n,); NaN where a leg can't close."""
    drives = {f"{name}.{side}" for name in m.joints for side in ("min", "max")}
    kept = [i for i, name in enumerate(m.limits) if name not in drives]
    return m.margins(poses, joints)[:, kept].min(1, initial=np.inf)


def same_pose(m, found, expected):
    """Greatest error of places, mm, and of directions, (n,) each, whatever way an orientation is written."""
    mm = np.array(m.axis_units) == "mm"
    one, two = (directions(m, rows) for rows in (found, expected))
    return np.abs(found - expected)[:, mm].max(1), np.abs(one - two).max((1, 2))


def directions(m, poses):
    """The tool's frame Rz(C)·Ry(B)·Rx(A), (n, 3, 3); of five axes only the tool's axis, (n, 3, 1)."""
    turned = np.broadcast_to(np.eye(3), (len(poses), 3, 3))
    for axis in "CBA":
        if axis in m.axes:
            turned = turned @ rotation(axis, poses[:, m.axes.index(axis)])
    return turned[..., 2:] if m.axes[3:] == ("B", "C") else turned


def rotation(axis, angle):
    """Rotation about an axis, (n, 3, 3)."""
    i, j = {"A": (1, 2), "B": (2, 0), "C": (0, 1)}[axis]
    result = np.zeros((len(angle), 3, 3))
    result[:, range(3), range(3)] = 1.0
    result[:, i, i] = result[:, j, j] = np.cos(angle)
    result[:, j, i], result[:, i, j] = np.sin(angle), -np.sin(angle)
    return result


# The inverse


def regular(m, poses, within=0.0):
    """Where poses keep the stated margin to singularities: +1 where they do, -1 where not, 0 within rounding of it."""
    margins, home = compute_singularity_margins(m, poses), compute_singularity_margins(m, m.home)
    off = np.column_stack([margins[:, 0] / home[0], margins[:, 1 : 1 + m.leg_count]]).min(1) - 0.02
    return np.where(off > within, 1, np.where(off < -within, -1, 0))


@everyone
def test_the_inverse_is_the_librarys(m, modules):
    poses = poses_about(m, COUNT)
    expected = m.inverse(poses)
    closing = np.isfinite(expected).all(1)
    least = beyond_the_drives(m, poses, expected)
    with np.errstate(invalid="ignore"):
        aside = regular(m, poses, 1e-9)
        good, sure = closing & (least >= 0.0) & (aside > 0), ~closing | ((np.abs(least) > 1e-9) & (aside != 0))
    last = np.where(closing[:, None], outward(m, expected), 0.0)
    found, codes = modules(m).inverse(world(m, poses), last)
    assert sure.mean() > 0.99
    assert np.array_equal((codes == 0)[sure], good[sure])
    assert (codes[~closing] == -1).all()
    assert good.sum() > 5000
    assert np.abs(found - outward(m, expected))[codes == 0].max() < 1e-9
    assert np.array_equal(found[codes != 0], last[codes != 0])  # refused, it leaves the joints as they were


@pytest.mark.parametrize("name", ["linear_delta", "tricept"])
def test_where_the_box_proves_a_pose_it_is_taken_as_if_measured(name, modules, tmp_path):
    """In the box, on its faces and beside them a module that measures nothing there answers as one that does."""
    m = load_shipped(name)
    box, rng = find_hand_box(m), np.random.default_rng(6)
    shares = rng.uniform(-0.05, 1.05, (COUNT // 5, len(m.axes)))
    shares[::2] = np.clip(np.round(shares[::2], 1), 0.0, 1.0)
    poses = np.vstack([box.low + shares * (box.high - box.low), poses_about(m, COUNT // 10)])
    last = np.nan_to_num(outward(m, m.inverse(poses)))
    found, codes = Stub(tmp_path).built(m, box=box).inverse(world(m, poses), last)
    joints, measured = modules(m).inverse(world(m, poses), last)
    assert np.array_equal(codes, measured)
    assert np.array_equal(found, joints)
    assert (codes == 0).mean() > 0.5


def winding_path(m, count=20_000):
    """Poses about home that turn on and on and swing through the pole of head and table."""
    t = np.linspace(0.0, 1.0, count)[:, None]
    some = np.array(SPREAD[m.name]) * 0.25
    poses = m.home + some * np.sin(2.0 * np.pi * t * np.arange(3, 3 + len(some)) + np.arange(len(some)))
    if m.axes[3:] == ("B", "C"):
        poses[:, 3] = 0.3 * min(1.0, SPREAD[m.name][3]) * np.sin(9.0 * t[:, 0] + 0.3)
        poses[:, 4] = 15.0 * t[:, 0]
    return poses


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head"])
def test_a_wrist_on_its_pole_goes_on_from_where_it_is_commanded_to_be(name, modules):
    """Where the machine was off, LinuxCNC's last joints are those of before, and drives have run on meanwhile."""
    m = load_shipped(name)
    pose = np.array(m.home)[None]
    joints, first = m.inverse(pose), m.wrist.first
    assert m.wrist.find_free(pose, 1e-6)[0]
    old, now = joints.copy(), joints.copy()
    old[0, first], now[0, first] = 0.3, 0.32
    kinematics = modules(m)
    kinematics.command(outward(m, now)[0])
    for near, expected in ((old, now), (now, now), (old, old)):  # a cycle each
        kinematics.watch_steps(True)
        found, codes = kinematics.inverse(world(m, pose), outward(m, near))
        kinematics.watch_steps(False)
        assert codes[0] == 0 and np.abs(found - outward(m, expected)).max() < 1e-9
        kinematics.command(outward(m, near)[0])
    kinematics.watch_steps(True)  # a cycle in which nothing is asked
    kinematics.watch_steps(False)
    kinematics.command(outward(m, now)[0])
    kinematics.watch_steps(True)
    found, codes = kinematics.inverse(world(m, pose), outward(m, old))
    kinematics.watch_steps(False)
    assert codes[0] == 0 and np.abs(found - outward(m, now)).max() < 1e-9


@pytest.mark.parametrize("name", ["george_v", "orthoglide5_head", "tricept"])
def test_upright_a_guess_may_have_any_c(name, modules):
    """A program turns C while the tool stands upright: what is shown follows, and does not stay behind for good."""
    m = load_shipped(name)
    pose = np.array(m.home)[None]
    pose[0, 3:] = 0.0
    turned = np.repeat(pose, 5, 0)
    turned[:, 4] = np.radians([0.0, 2.0, -30.0, 90.0, 179.0])
    kinematics = modules(m)
    kinematics.coordinate(True)
    found, codes = kinematics.forward(outward(m, np.repeat(m.inverse(pose), 5, 0)), world(m, turned))
    kinematics.coordinate(False)
    assert not codes.any()
    assert np.abs(found - world(m, turned))[:, :5].max() < 1e-6  # X Y Z A B; C is the commanded one


@representatives
def test_a_path_is_followed_cycle_by_cycle(m, modules):
    poses = winding_path(m)
    free = slice(4000, 4100)
    poses[free] = m.home  # where the first joint of a wrist is free
    expected = m.follow(poses)
    before = np.vstack([expected[:1], expected[:-1]])
    kinematics = modules(m)
    for _ in range(2):  # in the first cycle LinuxCNC's last joints may be old, and the commanded ones count
        kinematics.command(outward(m, before[:1])[0])
        kinematics.watch_steps(True)
        kinematics.inverse(world(m, poses[:1]), outward(m, before[:1]))
    found, codes = kinematics.inverse(world(m, poses), outward(m, before))
    kinematics.watch_steps(False)
    done = codes == 0
    assert np.abs(found - outward(m, expected))[done].max() < 1e-7
    step = np.abs(expected - before) / ([drive.speed for drive in m.drives] * np.array(1e-3))
    assert not done[(step > 2.001).any(1)].any()  # no drive can follow
    assert done[(step < 1.999).all(1)].mean() > 0.9
    if m.axes[3:] == ("B", "C") and len(m.joints) > m.leg_count:
        assert done[(step < 1.999).all(1)].all()
        assert (step > 2.0).any()
        assert np.abs(expected[:, -2:]).max() > np.pi  # it has counted turns
        assert (expected[:, -2:] > 0.05).any()
        assert (expected[:, -2:] < -0.05).any() or m.name == "exechon"  # whose wrist passes no pole here
    found, codes = kinematics.inverse_path(world(m, poses), outward(m, expected[0]))
    assert (codes == 0).mean() > 0.9
    if (codes == 0).all():
        assert np.abs(found - outward(m, expected)).max() < 1e-7


@representatives
def test_end_points_to_come_are_asked_with_joints_at_zero(m, modules):
    poses = poses_about(m, 20_000, seed=3)
    found, codes = modules(m).inverse(world(m, poses), np.zeros((len(poses), len(m.joints))))
    good = codes == 0
    assert good.mean() > 0.05
    miss, tilt = Description.of(m.spec).misses(poses[good], inward(m, found[good]))
    assert miss.max() < CLOSE
    assert tilt.max() < 1e-11


# The forward


def placed(m, rows):
    """Allowed poses in home's assembly mode, away from its singularities, with starts nearby that are in it too."""
    poses = np.tile(allowed(m.name), (rows // len(allowed(m.name)) + 1, 1))[:rows]
    starts = nudged(m, poses)
    det, least = legs_regularity(m, np.vstack([poses, m.home + 1e-3]))
    return poses, starts, (det[:-1] * det[-1] > 0.0) & (least[:-1] > 0.02)


@everyone
def test_the_forward_undoes_the_inverse_and_is_the_librarys(m, modules):
    poses, starts, regular = placed(m, COUNT)
    joints = m.inverse(poses)
    rows, codes = modules(m).forward(outward(m, joints), world(m, starts))
    found, done = pose(m, rows), codes == 0
    assert regular.mean() > 0.5
    assert done[regular].all()
    place, turned = same_pose(m, found[regular], poses[regular])
    assert place.max() < 1e-9
    closely = 3e-11 if m.name == "pentapod" else 1e-11  # its rings are near each other
    assert turned.max() < closely
    library = m.forward(joints, near=starts)
    both = done & library.converged & regular
    place, turned = same_pose(m, found[both], library.poses[both])
    assert place.max() < 1e-9
    assert turned.max() < closely
    assert (rows[~done] == world(m, starts)[~done]).all()  # refused, it leaves the pose as it was


@pytest.mark.parametrize("name", ["linear_delta", "quickstep"])
def test_a_forward_that_closes_by_its_form_does(name, modules):
    """Joints all over their ranges and somewhat beyond, guesses of all kinds: answers close by the tests' own model."""
    m = load_shipped(name)
    rng = np.random.default_rng(3)
    low, high = np.array([(drive.low, drive.high) for drive in m.drives]).T
    joints = low - 20.0 + (high - low + 40.0) * rng.uniform(size=(COUNT, 3))
    poses = m.common_points(joints, m.home_side)[0]
    joints, poses = joints[np.isfinite(poses).all(1)], poses[np.isfinite(poses).all(1)]
    starts = poses + rng.normal(size=poses.shape) * rng.choice([0.1, 10.0, 100.0], (len(poses), 1))
    rows, codes = modules(m).forward(outward(m, joints), world(m, starts))
    done = codes == 0
    assert done.mean() > 0.5
    assert Description.of(m.spec).misses(pose(m, rows)[done], joints[done])[0].max() < CLOSE


@pytest.mark.parametrize("name", ["linear_delta", "rotary_delta", "lambda6", "eclipse"])
def test_legs_in_another_mode_are_refused(name, modules):
    """Joints of the same pose in every other working mode, from that very pose: their slopes tell the mode."""
    m = load_shipped(name)
    poses = allowed(name)[:200]
    own = m.inverse(poses)
    for mode in m.modes[:: max(1, len(m.modes) // 8)]:
        joints = m.inverse(poses, mode=mode)
        apart = np.abs(signed(m, joints, own)).max(1) > 0.02
        codes = modules(m).forward(outward(m, joints[apart]), world(m, poses[apart]))[1]
        assert (codes != 0).all()
        assert apart.all() or mode == m.mode


def test_the_side_is_that_of_the_given_poses_own_joints(modules):
    """Next to singular lines: across one, these joints alone can turn the sign of the determinant."""
    m, rng = load_shipped("eclipse"), np.random.default_rng(1)
    spread = np.where(np.array(m.axis_units) == "mm", 1.0, 0.0025)
    poses = m.home + rng.uniform(-1.0, 1.0, (10_000, len(m.axes))) * 120.0 * spread
    near = poses + rng.uniform(-1.0, 1.0, poses.shape) * spread
    joints, sides, own = m.inverse(poses), m.sides(poses), m.sides(near)
    kept = np.isfinite(joints).all(1) & np.isfinite(own)
    rows, codes = modules(m).forward(outward(m, joints[kept]), world(m, near[kept]))
    done = codes == 0
    assert (m.sides(pose(m, rows[done])) * own[kept][done] > 0.0).all()
    assert (sides[kept] * own[kept] < 0.0).sum() > 10
    assert done.mean() > 0.99


@representatives
def test_a_forward_is_never_silently_wrong(m, modules):
    mad = 10_000
    joints = np.vstack([garbage(m, mad), m.inverse(allowed(m.name))])
    turning = np.array(m.joint_units) == "rad"
    joints[:, turning] = np.clip(joints[:, turning], -1e5, 1e5)  # beyond, angles have lost their digits
    home = np.tile(world(m, m.home[None]), (len(joints), 1))
    with np.errstate(all="ignore"):
        library = m.forward(joints, near=m.home)
    rows, codes = modules(m).forward(outward(m, joints), home)
    found, done = pose(m, rows), codes == 0
    assert set(codes.tolist()) <= {0, -1}
    assert not (done & ~library.converged)[mad:].any()
    with np.errstate(all="ignore"):  # joints of another working mode are refused
        legs = slice(m.leg_count)
        modes = m.head_modes(m.mode)
        off = np.fmin.reduce(
            [np.abs(signed(m, m.inverse(library.poses, mode), joints))[:, legs].max(1) for mode in modes]
        )
    same = done == (library.converged & (off <= 0.01))
    # Measured joints of more drives than freedoms disagree by their following errors, which the module allows for.
    vague = m.is_redundant & (library.residual > CLOSE) & (library.residual < 1.1)
    same, done = same | vague, done & ~vague
    # Where joints are none, and beside singularities, rounding decides. Far off, the library alone continues tilts.
    assert same.mean() > (0.75 if m.structure.has_slides else 0.998)
    # Of poses that are allowed it refuses some far from home, where the library alone goes on; it answers no other.
    assert not (done & ~same)[mad:].any()
    assert same[mad:].mean() > 0.99
    miss, tilt = Description.of(m.spec).misses(found[done], joints[done])
    size = 1.0 + np.abs(joints[done]).max(1) / 1e3
    assert (miss / size).max() < CLOSE
    assert tilt.max() < 1e-9
    if not m.model.by_spheres:
        sides = find_roots(m.model, found[done], joints[done], most=0, side=np.ones(1)).turned
        assert (sides * m.sides(m.home[None]) > 0.0).all()


@representatives
def test_joints_and_poses_of_nothing_do_no_harm(m, modules):
    kinematics = modules(m)
    place = find_home_pose(m)
    at_home, home = outward(m, m.inverse(place)), world(m, place[None])[0]
    nothing = [0.0, np.nan, np.inf, -np.inf, 1e300, -1e300, 5e-324]
    joints = np.vstack([np.full(len(at_home), value) for value in nothing])
    starts = np.vstack([np.full(9, value) for value in nothing])
    for given in (home[None], np.zeros((1, 9)), starts[1:2], starts[4:5]):
        rows, codes = kinematics.forward(joints, np.repeat(given, len(joints), 0))
        found = codes == 0
        assert not found[1:6].any()  # of zeros one or the other machine has a pose
        miss, _ = Description.of(m.spec).misses(pose(m, rows[found]), inward(m, joints[found]))
        assert miss.max(initial=0.0) < CLOSE
    rows, codes = kinematics.forward(np.repeat(at_home[None], len(starts), 0), starts)
    found = codes == 0
    assert found[[1, 2, 3]].all()  # a start that is none: home's
    assert np.abs(rows[1:4] - home).max() < 1e-7
    _, codes = kinematics.inverse(starts[1:6], np.repeat(at_home[None], 5, 0))
    assert (codes == -1).all()
    _, codes = kinematics.inverse(np.repeat(home[None], 5, 0), joints[1:6])
    assert set(codes.tolist()) <= {0, -1}


@representatives
def test_linuxcncs_own_home_has_no_turns(m, modules):
    home = find_home_pose(m)
    guess = world(m, home[None])
    guess[:, 3:6] = 0.0
    rows, codes = modules(m).forward(outward(m, m.inverse(home))[None], guess)
    assert codes[0] == 0
    place, turned = same_pose(m, pose(m, rows), home[None])
    assert place.max() < 1e-7
    assert turned.max() < 1e-9


@representatives
def test_a_path_of_poses_comes_back_as_it_was_written(m, modules):
    poses = winding_path(m)
    joints = m.follow(poses)
    rows, codes = modules(m).forward_path(outward(m, joints), world(m, poses[:1])[0])
    assert (codes == 0).all()
    error = np.abs(rows - world(m, poses))
    assert error[:, :3].max() < 1e-8
    upright = np.abs(np.sin(poses[:, 3])) < 1e-4 if m.axes[3:] == ("B", "C") else np.zeros(len(poses), bool)
    assert error[~upright].max() < 1e-6  # C's turns and B's sign are kept


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head", "orthoglide5_table"])
def test_an_upright_tool_keeps_its_last_c(name, modules):
    m = pk.load(name)
    start = world(m, m.home[None])
    start[:, 5] = 250.0
    rows, codes = modules(m).forward(outward(m, m.inverse(m.home))[None], start)
    assert codes[0] == 0
    assert np.abs(rows - start).max() < 1e-7


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head", "orthoglide5_table"])
def test_b_and_c_of_a_direction_are_written_as_the_library_writes_them(name, modules):
    """Of both ways to write it the one nearest to the last pose, ties within a millionth of a radian too."""
    m, rng, count = pk.load(name), np.random.default_rng(4), 4000
    poses = np.tile(m.home, (count, 1))
    poses[:, 3], poses[:, 4] = rng.uniform(0.02, 0.5, count), rng.uniform(-3.0, 3.0, count)
    near = poses.copy()
    near[:, 3], near[:, 4] = rng.uniform(-0.6, 0.6, count), rng.uniform(-9.0, 9.0, count)
    tied = np.arange(count) % 2 == 1  # (b + last)² + (π - way)² = (b - last)² + way²
    way = 0.5 * np.pi + 2.0 * poses[tied, 3] * near[tied, 3] / np.pi
    near[tied, 4] = poses[tied, 4] + way + rng.choice([-1e-6, 1e-6], tied.sum())
    found, codes = modules(m).forward(outward(m, m.inverse(poses)), world(m, near))
    assert (codes == 0).mean() > 0.5
    done = codes == 0
    written, turns = pose(m, found)[done, 3:], np.column_stack([np.zeros(done.sum()), near[done, 3:]])
    expected = find_nearest_direction(directions(m, poses)[done, :, 0], turns)[:, 1:]
    np.testing.assert_allclose(written, expected, atol=1e-8)
    flipped = written[:, 0] < 0.0
    assert flipped[tied[done]].any() and (~flipped)[tied[done]].any()


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_drawn_machines(family, modules, tmp_path):
    """A machine of every structure and leg kind, as a file of one's own."""
    d, drawn = draw(family, 12, 2000)
    m = machine_of(d, tmp_path)
    m.spec.__dict__["name"] = f"drawn_{family.replace(' ', '_')}"
    joints = m.inverse(drawn)
    least = beyond_the_drives(m, drawn, joints)
    with np.errstate(invalid="ignore"):
        good = np.isfinite(joints).all(1) & (least > 1e-9) & (regular(m, drawn, 1e-9) > 0)
    assert good.sum() > 100
    kinematics = modules(m)
    found, codes = kinematics.inverse(world(m, drawn[good]), outward(m, joints[good]))
    assert (codes == 0).all()
    assert np.abs(found - outward(m, joints[good])).max() < 1e-8
    back, codes = kinematics.forward(outward(m, joints[good]), world(m, nudged(m, drawn[good])))
    done = codes == 0
    assert done.mean() > 0.9
    miss, tilt = d.misses(pose(m, back[done]), joints[good][done])
    assert miss.max() < CLOSE
    assert tilt.max() < 1e-9


# The model that all modules share


@pytest.fixture(scope="module")
def probes(tmp_path_factory):
    """The model of every machine, built when asked for."""
    if not shutil.which("gcc"):
        pytest.skip("there is no gcc")
    stub, known = Stub(tmp_path_factory.mktemp("models")), {}

    def probe_of(machine):
        if machine.name not in known:
            known[machine.name] = stub.probe(machine)
        return known[machine.name]

    return probe_of


@representatives
def test_the_models_joint_rates_are_the_slopes_of_the_inverse(m, probes):
    poses = allowed(m.name)[:2000]
    joints, step = m.inverse(poses), 1e-5
    rates, regular = probes(m).rates(poses, joints)
    serial = compute_singularity_margins(m, poses)[:, 1:]
    safe = (np.abs(serial).min(1, initial=1.0) > 0.05) & regular
    assert safe.mean() > 0.5
    for k in range(len(m.axes)):
        ahead, behind = poses.copy(), poses.copy()
        ahead[:, k] += step
        behind[:, k] -= step
        slopes = (m.inverse(ahead) - m.inverse(behind)) / (2.0 * step)
        turned = np.abs(slopes) > 1e4  # an angle's turn between the two
        error = np.abs(rates[..., k] - slopes) / (1.0 + np.abs(slopes))
        assert error[safe & ~turned.any(1)].max() < 1e-4


@representatives
def test_the_models_singularity_margins_are_the_atlas(m, probes):
    poses = allowed(m.name)[:2000]
    margins = probes(m).singularities(poses, m.inverse(poses))
    assert np.abs(margins - compute_singularity_margins(m, poses)).max() < 1e-9


@pytest.mark.parametrize(("name", "telling"), [("exechon", ["parallel", "constraint"]), ("tricept", ["parallel"])])
def test_beside_a_parallel_or_constraint_singularity_joints_do_not_tell_the_pose(name, telling, probes):
    m = pk.load(name)
    names = list_margin_names(m)
    home = compute_singularity_margins(m, m.home)
    margins = np.tile(home, (1 + 2 * len(names), 1))
    for i in range(len(names)):
        margins[1 + i, i] *= 0.0019  # of home's: a tenth of what the kinematics refuses, 2 %, and a little less
        margins[1 + len(names) + i, i] *= -0.0021  # beyond it the pose is known, and refused
    told = probes(m).tell_pose(margins, 0.1)
    assert told[0] and told[1 + len(names) :].all()
    assert [name for name, known in zip(names, told[1:], strict=False) if not known] == telling


@representatives
def test_the_models_distance_to_limits_is_zero_where_one_is_reached(m, probes):
    poses = poses_about(m, 20_000, seed=5)
    joints = m.inverse(poses)
    distances, names = probes(m).distances(poses, joints)
    margins, broken = compute_singularity_margins(m, poses), m.check(poses)
    least = margins[:, 0] / compute_singularity_margins(m, m.home)[0] < 0.02
    least |= (margins[:, 1 : 1 + m.leg_count] < 0.02).any(1) | ~np.isfinite(joints).all(1)
    assert np.array_equal(distances < 0.0, (broken != 0) | least)
    assert set(names) <= {*m.limits, *(f"singularity, {name}" for name in list_margin_names(m))}


# The configuration


def numbers(text):
    return np.array([float(word) for word in text.split()])


@configured
def test_the_ini_says_what_the_machine_says(m):
    files = make_configuration(m)
    assert sorted(files) == sorted(f"{m.name}{end}" for end in ENDS)
    ini = read_ini(files[f"{m.name}.ini"])
    assert ini["KINS"]["KINEMATICS"] == f"{m.name}_kins"
    assert int(ini["KINS"]["JOINTS"]) == len(m.joints)
    assert ini["TRAJ"]["COORDINATES"].split() == list(m.axes)
    assert np.abs(numbers(ini["TRAJ"]["HOME"]) - world(m, find_home_pose(m)[None])[0, :3]).max() < 1e-9
    joints = [ini[f"JOINT_{i}"] for i in range(len(m.joints))]
    at_home = np.array([float(joint["HOME"]) for joint in joints])
    assert np.abs(at_home - outward(m, m.inverse(find_home_pose(m)))).max() < 1e-9
    assert f"JOINT_{len(m.joints)}" not in ini
    for joint, drive in zip(joints, m.model.drives, strict=True):
        factor = np.degrees(1.0) if drive.unit == "rad" else 1.0
        assert joint["TYPE"] == ("ANGULAR" if drive.unit == "rad" else "LINEAR")
        assert joint["HOME_OFFSET"] == joint["HOME"]
        ends = [float(joint["MIN_LIMIT"]), float(joint["MAX_LIMIT"])]
        assert np.abs(np.array(ends) / factor - [drive.low, drive.high]).max() < 1e-9
        for key, value in (("MAX_VELOCITY", drive.speed), ("MAX_ACCELERATION", drive.acceleration)):
            assert float(joint[key]) > 0.0
            assert not np.isfinite(value) or float(joint[key]) == pytest.approx(value * factor)


@configured
def test_the_axes_hold_the_poses_that_the_machine_can_take(m):
    ini = read_ini(make_configuration(m)[f"{m.name}.ini"])
    ends = [[float(ini[f"AXIS_{axis}"][f"PROGRAM_{end}_LIMIT"]) for axis in m.axes] for end in ("MIN", "MAX")]
    scale = np.where(np.array(m.axis_units) == "rad", np.degrees(1.0), 1.0)
    low, high = np.array(ends) / scale
    poses = poses_about(m, 200_000, seed=9)
    poses = poses[m.check(poses) == 0]
    inside = ((poses >= low) & (poses <= high)).all(1)
    assert inside.mean() > 0.999
    assert (low < m.home).all() and (m.home < high).all()
    assert (m.check(np.random.default_rng(4).uniform(low, high, (200_000, len(low)))) == 0).any()


@configured
def test_by_hand_an_axis_box_keeps_all_limits_and_all_axes_at_once_keep_the_joints_rates(m):
    ini = read_ini(make_configuration(m)[f"{m.name}.ini"])
    keys = ("MIN_LIMIT", "MAX_LIMIT", "MAX_VELOCITY", "MAX_ACCELERATION")
    scale = np.where(np.array(m.axis_units) == "rad", np.degrees(1.0), 1.0)
    low, high, speed, acceleration = (np.array([float(ini[f"AXIS_{a}"][key]) for a in m.axes]) / scale for key in keys)
    rng, home = np.random.default_rng(8), find_home_pose(m)
    assert ((low < home) & (home < high)).all()
    sides = rng.choice([0.0, 1.0], (20_000, len(low)))
    poses = low + np.vstack([sides, rng.uniform(0.0, 1.0, (20_000, len(low)))]) * (high - low)
    assert (m.check(poses) == 0).all()
    assert (regular(m, poses) > 0).all()
    signs, step = rng.choice([-1.0, 1.0], poses.shape), 1e-5
    moved = [m.inverse(poses + k * step * signs * speed / speed.max()) for k in (-1.0, 0.0, 1.0)]
    speeds = (moved[2] - moved[0]) / (2.0 * step) * speed.max()
    drives = np.array([[drive.speed, drive.acceleration] for drive in m.drives])
    assert (np.abs(speeds) <= drives[:, 0] * (1.0 + 1e-6)).all()
    assert (np.abs(speeds) / drives[:, 0]).max() > 0.3  # nor needlessly slow
    bend = (moved[2] - 2.0 * moved[1] + moved[0]) * (speed.max() / step) ** 2
    pulled = (
        (m.inverse(poses + step * signs * acceleration / acceleration.max()) - moved[1]) / step * acceleration.max()
    )
    assert (np.abs(pulled) + np.abs(bend) <= drives[:, 1] * 1.05).all()


@configured
def test_the_first_program_stays_inside(m):
    text = make_configuration(m)[f"{m.name}.ngc"]
    blocks = [re.findall(r"([XYZABC])(\S+)", line) for line in text.splitlines() if line.startswith("G1")]
    assert all([letter for letter, _ in block] == list(m.axes) for block in blocks)
    scale = np.where(np.array(m.axis_units) == "rad", np.degrees(1.0), 1.0)
    poses = np.array([[float(value) for _, value in block] for block in blocks]) / scale
    assert np.abs(poses[[0, -1]] - find_home_pose(m)).max() < 1e-9
    assert np.ptp(poses, axis=0)[:2].min() > 10.0
    way = np.concatenate([a + np.linspace(0.0, 1.0, 200)[:, None] * (b - a) for a, b in pairwise(poses)])
    assert (m.check(way) == 0).all()


def test_a_program_for_a_home_in_a_corner(tmp_path):
    text = (Path(pk.__file__).parent / "machines" / "hbg80_2d.yaml").read_text(encoding="utf-8")
    path = tmp_path / "corner.yaml"
    path.write_text(text.replace("-400 mm, 200 mm", "-97.3 mm, 200 mm").replace("hbg80_2d", "corner"), encoding="utf-8")
    m = pk.load(path)
    assert 0 < len(re.findall("^G1", pk.make_linuxcnc_configuration(m)["corner.ngc"], re.M)) <= 7


def test_what_a_description_leaves_open_is_chosen_and_said(tmp_path):
    text = (Path(pk.__file__).parent / "machines" / "hexapod.yaml").read_text(encoding="utf-8")
    path = tmp_path / "hexapod.yaml"
    path.write_text(text.replace("  acceleration: 5 m/s2\n", ""), encoding="utf-8")
    text = pk.make_linuxcnc_configuration(pk.load(path))["hexapod.ini"]
    joint = text[text.index("[JOINT_0]") : text.index("[JOINT_1]")]
    assert "does not say it: acceleration\n" in joint
    assert "MAX_VELOCITY = 500\n" in joint
    text = make_configuration(load_shipped("linear_delta"))["linear_delta.ini"]
    assert "does not say it" not in text


@configured
def test_the_c_is_under_the_gpl_and_names_itself(m):
    files = make_configuration(m)
    sources = [text for file, text in files.items() if file.endswith((".c", ".h"))]
    assert len(sources) >= 2
    for text in sources:
        assert "GNU General Public" in text.split("*/")[0]
        assert not re.search(r"\b(inf|nan)\b", text)
        assert text.count("{") == text.count("}")
    assert 'MODULE_LICENSE("GPL")' in files[f"{m.name}_kins.c"]
    assert f'#define MODULE "{m.name}_kins"' in files[f"{m.name}_kins.c"]


def test_a_module_of_another_making_is_not_loaded(modules):
    m = load_shipped("tricept")
    files = make_configuration(m)
    mark = re.search('#define MADE "(.*)"', files["tricept_kins.c"])[1]
    assert f"KINEMATICS made={mark}\n" in files["tricept.hal"]
    other = pk.load("tricept", parameters={"R": "351 mm"})
    assert f"made={mark}" not in write_hal(other)
    library, mark = modules(m).library, re.search('#define MADE "(.*)"', write_module(m))[1]
    given = ctypes.POINTER(ctypes.c_char_p).in_dll(library, "stub_string_made")
    codes = []
    for said in (b"another", mark.encode(), b""):
        given[0] = said
        codes.append(library.rtapi_app_main())
    assert codes == [-1, 0, 0]


# The command


def test_the_command_writes_the_files(tmp_path, capsys):
    assert main(["linuxcnc", "linear_delta", "-o", str(tmp_path / "out")]) == 0
    files = make_configuration(load_shipped("linear_delta"))
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(files)
    for name, text in files.items():
        assert (tmp_path / "out" / name).read_text(encoding="utf-8") == text
    assert capsys.readouterr().out.splitlines() == [str(tmp_path / "out" / name) for name in files]


def test_the_commands_folder_json_and_sizes(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["linuxcnc", "hbg80_2d", "--json", "--set", "l1=410mm"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["schema"] == "parakin.linuxcnc/1"
    assert all(Path(path).parent == Path("hbg80_2d") and Path(path).is_file() for path in said["files"])
    assert repr(410.0**2) in Path("hbg80_2d/hbg80_2d_model.h").read_text()


@pytest.mark.parametrize("arguments", [["nothing"], ["hexapod", "--set", "tool=1"], ["hbg80_2d", "-o", "/dev/null/x"]])
def test_what_the_command_refuses(arguments, capsys):
    assert main(["linuxcnc", *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
