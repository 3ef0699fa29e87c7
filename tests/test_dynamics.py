"""Inverse dynamics against MuJoCo's on the exported model, and masses against those that it finds in the shapes."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.dynamics.inverse_dynamics import Dynamics, Motion
from parakin.export.machine.mjcf import render_mjcf

mujoco = pytest.importorskip("mujoco")
from mujoco_engine import METRE, Engine  # noqa: E402

MACHINES = ["tricept", "hexapod", "orthoglide", "lambda6", "rotary_delta", "eclipse", "sprint_z3", "exechon"]
MACHINES += ["orthoglide5_table", "triglide_pairs", "hbg80_3d", "rrr3", "five_bar", "four_struts"]


def draw_motion(machine, count, seed):
    """Poses that are allowed about home, reached by following from there, with rates of the joints at each."""
    rng = np.random.default_rng(seed)
    length = np.median(machine.leg_sizes)
    sizes = np.array([0.15 * length if unit == "mm" else 0.25 for unit in machine.axis_units])
    poses = machine.home + rng.uniform(-1.0, 1.0, (20 * count, len(sizes))) * sizes
    good = (machine.check(poses) == 0) & (np.sign(machine.sides(poses)) == np.sign(machine.sides(machine.home)))
    poses = poses[good][:count]
    units = np.array([METRE if unit == "mm" else 1.0 for unit in machine.joint_units])
    joints = np.array([machine.follow(np.linspace(machine.home, pose, 12))[-1] for pose in poses])
    speeds, accelerations = rng.normal(size=(2, len(poses), len(units)))
    return Motion(poses, joints, speeds * units, 5.0 * accelerations * units), units


@pytest.mark.parametrize("name", MACHINES)
def test_forces_are_those_of_mujoco(name):
    machine = load_shipped(name)
    motion, units = draw_motion(machine, 4, 3)
    assert len(motion.poses) == 4
    forces = Dynamics(machine).compute_forces(motion)
    forces[:, units == 1.0] /= METRE  # to Nm
    engine = Engine(machine)
    for row in range(len(forces)):
        engine.reset()
        for pose in machine.follow(np.linspace(machine.home, motion.poses[row], 8)):
            engine.drive(pose)
        assert engine.drive(motion.joints[row]) < 1e-12
        theirs = engine.read_forces(motion.speeds[row] / units, motion.accelerations[row] / units)
        assert forces[row] == pytest.approx(theirs, rel=1e-6, abs=1e-6 * np.abs(theirs).max())


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_table", "eclipse", "sprint_z3"])
def test_masses_are_those_of_the_shapes(name):
    """Without our inertias MuJoCo finds its own from shapes and densities."""
    text = render_mjcf(load_shipped(name))
    ours = mujoco.MjModel.from_xml_string(text)
    bare, count = re.subn("<inertial .*?/>", "", text)
    theirs = mujoco.MjModel.from_xml_string(bare)
    assert count == ours.nbody - 2
    assert ours.body_mass == pytest.approx(theirs.body_mass, rel=1e-9)
    matrices = []
    for model in (ours, theirs):
        own, dense = mujoco.MjData(model), np.empty((model.nv, model.nv))
        mujoco.mj_forward(model, own)
        mujoco.mj_fullM(model, own, dense)
        matrices.append(dense)
    assert matrices[0] == pytest.approx(matrices[1], rel=1e-8, abs=1e-12)


PART = """UNITS/MM
FEDRAT/3000,MMPM
GOTO/0,0,0
GOTO/60,10,-20
GOTO/20,50,15
RAPID
GOTO/0,0,0
FINI
"""


@pytest.fixture(scope="module")
def orthoglide_job(tmp_path_factory):
    part = tmp_path_factory.mktemp("part") / "part.apt"
    part.write_text(PART, encoding="utf-8")
    return pk.prepare(load_shipped("orthoglide"), pk.read_path(part))


def test_a_force_on_the_tip_is_carried_by_the_jacobian():
    machine = load_shipped("lambda6")
    motion, _ = draw_motion(machine, 3, 8)
    force = np.array([300.0, -50.0, 120.0])
    dynamics = Dynamics(machine)
    carried = dynamics.compute_forces(motion, force) - dynamics.compute_forces(motion)
    a, b = machine.jacobians(motion.poses)
    assert carried == pytest.approx(-np.einsum("nij,i->nj", np.linalg.solve(a, b)[:, :3], force), rel=1e-9)


def test_forces_along_a_path_are_those_of_its_motion():
    """Inertia, centrifugal forces and weight add up, whatever the speed along the path."""
    machine = load_shipped("tricept")
    motion, _ = draw_motion(machine, 3, 5)
    dynamics = Dynamics(machine)
    own = dynamics.compute_path_forces(motion.poses, motion.joints, motion.speeds, motion.accelerations)
    for speed, rise in ((0.3, -2.0), (2.0, 7.0)):
        states = motion.speeds * speed, motion.accelerations * speed**2 + motion.speeds * rise
        whole = dynamics.compute_forces(Motion(motion.poses, motion.joints, *states))
        assert own.inertia * rise + own.centrifugal * speed**2 + own.weight == pytest.approx(whole, rel=1e-9, abs=1e-6)


def test_work_on_a_closed_path_is_none(orthoglide_job):
    """From rest to rest at one place, the drives give back what they gave: energy, which no formula here knows."""
    found = pk.compute_drive_forces(orthoglide_job.trajectory)
    power = found.powers.sum(axis=1).reshape(-1, 3)
    spans = np.diff(orthoglide_job.trajectory.profile.time)[:, None] * np.array([1.0, 4.0, 1.0]) / 6.0
    assert abs((spans * power).sum()) < 1e-4 * (spans * np.abs(power)).sum()
    assert (found.rms < found.peaks).all()
    assert found.times[-1] == pytest.approx(orthoglide_job.trajectory.seconds)


def test_a_force_acts_where_the_tool_cuts(orthoglide_job):
    free = pk.compute_drive_forces(orthoglide_job.trajectory)
    loaded = pk.compute_drive_forces(orthoglide_job.trajectory, {"Z": 50.0})
    change = np.abs(loaded.forces - free.forces).max(axis=1)
    cuts = free.times < orthoglide_job.trajectory.times[2] - 0.05
    rapid = free.times > orthoglide_job.trajectory.times[2] + 0.05
    assert cuts.any() and rapid.any()
    assert (change[cuts] > 10.0).all()
    assert (change[rapid] == 0.0).all()
    with pytest.raises(pk.PoseError, match="force"):
        pk.compute_drive_forces(orthoglide_job.trajectory, [1.0, 2.0])


def test_command(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("part.apt").write_text(PART, encoding="utf-8")
    words = ["forces", "orthoglide", "part.apt", "--force", "Z=50N"]
    assert main([*words, "-o", "f.png", "--csv", "f.csv"]) == 0
    assert "kg move" in capsys.readouterr().out
    assert Path("f.png").read_bytes().startswith(b"\x89PNG")
    table = np.genfromtxt("f.csv", delimiter=",", names=True, deletechars="")
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["schema"] == "parakin.forces/1"
    assert told["force"] == {"X": 0.0, "Y": 0.0, "Z": 50.0}
    for joint, own in told["joints"].items():
        assert own["peak"] == pytest.approx(np.abs(table[f"{joint}_[N]"]).max(), abs=1e-5)
        assert own["peak_power"] == pytest.approx(np.abs(table[f"{joint}_[W]"]).max(), abs=1e-5)
    assert main([*words, "--workpiece", "900,0,0"]) == 3
    assert "part.apt: off limits; parakin post tells more" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-o", "f.gif"], "expected a file name that ends in .png"),
        (["--csv", "f.txt"], "expected a file name that ends in .csv"),
        (["--force", "Q=5N"], 'unknown axis "Q"'),
        (["--force", "X=5"], "needs a unit: N, kN"),
        (["--arc-tolerance", "0"], "--arc-tolerance: expected a length"),
        (["--workpiece", "1,2"], "--workpiece"),
        (["--mode", "x"], "mode"),
    ],
)
def test_what_is_mistaken_is_said_in_one_line(words, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("part.apt").write_text(PART, encoding="utf-8")
    assert main(["forces", "orthoglide", "part.apt", *words]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert message in said.err
    assert [path.name for path in tmp_path.iterdir()] == ["part.apt"]


def test_the_example_runs(tmp_path):
    script = Path(__file__).parents[1] / "examples" / "forces.py"
    done = subprocess.run([sys.executable, script, "-o", tmp_path], capture_output=True, text=True, check=True)
    assert "N rms" in done.stdout
    assert sorted(path.name for path in tmp_path.iterdir()) == ["forces.png", "part.apt"]
