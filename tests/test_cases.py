"""What real files and public reports show, a small input for each: the right result, or one line with file and line.

Poles, windings and rewinds are in the tests of poles; tools in test_tools.
"""

import json

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main

HEAD = "PARTNO/T\nUNITS/MM\nSPINDL/RPM,1000,CLW\nFEDRAT/500,MMPM\nGOTO/0,0,0\n"
SOLIDWORKS = "PARTNO/1\nUNIT/{unit}\nLOAD/TOOL,5\nSPINDL/3000,RPM,CLW\n"
CREO = "$$*  Pro/CLfile  Version 7.0\nPARTNO / M\nMACHIN / UNCX01, 1\nUNITS / MM\nLOADTL / 1\nSPINDL / RPM, 900, CLW\n"
NX = "TOOL PATH/A,TOOL,D10\nTLDATA/MILL,10.0,0.0,75.0,0.0,0.0\n"

# a file's text, its suffix, the line that it is refused at, and words of the message
REFUSED = [
    (HEAD + "GOHOME\n", "apt", 6, "GOHOME"),
    (HEAD + "CALL/SUB1\n", "apt", 6, "CALL"),
    (HEAD + "COPY/1,TRANSL,10,0,0,1\n", "apt", 6, "COPY"),
    (HEAD + "GOTOO/1,2,3\n", "apt", 6, "GOTO"),
    (HEAD + "GOLFT/L1\n", "apt", 6, "GOLFT"),
    (HEAD + "ROTABL/90\n", "apt", 6, "ROTABL"),
    (HEAD + "CUTCOM/LEFT\n", "apt", 6, "CUTCOM"),
    (HEAD + "MODE/INCR\n", "apt", 6, "MODE"),
    (HEAD + "TRACUT/1,0,0,5\n", "apt", 6, "TRACUT"),
    ("UNITS/MM\nRAPID\nGOTO/0,0,20\nGOTO/0,0,-2\n", "cl", 4, "a cut without a feed"),
    ("UNITS/MM\nFEDRAT/0.2,MMPR\nGOTO/0,0,0\nGOTO/9,0,0\n", "apt", 4, "a feed per revolution"),
    (HEAD + "CYCLE/DRILL,FEDTO,2.,MMPM,120.,RAPTO,3.\nGOTO/10,10,0\n", "apt", 6, "FEDTO above zero"),
    (HEAD + "CYCLE/DRILL,10.,5.,500.,MMPM\nGOTO/10,10,0\n", "apt", 6, "values by position"),
    (NX + "FEDRAT/MMPM,9\nGOTO/0,1E9,0\nCIRCLE/0,0,0,0,0,1,1E9,.1\nGOTO/-1E9,0,0\n", "cls", 6, "points"),
    ("G21 G90\nG0 X0 Y0 Z0\nG33 X1 K1\nM2\n", "nc", 3, "threading"),
    ("G21 G90\nG0 X0 Y0 Z0\nG41 D1 X5\nM2\n", "nc", 3, "radius compensation"),
    ("G21 G90\nG0 X0 Y0 Z0\nG5 X1 I1 J1\nM2\n", "nc", 3, "spline"),
    ("%\nO0001\nG21 G90\nG91 G28 Z0\nM30\n%\n", "nc", 4, "--reference"),
    ("G21 G90\nG54\nG0 X0 Y0 Z0\nG55\nG0 X1\nM2\n", "nc", 4, "G55 after G54"),
    ("G21 G90\nG0 X0 Y0 Z0\nM98 P100\nM2\n", "nc", 3, "Fanuc"),
    ("G21 G90\nG0 X0 Y0 Z0\nG187 P1\nM2\n", "nc", 3, "Haas"),
    ("%\nO1234 (FANUC 31I)\nG28 G91 Z0\nM30\n%\n", "nc", 3, "Fanuc"),
    ("%\nO1 (HAAS VF2)\nG21 G91\nG28 Z0\nM30\n%\n", "nc", 4, "Haas"),
    ("0 BEGIN PGM A MM\n1 L X+0 Y+0 FMAX\n", "nc", 1, "Heidenhain"),
    ("G21 G90\nG0 X0 Y0 Z0\nR1=5\nM2\n", "nc", 3, "Siemens"),
    ("$H\nG21\n", "nc", 1, "grbl"),
    ("G21 G90\nG0 X0 Y0 Z0\nG1 X1 F0.1 E2\nM2\n", "nc", 3, "3D printer"),
    ("G21 G90\nG0 X0 Y0 Z0\nG17 G2 X1 Y0 R90000000\nM2\n", "nc", 3, ""),
]

