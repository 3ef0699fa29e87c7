"""Machines for other programs: meshes stand where the scene does, and firmwares' words come back as the machine."""

import json

import numpy as np
import pytest
import trimesh
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.description.machine_file import list_shipped_machines
from parakin.export.machine.scene import build_scene

DELTAS = ["linear_delta", "linapod3"]


@pytest.mark.parametrize("name", ["hexapod", "tricept", "orthoglide5_table"])
def test_meshes_stand_at_the_pose(name, tmp_path):
    machine = load_shipped(name)
    pose = machine.home.copy()
    pose[:2] += [20.0, -10.0]
    at = ",".join(f"{value}" for value in pose[:3])
    at += "".join(f",{np.degrees(value)}" for value in pose[3:])
    for kind in ("stl", "glb"):
        assert main(["export", name, "--to", kind, "--at", at, "-o", str(tmp_path / f"m.{kind}")]) == 0
    scene = build_scene(machine, pose)
    stl, glb = trimesh.load(tmp_path / "m.stl"), trimesh.load(tmp_path / "m.glb")
    low, high = scene.box
    thick = 0.03 * scene.size
    assert (np.abs(stl.bounds - scene.box) < thick).all()
    assert stl.volume > 0.0  # facing outward
    # glTF: metres, Y up
    y_up = np.array([[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]])
    assert glb.bounds == pytest.approx(1e-3 * y_up, abs=1e-3 * thick)  # glTF counts in metres
    assert len(glb.geometry) > 10


@pytest.mark.parametrize("to", ["klipper", "reprapfirmware"])
@pytest.mark.parametrize("name", DELTAS)
def test_a_delta_comes_back(name, to, tmp_path):
    """Written for a firmware and imported again, the inverse is the same but for where joints count from."""
    file = tmp_path / {"klipper": "printer.cfg", "reprapfirmware": "config.g"}[to]
    machine = load_shipped(name)
    assert main(["export", name, "--to", to, "-o", str(file)]) == 0
    assert main(["import", str(file), "-o", str(tmp_path / "again.yaml")]) == 0
    again = pk.load(tmp_path / "again.yaml")
    rng = np.random.default_rng(6)
    poses = machine.home + rng.uniform(-80.0, 80.0, (1000, 3))
    ours, theirs = machine.inverse(poses), again.inverse(poses)
    # the firmware's tower X is at 210°, Klipper's steppers are in the order of the joints
    order = [0, 1, 2] if to == "klipper" else [1, 2, 0]
    offsets = theirs - ours[:, order]
    assert np.ptp(offsets, axis=0).max() < 1e-7
    tool = machine.tool_length
    assert offsets[0] == pytest.approx(-tool, abs=1e-7)
    tops = np.array([drive.high for drive in machine.drives])[order] - tool
    assert [drive.high for drive in again.drives] == pytest.approx(tops, abs=1e-6)


@pytest.mark.parametrize("counts", ["downward", "upward"])
def test_a_rotary_delta_comes_back(counts, tmp_path):
    """Above its bed, with arms that count either way; the firmware's count upward."""
    text = list_shipped_machines()["rotary_delta"].read_text().replace("home: {X: 0 mm, Y: 0 mm, Z: -280 mm}", "")
    text = text.replace("[-30 deg, 80 deg]", "[2 deg, 80 deg]")
    text += "mounting:\n  - tz: 500 mm\nhome: {X: 0 mm, Y: 0 mm, Z: 200 mm}\n"
    if counts == "upward":
        text = text.replace("[[1, 0, 0], [-0.5, cos(30 deg), 0], [-0.5, -cos(30 deg), 0]]",
                            "[[-1, 0, 0], [0.5, -cos(30 deg), 0], [0.5, cos(30 deg), 0]]")  # fmt: skip
        text = text.replace('branch: "+"', 'branch: "-"').replace("[2 deg, 80 deg]", "[-80 deg, -2 deg]")
    (tmp_path / "mine.yaml").write_text(text)
    machine = pk.load(tmp_path / "mine.yaml")
    assert main(["export", str(tmp_path / "mine.yaml"), "--to", "klipper", "-o", str(tmp_path / "printer.cfg")]) == 0
    assert main(["import", str(tmp_path / "printer.cfg"), "-o", str(tmp_path / "again.yaml")]) == 0
    again = pk.load(tmp_path / "again.yaml")
    poses = machine.home + np.random.default_rng(6).uniform(-80.0, 80.0, (1000, 3))
    sign = 1.0 if counts == "upward" else -1.0
    np.testing.assert_allclose(again.inverse(poses), sign * machine.inverse(poses), atol=1e-9)
    assert [drive.high for drive in again.drives] == pytest.approx([np.radians(-2.0)] * 3, abs=1e-9)
    assert ("counts downward" in (tmp_path / "printer.cfg").read_text()) == (counts == "downward")


