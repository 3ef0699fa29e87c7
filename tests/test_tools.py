"""Tool lengths in the kinematics, tool changes, and the options that say how a file is read."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.errors import InputError
from parakin.toolpath.reading.tool_table import read_tool_table

NX = """\
TOOL PATH/A,TOOL,BALL
TLDATA/MILL,10.0,5.0,{length},0.0,0.0
LOAD/TOOL,1
SPINDL/RPM,8000,CLW
RAPID
GOTO/-60,0,50,0.1,0,0.99498744
FEDRAT/MMPM,1250
GOTO/-60,0,0
GOTO/-20,30,5,0.2,-0.1,0.9746794
GOTO/60,20,0,0.3,0.1,0.9486833
RAPID
GOTO/60,20,50
END-OF-PATH
"""
CHANGE = """\
TOOL PATH/OP1,TOOL,D10
TLDATA/MILL,10.0,0.0,75.0,0.0,0.0
LOAD/TOOL,1
SPINDL/RPM,5000,CLW
COOLNT/ON
RAPID
GOTO/0,0,30,0,0,1
FEDRAT/MMPM,500
GOTO/20,0,0
{away}END-OF-PATH
TOOL PATH/OP2,TOOL,BALL6
TLDATA/MILL,6.0,3.0,{second},0.0,0.0
LOAD/TOOL,2
SPINDL/RPM,9000,CLW
RAPID
GOTO/0,20,30
FEDRAT/MMPM,500
GOTO/20,20,0
END-OF-PATH
"""
AWAY = "RAPID\nGOTO/20,0,30\n"
TABLE = "T1 P1 Z+120.5 D10 ;ball mill\n\nT2 P2 X0 Y0 Z80.25 D6\n"
NGC = """\
G21 G90 G17 G40 G49 G54
T2 M6
S6000 M3
M8
G0 X0 Y0 Z30
G1 Z0 F600
X20
G0 Z30
T3 M6
S3000 M4
G0 X0 Y20
G1 Z0 F600
G4 P0.5
X20
G0 Z30
M5
M30
"""
PLACE = pk.workpiece(Z=-1450)


@pytest.fixture
def write(tmp_path):
    def writes(text, name="part.cls"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return writes


@pytest.fixture(scope="module")
def tricept():
    return load_shipped("tricept")


def post(capsys, path, *options, code=0, machine="tricept", place="0,0,-1450"):
    arguments = [str(path), "-m", machine, "--workpiece", place, "-o", str(path.parent / "out"), *map(str, options)]
    assert main(["post", *arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def refusal(capsys, path, *options):
    assert main(["post", str(path), "-m", "tricept", "--workpiece", "0,0,-1450", *map(str, options)]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


# lengths


@pytest.mark.parametrize("length", [75.0, 110.0, 190.0])
def test_the_joints_are_those_of_a_machine_with_that_tool(tricept, write, length):
    path = pk.fit_tool_lengths(tricept, pk.read_path(write(NX.format(length=length))), "file")
    job = pk.prepare(tricept, path, workpiece=PLACE)
    posted = job.posted
    assert posted.first is None and job.trajectory is not None
    other = pk.load("tricept", {"l2": f"{length} mm"})  # an independent machine, whose own tool is so long
    tips = posted.path.tip - posted.path.extension[:, None] * posted.path.axis
    poses = posted.poses.copy()
    poses[:, :3] = tips + [0.0, 0.0, -1450.0]
    assert np.abs(other.inverse(poses, posted.mode)[:, :3] - posted.joints[:, :3]).max() < 1e-6
    # and the tip of the real tool keeps to the programmed lines where the controller moves the pose evenly
    s = np.linspace(0.0, 1.0, 21)[:, None]
    programmed = pk.read_path(write(NX.format(length=length))).tip + [0.0, 0.0, -1450.0]
    for a, b in zip(posted.poses[:-1], posted.poses[1:], strict=True):
        between = a + s * (b - a)
        ks = np.column_stack([np.sin(between[:, 3]) * np.cos(between[:, 4]),
                              np.sin(between[:, 3]) * np.sin(between[:, 4]), np.cos(between[:, 3])])  # fmt: skip
        real = between[:, :3] - (length - 150.0) * ks
        assert measure_distance(real, programmed).max() < 0.005 + 1e-6  # half the tolerance


def measure_distance(points, corners):
    """The distance of points (n, 3) from a polygon's lines, (n,)."""
    a, d = corners[:-1], np.diff(corners, axis=0)
    along = np.einsum("nkj,kj->nk", points[:, None] - a, d) / np.maximum((d * d).sum(1), 1e-30)
    nearest = a + np.clip(along, 0.0, 1.0)[..., None] * d
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(1)


