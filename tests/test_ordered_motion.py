"""Motions in another order than that of a pose: the coordinates are the words as written, the pose is as ever."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from drawn import draw, machine_of
from independent import orientation, transform
from scipy.spatial.transform import Rotation
from shipped import load_shipped

import parakin as pk
from parakin.errors import SingularHomeWarning

RANGES = "limits: {passive: {tx: [-1 m, 1 m], ty: [-1 m, 1 m], tz: [-2 m, 2 m], rx: [-3 rad, 3 rad], "
RANGES += "ry: [-3 rad, 3 rad], rz: [-3 rad, 3 rad]}}"
ORDERS = [" ".join(turns) for turns in permutations(["rx", "ry", "rz"]) if turns != ("rz", "ry", "rx")]


def list_motions():
    """Every order of turns, with the translations before, behind and between them."""
    for order in [*ORDERS, "rz ry rx"]:
        first, rest = order[:2], order[3:]
        yield from (f"tx ty tz {order}", f"{order} ty tz tx", f"{first} tz tx ty {rest}")


MOTIONS = [motion for motion in list_motions() if motion != "tx ty tz rz ry rx"]


def read_coordinates(machine, pose):
    """The motion's coordinates, from their limits' margins."""
    margins = dict(zip(machine.limits, machine.margins(pose), strict=True))
    bounds = {limit.name: limit.bound for limit in machine.limit_definitions}
    return {word: margins[f"{word}.min"] + bounds[f"{word}.min"] for word in machine.spec.motion}


@pytest.mark.parametrize("motion", MOTIONS[::2])
def test_the_words_as_written_lead_to_the_platform(motion, tmp_path):
    d, poses = draw("six", 7)
    d.motion, d.limits = tuple(motion.split()), [RANGES]
    machine = machine_of(d, tmp_path)
    assert machine.axes == tuple("XYZABC")
    joints = machine.inverse(poses)
    assert d.misses(poses, joints)[0].max() < 1e-9
    found = machine.forward(joints, near=poses + 1e-3)
    assert found.converged.all()
    assert np.abs(found.poses - poses).max() < 1e-8
    frames, _ = d.platform(poses, joints)
    for pose, frame in zip(poses[:5], frames, strict=False):
        given, led = read_coordinates(machine, pose), np.eye(4)
        for word in d.motion:
            led = led @ transform(word, np.array([given[word]]))[0]
        assert np.abs(led - frame).max() < 1e-9
        turns = "".join(word[1].upper() for word in d.motion if word[0] == "r")
        angles = Rotation.from_matrix(frame[:3, :3]).as_euler(turns)
        assert np.abs(angles - [given[f"r{letter.lower()}"] for letter in turns]).max() < 1e-12


def test_where_the_pose_is_singular_the_motion_need_not_be(tmp_path):
    """With B = 90° at home turns C, B, A are singular there, and A, C, B are not."""
    d, _ = draw("six", 7)
    upright = transform("ry", np.array([0.5 * np.pi]))[0, :3, :3]
    turn = orientation(*np.array([[0.1], [0.2], [0.1]]))[0].T @ upright
    for leg in d.legs:
        leg["platform"] = turn.T @ leg["platform"]
    d.limits, d.mounting, d.head = [], [], []
    d.home = np.array([0.0, 0.0, -700.0, 0.0, 0.5 * np.pi, 0.0])
    with pytest.warns(SingularHomeWarning):
        assert not machine_of(d, tmp_path).forward(machine_of(d, tmp_path).inverse(d.home)).converged
    d.motion = ("tx", "ty", "tz", "rx", "rz", "ry")
    machine = machine_of(d, tmp_path)
    joints = machine.inverse(machine.home)
    moved = joints + 0.01 * np.where(np.array(machine.joint_units) == "mm", 10.0, 0.1)
    found = machine.forward(moved)
    assert found.converged
    assert np.abs(machine.inverse(found.poses) - moved).max() < 1e-7


def test_a_turn_before_the_translations_of_a_plane(tmp_path):
    before = load_shipped("rpr3")
    text = before.format_yaml().replace("motion: tx ty rz", "motion: rz tx ty").replace("name: rpr3", "name: turned")
    (tmp_path / "m.yaml").write_text(text.replace("passive: {", "passive: {tx: [-30 mm, 30 mm], "))
    after = pk.load(tmp_path / "m.yaml")
    poses = before.home + np.random.default_rng(1).uniform(-1.0, 1.0, (100, 3)) * [80.0, 80.0, 0.4]
    assert np.array_equal(after.inverse(poses), before.inverse(poses))
    along = poses[:, 0] * np.cos(poses[:, 2]) + poses[:, 1] * np.sin(poses[:, 2])  # what the turned axis sees
    assert np.abs(after.margins(poses)[:, after.limits.index("tx.max")] - (30.0 - along)).max() < 1e-9


def test_assemblies_do_not_depend_on_the_order(tmp_path):
    before = load_shipped("hexapod")
    text = before.format_yaml().replace("motion: tx ty tz rz ry rx", "motion: ry rz rx tx ty tz")
    (tmp_path / "m.yaml").write_text(text.replace("name: hexapod", "name: turned"))
    joints = before.inverse(before.home + [30.0, -20.0, 10.0, 0.1, -0.1, 0.2])
    one, two = (np.sort(m.assemblies(joints).poses[:, 2]) for m in (before, pk.load(tmp_path / "m.yaml")))
    assert np.abs(one - two).max() < 1e-6


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        ("tx rx ty tz ry rz", "its translations stand together"),
        ("rz tx", "a turn before one translation across it leads along a circle"),
        ("tx tz rz", "m.yaml:[0-9]+: motion: tx tz rz: the turn of a motion in a plane .* expected ry"),
        ("tx ty tz rz ry rz", "each word once"),
    ],
)
def test_an_order_that_no_pose_tells_is_refused(motion, message, tmp_path):
    text = pk.load("rpr3" if len(motion.split()) < 4 else "hexapod").format_yaml()
    old = next(line for line in text.splitlines() if line.startswith("motion: "))
    (tmp_path / "m.yaml").write_text(text.replace(old, f"motion: {motion}"))
    with pytest.raises(pk.InputError, match=message):
        pk.load(tmp_path / "m.yaml")