# a file's text, its suffix, and where its last record is
READ = [
    (NX + "MSYS/0,0,0,1,0,0,0,1,0\nRAPID\nGOTO/0,0,50\nGOHOME/0,0,120\nEND-OF-PATH\n", "cls", [0, 0, 120]),
    (
        SOLIDWORKS.format(unit="INCH") + "RAPID/\nGOTO/1.0,2.0,1.0\nFEDRAT/10.,IPM\nGOTO/1,2,-.5\n",
        "apt",
        [25.4, 50.8, -12.7],
    ),
    (
        SOLIDWORKS.format(unit="MM") + "RAPID/\nGOTO/5,5,25\nCYCLE/DRILL,FEDTO,2.,MMPM,120.,RAPTO,3.\nGOTO/5,5,0\n",
        "apt",
        [5, 5, 3],
    ),
    (
        CREO + "RAPID\nGOTO / 0, 0, 50\nCYCLE / DRILL, DEPTH, 20.0, MMPM, 100.0, CLEAR, 3.0\nGOTO / 0, 0, 0\nFINI\n",
        "ncl",
        [0, 0, 3],
    ),
    (HEAD + "GODLTA/1,2,3\n", "apt", [1, 2, 3]),
    ("G21 G90 G17\nG0 X10 Y0 Z0\nG1 Z-1 F100\nG2 X0 Y-10 I-10 J0 K0\nM2\n", "nc", [0, -10, -1]),
    ("G21 G90\nG0 X0 Y0 Z5\nG1 Z-1 F100\nX10\nM2\n%\n", "nc", [10, 0, -1]),
    ("G21 G90\nG0 X0 Y0 Z5\nG1 Z-1 F100\nX10\n%\n", "nc", [10, 0, -1]),
    ("G21 G90\nG1 Z5 F500\nG0 X0 Y0\nG1 Z-1 F100\nX10\nM2\n", "nc", [10, 0, -1]),
    ("G21 G90\n#1=5\n#<deep>=[#1*2]\nG0 X0 Y0 Z#1\nG1 X[#<deep>+1] F100\nM2\n", "nc", [11, 0, 5]),
    ("G21 G90\nG0 X0 Y0 Z9\nG98 G81 X10 Y0 Z-2 R3 F90\nG80\nM2\n", "nc", [10, 0, 9]),
    ("G21 G90\nG0 X0 Y0 Z9\nG99 G83 X10 Y0 Z-2 R3 Q1 F90\nG80\nM2\n", "nc", [10, 0, 3]),
    ("G21 G90\nG92.1\nG0 X0 Y0 Z0\nG92 X5\nG1 X7 F100\nM2\n", "nc", [2, 0, 0]),
    ("G21 G90 G40 D1\nG0 X0 Y0 Z0\nG1 X1 F100\nM2\n", "nc", [1, 0, 0]),
    ("o100 sub\nG1 X[#1] F100\no100 endsub\nG21 G90\nG0 X0 Y0 Z0\no100 call [4]\nM2\n", "nc", [4, 0, 0]),
]


@pytest.fixture
def write(tmp_path):
    def writes(text, suffix):
        path = tmp_path / f"part.{suffix}"
        path.write_text(text)
        return path

    return writes