def test_the_real_tip_keeps_the_feed(tricept, write):
    path = pk.fit_tool_lengths(tricept, pk.read_path(write(NX.format(length=60.0))), "file")
    trajectory = pk.prepare(tricept, path, workpiece=PLACE).trajectory
    sample = trajectory.sample(2000.0)
    b, c = sample.poses[:, 3], sample.poses[:, 4]
    axis = np.column_stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)])
    tip = sample.poses[:, :3] + 90.0 * axis
    speed = np.linalg.norm(np.diff(tip, axis=0), axis=1) * 2000.0
    cutting = (np.abs(tip[:-1, 0]) < 59.0) & (np.abs(tip[1:, 0]) < 59.0)
    assert speed[cutting].max() < 1250 / 60 * 1.02


def test_a_length_that_contradicts_the_machine_is_refused(write, capsys):
    long = write(NX.format(length=300.0))
    said = refusal(capsys, long)
    assert said.startswith(f"{long}:2: tool 1 BALL has a cutter of 300 mm") and "--tool-length" in said
    told = write("LOADTL/1,LENGTH,140\nFEDRAT/500,MMPM\nGOTO/0,0,50\nGOTO/20,0,0\n", "told.apt")
    assert refusal(capsys, told).startswith(f"{told}:1: tool 1 is 140 mm long, the tool of tricept is 150 mm long")
    gcode = write("G21 G90\nG10 L1 P1 Z120\nG43 H1\nG0 X0 Y0 Z50\nG1 X20 F500\nM2\n", "a.ngc")
    assert refusal(capsys, gcode).startswith(f"{gcode}:3: the tool is 120 mm long")
    for path in (long, told, gcode):
        said = post(capsys, path, "--tool-length", "machine")
        assert said["tools"][-1]["length"] == 150.0 and said["tool_length"] == 150.0


def test_a_tool_on_a_machine_that_has_none_is_refused_by_its_own_length(write):
    with pytest.raises(InputError, match=r":2: tool 1 BALL is 75 mm long, the tool of orthoglide is 0 mm long"):
        pk.fit_tool_lengths(load_shipped("orthoglide"), pk.read_path(write(NX.format(length=75.0))))


UPRIGHT = re.sub(r"(GOTO/-?\d+,\d+,\d+),.*", r"\1", NX)


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        (NX, True),
        (NX.replace("LOAD/TOOL,1\n", ""), False),  # a cutter; which tool holds it is the operator's affair
        (UPRIGHT, False),
        (UPRIGHT.replace("0,50\nFEDRAT", "0,50,0,0.01,0.99995\nFEDRAT"), True),
        (UPRIGHT.replace("END-OF-PATH", "TOOL PATH/B,TOOL,BALL\nRAPID\nGOTO/0,0,60,0.1,0,0.99498744"), True),
    ],
)
def test_the_length_of_a_loaded_tool_that_tilts_has_to_be_the_machines(text, refused, write, capsys):
    path = write(text.format(length=75.0))
    if refused:
        said = f"{path}:2: tool 1 BALL is 75 mm long by TLDATA and tilts, the tool of tricept is 150 mm long"
        assert refusal(capsys, path).startswith(said)
    else:
        assert post(capsys, path)["tools"][0]["length"] == 150.0
    assert post(capsys, path, "--tool-length", "machine")["tools"][0]["length"] == 150.0
    assert post(capsys, write(text.format(length=150.0)))["verdict"] == "ok"


