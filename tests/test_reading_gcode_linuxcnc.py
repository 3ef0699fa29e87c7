"""G-code against LinuxCNC's own interpreter: what it refuses is refused, and what is read is read as there."""

import math
import os
import random
import re
import shutil
import subprocess
from dataclasses import dataclass

import numpy as np
import pytest
from gcode_model import Program

from parakin.errors import InputError
from parakin.toolpath.reading.gcode.reader import read_gcode

pytestmark = pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC's interpreter is not here")

PLANES = {"XY": (0, 1, 2), "XZ": (2, 0, 1), "YZ": (1, 2, 0)}
_CALL = re.compile(r"(USE_LENGTH_UNITS|SELECT_PLANE|SET_FEED_RATE|STRAIGHT_FEED|STRAIGHT_TRAVERSE|ARC_FEED)\((.*)\)")


@dataclass
class Motion:
    """A motion of LinuxCNC's interpreter: X to C at its end in mm and degrees, the feed in mm/min.

    An arc has its plane, its centre there in mm, and how often it turns, right-handed if above zero.
    """

    kind: str
    end: list[float]
    feed: float
    plane: tuple[int, int, int]
    centre: tuple[float, float] = (0.0, 0.0)
    turns: int = 0


def canonical(text, folder):
    """The motions of LinuxCNC's own interpreter and its error, empty if there is none."""
    (folder / "part.ngc").write_text(text)
    # a home of its own, for there it keeps a table of tools that another run would cut short
    run = subprocess.run(
        ["rs274", "-g", "part.ngc"], cwd=folder, env={**os.environ, "HOME": str(folder)}, capture_output=True,
        text=True, timeout=30, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert run.returncode in (0, 1), run.stderr
    motions, feed, scale, plane = [], math.nan, 1.0, PLANES["XY"]
    for line in run.stdout.splitlines():
        found = _CALL.search(line)
        if found is None:
            continue
        kind, given = found.groups()
        if kind == "USE_LENGTH_UNITS":
            scale = {"CANON_UNITS_MM": 1.0, "CANON_UNITS_INCHES": 25.4}[given]
        elif kind == "SELECT_PLANE":
            plane = PLANES[given[-2:]]
        else:
            values = [float(value) for value in given.split(",")]
            if kind == "SET_FEED_RATE":
                feed = values[0] * scale
            elif kind == "ARC_FEED":
                end = [0.0, 0.0, 0.0, *values[6:9]]
                for axis, value in zip(plane, (values[0], values[1], values[5]), strict=True):
                    end[axis] = value * scale
                centre = values[2] * scale, values[3] * scale
                motions.append(Motion(kind, end, feed, plane, centre, int(values[4])))
            else:
                motions.append(Motion(kind, [*(value * scale for value in values[:3]), *values[3:6]], feed, plane))
    return motions, run.stderr.removeprefix("executing").strip()


def read(text, folder, **options):
    """The path, or the line and the text of the error."""
    (folder / "mine.ngc").write_text(text)
    try:
        return read_gcode(folder / "mine.ngc", **options)
    except InputError as error:
        return error.line, error.message


def compare(path, motions, rounding):
    """Every motion of the path with LinuxCNC's; returns how many."""
    turns = np.zeros((len(path), 3)) if path.turns is None else path.turns
    rows = np.column_stack([path.tip, np.degrees(turns)])
    starts = np.flatnonzero(np.diff(path.line, prepend=-1))
    stops = np.append(starts[1:], len(path))
    assert len(starts) == len(motions)
    for begin, stop, motion in zip(starts, stops, motions, strict=True):
        np.testing.assert_allclose(rows[stop - 1], motion.end, atol=rounding)
        assert path.rapid[begin] == (motion.kind == "STRAIGHT_TRAVERSE")
        if not path.rapid[begin] and not math.isnan(path.feed[begin]):
            assert path.feed[begin] == pytest.approx(motion.feed, abs=rounding)
        if motion.kind == "ARC_FEED":
            compare_arc(path.tip[begin - 1 : stop], motion, rounding)
        else:
            assert stop == begin + 1
    return len(motions)


def compare_arc(tip, motion, rounding):
    first, second, along = motion.plane
    a, b = tip[:, first] - motion.centre[0], tip[:, second] - motion.centre[1]
    radius = np.hypot(a, b)
    assert radius.min() >= min(radius[0], radius[-1]) - 2 * rounding
    assert radius.max() <= max(radius[0], radius[-1]) + 2 * rounding
    swept = np.unwrap(np.arctan2(b, a), period=2 * math.pi)
    steps = np.diff(swept) * math.copysign(1, motion.turns)
    assert (steps > 0).all()
    slack = 4 * rounding / radius.min()
    assert (abs(motion.turns) - 1) * 2 * math.pi - slack <= steps.sum() <= abs(motion.turns) * 2 * math.pi + slack
    height = tip[-1, along] - tip[0, along]
    risen = tip[1:, along] - tip[0, along]
    np.testing.assert_allclose(risen, np.cumsum(steps) / steps.sum() * height, atol=rounding + slack * abs(height))


def test_random_programs(tmp_path):
    compared = 0
    for seed in range(40):
        program = Program(1000 + seed)
        motions, error = canonical(program.text, tmp_path)
        path = read(program.text, tmp_path, arc_tolerance=0.05)
        assert error == "" and len(motions) == len(program.steps)
        compared += compare(path, motions, 1.6e-3)  # four decimals of an inch
    assert compared > 1000


@pytest.mark.parametrize(
    "text",
    [
        "G1 X1", "G0 X1 X2", "X1", "G0 G1 X1 F1", "G17 G18", "M3 M5", "M7 M8", "G80 X1", "T1.5", "M3.5", "G0 X1 H1",
        "G0 X1 P1", "G0 X1 R1", "G0 X1 I1", "G61 P1", "G59.4", "G2 F1 X10", "G2 F1 X10 I5 K1",
        "G2 F1 X10 R5 I5", "G2 F1 R5", "G2 F1 X10 Y0.6 I5", "G2 F1 X10.003 R5", "G2 F1 I5 P0", "G2 F1 I5 P1.5",
        "G18 G2 F1 X1 J1", "G90.1 G2 F1 I5 X10", "G93 G1 X1", "G53", "G53 X1", "G0 G91 G53 X1", "G4", "G0 X1 N5",
        "N-1 G0 X1", "//G0 X1", "G0 X1 )", "G0 X1 (a", "G0 X1 (a (b))", "G0 X1.2.3", "G0 X.", "G0 X", "G0 X1E5",
        "G49 H1", "G0 X1 %", "G43 H1.5", "S-1 M3", "G1 X1 F-1", "G0 X(a)1", "G4 P1 G53 G0 X1", "M-3",
        "G93 F-1", "G0 X1 F-1 G93", "O5 G0 X1", "O1.5", ":5", "% x", "G0 X1 M98 P1", "/G0 X1 X2",
    ],
)  # fmt: skip
def test_what_linuxcnc_refuses_is_refused(tmp_path, text):
    assert canonical(f"G21 G0 X0 Y0 Z0\nG80\n{text}\nM2\n", tmp_path)[1] != ""
    assert read(f"G21 G0 X0 Y0 Z0\nG80\n{text}\nM2\n", tmp_path, workpiece=np.eye(3, 4))[0] == 3


@pytest.mark.parametrize(
    ("lines", "line"),
    [("F9\nG94\nG1 X1", 3), ("G1 F9 X1\nG94 X2", 2), ("G93 G1 F2 X1\nG94\nX2", 3), ("G1 F9 X1\nF0\nX2", 3)],
)
def test_feeds_that_are_forgotten(tmp_path, lines, line):
    assert "zero feed" in canonical(f"{lines}\nM2\n", tmp_path)[1]
    assert read(f"{lines}\nM2\n", tmp_path)[0] == line


def test_machine_coordinates(tmp_path):
    """G10 gives LinuxCNC the offset that the reader is told otherwise."""
    rng = random.Random(0)
    for _ in range(20):
        shift = [rng.uniform(-50, 50) for _ in range(3)]
        shift = [round(value, 3) for value in shift]
        lines = ["G0 X1 Y2 Z3"]
        for _ in range(20):
            words = [f"{letter}{rng.uniform(-20, 20):.3f}" for letter in "XYZABC" if rng.random() < 0.5] or ["X0"]
            lines.append(" ".join([rng.choice(["G53 G0", "G53 G1 F9", "G0", "G20", "G21"]), *words]))
        text = "\n".join([*lines, "M2", ""])
        motions, error = canonical("G21 G10 L2 P1 X{} Y{} Z{}\n".format(*shift) + text, tmp_path)
        assert error == ""
        workpiece = np.column_stack([np.eye(3), shift])
        assert compare(read("\n" + text, tmp_path, workpiece=workpiece), motions, 2e-3) == 21


# any blocks at all

NUMBERS = [
    "1", "2.5", "-3", "0", ".5", "-.25", "10", "7.", "+4", "0.0001", "1 2", "- 3", "00.5", "100", "5", "-5", "0.1", "-9"
]  # fmt: skip
CODES = [
    "G0", "G1", "G2", "G3", "G17", "G18", "G19", "G20", "G21", "G90", "G91", "G93", "G94", "G53", "G54", "G61", "G61.1",
    "G64", "G4", "G80", "G90.1", "G91.1", "G40", "G49", "G98", "G99", "G97", "G92.1", "G92.2", "G01", "g 1", "G1.0",
    "G00", "G03", "G28", "G41", "G81", "G10", "G92", "G38.2", "G5.2", "G7", "G69",
]  # fmt: skip
OTHERS = [
    "M3", "M5", "M0", "M8", "M9", "M7", "M48", "M49", "M6", "M1", "M60", "M03", "(c)", ";x", "/", "N5", "M2", "M30",
    "%", "(a(b))", "()", "(MSG,a)", "O100", "#1", "[1]", "X#1", "M66", "M19", "M98", "@", ",", "e", "U1", "Q1", "D1",
]  # fmt: skip


def word(rng):
    kind = rng.random()
    if kind < 0.45:
        return rng.choice("XYZXYZXYZABC") + rng.choice(NUMBERS)
    if kind < 0.62:
        return rng.choice("IJKRIJKRPPQHSFFFF") + rng.choice(NUMBERS)
    return rng.choice(CODES if kind < 0.9 else OTHERS)


def any_block(rng):
    words = [word(rng) for _ in range(rng.choice([1, 1, 2, 2, 3, 3, 4, 5]))]
    return rng.choice(["", "", "", "N7", "/"]) + rng.choice(["", " "]).join(words)


def any_arc(rng):
    def some(letters, numbers, share):
        return [letter + rng.choice(numbers) for letter in letters if rng.random() < share]

    words = [rng.choice(["G2", "G3"]), *some("XYZ", ["0", "1", "2", "-2", "4", "10"], 0.6)]
    words += some("IJK", ["0", "1", "-1", "2", "5", ".5"], 0.4) + some("R", ["1", "5", "-5", "50", ".1"], 0.3)
    return " ".join([*words, *some("P", ["1", "2", "3", "0"], 0.2), *some("F", ["10"], 0.3), *some("ABC", ["9"], 0.1)])


def ends_of(rows):
    """Without the motions that lead nowhere, which LinuxCNC makes of a bare G0 or G1."""
    kept = [np.zeros(6)]
    for row in rows:
        if np.abs(np.array(row) - kept[-1]).max() > 3e-3:
            kept.append(np.array(row))
    return kept


def test_any_blocks(tmp_path):
    rng, both, neither = random.Random(7), 0, 0
    head = "G21 G17 G90 G0 X0 Y0 Z0 A0 B0 C0\n"
    for _ in range(450):
        lines = [rng.choice([any_block, any_block, any_arc])(rng) for _ in range(rng.choice([1, 1, 2, 3]))]
        text = head + rng.choice(["", "F100\n", "F100\n"]) + "\n".join([*lines, "M2", ""])
        path = read(text, tmp_path, arc_tolerance=0.5, workpiece=np.eye(3, 4))
        motions, error = canonical(text, tmp_path)
        if isinstance(path, tuple):  # codes that LinuxCNC reads may be refused
            assert path[0] is not None, (text, path)
            neither += error != ""
            continue
        # a G1 or an offset without a motion needs no feed and no table of tools here
        if not re.search("zero feed|F word missing|not found in the tool table", error):
            assert error == "", text
            stops = np.flatnonzero(np.diff(path.line, append=-1))
            if len(stops) == len(motions):
                compare(path, motions, 1.6e-3)
            else:
                turns = np.zeros((len(path), 3)) if path.turns is None else np.degrees(path.turns)
                mine = ends_of(np.column_stack([path.tip, turns])[stops])
                np.testing.assert_allclose(mine, ends_of(motion.end for motion in motions), atol=3e-3)
            both += 1
    assert both > 70 and neither > 150
