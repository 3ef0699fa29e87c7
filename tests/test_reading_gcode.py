"""G-code: whole programs, and where the records begin."""

import math

import numpy as np
import pytest
from gcode_reading import SAMPLE, SHIFTED, both_error, both_reader, notes, refused, told


@pytest.fixture
def both(tmp_path, monkeypatch):
    return both_reader(tmp_path, monkeypatch)


# whole files


def test_a_whole_program(both):
    p = both(SAMPLE)
    assert (p.dialect, p.units, p.frame, p.turns, p.seconds) == ("gcode", "mm", None, None, None)
    np.testing.assert_array_equal(p.tip[[0, 1, 2]], [[10, 0, 50], [10, 0, 2], [10, 0, -1]])
    np.testing.assert_array_equal(p.tip[[-4, -3, -2, -1]], [[0, 10, -1], [-20, 10, -1], [-20, 0.5, -1], [-20, 0.5, 50]])
    np.testing.assert_array_equal(p.axis, np.tile([0.0, 0, 1], (len(p), 1)))
    arc = p.line == 11
    assert arc.sum() == len(p) - 6 > 10
    np.testing.assert_allclose(np.hypot(p.tip[arc, 0], p.tip[arc, 1]), 10, atol=1e-12)
    assert p.line[:3].tolist() == [8, 9, 10] and p.line[-3:].tolist() == [12, 13, 15]
    assert p.rapid.tolist() == [True, True] + [False] * (len(p) - 3) + [True]
    np.testing.assert_array_equal(p.feed[:3], [math.nan, math.nan, 300])
    assert set(p.feed[3:]) == {800.0} and set(p.spindle) == {12000.0}
    assert p.tool == {"number": 3.0}
    assert told(p) == [
        (0, 3, "G49"),
        (0, 4, "G54"),
        (0, 4, "G64 P0.02 Q0.01"),
        (0, 5, "(MSG, the 6 mm mill)"),
        (0, 5, "T3"),
        (0, 5, "M6"),
        (0, 6, "S12000"),
        (0, 6, "M3"),
        (0, 7, "G43 H3"),
        (0, 8, "M8"),
        (len(p) - 1, 14, "G4 P0.5"),
        (len(p) - 1, 15, "M9"),
        (len(p), 16, "M5"),
        (len(p), 17, "M30"),
    ]
    assert [(n.line, "length" in n.text, "slash" in n.text) for n in p.notes] == [(7, True, False), (13, False, True)]


@pytest.mark.parametrize(
    "text",
    [
        "G0X1Y2Z3\nG1X4F60\n",
        "g00 x1 y2 z3\ng01 x4 f60",
        "  G 0 X +1. Y\t2.0 Z03\r\n\r\nF60\r\nG1 X4\r\n",
        "n1 z3 y2 x1 g0\nn2 f60 x4 g1",
        "N000001G0X01.000Y+2Z3.\nN99999999 X4F60.G1",
        "(a)G0(b)X1(;)Y2 Z3 ; (c\n(d) G1 X4 F60 ;;",
        "\ufeffG0 X1 Y2 Z3\nG1 F60\nX4",
        "G0 X1 Y2 Z3\nG1.0 X4 Y2 Z3 F60",
        "G21 G90 G94 G0 X1 Y2 Z3\nG1 F60 X4",
        "%\nG0 X1 Y2 Z3\nG1 F60 X4\n%\n",
        "\n%\n\nG0 X1 Y2 Z3\nG1 F60 X4\nM2\n",
        "G0 X1 Y2 Z3\nG1 F60 X4\nM30\n%\n",
    ],
)
def test_the_same_two_points(both, text):
    p = both(text)
    np.testing.assert_array_equal(p.tip, [[1, 2, 3], [4, 2, 3]])
    assert p.rapid.tolist() == [True, False] and p.feed[1] == 60
    assert notes(p) == []


FANUC = """\
%
O0001 (BRACKET OP1)
(T1  D=6. CR=0. - ZMIN=-5. - FLAT END MILL)
N10 G90 G94 G17 G49 G40 G80
N15 G21
N20 T1 M06
N25 S8000 M03
N30 G54
N35 M08
N40 G00 X-5. Y10.
N45 G43 Z15. H01
N50 Z5.
N55 G01 Z-1. F333.
N60 X20. F1000.
N65 G02 X25. Y5. I0. J-5.
N70 G00 Z15.
N75 M09
N80 M05
N85 M30
%
"""
FUSION = """\
%
(1001)
(T1 D=6. CR=0. - ZMIN=-5. - flat end mill)
N10 G90 G94 G17 G91.1
N15 G21

(2D Contour1)
N20 G53 G0 Z0.
N25 T1 M6
N30 S5000 M3
N35 G54
N40 M8
N45 G0 X31.6 Y0.
N50 G43 Z15. H1
N55 G1 Z-4.4 F333.
N60 G18 G3 X31. Z-5. I-0.6 K0. F1000.
N65 G1 X30.4
N70 G17 G2 X28. Y2.4 I0. J2.4
N75 G0 Z15.
N80 G49
N85 G53 G0 Z0.
N90 M30
%
"""
FREECAD = """\
(Exported by FreeCAD)
(Output Time:2024-01-01 10:00:00.000000)
(begin preamble)
G17 G54 G40 G49 G80 G90
G21
(TC: 5mm Endmill)
M5
M6 T1
G43 H1
M3 S8000
G0 Z15.000
G0 X-2.500 Y0.000
G1 X-2.500 Y0.000 Z10.000 F600.000
G2 X0.000 Y2.500 Z10.000 I2.500 J0.000 F1200.000
G0 Z15.000
(begin postamble)
M05
G17 G54 G90 G80 G40
M2
"""
VCARVE = "T1M6\nG17\nG0Z20.320\nG0X0.000Y0.000S16000M3\nG1Z-3.000F762.0\nG1Y100.000F2540.0\nG0Z20.320\nM09\nM30\n"