def test_joints_hang_on_the_length(write, capsys):
    joints = {}
    for options in ("75", "150", "machine", "file"):
        said = post(capsys, write(NX.format(length=75.0)), "--tool-length", options)
        joints[options] = [joint["max"] for joint in said["joints"][:3]]
        assert said["tools"][0]["length"] == (75.0 if options in ("75", "file") else 150.0)
        assert said["tools"][0]["cutter_length"] == 75.0
    assert joints["75"] == joints["file"] and joints["150"] == joints["machine"]
    assert abs(joints["75"][0] - joints["150"][0]) > 30.0


def test_lengths_are_told_in_summary_report_and_program(write, capsys):
    path = write(NX.format(length=75.0))
    out = path.parent / "out"
    options = [
        "-m",
        "tricept",
        "--workpiece",
        "0,0,-1450",
        "-o",
        str(out),
        "--target",
        "linuxcnc",
        "--tool-length",
        "75",
    ]
    assert main(["post", str(path), *options]) == 0
    said = "tool 1 BALL: 75 mm from the spindle's nose to its tip, the machine's own is 150"
    assert said in capsys.readouterr().out
    program = (out / "part.linuxcnc.ngc").read_text()
    assert f"( {said} )" in program and "( part zero at X 0 Y 0 Z -1450 in the machine )" in program
    assert said.replace("'", "&#x27;") in (out / "part.report.html").read_text()
    # of a tool that the file does not load the machine's own counts, and the cutter is told wherever the length is
    write(NX.format(length=75.0).replace("LOAD/TOOL,1\n", ""))
    assert main(["post", str(path), *options[:-2]]) == 0
    said = "150 mm from the spindle's nose to its tip, the machine's own length, 75 mm of it the file's cutter"
    assert said in capsys.readouterr().out and said in (out / "part.linuxcnc.ngc").read_text()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--tool-length", "-3"], "--tool-length: 0 to 10000 mm expected"),
        (["--tool-length", "long"], "--tool-length: length"),
        (["--tool-length", "75", "--tools", "x"], "--tool-length: --tools tells the lengths"),
        (["--tools", "nowhere.tbl"], "nowhere.tbl: cannot be read"),
        (["--start", "X=1"], "--start: only a G-code program"),
        (["--start", "X=1,X=2"], "--start: X is given twice"),
        (["--reference", "Q=1"], "--reference: unknown axis"),
        (["--reference", "1,2"], "--reference: '1'"),
    ],
)
def test_mistaken_options(options, said, write, capsys):
    assert said.strip("'") in refusal(capsys, write(NX.format(length=75.0)), *options).replace('"', "'")


# tables


def test_a_tool_table(write):
    assert read_tool_table(write(TABLE, "t.tbl")) == {1: 120.5, 2: 80.25}


@pytest.mark.parametrize(
    ("text", "line"),
    [("T1 P1 Z-5\n", 1), ("T1 Z5\nT1 Z6\n", 2), ("P1 Z5\n", 1), ("T1 Z5 hello\n", 1), ("T1 X2 Z5\n", 1), (";\n", None)],
)
def test_tables_that_are_refused(text, line, write):
    with pytest.raises(InputError) as caught:
        read_tool_table(write(text, "t.tbl"))
    assert caught.value.line == line and "\n" not in str(caught.value)


def test_a_table_goes_before_the_file(write, capsys):
    table = write(TABLE, "t.tbl")
    said = post(capsys, write(CHANGE.format(away=AWAY, second=50.0)), "--tools", table)
    assert [(tool["number"], tool["length"]) for tool in said["tools"]] == [(1, 120.5), (2, 80.25)]
    ngc = write(NGC, "a.ngc")
    assert refusal(capsys, ngc, "--tools", table).startswith(f"{ngc}:9: tool 3 is not in the tool table")
    table.write_text("T2 Z100\nT3 Z160\n")
    said = post(capsys, ngc, "--tools", table)
    assert [tool["length"] for tool in said["tools"]] == [100.0, 160.0]


