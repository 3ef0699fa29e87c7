"""The 3-RPR of CONTRIBUTING.md: one YAML file, and everything works for it."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import parakin as pk
from parakin.cli import main

PAGE = Path(__file__).parents[1] / "CONTRIBUTING.md"


@pytest.fixture
def machine_file(tmp_path):
    text = re.search(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S).group(1)
    assert len(text.splitlines()) <= 20
    path = tmp_path / "rpr3.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_its_kinematics_are_those_of_three_struts(machine_file):
    m = pk.load(machine_file)
    assert m.axes == ("X", "Y", "C")
    rng = np.random.default_rng(3)
    poses = rng.uniform([-60, -60, -0.3], [60, 60, 0.3], (2000, 3))
    turn = poses[:, 2, None] + np.radians([60, 180, 300])
    feet = 500.0 * np.exp(1j * np.radians([90, 210, 330]))
    corners = (poses[:, 0] + 1j * poses[:, 1])[:, None] + 120.0 * np.exp(1j * turn)
    joints = m.inverse(poses)
    assert np.abs(joints - np.abs(corners - feet)).max() < 1e-9
    back = m.forward(joints, near=poses + [0.5, -0.5, 0.005])
    assert back.converged.all()
    assert np.abs(back.poses - poses).max() < 1e-8
    a, b = m.jacobians(poses)
    step = 1e-5
    slopes = np.stack([(m.inverse(poses + step * e) - m.inverse(poses - step * e)) / (2 * step) for e in np.eye(3)], -1)
    assert np.abs(np.linalg.solve(b, a) - slopes).max() < 1e-5
    found = m.assemblies(joints[0]).poses
    assert 2 <= len(found) <= 6
    assert np.abs(m.inverse(found) - joints[0]).max() < 1e-9
    assert np.abs(found - poses[0]).max(1).min() < 1e-8


def test_the_commands_of_the_page_work(machine_file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("part.apt").write_text("UNITS/MM\nFEDRAT/900,MMPM\nRAPID\nGOTO/0,0,0\nGOTO/40,10,0\nGOTO/40,-30,0\nFINI\n")
    commands = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("parakin ")]
    assert len(commands) == 5
    for command in commands:
        assert main(command.split()[1:]) == 0, command
    assert Path("linuxcnc/rpr3_kins.c").is_file()  # its box for moves by hand is the whole of what is tried
    assert Path("rpr3.html").stat().st_size > 1e5
    assert {p.name for p in Path("out").iterdir()} == {"part.joints.csv", "part.report.html"}
    capsys.readouterr()
    assert main(["post", "part.apt", "--machine", "rpr3.yaml", "-o", "out", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)


def test_a_path_off_its_limits_or_plane_is_refused(machine_file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("part.apt").write_text("FEDRAT/900,MMPM\nGOTO/0,0,0\nGOTO/400,0,0\nGOTO/0,0,7\nFINI\n")
    assert main(["post", "part.apt", "--machine", "rpr3.yaml", "-o", "out"]) == 3
    said = "".join(capsys.readouterr())
    assert "part.apt:3" in said
    assert "part.apt:4" in said
