"""Rods without a drive: the platform's own turns follow from them, against geometry that knows no closed form."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from geometry import Description
from independent import orientation
from shipped import load_shipped
from test_mjcf import Engine, draw_ways
from test_parasitic import draw_prs, load_text

import parakin as pk
from parakin.errors import InputErrors
from parakin.performance.singularities import compute_singularity_margins, list_margin_names

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from stub import Stub, inward, outward, world

SKEWED = Path(__file__).parent / "machines" / "skewed_pairs.yaml"
# Free pendulums and levers in space: rods on the base, and one whose foot turns with an arm.
MIXED = """\
name: mixed
source: Sizes were chosen.
motion: tx ty tz rz ry rx
parasitic: tx ty rz
legs:
  kind: crank
  joints: [q1, q2, q3]
  pivot: {circle: 250 mm, at: [90 deg, 210 deg, 330 deg]}
  axis: [[1, 0, 0], [-0.5, sqrt(3) / 2, 0], [-0.5, -sqrt(3) / 2, 0]]
  zero: [[0, 1, 0], [-sqrt(3) / 2, -0.5, 0], [sqrt(3) / 2, -0.5, 0]]
  arm: 180 mm
  branch: "-"
  rod: 500 mm
  platform: {circle: 120 mm, at: [90 deg, 210 deg, 330 deg]}
  range: [-80 deg, 80 deg]
constraints:
  - {rod: 505 mm, on: q1, foot: [60 mm, 430 mm, 5 mm], platform: [50 mm, 120 mm, 0]}
  - {rod: 700 mm, foot: [-700 mm, -60 mm, -430 mm], platform: [0, -60 mm, 0]}
  - {plane_of: base, platform: [0, -60 mm, 0], foot: [0, -62 mm, 0], normal: [0.05, 1, 0]}