def test_the_table_of_a_configuration_leaves_all_to_the_machine(write, tricept, capsys):
    own = dict(pk.make_linuxcnc_configuration(tricept))["tricept.tbl"]
    table = write(own if isinstance(own, str) else own.decode(), "tricept.tbl")
    assert read_tool_table(table) == {1: 0.0}
    ngc = write(NGC.replace("T2", "T1").replace("T3 M6\n", "G43 H1\n"), "a.ngc")
    said = post(capsys, ngc, "--tools", table)
    assert [tool["length"] for tool in said["tools"]] == [150.0]
    table.write_text("T1 Z0\nT2 Z80\n")
    assert refusal(capsys, write(CHANGE.format(away=AWAY, second=50.0)), "--tools", table).count("length 0 in the tool")


def test_offsets_of_known_length_count_where_they_are_in_force(write, capsys, tricept):
    table = write("T1 Z100\n", "t.tbl")
    text = "G21 G90\nG0 X0 Y0 Z150\nT1 M6\nG43 H1\nG0 Z50\nG1 X20 F500\nM2\n"
    path = pk.fit_tool_lengths(tricept, pk.read_path(write(text, "a.ngc"), tools=read_tool_table(table)))
    assert path.extension.tolist()[-2:] == [-50.0, -50.0] and path.extension[0] == -150.0


# changes


@pytest.mark.parametrize("away", [AWAY, ""])
@pytest.mark.parametrize("second", [50.0, 75.0, 90.0])
def test_the_tool_is_withdrawn_before_a_change(tricept, write, away, second):
    path = pk.fit_tool_lengths(tricept, pk.read_path(write(CHANGE.format(away=away, second=second))))
    tips = path.tip - (0.0 if path.extension is None else path.extension[:, None] * path.axis)
    at = path.tools[1].record
    last = np.array([20.0, 0.0, 30.0 if away else 0.0])
    longer = max(0.0, second - 75.0)
    if away and second == 75.0:
        assert at == 3 and len(path) == 5
    else:
        old = tips[at - 1]
        assert np.allclose(old, last + [0.0, 0.0, longer + (0.0 if away else 20.0)]) and path.rapid[at - 1]
        assert np.allclose(path.tip[at], path.tip[at - 1])  # the holder stands still while the tool is changed
        new = tips[at]
        assert new[2] >= last[2] - 1e-9  # no tool is put in deeper than the one before
    assert [event.record for event in path.events if event.text == "LOAD/TOOL,2"] == [at]


@pytest.mark.parametrize(
    ("text", "name", "change"),
    [
        ("G21 G90\nT1 M6\nG0 X0 Y0 Z5\nG1 Z0 F60\nM63 P0\nG4 P2\nM9\nM5\nT2 M6\nM64 P1\nG0 X5\nM2\n", "a.ngc", "T2"),
        ("UNITS/MM\nLOADTL/1\nFEDRAT/60\nGOTO/0,0,5\nGOTO/0,0,0\nAUXFUN/63\nDELAY/2\nCOOLNT/OFF\nSPINDL/OFF\n"
         "LOADTL/2\nAUXFUN/64\nGOTO/5,0,0\n", "a.apt", "LOADTL/2"),
    ],
)  # fmt: skip
def test_what_is_said_before_a_change_happens_where_it_was_said(tricept, write, text, name, change):
    path = pk.fit_tool_lengths(tricept, pk.read_path(write(text, name)))
    height = {event.text: path.tip[event.record - 1, 2] for event in path.events if event.record}
    said = list(height)
    first = next(k for k, text in enumerate(said) if "63" in text)
    assert [height[text] for text in said[first : first + 5]] == [0, 0, 20, 20, 20] and change in said[first + 4]
    assert next(height[text] for text in said if "64" in text) == 20
    assert [event.record for event in path.events] == sorted(event.record for event in path.events)


