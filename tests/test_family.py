"""Families against machines made one by one: by replaced numbers, by machine files, and by differences."""

import re
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.errors import PoseError
from parakin.machine import Machine
from parakin.model.elements import Point, Size
from parakin.workspaces.sampled.allowed_poses import sample_allowed_poses

SHIPPED = pk.machines()
FEW = ["tricept", "hexapod", "orthoglide", "lambda6", "rotary_delta", "orthoglide5_table", "eclipse", "rpr3"]
FEW += ["triglide_pairs"]  # whose constraints have no closed form once a number of them is free


def draw(machine, seed=0, size=0.1, count=None):
    """Draw sizes of a family of all numbers, one row or count rows."""
    family = pk.family(machine, [p.name for p in machine.parameters if p.group != "sizes"])
    shape = (len(family.names),) if count is None else (count, len(family.names))
    scales = [size if p.unit == "mm" else size * 2e-3 for p in family.parameters]
    return family, family.nominal + np.random.default_rng(seed).uniform(-1.0, 1.0, shape) * scales


def draw_poses(machine, count, seed=1):
    ways = np.array([3.0 if unit == "mm" else 0.02 for unit in machine.axis_units])
    poses = machine.home + np.random.default_rng(seed).uniform(-1.0, 1.0, (count, len(ways))) * ways
    if machine.has_direction:
        poses[:, machine.direction.b] = 0.1 + np.abs(poses[:, machine.direction.b])  # clear of the tool upright
    return poses


@pytest.mark.parametrize("name", SHIPPED)
def test_a_family_is_the_machines_of_its_sizes(name):
    machine = load_shipped(name)
    family, sizes = draw(machine)
    one, poses = family.at(sizes), draw_poses(machine, 20)
    joints = one.inverse(poses)
    assert np.isfinite(joints).all()
    assert np.abs(family.inverse(poses, sizes) - joints).max() < 1e-9
    if family.margins(poses, sizes).shape == one.margins(poses).shape:
        own = [name != "constraints.reach" for name in one.limits]  # which is against home's, of the nominal machine
        off = np.abs(family.margins(poses, sizes) - one.margins(poses))
        assert np.nanmax(off[:, own]) < 1e-8
        assert np.nanmax(off) < 0.1
    a, b, c = family.jacobians(poses, sizes)
    for ours, theirs in zip((a, b), one.jacobians(poses), strict=True):
        assert np.abs(ours - theirs).max() < 1e-11 * np.abs(theirs).max()
    assert c.shape == (20, max(len(machine.axes), len(machine.joints)), len(family.names))
    solution = family.forward(joints, sizes, near=machine.home)
    theirs = one.forward(joints, near=poses)
    assert solution.converged.all() and theirs.converged.all()
    assert np.abs(solution.poses - theirs.poses).max() < 1e-9


@pytest.mark.parametrize("name", FEW)
def test_sizes_move_the_pose_as_differences_say(name):
    machine = load_shipped(name)
    family, sizes = draw(machine, 2)
    poses = draw_poses(machine, 5, 3)
    joints = family.inverse(poses, sizes)
    a, _, c = family.jacobians(poses, sizes)
    moves = -np.linalg.solve(a, c)
    for i, parameter in enumerate(family.parameters):
        step = np.zeros(len(sizes))
        step[i] = 1e-3 if parameter.unit == "mm" else 1e-5
        ends = [family.forward(joints, sizes + sign * step, near=poses).poses for sign in (1.0, -1.0)]
        differences = (ends[0] - ends[1]) / (2.0 * step[i])
        scale = np.abs(moves[:, :, i]).max() + 1e-3
        assert np.abs(differences - moves[:, :, i]).max() < 2e-5 * scale, parameter.name