home: {Z: -430 mm}
"""


def check_rates(machine, poses):
    a, b = machine.jacobians(poses)
    rates = np.linalg.solve(b, a)
    for axis, step in enumerate(1e-4 * np.where(np.array(machine.axis_units) == "mm", 100.0, 1.0)):
        way = np.eye(len(machine.axes))[axis] * step
        slope = (machine.inverse(poses + way) - machine.inverse(poses - way)) / (2.0 * step)
        assert np.abs(rates[:, :, axis] - slope).max() < 1e-4 * np.abs(rates).max()


def spread(machine, count, sizes, seed=0):
    return machine.home + np.random.default_rng(seed).uniform(-1.0, 1.0, (count, len(machine.axes))) * sizes


def test_pairs_that_are_no_parallelograms_turn_the_platform():
    machine = pk.load(SKEWED)
    assert machine.axes == ("X", "Y", "Z")
    assert machine.modes == ("+++",)  # carriages by which the platform is turned stand as they do
    poses = spread(machine, 2000, [110.0, 110.0, 150.0])
    joints = machine.inverse(poses)
    assert Description.of(machine.spec).misses(poses, joints)[0].max() < 1e-9
    found = machine.forward(joints)
    assert found.converged.all()
    assert np.abs(found.poses - poses).max() < 1e-9
    check_rates(machine, poses[:100])
    turned = [np.array(machine.place_platform(pose, machine.mode).rotation) for pose in poses[:50]]
    assert 5e-4 < np.abs([r - np.eye(3) for r in turned]).max() < 5e-3


def test_planes_and_rods_of_base_and_arm_together(tmp_path):
    machine = load_text(tmp_path, MIXED)
    assert machine.axes == ("Z", "A", "B")
    poses = spread(machine, 60, [50.0, 0.15, 0.15])
    joints = machine.inverse(poses)
    assert np.isfinite(joints).all()
    d = Description.of(machine.spec)
    for pose, q in zip(poses, joints, strict=True):
        frame = machine.place_platform(pose, machine.mode)
        rotation, origin = np.array(frame.rotation, float)[None], np.array(frame.origin, float)[None]
        turn = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
        assert np.abs(rotation - orientation(pose[1], pose[2], turn)).max() < 1e-12
        assert origin[0, 2] == pose[0]
        assert np.abs(d.open_constraints(rotation, origin, q[None])).max() < 1e-9
    found = machine.forward(joints, near=poses)
    assert found.converged.all()
    assert np.abs(found.poses - poses).max() < 1e-8
    check_rates(machine, poses[:50])


def test_planes_are_solved_as_their_closed_form(tmp_path):
    """A rod of a kilometre is all but a plane: what is solved is near the closed form, as near as its bend."""
    far = 1e6
    text = draw_prs(np.random.default_rng(3), "head: [tz: -50 mm]\nhome: {Z: 300 mm}\n", "tx ty tz rz ry rx")
    planes = load_text(tmp_path, text)
    assert not planes.structure.is_solved
    rods = []
    for each in planes.constraints:
        platform, foot, normal = (np.array(v) for v in (each.platform, each.foot, each.normal))
        foot = foot - normal * far
        rods.append(f"  - {{rod: {far} mm, platform: {list_mm(platform)}, foot: {list_mm(foot)}}}\n")
    head, rest = text.split("constraints:\n")
    solved = load_text(tmp_path, head + "constraints:\n" + "".join(rods) + rest[rest.index("legs:") :])
    assert solved.structure.is_solved
    poses = spread(planes, 200, [100.0, 0.25, 0.25])
    assert 1e-6 < np.abs(planes.inverse(poses) - solved.inverse(poses)).max() < 0.2


def list_mm(point):
    return "[" + ", ".join(f"{x!r} mm" for x in point.tolist()) + "]"


def test_where_the_steps_do_not_converge_there_is_no_answer(tmp_path):
    machine = load_text(tmp_path, MIXED)
    poses = spread(machine, 3000, [400.0, 1.5, 1.5], seed=5)
    joints = machine.inverse(poses)
    good = np.isfinite(joints).all(1)
    assert 0.02 < good.mean() < 0.9
    d = Description.of(machine.spec)
    for pose, q in zip(poses[good][:60], joints[good], strict=False):
        frame = machine.place_platform(pose, machine.mode)
        rotation, origin = np.array(frame.rotation, float)[None], np.array(frame.origin, float)[None]
        assert np.abs(d.open_constraints(rotation, origin, q[None])).max() < 1e-6
    assert (machine.check(poses[~good]) > 0).all()


def test_rods_in_the_plane_of_the_rails_are_a_constraint_singularity():
    machine = load_shipped("triglide_pairs")
    column = list_margin_names(machine).index("constraint")
    poses = machine.home + np.linspace(0.0, 429.9, 50)[:, None] * [0.0, 0.0, 1.0]  # at 430 all rods lie flat
    margins = np.abs(compute_singularity_margins(machine, poses)[:, column])
    assert (np.diff(margins) < 0.0).all()
    assert margins[-1] < 1e-3 * margins[0]


def test_the_engine_holds_skewed_pairs_as_we_do():
    machine = pk.load(SKEWED)
    engine = Engine(machine)
    for way, joints in draw_ways(machine, 100, 5):
        engine.reset()
        for q in joints:
            gap = engine.drive(q)
        assert gap < 1e-10
        tip, turn = engine.read()
        assert np.abs(tip - way[-1]).max() < 1e-4
        assert np.abs(turn - np.array(machine.place_platform(way[-1], machine.mode).rotation)).max() < 1e-6


def test_assemblies_of_a_skewed_machine():
    machine = pk.load(SKEWED)
    pose = machine.home + [40.0, -30.0, 20.0]
    every = machine.assemblies(machine.inverse(pose))
    assert every.complete == "all paths accounted for"
    assert np.abs(every.poses - pose).max(1).min() < 1e-9


@pytest.mark.skipif(not shutil.which("gcc"), reason="there is no gcc to build a kinematics module with")
def test_linuxcnc_turns_the_platform_too(tmp_path):
    machine = pk.load(SKEWED)
    module = Stub(tmp_path).built(machine, "-Wframe-larger-than=4096")  # long straight-line code
    poses = spread(machine, 5000, [110.0, 110.0, 150.0])
    joints = machine.inverse(poses)
    given = outward(machine, joints)
    found, codes = module.inverse(world(machine, poses), given)
    allowed = machine.check(poses) == 0
    assert allowed.mean() > 0.5
    assert (codes[allowed] == 0).all()
    assert np.abs(inward(machine, found[allowed]) - joints[allowed]).max() < 1e-9


def test_it_is_written_as_it_was_read(tmp_path):
    machine = pk.load(SKEWED)
    again = load_text(tmp_path, machine.format_yaml())
    assert again.spec.constraints == machine.spec.constraints
    assert np.array_equal(again.inverse(again.home), machine.inverse(machine.home))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("on: q1", "on: q4", 'unknown joint "q4"'),
        ("{rod: 700 mm, foot", "{foot", "expected a mapping with plane_of, or one with rod"),
        ("rod: 700 mm", "rod: -1 mm", "out of range"),
        ("rod: 700 mm", "rod: 7 mm", "no frame of the platform keeps them at home"),
    ],
)
def test_a_rod_that_is_none_is_refused(tmp_path, old, new, message):
    assert old in MIXED
    with pytest.raises((InputErrors, pk.ParakinError), match=message):
        load_text(tmp_path, MIXED.replace(old, new))


def test_a_rod_on_a_strut_that_changes_its_length_is_refused(tmp_path):
    text = MIXED.replace("kind: crank", "kind: length").replace("on: q1", "on: q2")
    for key in ("pivot", "axis", "zero", "arm", "branch", "rod"):
        text = re.sub(rf"(?m)^  {key}: .*\n", "", text)
    text = text.replace(
        "  range: [-80 deg, 80 deg]",
        "  foot: {circle: 300 mm, at: [90 deg, 210 deg, 330 deg]}\n  range: [300 mm, 900 mm]",
    )
    with pytest.raises(pk.InputError, match=r":\d+: .*legs of kind length have no carriage or arm"):
        load_text(tmp_path, text)