@pytest.mark.parametrize("text, name", [(CHANGE.format(away=AWAY, second=50.0), "a.cls"), (NGC, "a.ngc")])
@pytest.mark.parametrize("target", ["linuxcnc", "joints"])
def test_spindle_and_coolant_stop_before_a_change(text, name, target, write, capsys):
    path = write(text, name)
    said = post(capsys, path, "--target", target)
    lines = Path(said["files"]["program"]).read_text().splitlines()
    lines = [line for line in lines if not line.startswith(("G53", "G1 "))]
    stop = lines.index("M0")
    assert "M5" in lines[stop - 5 : stop] and "M9" in lines[stop - 5 : stop]
    before, after = lines[:stop], lines[stop + 1 :]
    assert "M8" in before and "M8" not in after  # only the file starts it again
    assert [line for line in after if re.match(r"S\d+|M[34]$", line)]
    assert any(line.startswith("(MSG,tool ") and "length" in line for line in before)
    assert lines.count("M0") == 1


def test_a_spindle_that_is_not_started_again_is_told(write, tricept):
    text = CHANGE.format(away=AWAY, second=75.0)
    assert "spindle stands" not in str(pk.fit_tool_lengths(tricept, pk.read_path(write(text))).notes)
    path = pk.fit_tool_lengths(tricept, pk.read_path(write(text.replace("SPINDL/RPM,9000,CLW\n", ""))))
    assert [note.line for note in path.notes if "spindle stands" in note.text] == [19]


def test_two_tools_have_each_its_own_length(write, capsys):
    said = post(capsys, write(CHANGE.format(away=AWAY, second=50.0)))
    assert [tool["length"] for tool in said["tools"]] == [150.0, 125.0]
    longer = write(CHANGE.format(away=AWAY, second=200.0))
    assert refusal(capsys, longer).startswith(f"{longer}:14: tool 2 BALL6 has a cutter of 200 mm")
    assert [tool["length"] for tool in post(capsys, longer, "--tool-length", "file")["tools"]] == [75.0, 200.0]


# codes that pass through


def test_codes_pass_through_in_order(write, capsys):
    codes = ["M62 P1", "M64 P2", "M121 P3 Q4", "M65 P2", "M63 P1", "M68 E0 Q2.5", "M21"]
    text = (
        "G21 G90\nG0 X0 Y0 Z0\n" + "".join(f"{code}\nG1 X{10 * k} F600\n" for k, code in enumerate(codes, 1)) + "M2\n"
    )
    said = post(capsys, write(text, "a.ngc"), "--target", "linuxcnc")
    lines = Path(said["files"]["program"]).read_text().splitlines()
    assert [line for line in lines if line in codes] == codes


def test_what_cannot_be_passed_is_refused(write, capsys):
    path = write("FEDRAT/500,MMPM\nGOTO/0,0,0\nAUXFUN/30\nGOTO/9,0,0\n")
    said = post(capsys, path, "--target", "linuxcnc", code=3)
    assert said["missing"][0].startswith(f"no program: {path}:3: AUXFUN/30 can't be passed on")
    path.write_text("FEDRAT/500,MMPM\nGOTO/0,0,0\nAUXFUN/62\nGOTO/9,0,0\n")
    assert "\nM62\n" in Path(post(capsys, path, "--target", "linuxcnc")["files"]["program"]).read_text()


# how a file is read


def test_the_start_and_the_reference_point(write, capsys):
    path = write("G21 G90\nG1 X20 F600\nG28\nM2\n", "a.ngc")
    assert "a stated reference" not in refusal(capsys, path, "--start", "0,0,10")
    assert refusal(capsys, write("G21 G91\nG1 X20 F600\nM2\n", "b.ngc")).endswith("in G90 before, or --start")
    said = post(capsys, path, "--start", "X=0,Y=0,Z=10", "--reference", "X=5,Y=6,Z=-1400")
    assert said["records"] >= 3
    read = pk.read_path(path, start={"X": 0.0, "Y": 0.0, "Z": 10.0}, reference={"X": 5.0, "Y": 6.0, "Z": -1400.0},
                        workpiece=PLACE)  # fmt: skip
    assert read.tip.tolist() == [[0.0, 0.0, 10.0], [20.0, 0.0, 10.0], [5.0, 6.0, 50.0]]


