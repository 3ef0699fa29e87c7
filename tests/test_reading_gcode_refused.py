"""G-code: every refusal with its line."""

import math

import pytest
from gcode_reading import both_error, both_reader, refused

from parakin.errors import InputError
from parakin.toolpath.reading.detect import read_path
from parakin.toolpath.reading.gcode.reader import read_gcode


@pytest.fixture
def both(tmp_path, monkeypatch):
    return both_reader(tmp_path, monkeypatch)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("G0 X1\nX\n", 2, ["X without a number"]),
        ("G0 X1 X2\n", 1, ["two X words"]),
        ("G0 X1 Y2 x3\n", 1, ["two X words"]),
        ("X1\n", 1, ["X without a motion code"]),
        ("G0 X1\nG80\nX2\n", 3, ["without a motion code"]),
        ("G0 X1\nG80 X2\n", 2, ["without a motion code"]),
        ("G0 G1 X1 F1\n", 1, ["G0 and G1", "modal group"]),
        ("G0 G0 X1\n", 1, ["G0 and G0"]),
        ("G17 G18\n", 1, ["G17 and G18"]),
        ("G54 G59.2\n", 1, ["G54 and G59.2"]),
        ("G61 G64\n", 1, ["G61 and G64"]),
        ("G4 P1 G53 G0 X1\n", 1, ["G4 and G53"]),
        ("G43 G49\n", 1, ["G43 and G49"]),
        ("M3 M5\n", 1, ["M3 and M5", "modal group"]),
        ("M7 M8\n", 1, ["M7 and M8"]),
        ("M2 M30\n", 1, ["M2 and M30"]),
        ("M3 M8 M48 M6 M0\n", 1, ["more than 4 M codes"]),
        ("G1 X1\n", 1, ["G1 without a feed"]),
        ("G0 X1\nF0\nG1 X2\n", 3, ["G1 without a feed"]),
        ("G0 X1 F-1\n", 1, ["feed below zero"]),
        ("G93 G1 X1 F5\nX2\n", 2, ["G93", "F"]),
        ("G93 G1 X1 F0\n", 1, ["F0"]),
        ("F5\nG93 G1 X1 F1\nG94 X2\n", 3, ["without a feed"]),
        ("S-1\n", 1, ["below zero"]),
        ("T1.5\n", 1, ["T1.5", "whole"]),
        ("T-1\n", 1, ["T-1"]),
        ("M3.5\n", 1, ["M3.5"]),
        ("M-3\n", 1, ["M-3"]),
        ("G-1 X1\n", 1, ["G-1"]),
        ("G1.23 X1\n", 1, ["G1.23"]),
        ("G999999999\n", 1, ["G999999999"]),
        ("G95 F1\n", 1, ["G95", "per revolution"]),
        ("G96 S1\n", 1, ["G96"]),
        ("G10 L2 P1 X1\n", 1, ["G10", "offsets"]),
        ("G92 X0\n", 1, ["G92"]),
        ("G92.3\n", 1, ["G92.3"]),
        ("G52 X1\n", 1, ["G52"]),
        ("G28\n", 1, ["G28", "place this file does not tell"]),
        ("G0 X1\nG30 Z0\n", 2, ["G30", "place"]),
        ("G28.1\n", 1, ["G28.1"]),
        *[
            (f"G0 X1\n\nG{n} X1 Z1 R1\n", 3, [f"G{n}", "cycle"])
            for n in (73, 74, 76, 81, 82, 83, 84, 85, 86, 87, 88, 89)
        ],
        *[(f"G38.{n} Z1\n", 1, [f"G38.{n}", "probing"]) for n in (2, 3, 4, 5)],
        ("G33 Z1 K1\n", 1, ["G33", "threading"]),
        ("G33.1 Z1 K1\n", 1, ["G33.1"]),
        *[(f"G{n} D1\n", 1, [f"G{n}", "compensation"]) for n in ("41", "42", "41.1", "42.1")],
        *[(f"G{n} X1\n", 1, [f"G{n}", "spline"]) for n in ("5", "5.1", "5.2", "5.3")],
        ("G59.4\n", 1, ["G59.4"]),
        ("G43.5\n", 1, ["G43.5"]),
        ("G68.2\n", 1, ["G68.2"]),
        ("G7\n", 1, ["G7"]),
        *[(f"M{n}\n", 1, [f"M{n}", "M0 M1"]) for n in (10, 19, 50, 61, 62, 66, 70, 90, 200)],
        *[(f"M{n}\n", 1, [f"M{n}", "user's own"]) for n in (100, 150, 199)],
        *[(f"M{n}\n", 1, [f"M{n}", "subroutines"]) for n in (97, 98, 99)],
        ("#1=5\n", 1, ["parameters"]),
        ("G0 X#1\n", 1, ["parameters"]),
        ("G0 X#<a>\n", 1, ["parameters"]),
        ("G0 X[1+2]\n", 1, ["expressions", "not read"]),
        ("G0 X-[1]\n", 1, ["X without a number"]),
        ("G0 Xsin[30]\n", 1, ["functions"]),
        ("(a)\no100 sub\n", 2, ["O words"]),
        ("O<name> call\n", 1, ["O"]),
        ("O5 sub\n", 1, ["O words", "program number"]),
        ("O5 G21\n", 1, ["O words"]),
        ("O5 O6\n", 1, ["O words"]),
        ("G21 O5\n", 1, ["O words"]),
        ("N1 O5\n", 1, ["O words"]),
        ("/O5\n", 1, ["O words"]),
        ("O1.5\n", 1, ["O words"]),
        ("O-5\n", 1, ["O words"]),
        ("O5 (a\n", 1, ["comment without an end"]),
        ("O5 X\n", 1, ["O words"]),
        ("G21\nO5\n", 2, ["O words"]),
        ("M8\nO5\n", 2, ["O words"]),
        ("F5\nO5\n", 2, ["O words"]),
        ("O5\nO6\n", 2, ["O words"]),
        ("G0 X1\nX2\nO5\n", 3, ["O words"]),
        (":5\n", 1, ["colon"]),
        ("(py,import os)\n", 1, ["Python"]),
        ("G0 X1 ; PY , x\n", 1, ["Python"]),
        ("F-1 G93\n", 1, ["feed below zero"]),
        ("G93 G0 X1 F-1\n", 1, ["feed below zero"]),
        ("G1 F5 X1\nG94 X2\n", 2, ["without a feed", "G94"]),
        ("F5 G94\nG94\nG1 X2\n", 3, ["without a feed"]),
        ("G0 X1 %\n", 1, ["%"]),
        ("G0 X1\n%\n", 2, ["%"]),
        ("% x\n", 1, ["%"]),
        ("G0 /X1\n", 1, ["slash"]),
        ("//G0 X1\n", 1, ["slash"]),
        ("G0 X1 (a\n", 1, ["comment without an end"]),
        ("G0 X1 (a(b))\n", 1, ["comment within a comment"]),
        ("G0 X1 a)\n", 1, ["A without a number"]),
        ("G0 X1)\n", 1, ["closing bracket"]),
        ("G0 X(a)1\n", 1, ["X without a number"]),
        ("G0 X1 N5\n", 1, ["N within"]),
        ("N-5 G0 X1\n", 1, ["line number"]),
        ("G0 X1.2.3\n", 1, ["'.3'", "number without a letter"]),
        ("G0 X--1\n", 1, ["X without"]),
        ("G0 X.\n", 1, ["X without"]),
        ("G0 X1e5\n", 1, ["E5"]),
        ("G0 X1,5\n", 1, ["',5'"]),
        ("G0 X1*5\n", 1, ["'*5'"]),
        ("G0 X٣\n", 1, ["X without"]),
        ("G0 Xé\n", 1, ["X without"]),
        ("G0 @5 ^3\n", 1, ["'@5 ^3'"]),
        ("$\n", 1, ["'$'"]),
        ("hello\n", 1, ["'hello'", "names"]),
        *[(f"G0 X1\n{c}1\n", 2, [f"{c}1", "knows"]) for c in "DELUVW"],
        *[(f"G0 X1\nG0 X2 {c}1\n", 2, [f"{c}1", "no code"]) for c in "HIJKPQR"],
        ("G49 H1\n", 1, ["H1"]),
        ("G61 P1\n", 1, ["P1"]),
        ("G64 P-1\n", 1, ["P below zero"]),
        ("G43 H1.5\n", 1, ["H1.5"]),
        ("G43.1 A1\n", 1, ["G43.1"]),
        ("G43.1 Z1 G0\n", 1, ["G43.1 and G0"]),
        ("G4\n", 1, ["G4", "P"]),
        ("G4 P-1\n", 1, ["G4", "P"]),
        ("G4 G64 P1\n", 1, ["P in a block"]),
        ("F1\nG0 X0 Y0\nG2 X1 I.5 G4 P1\n", 3, ["P in a block"]),
        ("G0 X9999999999\n", 1, ["out of range"]),
        ("G0 X" + "9" * 500 + "\n", 1, ["out of range"]),
        ("G0 X1\n" + "(" + "x" * 4000 + ")\n", 2, ["4000 characters"]),
        ("G0 X1\n" + " X2" * 2_000_000, 2, ["4000 characters"]),
        ("G0 X1\n(a\x01)\n", 2, ["control character (1)"]),
        ("G0 X1\n\0\n", 2, ["NUL byte"]),
        ("G0 X1\rX2\n", 1, ["carriage return"]),
        ("G0 X1\x0c\n", 1, ["control character (12)"]),
        ("G0 X1\n".encode("utf-16"), 1, ["NUL byte", "UTF-16"]),
        ("", None, ["no motion"]),
        ("%\n%\n", None, ["no motion"]),
        ("G21\nM2\nG0 X1\n", None, ["no motion"]),
    ],
)
def test_refused_with_the_line(both, text, line, words):
    refused(both_error(both), text, line, *words)


def test_files_that_cannot_be_read(tmp_path):
    for path in (tmp_path / "none.ngc", tmp_path, str(tmp_path / "nul\0.ngc")):
        with pytest.raises(InputError, match="cannot be read"):
            read_gcode(path)
        with pytest.raises(InputError, match="cannot be read"):
            read_path(path)
    for tolerance in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="arc_tolerance"):
            read_gcode(tmp_path / "none.ngc", arc_tolerance=tolerance)