def test_a_number_replaced_by_hand_is_the_same():
    machine = load_shipped("linear_delta")
    spec = machine.spec
    x, y, z = spec.legs[0].foot
    leg = replace(spec.legs[0], foot=Point((x + 0.3, y, z)), rod=Size(spec.legs[0].rod - 0.2))
    other = Machine(replace(spec, legs=(leg, *spec.legs[1:])))
    family = pk.family(machine, ["legs.tower_a.foot.x", "legs.tower_a.rod"])
    poses = draw_poses(machine, 10)
    sizes = {"legs.tower_a.foot.x": x + 0.3, "legs.tower_a.rod": f"{spec.legs[0].rod - 0.2!r} mm"}
    assert np.abs(family.inverse(poses, sizes) - other.inverse(poses)).max() < 1e-12


@pytest.mark.parametrize("name", FEW)
def test_a_file_of_the_sizes_reads_back(name):
    family, sizes = draw(load_shipped(name), 4)
    one = family.at(sizes)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "own.yaml")
        path.write_text(one.format_yaml(), encoding="utf-8")
        read = pk.load(path)
    poses = draw_poses(one, 10)
    assert np.array_equal(read.inverse(poses), one.inverse(poses))
    assert np.array_equal(read.margins(poses), one.margins(poses))


@pytest.mark.parametrize("name", FEW)
def test_an_offset_shifts_what_the_drives_say(name):
    machine = load_shipped(name)
    offsets = {f"joints.{joint}.offset": 0.01 * (i + 1) for i, joint in enumerate(machine.joints)}
    other = machine.replace_parameters(offsets)
    poses = draw_poses(machine, 10)
    shift = machine.inverse(poses) - other.inverse(poses)
    shift -= 2.0 * np.pi * np.round(shift / (2.0 * np.pi)) * (np.array(machine.joint_units) == "rad")
    assert np.abs(shift - list(offsets.values())).max() < 1e-9
    assert other.forward(other.inverse(poses), near=poses).converged.all()
    if name in ("orthoglide", "rpr3"):
        poses_found = np.array(other.assemblies(other.inverse(poses[0])).poses)
        assert np.abs(poses_found - poses[0]).max(1).min() < 1e-6


def test_batches_of_machines_and_poses_broadcast():
    machine = load_shipped("hexapod")
    family, sizes = draw(machine, 5, count=7)
    poses = draw_poses(machine, 4)
    joints = family.inverse(poses[:, None], sizes)
    assert joints.shape == (4, 7, 6)
    for i in range(7):
        assert np.abs(joints[:, i] - family.at(sizes[i]).inverse(poses)).max() < 1e-11
    back = family.forward(joints, sizes, near=poses[:, None])
    assert back.converged.all()
    assert np.abs(back.poses - poses[:, None]).max() < 1e-10


def test_a_machine_a_row_costs_no_trace(monkeypatch):
    machine = load_shipped("hexapod")
    family = pk.family(machine, ["feet", "platform"])
    family.inverse(machine.home, family.nominal)
    monkeypatch.delattr("parakin.families.family.compile_tape")
    sizes = family.nominal + np.random.default_rng(0).uniform(-0.1, 0.1, (1000, len(family.names)))
    assert np.isfinite(family.inverse(machine.home, sizes)).all()