def test_the_files_frame_is_taken_or_ignored(write, capsys):
    msys = "MSYS/10,20,-30,0,1,0,-1,0,0\n"
    path = write(NX.format(length=150.0).replace("LOAD", msys + "LOAD"))
    said = post(capsys, path)
    assert np.allclose(np.array(said["frame"])[:, 3], [10.0, 20.0, -1480.0]) and said["file_frame"] is not None
    assert any("the file's frame: origin 10, 20, -30 mm" in note["text"] for note in said["notes"])
    said = post(capsys, path, "--frame", "ignore")
    assert np.allclose(np.array(said["frame"])[:, 3], [0.0, 0.0, -1450.0]) and said["file_frame"] is None
    assert any(note["text"].endswith("ignored") for note in said["notes"])


# the first file of a newcomer


@pytest.mark.parametrize("name", ["tricept", "hexapod", "lambda6"])
def test_a_file_about_its_own_zero_is_told_where_it_would_fit(name, write, capsys):
    path = write("G21 G90\nG0 X0 Y0 Z10\nG1 Z-2 F600\nX60\nY40\nG0 Z10\nM2\n", "first.ngc")
    out = path.parent / "out"
    assert main(["post", str(path), "-m", name, "-o", str(out)]) == 3
    text = capsys.readouterr().out
    line = next(line for line in text.splitlines() if "outside the workspace" in line)
    assert "would be" not in text  # not the limits that it breaks
    assert main(["post", str(path), "-m", name, "-o", str(out), "--json"]) == 3
    outside = json.loads(capsys.readouterr().out)["outside"]
    assert outside["option"] in line and outside["off_limits_there"] == 0
    assert outside["path"]["X"] == [0.0, 60.0] and outside["workspace"]["Z"][0] < outside["workspace"]["Z"][1]
    assert "outside the workspace" in (out / "first.report.html").read_text()
    option, value = outside["option"].split(" ")
    assert main(["post", str(path), "-m", name, "-o", str(out), option, value, "--json"]) == 0
    posted = json.loads(capsys.readouterr().out)
    assert posted["verdict"] == "ok" and posted["outside"] is None


def test_a_part_that_is_off_limits_in_part_is_not_outside(write, capsys):
    path = write("G21 G90\nG0 X0 Y0 Z0\nG1 X60 F600\nX2500\nM2\n", "wide.ngc")
    assert post(capsys, path, code=3)["outside"] is None


def test_a_part_that_fits_not_at_home_is_looked_for(write, capsys):
    path = write("G21 G90\nG0 X-800 Y0 Z0\nG1 X800 F6000\nZ700\nM2\n", "large.ngc")
    assert main(["post", str(path), "-m", "tricept", "-o", str(path.parent / "out"), "--json"]) == 3
    outside = json.loads(capsys.readouterr().out)["outside"]
    assert outside["off_limits_there"] > 0 and "--place X=" in outside["text"]
    option, value = re.search(r"(--place) (\S+)", outside["text"]).groups()
    assert main(["post", str(path), "-m", "tricept", "-o", str(path.parent / "out"), option, value]) in (0, 3)


@pytest.mark.parametrize(
    "options",
    [
        {"start": {"Q": 1.0}},
        {"start": {"X": "5"}},
        {"tools": {1: "x"}},
        {"tools": {"a": 1.0}},
        {"reference": {"X": np.nan}},
    ],
)
def test_mistaken_arguments_of_the_reader(options, write):
    with pytest.raises(pk.ParakinError) as caught:
        pk.read_path(write(NGC, "a.ngc"), **options)
    assert str(caught.value).startswith(next(iter(options)))