def test_calibrated_deltas_come_back(tmp_path):
    """Three rods, turned towers and uneven endstops."""
    text = "M669 K3\nM665 R131.5 L290.8:290.9:291 H300.2 X0.3 Y-0.2 Z0.1\nM666 X0.5 Y-0.3 Z-0.2\n"
    (tmp_path / "config.g").write_text(text)
    assert main(["import", str(tmp_path / "config.g"), "-o", str(tmp_path / "one.yaml")]) == 0
    assert main(["export", str(tmp_path / "one.yaml"), "--to", "reprapfirmware", "-o", str(tmp_path / "two.g")]) == 0
    again = (tmp_path / "two.g").read_text()
    assert "M665 R131.5 L290.8:290.9:291 H300.2 X0.3 Y-0.2 Z0.1" in again
    assert "M666 X0.5 Y-0.3 Z-0.2" in again


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["hexapod", "--to", "klipper"], "three legs"),
        (["rus6", "--to", "klipper"], "three legs"),
        (["rotary_delta", "--to", "klipper"], "knees are not outside"),
        (["rotary_delta", "--to", "reprapfirmware"], "no tower"),
        (["orthoglide", "--to", "reprapfirmware"], "no tower"),
        (["hexapod", "--to", "check-move-klipper"], "X, Y and Z"),
        (["hexapod", "--to", "mjcf", "--at", "X=1"], "no pose"),
        (["hexapod", "--to", "stl", "--at", "X=a"], "X"),
    ],
)
def test_what_can_not_be_written_is_refused(words, told, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["export", *words]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert len(error.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_mesh_at_a_pose_out_of_reach_is_not_written(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["export", "linear_delta", "--to", "stl", "--at", "X=9999"]) == 3
    assert capsys.readouterr().err == "--at: out of reach: tower_a.reach\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["hexapod", "tricept", "lambda6", "orthoglide5_table", "hbg80_2d", "eclipse"])
def test_a_urdf_stands_as_at_home(name, tmp_path):
    """Read by MuJoCo with its joints at home's values, the tool is at home's pose, and the loops close."""
    mujoco = pytest.importorskip("mujoco")
    machine = load_shipped(name)
    output = tmp_path / "m.urdf"
    assert main(["export", name, "--to", "urdf", "-o", str(output)]) == 0
    loops = json.loads((tmp_path / "m_loops.json").read_text())
    text = output.read_text().replace("<link", '<mujoco><compiler fusestatic="false"/></mujoco><link', 1)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for joint, value in loops["home"].items():
        data.qpos[model.joint(joint).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    for loop in loops["loops"]:
        ends = [
            data.body(link).xpos + data.body(link).xmat.reshape(3, 3) @ np.array(point)
            for link, point in zip(loop["links"], loop["points"], strict=True)
        ]
        assert ends[0] == pytest.approx(ends[1], abs=1e-9)
    tool, workpiece = data.body("tool"), data.body("workpiece")
    tip = 1e3 * workpiece.xmat.reshape(3, 3).T @ (tool.xpos - workpiece.xpos)
    wanted = dict(zip(machine.axes, machine.home, strict=True))
    assert [tip["XYZ".index(axis)] for axis in wanted if axis in "XYZ"] == pytest.approx(
        [wanted[axis] for axis in wanted if axis in "XYZ"], abs=1e-6
    )
    assert loops["drives"] == list(machine.joints)
    assert np.array([loops["home"][joint] for joint in machine.joints]) * np.where(
        np.array(machine.joint_units) == "mm", 1e3, 1.0
    ) == pytest.approx(machine.inverse(machine.home), abs=1e-9)
    low, high = (
        1e-3 * end if machine.drives[0].unit == "mm" else end for end in (machine.drives[0].low, machine.drives[0].high)
    )
    assert model.joint(machine.joints[0]).range == pytest.approx([low, high])
