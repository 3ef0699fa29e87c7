"""``parakin post`` on the command line: G-code in, programs and setpoints out, the part placed, the exit codes."""

import csv
import json
import re

import numpy as np
import pytest
from shipped import load_shipped

from parakin.cli import main
from parakin.toolpath.reading.detect import read_path

SQUARE = "G21 G90 G94\nG0 X-40 Y-40 Z300\nG1 X40 F6000\nY40\nX-40\nY-40\nM2\n"


@pytest.fixture
def part(tmp_path):
    path = tmp_path / "square.ngc"
    path.write_text(SQUARE)
    return path


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def ran(capsys, *arguments, code=0):
    assert main(["post", *[str(a) for a in arguments]]) == code
    return capsys.readouterr().out


def told(capsys, *arguments, code=0):
    return json.loads(ran(capsys, *arguments, "--json", code=code), parse_constant=pytest.fail)


def test_gcode_goes_in(part, out, capsys):
    said = told(capsys, part, "-m", "linear_delta", "-o", out)
    assert (said["records"], said["verdict"]) == (5, "ok")
    assert said["seconds"] > 4 * 80 / 100  # the square's length at its feed
    assert sum(said["bound_by"].values()) == pytest.approx(1.0)


def test_off_limits_between_the_records(part, out, capsys):
    part.write_text("G0 X-100 Y100 Z550\nG1 X100 F6000\n")
    said = told(capsys, part, "-m", "linear_delta", "-o", out, code=3)
    first = said["first"]
    assert said["off_limits"] == 0 and said["motions_off_limits"] == 1
    assert (first["limit"], first["line"]) == ("tower_a.max", 2) and 0 < first["begins"] <= first["share"] < 1
    text = ran(capsys, part, "-m", "linear_delta", "-o", out, code=3)
    said = rf"^{part}:2: (from )?\d+ % on the way there, X .*: leg tower_a would be .*, limit 1,300$"
    assert re.search(said, text, re.M)


