"""The MuJoCo model: another engine, driven to our joints, shows our tool pose."""

from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.export.machine.mjcf import render_mjcf

mujoco = pytest.importorskip("mujoco")
from mujoco_engine import Engine  # noqa: E402

MACHINES = Path(__file__).parent / "machines"
OWN = [str(MACHINES / f"{name}.yaml") for name in ("hexaglide", "swing", "arm", "balls")]
KINDS = {
    "rotary": """\
name: rotary
source: Sizes were chosen.
motion: tx ty tz
legs:
  kind: crank
  joints: [q1, q2, q3]
  pivot: {circle: 200 mm, at: [90 deg, 210 deg, 330 deg]}
  axis: [[1, 0, 0], [-0.5, sqrt(3) / 2, 0], [-0.5, -sqrt(3) / 2, 0]]
  zero: [[0, 1, 0], [-sqrt(3) / 2, -0.5, 0], [sqrt(3) / 2, -0.5, 0]]
  arm: 200 mm
  branch: "-"
  rod: 500 mm
  platform: {circle: 50 mm, at: [90 deg, 210 deg, 330 deg]}
  range: [-80 deg, 80 deg]
home: {X: 0, Y: 0, Z: -450 mm}
""",
    "eclipse": """\
name: eclipse
source: Sizes were chosen.
motion: tx ty tz rz ry rx
legs:
  kind: column
  joints: [[a1, h1], [a2, h2], [a3, h3]]
  radius: 500 mm
  rod: 500 mm
  platform: {circle: 150 mm, at: [90 deg, 210 deg, 330 deg]}
  range: [[-400 deg, 400 deg], [0 mm, 900 mm]]
home: {X: 0, Y: 0, Z: 700 mm, A: 0, B: 0, C: 0}
""",
}
STEPS = 12  # of a way from home


def rotate(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)]["xyz".index(axis)]
    turn = np.eye(3)
    turn[[i, j], [i, j]], turn[i, j], turn[j, i] = c, -s, s
    return turn


def measure_difference(machine, engine, pose):
    """How far the engine's tool is from a pose: mm of the tip, rad of the rotation or, of five axes, of the axis."""
    tip, turn = engine.read()
    given = dict(zip(machine.axes, pose, strict=True))
    wanted = rotate("z", given.get("C", 0.0)) @ rotate("y", given.get("B", 0.0)) @ rotate("x", given.get("A", 0.0))
    home = (
        np.array(machine.structure.tool_rotation) if not machine.has_direction and len(machine.axes) < 6 else np.eye(3)
    )
    if machine.structure.has_central_leg and not machine.has_direction:  # which leans by itself
        wanted = np.array(machine.place_platform(pose, machine.mode).rotation, float)
    off = turn - wanted @ home
    off = off[:, 2] if machine.has_direction else off
    return max(abs(tip["XYZ".index(axis)] - given[axis]) for axis in "XYZ" if axis in given), np.abs(off).max()


def draw_ways(machine, count, seed):
    """Ways from home to random poses, (steps, axes) each and allowed all along, with their joints."""
    rng = np.random.default_rng(seed)
    length = np.median(machine.leg_sizes)
    sizes = np.array([0.4 * length if unit == "mm" else 0.8 for unit in machine.axis_units])
    while count:
        end = machine.home + rng.uniform(-1.0, 1.0, len(sizes)) * sizes * rng.uniform()
        way = machine.home + np.linspace(0.0, 1.0, STEPS + 1)[1:, None] * (end - machine.home)
        if not machine.check(way).any() and (np.sign(machine.sides(way)) == np.sign(machine.sides(machine.home))).all():
            count -= 1
            yield way, machine.follow(np.vstack([machine.home, way]))[1:]


def load(name, tmp_path):
    if name in KINDS:
        (tmp_path / f"{name}.yaml").write_text(KINDS[name])
        name = str(tmp_path / f"{name}.yaml")
    return pk.load(name)


@pytest.mark.parametrize("name", [*pk.machines(), *OWN, *KINDS], ids=lambda name: Path(name).stem)
def test_the_engine_shows_our_pose(name, tmp_path):
    machine = load(name, tmp_path)
    engine = Engine(machine)
    worst = np.zeros(2)
    for way, joints in draw_ways(machine, 100, 5):
        engine.reset()
        for q in joints:
            gap = engine.drive(q)
        assert gap < 1e-10
        worst = np.maximum(worst, measure_difference(machine, engine, way[-1]))
    assert worst[0] < 1e-4  # mm
    assert worst[1] < 1e-7  # rad


@pytest.mark.parametrize("name", pk.machines())
def test_servos_hold_the_machine_at_home(name):
    """A second of dynamics under its own weight: closed, and where home is."""
    machine = load_shipped(name)
    engine = Engine(machine)
    mujoco.mj_resetDataKeyframe(engine.model, engine.data, 0)
    assert engine.data.ctrl == pytest.approx(machine.inverse(machine.home) / engine.units, abs=1e-12)
    for _ in range(2000):
        mujoco.mj_step(engine.model, engine.data)
    mujoco.mj_forward(engine.model, engine.data)
    tip, turn = measure_difference(machine, engine, machine.home)
    assert tip < 0.2  # mm
    assert turn < (2e-3 if name == "pentapod" else 1e-3)  # its rings are near each other: 0.03 rad a mm of strut
    assert np.abs(engine.data.efc_pos[: engine.data.ne]).max() < 1e-5  # m


def test_ranges_and_drives_are_the_machines():
    machine = load_shipped("tricept")
    model = mujoco.MjModel.from_xml_string(render_mjcf(machine))
    assert [model.actuator(i).name for i in range(model.nu)] == list(machine.joints)
    assert model.joint("d2").range == pytest.approx([0.934, 1.520])
    assert model.actuator("theta2").ctrlrange == pytest.approx(np.radians([-120.0, 120.0]))
    assert model.joint("platform_rx").range == pytest.approx(np.radians([-60.0, 60.0]))
    assert not model.jnt_limited[model.joint("platform_tz").id]


def test_masses_follow_from_the_densities():
    """A rod is a capsule of steel: the cylinder's volume and the ball's, times 7850 kg/m³."""
    model = mujoco.MjModel.from_xml_string(render_mjcf(load_shipped("linear_delta")))
    geom = model.geom(model.body("tower_a_1").geomadr[0])
    radius, half = geom.size[:2]
    assert 2.0 * half == pytest.approx(0.7)
    volume = np.pi * radius**2 * 0.7 + 4.0 / 3.0 * np.pi * radius**3
    assert model.body("tower_a_1").mass[0] == pytest.approx(7850.0 * volume, rel=1e-9)


def test_command(tmp_path, capsys):
    output = tmp_path / "h.xml"
    assert main(["export", "hexapod", "--to", "mjcf", "-o", str(output), "--json"]) == 0
    assert '"schema": "parakin.export/1"' in capsys.readouterr().out
    assert mujoco.MjModel.from_xml_path(str(output)).nu == 6
    assert main(["export", "hexapod", "--to", "mjcf", "-o", str(tmp_path / "h.stl")]) == 2
    assert main(["export", "hexapod", "--to", "sdf", "-o", str(output)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["h.xml"]