@pytest.mark.parametrize(("text", "suffix", "line", "words"), REFUSED)
def test_refused_in_one_line(text, suffix, line, words, write, capsys):
    path = write(text, suffix)
    assert main(["post", str(path), "-m", "tricept", "-o", str(path.parent / "out")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert said.err.startswith(f"{path}:{line}: ") and words in said.err
    assert not (path.parent / "out").exists()


@pytest.mark.parametrize(("text", "suffix", "last"), READ)
def test_read_as_it_is_meant(text, suffix, last, write):
    path = pk.read_path(write(text, suffix))
    assert path.tip[-1].tolist() == pytest.approx(last, abs=1e-9)


def post(capsys, path, *options, code=0, machine="tricept"):
    arguments = [str(path), "-m", machine, "-o", str(path.parent / "out"), *options]
    assert main(["post", *arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    ("head", "sign", "turn"),
    [(CREO, "-", -90.0), (SOLIDWORKS.format(unit="MM"), "", 90.0), (NX, "", -90.0)],
)
def test_arcs_go_the_way_of_their_dialect(head, sign, turn, write):
    text = f"RAPID\nGOTO/0,20,30\nFEDRAT/500,MMPM\nGOTO/0,20,10\nCIRCLE/0,0,10,0,0,{sign}1,20\nGOTO/{{}},0,10\n"
    end = 20 if turn < 0 else -20
    path = pk.read_path(write(head + text.format(end), "apt"))
    angle = np.unwrap(np.arctan2(path.tip[1:, 1], path.tip[1:, 0]))
    assert np.degrees(angle[-1] - angle[0]) == pytest.approx(turn)


def test_a_file_of_nx_tells_its_frame_and_its_axis_is_upright_again(write, capsys):
    msys = "MSYS/393.0,-297.5,3.0,0.0,1.0,0.0,1.0,0.0,0.0\n"
    path = write(NX + msys + "RAPID\nGOTO/0,0,30,0,0,1\nFEDRAT/MMPM,500\nGOTO/40,0,0\nEND-OF-PATH\n", "cls")
    said = post(capsys, path, "--workpiece", "0,0,-1400", code=3)
    frame = next(note for note in said["notes"] if "the file's frame" in note["text"])
    assert frame["line"] == 3 and "origin 393, -297.5, 3 mm" in frame["text"] and "Z along 0, 0, -1" in frame["text"]
    assert post(capsys, path, "--workpiece", "0,0,-1450", "--frame", "ignore")["verdict"] == "ok"
    text = NX + "RAPID\nGOTO/0,0,50,0.5,0,0.8660254\n" + NX.replace("/A", "/B") + "RAPID\nGOTO/20,0,50\n"
    assert pk.read_path(write(text, "cls")).axis[-1].tolist() == [0.0, 0.0, 1.0]


def test_turns_without_tool_centre_point_control_are_told(write, capsys):
    text = "G21 G90 G17 G54\nG0 X0 Y0 Z60 A0 C0\nG1 X20 Y0 Z30 A-20 C45 F500\nM2\n"
    said = post(capsys, write(text, "ngc"), "--workpiece", "0,0,-1500")
    assert any(note["line"] == 2 and "without tool centre point control" in note["text"] for note in said["notes"])
    told = post(capsys, write(text.replace("G54\n", "G54\nG43.4 H1\n"), "ngc"), "--workpiece", "0,0,-1500")
    assert any("tool centre point control" in note["text"] for note in told["notes"])
    assert told["joints"] == said["joints"]


def test_unknown_words_that_only_inform_are_listed_once(write):
    path = pk.read_path(write(CREO + "CLAMP/1\nCLAMP/2\nPIVOTZ/10\nRAPID\nGOTO / 0, 0, 50\nFINI\n", "ncl"))
    texts = [note.text for note in path.notes]
    assert texts.count("words that only inform: CLAMP") == 1
    assert any("unknown word 'PIVOTZ'" in text for text in texts)


def test_stops_dwells_coolant_and_messages_pass_in_order(write, capsys):
    text = HEAD + (
        "COOLNT/FLOOD\nSTOP\nOPSTOP\nDELAY/1.5\nDELAY/100,REV\nINSERT/M117\nPPRINT half way\nGOTO/20,0,0\n"
        "COOLNT/OFF\nGOTO/30,0,0\nSPINDL/OFF\nFINI\n"
    )
    said = post(capsys, write(text, "apt"), "--workpiece", "0,0,-1450", "--target", "linuxcnc")
    assert said["waits"] == pytest.approx(1.5 + 6.0)
    with open(said["files"]["program"]) as file:  # noqa: PTH123
        lines = [line.strip() for line in file]
    wanted = ["S1000 M3", "M8", "M0", "M1", "G4 P1.5", "G4 P6", "M117", "( line 12: PPRINT half way )", "M9", "M5"]
    assert [line for line in lines if line in wanted] == wanted


@pytest.mark.parametrize(
    "text", ["G0 X0 Y0 Z0\nG1 X1000 B90 F1\n", "G21\nG0 X0 Y0 Z0 B0\nG1 X9 B170 C170 F100\nX0 B0\n"]
)
def test_far_out_of_reach_is_told_in_seconds(text, write, capsys):
    said = post(capsys, write("G21 G90\n" + text + "M2\n", "ngc"), code=3)
    assert said["first"]["line"] >= 2


def test_far_records_by_the_ten_thousand_end_soon(write, monkeypatch):
    """A path that is off limits all over is told so at once; what lies between its records changes nothing."""
    rng = np.random.default_rng(0)
    axes = rng.normal(0.0, 0.1, (30, 3)) + [0.0, 0.0, 1.0]
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    rows = np.column_stack([rng.uniform(-1.0, 1.0, (30, 3)) + [5000.0, 0.0, 0.0], axes])
    text = "UNITS/MM\nFEDRAT/500,MMPM\n" + "".join(f"GOTO/{','.join(f'{v:.6f}' for v in row)}\n" for row in rows)
    path = pk.read_path(write(text, "apt"))
    monkeypatch.setattr("parakin.toolpath.job._MOST_BROKEN", 20)
    job = pk.prepare(load_shipped("tricept"), path)
    assert job.inserted == 0 and job.posted.broken_record_count == 30 and not job.runs
    assert job.unplanned.startswith("off limits at more than 20 records")


def test_nearly_full_circles_upright_run_with_a_program(write, capsys):
    """An upright tool on a wrist's pole, on circles that end where they start, or a little beside."""
    arcs = ["G3 X0 Y0.001 I20 J0 F100", "G3 X0 Y-0.001 I20 J0", "G3 I30 J0", "G2 X0 Y0.00001 I20 J0"]
    text = "G21 G90\n" + "".join(f"G0 X0 Y0 Z0\n{arc}\n" for arc in arcs) + "M2\n"
    path = write(text, "ngc")
    said = post(capsys, path, "--workpiece", "0,0,-1400", "--target", "linuxcnc")
    assert said["verdict"] == "ok" and "program" in said["files"]
    read = pk.read_path(path)
    length = np.linalg.norm(np.diff(read.tip, axis=0), axis=1).sum()
    # at the circle's left G3 goes down and G2 up: the first and the third go all round, the others are that short
    assert length == pytest.approx(2 * np.pi * (20 + 30), rel=1e-3)