@pytest.mark.parametrize(
    ("text", "first", "last", "feeds"),
    [
        (FANUC, (-5, 10, 15), (25, 5, 15), {333, 1000}),
        (FUSION, (31.6, 0, 1400), (28, 2.4, 1400), {333, 1000}),
        (FREECAD, (-2.5, 0, 15), (0, 2.5, 15), {600, 1200}),
        (VCARVE, (0, 0, 20.32), (0, 100, 20.32), {762, 2540}),
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_programs_as_they_are_written(both, text, first, last, feeds, end):
    p = both(text.replace("\n", end), workpiece=SHIFTED)
    assert p.tip[0].tolist() == list(first) and p.tip[-1].tolist() == list(last)
    assert set(p.feed[~p.rapid]) == feeds and told(p)[-1][2].startswith("M")


@pytest.mark.parametrize(
    "text",
    ["%\nO0001\n", "%\nO0001(PART)\n", "O0001 (a) (b) ;c\n", "o0001\r\n", "%\n(head)\n\n ; head\nO 0001\n"],
)
def test_a_program_number_is_told(both, text):
    p = both(text + "G21 G0 X1 Y2 Z3\nM30\n%\nO0002\n")
    assert told(p)[0] == (0, 1 + text.rstrip().count("\n"), "O0001") and len(p) == 1
    assert [n.text for n in p.notes] == ["a line after the program's end, not read"]
    assert told(both("O7 (MSG, x)\nG0 X0\n")) == [(0, 1, "(MSG, x)"), (0, 1, "O7")]


def test_blanks_within_a_number_are_told(both):
    p = both("G0 X1 2 Y- 3 . 5 Z0\nG 0 1 F 1 X13\n")
    np.testing.assert_array_equal(p.tip, [[12, -3.5, 0], [13, -3.5, 0]])
    assert [(n.line, "(2 times)" in n.text) for n in notes(p)] == [(1, True)]


def test_encodings(both):
    for raw in (b"(MSG, Gr\xf6\xdfe)", "(MSG, Größe)".encode()):
        p = both(raw + b"\nG0 X0 Y0 Z0 (\xf6)\n")
        assert p.events[0].text == "(MSG, Gr\u00f6\u00dfe)"
    assert both(b"(MSG, \x93a\x94)\nG0X0\n").events[0].text.isprintable()


def test_what_follows_the_end_is_told(both):
    for end, record in (("M2", 1), ("M30", 1), ("%", 1), ("M2 X5", 2)):
        p = both(f"%\nG0 X1 Y2 Z3\n{end}\n\nG0 X7\nrubbish \x01\0\n%\n\x1a")
        assert len(p) == record and [(n.line, "(2 times)" in n.text) for n in notes(p)] == [(5, True)]
    assert notes(both("%\nG0 X1 Y2 Z3\nM2\n%\n\n\x1a")) == []
    assert [n.text for n in both("G21 G0 X1 Y2 Z3\n").notes] == ["the program ends without M2, M30 or a second %"]
    assert [(n.line, "mm" in n.text) for n in both("G0 X1 Y2 Z3\nM2\n").notes] == [(0, True)]


def test_m2_on_a_line_with_motion_ends_behind_it(both):
    p = both("G0 X1 Y2 Z3\nX4 M30\nX5\n")
    assert p.tip[:, 0].tolist() == [1, 4] and told(p) == [(2, 2, "M30")]


# where the records begin


def test_the_records_begin_where_the_position_is_known(both):
    p = both("G0 Z50\nM3\nG0 X1\nM8\nY2\nM7\nG1 Z1 F5\n")
    np.testing.assert_array_equal(p.tip, [[1, 2, 50], [1, 2, 1]])
    assert told(p) == [(0, 2, "M3"), (0, 4, "M8"), (1, 6, "M7")]
    assert [(n.line, "(2 times)" in n.text) for n in notes(p)] == [(1, True)]


def test_letters_that_are_never_given_are_zero(both):
    p = both("G0 X1 Y2\nG1 X3 F5\nG2 X5 I1\nG91 G1 Y1\n")
    assert p.tip[:, 2].tolist() == [0] * len(p) and p.tip[-1].tolist() == [5, 3, 0]
    assert [(n.line, n.text) for n in notes(p)] == [(0, "no Z word: Z is 0")]
    p = both("G0 Z1\nG1 Z0 F1\n")
    np.testing.assert_array_equal(p.tip, [[0, 0, 1], [0, 0, 0]])


def test_no_feed_towards_the_unknown(both):
    refused(both_error(both), "G0 X0\nG1 X1 F5\nX2\nY1\nG0 Z3\n", 2, "Y is not known", "line 4", "a stated start")
    refused(both_error(both), "G91 G0 X1\n", 1, "G91", "X")
    refused(both_error(both), "G0 X0 Y0\nG91 Z1\n", 2, "Z")
    refused(both_error(both), "G0 X0 Y0\nG91\nX1\nZ1\n", 4, "Z")
    refused(both_error(both), "G2 X1 I1 F1\n", 1, "X is not known", "a stated start")
    refused(both_error(both), "G0 X0 Y0\nG2 X1 I.5 Z1 F1\n", 2, "Z is not known")