@pytest.mark.parametrize("name", ["hexapod", "tornado_2000"])
def test_struts_of_a_joint_go_on_meeting_there(name, tmp_path):
    """Machines of a family keep the limits of the nominal one, whose file tells which struts share a joint."""
    machine = load_shipped(name)
    family = pk.family(machine, ["feet", "platform"])
    sizes = family.nominal + np.random.default_rng(1).normal(0.0, 3.0, len(family.names))
    other = family.at(sizes)
    path = tmp_path / "other.yaml"
    path.write_text(other.format_yaml())
    with pytest.raises(pk.ParakinError, match='joined: unknown strut "strat", did you mean "strut'):
        wrong = tmp_path / "wrong.yaml"
        wrong.write_text(path.read_text().replace("joined: [[strut", "joined: [[strat, strut1], [strut"))
        pk.load(wrong)
    for each in (other, pk.load(path)):
        assert each.limits == machine.limits
        assert each.margins(machine.home) == pytest.approx(family.margins(machine.home, sizes), abs=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: pk.family(m, ["legs.d9.foot.x"]), 'free: unknown "legs.d9.foot.x", did you mean "legs.d'),
        (
            lambda m: pk.family(m, ["Q"]),
            "a group (encoders, feet, head, platform, sizes); Machine.parameters lists all",
        ),
        (lambda m: pk.family(m, "feet"), "free: a list of a text expected"),
        (lambda m: pk.family(m, ["feet"]).inverse(m.home, [1.0]), "sizes: shape (..., 9)"),
        (lambda m: pk.family(m, ["feet"]).inverse(m.home, {"legs.d1.foot.x": "3"}), "needs a unit"),
        (lambda m: pk.family(m, ["feet"]).inverse(m.home, {"foot": 3.0}), 'sizes: unknown "foot"'),
        (lambda m: pk.family(m, ["feet"]).at(np.zeros((2, 9))), "one machine's expected"),
        (lambda m: m.replace_parameters({"rods": 3.0}), 'parameters: unknown "rods"'),
        (lambda m: m.replace_parameters({}, ranges={"theta1": (0.0, 1.0)}), 'ranges: unknown "theta1"'),
        (lambda m: m.list_follow_rates("l9"), 'size: unknown "l9", expected one of'),
        (lambda m: m.tapes("++"), "mode '++': one of"),
    ],
)
def test_what_is_mistaken_is_said(call, message):
    with pytest.raises(PoseError) as error:
        call(load_shipped("tricept"))
    assert message in str(error.value)


def test_sizes_that_break_the_machine_are_refused():
    machine = load_shipped("tricept")
    with pytest.raises(pk.DescriptionError, match="home"):
        pk.family(machine, ["legs.d1.foot.x"]).at([5000.0])


def test_a_calibrated_pair_of_rods_moves_the_platform_far():
    """Near the rim, where driven rods are off by some 0.2 mm and their passive neighbours are not."""
    machine = load_shipped("triglide_pairs")
    family = pk.family(machine, ["legs.*.rod"])
    sizes = family.nominal + np.random.default_rng(3).normal(size=3) * 0.2
    poses = sample_allowed_poses(machine, 120, 7)
    own = family.at(sizes).inverse(poses)
    assert np.isfinite(own).all()
    assert np.abs(family.inverse(poses, sizes) - own).max() < 1e-9


# Named sizes.


@pytest.mark.parametrize(
    "name", ["tricept", "linear_delta", "rotary_delta", "lambda6", "hexapod", "exechon", "sprint_z3", "triglide_pairs"]
)
def test_named_sizes_are_inputs(name):
    """Against machines of the file with other sizes."""
    machine = load_shipped(name)
    names = [parameter.name for parameter in machine.parameters if parameter.group == "sizes"]
    assert names
    family = pk.family(machine, names)
    rng = np.random.default_rng(6)
    for _ in range(3):
        sizes = family.nominal * (1.0 + rng.uniform(-2e-3, 2e-3, len(names)))
        other = pk.load(name, dict(zip(names, sizes.tolist(), strict=True)))
        poses = draw_poses(machine, 10)
        assert np.abs(family.inverse(poses, sizes) - other.inverse(poses)).max() < 1e-9
        assert np.abs(family.at(sizes).inverse(poses) - other.inverse(poses)).max() < 1e-9
        assert np.nanmax(np.abs(family.margins(poses, sizes) - other.margins(poses))) < 1e-7


def test_the_example_runs(tmp_path):
    script = Path(__file__).parents[1] / "examples" / "family.py"
    done = subprocess.run([sys.executable, script, "-o", tmp_path], capture_output=True, text=True, check=True)
    drawn, told = map(
        float, re.search(r"drawn: (\S+) um rms at home, the first order tells (\S+)", done.stdout).groups()
    )
    assert drawn == pytest.approx(told, rel=0.01)
    assert [path.name for path in tmp_path.iterdir()] == ["family.png"]