def test_setpoints(part, out, capsys):
    said = told(capsys, part, "-m", "linear_delta", "-o", out, "--rate", "50", "--parquet")
    assert sorted(said["files"]) == ["parquet", "report", "setpoints", "setpoints-parquet", "table"]
    with (out / "square.setpoints.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == int(np.ceil(50 * said["seconds"])) + 1
    machine = load_shipped("linear_delta")
    poses = np.array([[float(row[f"{axis} [mm]"]) for axis in "XYZ"] for row in rows])
    joints = np.array([[float(row[f"{joint} [mm]"]) for joint in machine.joints] for row in rows])
    np.testing.assert_allclose(machine.inverse(poses), joints, atol=0.01)


def test_placed(part, out, capsys):
    said = told(capsys, part, "-m", "linear_delta", "-o", out, "--place", "X=-80:80,Y=-80:80")
    found = said["placement"]
    assert found["margin"] > 0 and found["tried"] > 10
    assert sorted(found["workpiece"]) == ["X", "Y"]
    words = ",".join(f"{axis}={value!r}" for axis, value in found["workpiece"].items())
    again = told(capsys, part, "-m", "linear_delta", "-o", out, "--workpiece", words)
    np.testing.assert_allclose(again["frame"], said["frame"], atol=1e-9)
    text = ran(capsys, part, "-m", "linear_delta", "-o", out, "--place", "X=-80:80,Y=-80:80")
    assert "best placement --workpiece X=" in text


def test_placed_where_no_job_runs(tmp_path, out, capsys):
    """Both records are within theta2's 100 degrees, but the short way between them turns the tool upside down."""
    part = tmp_path / "over.apt"
    part.write_text("UNITS/MM\nFEDRAT/600,MMPM\nGOTO/0,0,0,0.9962,0,-0.0872\nGOTO/10,0,0,-0.9962,0,-0.0872\nFINI\n")
    text = ran(capsys, part, "-m", "orthoglide5_head", "-o", out, "--place", "X=-9:9,Z=-100:0", code=3)
    assert "no placement was found at which the path runs" in text and "best placement" not in text
    assert "but it does not run" in text.splitlines()[0]


def test_nowhere_to_place(part, out, capsys):
    said = told(capsys, part, "-m", "linear_delta", "-o", out, "--place", "X=900:1000", code=3)
    assert said["placement"]["margin"] < 0
    assert "no placement within these bounds is allowed" in ran(
        capsys, part, "-m", "linear_delta", "-o", out, "--place", "X=900:1000", code=3
    )


@pytest.mark.parametrize("target", ["linuxcnc", "joints"])
def test_programs(target, part, out, capsys):
    said = told(capsys, part, "-m", "linear_delta", "-o", out, "--target", target)
    assert said["files"]["program"].endswith(f"square.{target}.ngc")
    if target == "linuxcnc":
        back = read_path(said["files"]["program"], workpiece=np.eye(3, 4))
        corners = np.array([[-40, -40, 300], [40, -40, 300], [40, 40, 300], [-40, 40, 300]], dtype=float)
        assert all(np.abs(back.tip - corner).sum(axis=1).min() < 2.0 for corner in corners)  # they are rounded
        assert np.abs(back.tip[-1] - corners[0]).max() < 1e-6


def test_no_program_off_limits_but_by_force(part, out, capsys):
    part.write_text(SQUARE.replace("X40", "X400"))
    text = ran(capsys, part, "-m", "linear_delta", "-o", out, "--target", "linuxcnc", code=3)
    assert "no program: " in text and not (out / "square.linuxcnc.ngc").exists()
    ran(capsys, part, "-m", "linear_delta", "-o", out, "--target", "linuxcnc", "--force", code=3)


def test_a_program_of_an_earlier_run_is_told(part, out, capsys):
    told(capsys, part, "-m", "linear_delta", "-o", out, "--target", "linuxcnc", "--rate", 10)
    part.write_text(SQUARE.replace("X40", "X4000"))
    said = told(capsys, part, "-m", "linear_delta", "-o", out, "--target", "linuxcnc", "--rate", 10, code=3)
    (program,) = (reason for reason in said["missing"] if reason.startswith("no program"))
    assert program.endswith("; square.linuxcnc.ngc in the folder is of an earlier run")
    out.joinpath("square.linuxcnc.ngc").unlink()
    said = told(capsys, part, "-m", "linear_delta", "-o", out, "--target", "linuxcnc", code=3)
    assert "earlier" not in said["missing"][0]


def test_a_program_never_replaces_its_source(part, capsys):
    ran(capsys, part, "-m", "linear_delta", "-o", part.parent, "--target", "linuxcnc")
    assert part.read_text() == SQUARE


def test_forced_where_the_tool_can_go(part, out, capsys):
    part.write_text("G0 X0 Y0 Z300\nG1 Z650 F6000\nG1 Z300\n")
    said = told(capsys, part, "-m", "linear_delta", "-o", out, "--target", "linuxcnc", "--force", code=3)
    text = (out / "square.linuxcnc.ngc").read_text()
    assert "OFF LIMITS" in text.upper() and said["offences"]
    for offence in said["offences"]:
        assert offence["text"].replace("(", "").replace(")", "") in text


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--tolerance", "0"], "--tolerance: "),
        (["--angle-tolerance", "nan"], "--angle-tolerance: "),
        (["--place", "X=1:2", "--workpiece", "0,0,0"], "--place: "),
        (["--place", "Q=1:2"], "--place: "),
        (["--rate", "0"], "--rate: "),
        (["--rate", "inf"], "--rate: "),
        (["--target", "mazak"], "--target"),
        (["--corners", "cut"], "--corners"),
    ],
)
def test_refused(options, said, part, out, capsys):
    assert main(["post", str(part), "-m", "linear_delta", "-o", str(out), *options]) == 2
    text = capsys.readouterr()
    assert text.out == "" and said in text.err and text.err.count("\n") == 1
    assert not out.exists()


def test_a_machine_without_rates(part, out, tmp_path, capsys):
    machine = tmp_path / "slow.yaml"
    machine.write_text("""\
name: slow
title: Two slides
source: none
motion: tx ty
legs:
  kind: slider
  joints: [a, b]
  foot: [0, 0, 0]
  rail: [[1, 0, 0], [0, 1, 0]]
  rod: 400 mm
  branch: "-"
  platform: [0, 0, 0]
  range: [-400 mm, 200 mm]
home: {X: 230 mm, Y: 230 mm}
""")
    part.write_text("G0 X200 Y200 Z0\nG1 X250 F1000\nG0 Y250\n")
    said = told(capsys, part, "-m", machine, "-o", out)
    assert said["verdict"] == "ok" and said["seconds"] is None
    assert "no cycle time: " in ran(capsys, part, "-m", machine, "-o", out)
    assert "no program: " in ran(capsys, part, "-m", machine, "-o", out, "--target", "linuxcnc", code=3)


def test_joint_programs_are_not_taken_for_paths(part, out, capsys):
    said = told(capsys, part, "-m", "linear_delta", "-o", out, "--target", "joints")
    assert main(["post", said["files"]["program"], "-m", "linear_delta", "-o", str(out)]) == 2
    assert "a program of joint positions" in capsys.readouterr().err


def test_a_turn_that_the_machine_has_not_is_noted(part, out, capsys):
    part.write_text("G0 X0 Y0 Z300 C0\nG1 X10 C90 F600\n")
    assert any(
        "can't" in note["text"] and note["line"] == 2
        for note in told(capsys, part, "-m", "linear_delta", "-o", out)["notes"]
    )
