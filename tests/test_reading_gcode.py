"""G-code: every code that is read, every refusal with its line, arcs against closed forms, random programs against what
they were made from, the fast reader against the block reader, and fuzz."""

import io
import math
import random
import re
import tracemalloc

import numpy as np
import pytest
from gcode_model import Program

from parakin.errors import InputError
from parakin.toolpath.reading.detect import detect_format, read_path
from parakin.toolpath.reading.gcode import motion as gcode_motion
from parakin.toolpath.reading.gcode import reader as gcode
from parakin.toolpath.reading.gcode.reader import read_gcode

COLUMNS = ("tip", "axis", "line", "rapid", "feed", "spindle", "turns", "seconds")

SHIFTED = np.column_stack([np.eye(3), [100.0, 0.5, -1400.0]])  # a workpiece
SAMPLE = """\
%
(A pocket in two depths)
N10 G21 G17 G40 G49 G80 G90 G94 G98 ; as every program begins
N20 G54 G64 P0.02 Q0.01
N30 T3 M6 (MSG, the 6 mm mill)
N40 S12000 M3
N50 G43 H3
N60 G0 X10 Y0 Z50 M8
N70 Z2
N80 G1 Z-1 F300
N90 G3 X0 Y10 I-10 J0 F800
N100 G1 X-20.
/N110 G1 Y.5
N120 G4 P0.5
N130 G0 Z50 M9
N140 M5
N150 M30
%
"""


@pytest.fixture
def read(tmp_path):
    def reads(text, **options):
        path = tmp_path / "part.ngc"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_gcode(path, **options)

    return reads


@pytest.fixture
def both(read, monkeypatch):
    """With and without the fast reader; the same path or the same error, or it fails."""
    plain = gcode.read_plain_lines

    def reads(text, **options):
        results = []
        for run in (plain, lambda lines, at, first, motion: at):
            monkeypatch.setattr(gcode, "read_plain_lines", run)
            try:
                results.append(read(text, **options))
            except InputError as error:
                results.append(str(error))
        fast, slow = results
        if isinstance(slow, str) or isinstance(fast, str):
            assert fast == slow
            raise InputError(slow)
        same(fast, slow)
        return slow

    return reads


def same(fast, slow):
    for name in COLUMNS:
        a, b = getattr(fast, name), getattr(slow, name)
        assert (a is None) == (b is None), name
        if a is not None:
            assert a.tobytes() == b.tobytes(), (name, a, b)  # to the bit
            assert a.dtype == b.dtype and a.shape == b.shape and a.flags.c_contiguous
    for name in ("events", "notes", "tool", "units", "frame"):
        assert getattr(fast, name) == getattr(slow, name)


def told(path):
    return [(e.record, e.line, e.text) for e in path.events]


def notes(path):
    """Notes but for the two that nearly every snippet here earns."""
    return [n for n in path.notes if not n.text.startswith(("no G20", "the program ends"))]


def refused(read, text, line, *words, **options):
    with pytest.raises(InputError) as caught:
        read(text, **options)
    message = str(caught.value)
    assert "\n" not in message and message.isprintable()
    assert caught.value.line == line, message
    place = caught.value.source + (f":{line}: " if line else ": ")
    assert message.startswith(place)
    for word in words:
        assert word in message.removeprefix(place), message
    return message


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
    assert [(n.line, "slash" in n.text) for n in p.notes] == [(13, True)]


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
    refused(both_error(both), "G0 X0\nG1 X1 F5\nX2\nY1\nG0 Z3\n", 2, "Y is not known", "line 4")
    refused(both_error(both), "G91 G0 X1\n", 1, "G91", "X")
    refused(both_error(both), "G0 X0 Y0\nG91 Z1\n", 2, "Z")
    refused(both_error(both), "G0 X0 Y0\nG91\nX1\nZ1\n", 4, "Z")
    refused(both_error(both), "G2 X1 I1 F1\n", 1, "X is not known")
    refused(both_error(both), "G0 X0 Y0\nG2 X1 I.5 Z1 F1\n", 2, "Z is not known")


def both_error(both):
    """The same error either way, with its place."""

    def reads(text, **options):
        try:
            return both(text, **options)
        except InputError as error:
            found = re.fullmatch(r"(.*?\.ngc)(?::(\d+))?: (.*)", str(error), re.DOTALL)
            raise InputError(found[3], found[1], found[2] and int(found[2])) from error

    return reads


# motion


def test_modes_of_distance(both):
    p = both("G0 X1 Y2 Z3\nG91 X1 Y-1\nG1 Z.5 F9\nG90 X7\nG91\nX1\n")
    np.testing.assert_array_equal(p.tip, [[1, 2, 3], [2, 1, 3], [2, 1, 3.5], [7, 1, 3.5], [8, 1, 3.5]])


def test_units(both):
    p = both("G20\nG0 X1 Y2 Z3\nG1 X2 F10\nG21 X2\nF10 X3\nG20 X1\n")
    np.testing.assert_allclose(p.tip[:, 0], [25.4, 50.8, 2, 3, 25.4], rtol=1e-15)
    np.testing.assert_allclose(p.feed[1:], [254, 254, 10, 10], rtol=1e-15)
    assert p.units == "inch" and [(n.line, "unit" in n.text) for n in notes(p)] == [(4, True)]
    assert both("G21\nG0 X1\nG21\n").units == "mm"


def test_f_is_read_before_the_unit_of_its_block(both):
    p = both("G20 G1 X1 Y0 Z0 F10\nF10 X2\nG21 F10 X1\n")
    np.testing.assert_allclose(p.feed, [10, 254, 254], rtol=1e-15)
    assert [(n.line, "unit before" in n.text, "(2 times)" in n.text) for n in p.notes if "before" in n.text] == [
        (1, True, True)
    ]


def test_feeds(both):
    p = both("F100\nG0 X0 Y0 Z0\nG1 X1\nG0 X2\nG1 X3 F50.5\nG94 X4 F7\nX5\nG94 G0 X6\n")
    np.testing.assert_array_equal(p.feed, [100, 100, 100, 50.5, 7, 7, math.nan])
    assert p.seconds is None


def test_inverse_time(both):
    p = both("G0 X0 Y0 Z0\nG93 G1 X10 F2\nX20 F.5\nG0 Y3\nG3 X30 I5 F6\nG94 G1 X40 F100\n")
    arc = p.line == 5
    np.testing.assert_array_equal(p.seconds[[0, 1, 2, 3, -1]], [math.nan, 30, 120, math.nan, math.nan])
    assert p.seconds[arc].sum() == pytest.approx(10, rel=1e-12) and np.ptp(p.seconds[arc]) == 0
    np.testing.assert_array_equal(p.feed[[0, 1, 2, 3, -1]], [math.nan] * 4 + [100])
    assert np.isnan(p.feed[arc]).all() and notes(p) == []
    p = both("G0 X0 Y0 Z0\nG93\nG0 X1 F3\nF4\nG1 X2 F1\n")
    assert [(n.line, "(2 times)" in n.text) for n in notes(p)] == [(3, True)]


def test_turns(both):
    p = both("G0 X0 Y0 Z0 A30 B-20 C400\nG1 F10 X1 A0\nG91 C-40\n")
    np.testing.assert_allclose(np.degrees(p.turns), [[30, -20, 400], [0, -20, 400], [0, -20, 360]], rtol=1e-15)
    for turns, axis in zip(p.turns, p.axis, strict=True):
        np.testing.assert_allclose(rotation(*turns)[:, 2], axis, atol=1e-15)
    assert notes(p) == []


def rotation(a, b, c):
    """Rz(c) Ry(b) Rx(a) by the exponential of each axis's cross product."""

    def about(n, angle):
        k = np.cross(n, np.eye(3)).T
        return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k

    return about((0, 0, 1), c) @ about((0, 1, 0), b) @ about((1, 0, 0), a)


def test_turns_given_late(both):
    p = both("G0 X0 Y0 Z0\nG1 X1 F1\nB10\nC0\nA5\n")
    np.testing.assert_array_equal(np.degrees(p.turns[:2]), np.zeros((2, 3)))
    assert [(n.line, n.text[0]) for n in notes(p)] == [(3, "B"), (5, "A")]


def test_f_is_degrees_where_only_turns_move(both):
    p = both("G20 G0 X0 Y0 Z0 A0 B0\nF30\nG1 A30 B40\nX0 Y0 Z0 A30 B70\nX1 B10\nG0 A0\nG1 Z0\nG93 A10 F2\n")
    np.testing.assert_array_equal(p.seconds, [math.nan, 100, 60, math.nan, math.nan, math.nan, 30])
    np.testing.assert_allclose(p.feed[1:3], 762, rtol=1e-15)
    p = both("G0 X0 Y0 A0\nG1 F60 A90\nA0 F30\n")  # Z is never given
    np.testing.assert_array_equal(p.seconds, [math.nan, 90, 180])
    for letter in "XYZ":
        p = both(f"G0 X0 Y0 Z0 A0\nG1 F5 A1\n{letter}1 A2\n{letter}1.00000001 A3\n")
        np.testing.assert_array_equal(p.seconds, [math.nan, 12, math.nan, 12])


def test_g53(both):
    p = both("G53 G0 Z-1390\nG55\nG0 X1 Y1\nG53 X5\nX6\nG20 G53 Y.5 A20\nG91 Z1\n", workpiece=SHIFTED)
    expected = [[1, 1, 10], [-95, 1, 10], [6, 1, 10], [6, 12.2, 10], [6, 12.2, 35.4]]
    np.testing.assert_allclose(p.tip, expected, rtol=1e-14)
    assert told(p) == [(0, 2, "G55")] and np.degrees(p.turns[-1]).tolist() == [20, 0, 0] and p.frame is None
    p = both("G53 G0 X1 Y2 Z3\n", workpiece=np.eye(3, 4))
    np.testing.assert_array_equal(p.tip, [[1, 2, 3]])
    assert notes(p) == []
    text = "G43 H0\nG53 G0 X101\nG43 H1\nG49 G53 X2\nG43.1 Z0\nG53 X3\n"
    assert both(text, workpiece=SHIFTED).tip[:, 0].tolist() == [1, -98, -97]


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("G53\n", 1, ["G53"]),
        ("G53 G0\n", 1, ["G53"]),
        ("F1\nG0 X0 Y0\nG53 G2 X1 I.5\n", 3, ["G53"]),
        ("G0 X0\nG91\nG53 X1\n", 3, ["G53 in G91"]),
        ("G43 H1\nG53 G0 Z0\n", 2, ["G53", "G43", "G49"]),
        ("G43.1 Z5\nG53 G0 Z0\n", 2, ["G53", "G43.1"]),
    ],
)
def test_g53_refused(both, text, line, words):
    refused(both_error(both), text, line, *words, workpiece=SHIFTED)


def test_g53_needs_to_know_where_the_work_lies(both):
    refused(both_error(both), "G0 X0 Y0\nG53 Z0\n", 2, "G53", "workpiece")
    turned = np.column_stack([rotation(0.0, 0.0, 1e-3), np.zeros(3)])
    refused(both_error(both), "G0 X0 Y0\nG53 Z0\n", 2, "G53", "turned", workpiece=turned)
    for wrong in (np.eye(3), np.full((3, 4), math.nan)):
        with pytest.raises(InputError, match="workpiece: expected a transform"):
            both("G0 X0\n", workpiece=wrong)


@pytest.mark.parametrize("code", ["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"])
def test_one_work_system(both, code):
    p = both(f"{code} G0 X1 Y2 Z3\n{code}\nX2\n")
    assert told(p) == [(0, 1, code)] and len(p) == 2
    other = "G57" if code != "G57" else "G59.1"
    refused(both_error(both), f"{code} G0 X1\n{other} X2\n", 2, code, other)
    if code == "G54":
        assert len(both("G0 X1\nG54 X2\n")) == 2
    else:
        refused(both_error(both), f"G0 X1\n{code} X2\n", 2, code, "offset")


def test_tool_length_offsets_move_nothing(both):
    p = both("G0 X0 Y0 Z9\nG43 H2 Z8\nG43 Z7\nG43.1 X1 Z2.5\nG20\nG43.1 Z1\nG21 Z6\nG43.2 H4\nG49 Z5\n")
    assert p.tip[:, 2].tolist() == [9, 8, 7, 6, 5] and p.tip[:, 0].tolist() == [0] * 5
    assert [e.text for e in p.events] == ["G43 H2", "G43", "G43.1 X1 Z2.5", "G43.1 Z25.4", "G43.2 H4", "G49"]


def test_tool_centre_point_control(both):
    p = both("G43.4 H1\nG0 X0 Y0 Z9 B0\n")
    assert told(p) == [(0, 1, "G43.4 H1")] and [n.line for n in notes(p)] == [1]
    p = both("N10 TRAORI\nG0 X0 Y0 Z9 B0\nTRAORI(1)\n")
    assert [e.line for e in p.events] == [1, 3] and "(2 times)" in notes(p)[0].text


def test_path_modes_and_dwell(both):
    p = both("G61\nG0 X1 Y1 Z1\nG61.1\nG64\nG64 P.1\nG20 G64 Q1 P0.5\nG4 P2.5 X2\nG4 P0 G0 X1\n")
    assert [e.text for e in p.events] == ["G61", "G61.1", "G64", "G64 P0.1", "G64 P12.7 Q25.4", "G4 P2.5", "G4 P0"]
    assert [e.record for e in p.events] == [0, 1, 1, 1, 1, 1, 2]


def test_spindle(both):
    p = both("S100\nG0 X0 Y0 Z0\nM3\nX1\nS200 X2\nM5 X3\nS50\nX4\nM4 X5\n")
    np.testing.assert_array_equal(p.spindle, [math.nan, 100, 200, 0, 0, 50])
    assert [e.text for e in p.events] == ["S100", "M3", "S200", "M5", "S50", "M4"]
    np.testing.assert_array_equal(both("M3 G0 X0\nG97 S5 X1\n").spindle, [math.nan, 5])


def test_tools(both):
    p = both("T4\nM6\nG0 X0\nT5\nX1\nM6\nX2\nM6 T4\n")
    assert p.tool == {"number": 4.0} and [(n.line, "another tool" in n.text) for n in notes(p)][-1:] == [(6, True)]
    assert [e.text for e in p.events] == ["T4", "M6", "T5", "M6", "T4", "M6"]
    assert both("M6\nG0 X0\n").tool == {}


@pytest.mark.parametrize("code", [0, 1, 3, 4, 5, 6, 7, 8, 9, 48, 49, 60])
def test_m_codes_are_events(both, code):
    p = both(f"G0 X1 Y1 Z1\nM{code:02}\nX2 M{code}\nX3\n")
    after = 2 if code in (0, 1, 60) else 1  # stops come behind the motion of their block, all else before it
    assert told(p) == [(1, 2, f"M{code}"), (after, 3, f"M{code}")] and len(p) == 3


def test_g80_gives_way_to_a_motion_code(both):
    p = both("G00 G17 G40 G49 G80 G90 X1 Y2 Z3\nX2\nG80 G1 X3 F5\nX4\n")
    assert p.tip[:, 0].tolist() == [1, 2, 3, 4]


def test_offsets_that_are_cancelled_are_none_anyway(both):
    p = both("G0 X1 Y1 Z1\nG92.1\nG92.2 X2\n")
    assert told(p) == [(1, 2, "G92.1"), (1, 3, "G92.2")] and p.tip[-1].tolist() == [2, 1, 1]


def test_order_within_a_block(both):
    p = both("M0 G4 P1 M8 S3 M3 T1 M6 G61 G0 X1 Y1 Z1\n")
    assert [(e.record, e.text) for e in p.events] == [
        (0, "S3"), (0, "T1"), (0, "M6"), (0, "M3"), (0, "M8"), (0, "G4 P1"), (0, "G61"), (1, "M0"),
    ]  # fmt: skip


def test_bare_codes_move_nothing(both):
    p = both("G0 X1 Y2 Z3\nG1\nF5\nX4\nG0\nG80\nG17 G40 G91.1 G97 G98\nG1 X5\n")
    assert p.line.tolist() == [1, 4, 8]


# arcs: exact geometry

PLANES = {"G17": (0, 1, 2), "G18": (2, 0, 1), "G19": (1, 2, 0)}


def words(letters, values):
    return " ".join(f"{letter}{value:.9f}" for letter, value in zip(letters, values, strict=True))


def check_arc(points, plane, centre, radius, sweep, rise, tolerance):
    """Points (the start first) on the helix about centre, right-handed sweep in rad, no chord off by more."""
    first, second, along = PLANES[plane]
    a, b = points[:, first] - centre[0], points[:, second] - centre[1]
    np.testing.assert_allclose(np.hypot(a, b), radius, atol=1e-6)
    angle = np.unwrap(np.arctan2(b, a), period=2 * math.pi)
    angle = angle - angle[0]
    assert (np.diff(angle) * sweep > 0).all()
    assert angle[-1] == pytest.approx(sweep, abs=1e-6)
    np.testing.assert_allclose(points[:, along] - points[0, along], rise * angle / sweep, atol=1e-6)
    steps = np.abs(np.diff(angle))
    assert (radius * (1 - np.cos(steps / 2)) <= tolerance * (1 + 1e-5)).all()
    fewest = abs(sweep) / min(2 * math.acos(max(0.0, 1 - tolerance / radius)), math.pi / 4)
    assert len(points) - 1 <= math.ceil(fewest - 1e-7) + 1


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("code", ["G2", "G3"])
@pytest.mark.parametrize("form", ["IJK", "R", "G90.1"])
@pytest.mark.parametrize("mode", ["G90", "G91"])
@pytest.mark.parametrize("unit", ["G20", "G21"])
def test_arcs(read, plane, code, form, mode, unit):
    rng = np.random.default_rng(list((plane + code + form).encode()))
    first, second, along = PLANES[plane]
    scale = 25.4 if unit == "G20" else 1.0
    for turn in (0.02, 1.0, math.pi - 0.02, math.pi + 0.02, 4.0, 6.27):
        for tolerance, turns, rise in ((0.1, 1, 0.0), (1e-3, 1, 3.0), (0.01, 3, -2.0)):
            centre, radius, begin = rng.normal(size=2) * 20, rng.uniform(5, 40), rng.uniform(-4, 4)
            sign = 1.0 if code == "G3" else -1.0
            start, end = np.zeros((2, 3))
            start[along] = rng.normal()
            end[along] = start[along] + rise
            for point, angle in ((start, begin), (end, begin + sign * turn)):
                point[first] = centre[0] + radius * math.cos(angle)
                point[second] = centre[1] + radius * math.sin(angle)
            letters, offsets = "XYZ", "IJK"
            text = f"{unit} {plane} G0 {words(letters, start)}\n{mode} F100\n"
            text += f"{code} {words(letters, end - start if mode == 'G91' else end)} "
            if form == "R":
                text += f"R{radius if turn < math.pi else -radius:.9f}"
            else:
                absolute = form == "G90.1"
                out = (centre[0], centre[1]) if absolute else (centre[0] - start[first], centre[1] - start[second])
                text += f"{form if absolute else ''} " + words((offsets[first], offsets[second]), out)
            p = read(text + (f" P{turns}\n" if turns > 1 else "\n"), arc_tolerance=tolerance)
            np.testing.assert_allclose(p.tip[-1], end * scale, atol=1e-7)
            sweep = sign * (turn + 2 * math.pi * (turns - 1))
            check_arc(p.tip, plane, centre * scale, radius * scale, sweep, rise * scale, tolerance)
            assert set(p.line[1:]) == {3} and not p.rapid[1:].any()


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize(("code", "sign"), [("G2", -1), ("G3", 1)])
@pytest.mark.parametrize("turns", [1, 2])
def test_full_circles_and_helices(both, plane, code, sign, turns):
    first, second, along = PLANES[plane]
    for end in ("", "XYZ"[first] + "0", "XYZ"[first] + "0" + "XYZ"[second] + "1"):
        for rise in (0.0, 5.0):
            height = f"{'XYZ'[along]}{rise}" if rise else ""
            text = f"G0 X0 Y0 Z0\n{plane} {'XYZ'[second]}1\n{code} {end} {height} {'IJK'[first]}7 P{turns} F1\n"
            p = both(text, arc_tolerance=0.05)
            check_arc(p.tip[1:], plane, (7, 1), 7, sign * 2 * math.pi * turns, rise, 0.05)


def test_a_half_circle_by_r(both):
    for code, side in (("G2", 1), ("G3", -1)):
        for radius in ("5", "-5", "4.999"):
            p = both(f"G0 X0 Y0 Z0\n{code} X10 R{radius} F1\n")
            assert (np.sign(p.tip[1:-1, 1]) == side).all()
            np.testing.assert_allclose(np.hypot(p.tip[:, 0] - 5, p.tip[:, 1]), 5, atol=1e-9)


def test_turns_along_arcs(both):
    p = both("G0 X10 Y0 Z0 A0 B0\nG3 X0 Y10 I-10 A90 B-30 F5\n")
    along = np.arctan2(p.tip[:, 1], p.tip[:, 0]) / (math.pi / 2)
    np.testing.assert_allclose(np.degrees(p.turns), np.outer(along, [90, -30, 0]), atol=1e-9)
    p = both("G0 X10 Y0 Z0 A28.4\nG3 X0 Y10 I-10 A-19.7 F5\n")
    assert p.turns[-1, 0] == math.radians(-19.7)  # not a digit is lost


def test_arcs_slightly_off_their_circle(both):
    p = both("G0 X10 Y0 Z0\nG3 X0 Y10.02 I-10 F5\n")  # within what RS274/NGC tolerates
    radius = np.hypot(p.tip[:, 0], p.tip[:, 1])
    along = np.arctan2(p.tip[:, 1], p.tip[:, 0]) / (math.pi / 2)
    np.testing.assert_allclose(radius, 10 + 0.02 * along, atol=1e-12)
    assert p.tip[-1].tolist() == [0, 10.02, 0]
    assert len(both("G0 X1000 Y0 Z0\nG3 X0 Y1000.9 I-1000 F5\n")) > 2  # a share of 1e-3
    assert len(both("G20 G0 X1 Y0 Z0\nG3 X0 Y1.0028 I-1 F5\n")) > 2


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("G3 X0 Y10.03 I-10\n", 3, ["10 mm at the start", "10.03 mm at the end"]),
        ("G3 X0 Y9.97 I-10\n", 3, ["9.97 mm at the end"]),
        ("G20 G3 X0 Y0.4 I-0.39370079\n", 3, ["10 mm", "10.16 mm"]),
        ("G3 X0 Y10 I0 J0\n", 3, ["without a radius"]),
        ("G3 X5 Y0 I-5\n", 3, ["5 mm at the start", "0 mm at the end"]),
        ("G3 X0 Y10\n", 3, ["either R or I and J"]),
        ("G3\n", 3, ["either R or I and J"]),
        ("G3 X0 Y10 R5 I1\n", 3, ["either R or I and J"]),
        ("G3 X0 Y10 I-10 K0\n", 3, ["K for an arc in G17"]),
        ("G18 G3 X0 J1\n", 3, ["J for an arc in G18", "K and I"]),
        ("G19 G3 Y0 I1\n", 3, ["I for an arc in G19", "J and K"]),
        ("G3 X0 Y10 R7\n", 3, ["radius 7 mm", "14.1421 mm", "7.07107 mm or more"]),
        ("G3 X0 Y10 R0\n", 3, ["radius 0 mm"]),
        ("G3 R10\n", 3, ["full circle by R"]),
        ("G3 X10 Y0 R10\n", 3, ["full circle by R"]),
        ("G3 Z1 R10\n", 3, ["full circle by R"]),
        ("G3 X0 Y10 I-10 P0\n", 3, ["P"]),
        ("G3 X0 Y10 I-10 P1.5\n", 3, ["P1.5"]),
        ("G3 X0 Y10 I-10 P-1\n", 3, ["P-1"]),
        ("G3 X0 Y10 I-10 P999999\n", 3, ["points"]),
        ("G90.1 G3 X0 Y10 I0\n", 3, ["G90.1", "both I and J"]),
        ("G3 X0 Y10 I-10 Q1\n", 3, ["Q1"]),
        ("G3 X0 Y10 I-10 F0\n", 3, ["G3 without a feed"]),
        ("G93 G3 X0 Y10 I-10\n", 3, ["G93", "F"]),
        ("G3 I-10\nI-10\n", 4, ["I-10"]),
    ],
)
def test_arcs_refused(both, text, line, words):
    refused(both_error(both), "G0 X10 Y0 Z0\nF10\n" + text, line, *words)


# refusals


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


# random programs


def test_random_programs_against_their_model(both):
    arcs = 0
    for seed in range(150):
        program = Program(seed)
        path = both(program.text, arc_tolerance=0.05)
        program.verify(path)
        arcs += program.arcs
    assert arcs > 500


# large files, memory, progress


def test_progress_and_many_blocks(tmp_path, monkeypatch):
    monkeypatch.setattr(gcode, "READ_SIZE", 1000)
    path = tmp_path / "a.ngc"
    path.write_text("G0 X0 Y0 Z0\nF5\nG1\n" + "".join(f"X{k} Y-.5\nG2 X{k} I1\nG1\n" for k in range(1, 300)) + "M2\n")
    seen = []
    p = read_gcode(path, progress=seen.append, arc_tolerance=1.0)
    assert seen == sorted(seen) and seen[-1] == 1.0 and len(seen) > 5 and seen[0] < 0.5
    monkeypatch.setattr(gcode, "READ_SIZE", 1 << 20)
    same(p, read_gcode(path, arc_tolerance=1.0))
    assert p.line[-1] == 3 + 298 * 3 + 2 and len(p) == 1 + 299 * 9


def test_an_error_far_into_a_large_file(tmp_path):
    path = tmp_path / "big.ngc"
    lines = ["G0 X0 Y0 Z0", "F5", "G1", *["X12.3456 Y-.5 Z1"] * 100_000]
    lines[50_000] = "X1 Y#2"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"big\.ngc:50001: parameters"):
        read_gcode(path)


def test_arcs_do_not_fill_the_memory(read, monkeypatch):
    monkeypatch.setattr(gcode_motion, "_MOST_POINTS", 1000)
    refused(read, "G0 X0 Y0\nF5\n" + "G2 I50 P3\n" * 9, 5, "1000 points in all", "coarser", arc_tolerance=0.01)


def test_memory_is_a_few_times_the_columns(tmp_path):
    path = tmp_path / "big.ngc"
    path.write_text("G21 G0 X0 Y0 Z0 A0\nF5\nG1\n" + "X123.4567 Y-12.3456 Z1.2345 A12.34\n" * 30_000)
    tracemalloc.start()
    p = read_gcode(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    columns = sum(getattr(p, name).nbytes for name in COLUMNS if getattr(p, name) is not None)
    assert peak < 3.5 * columns + 1.6e7


@pytest.mark.parametrize("text", ["X" * 1_000_000, "G0 X" + "1" * 1_000_000, " " * 1_000_000 + "!", "(" * 1_000_000])
def test_long_lines_end_soon(both, text):
    for begin, line in (("", 1), ("G0 X1\n", 2)):
        for after in ("", "\nG0 X1\n"):
            refused(both_error(both), begin + text + after, line)


# which reader


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        *[(f"a{suffix}", "GOTO/1,2,3\n", "gcode") for suffix in (".ngc", ".nc", ".NC", ".gcode", ".tap", ".cnc")],
        ("a.cls", "TOOL PATH/A,TOOL,B\n", "cl"),
        ("a.apt", "PARTNO X\n", "cl"),
        ("a", "$$ -----\n$$ (text)\n", "cl"),
        ("a.txt", "\n\n  goto/ 1,2,3\n", "cl"),
        ("a.txt", "UNITS / MM\n", "cl"),
        ("a.txt", "FROM/0,0,0", "cl"),
        ("a.txt", "RAPID\n", "cl"),
        ("a.txt", "MULTAX\nG0", "cl"),
        ("a.txt", "%\nO0001\n", "gcode"),
        ("a.txt", "\n\r\n(header)\n", "gcode"),
        ("a.txt", "; header\n", "gcode"),
        ("a.txt", "\ufeffN10 G0 X1\n", "gcode"),
        ("a.txt", "/ g 0 x1\n", "gcode"),
        ("a.txt", "X.5\n", "gcode"),
        ("a.txt", "M6\n", "gcode"),
        ("a.txt", "T1\nGOTO/1,2,3\n", "gcode"),
        ("a.txt", "hello\nG0 X1\n", "gcode"),
        ("a.txt", "", "cl"),
        ("a.txt", "\0\1", "cl"),
    ],
)
def test_which_reader(tmp_path, name, text, kind):
    path = tmp_path / name
    path.write_text(text)
    assert detect_format(path) == kind


def test_any_file(tmp_path):
    (tmp_path / "a").write_text("G0 X1 Y2 Z3\nG2 X3 I1 F5\n")
    (tmp_path / "b").write_text("GOTO/1,2,3\nGOTO/3,2,3\n")
    seen = []
    a, b = read_path(tmp_path / "a", arc_tolerance=0.5, progress=seen.append), read_path(tmp_path / "b")
    assert (a.dialect, b.dialect) == ("gcode", "apt") and seen[-1] == 1.0
    assert a.line.tolist() == [1, 2, 2, 2, 2] and b.tip.tolist() == [[1, 2, 3], [3, 2, 3]]


# fuzz

ALPHABET = b"GMXYZABCIJKRFSTPNHQ0123456789.-+ %/();#[]\n\r\t"
PIECES = [
    b"G0", b"G1", b"G2", b"G3", b"G17", b"G18", b"G19", b"G20", b"G21", b"G90", b"G91", b"G93", b"G94", b"G53", b"G54",
    b"G43.1", b"G64", b"G4", b"G80", b"G90.1", b"M3", b"M30", b"M2", b"X1", b"Y-2.5", b"Z.5", b"A30", b"B-7", b"C370",
    b"I5", b"J-5", b"K1", b"R7", b"R-7", b"F100", b"F0", b"P2", b"S5", b"T1", b"H1", b"\n", b"\n", b"\n", b"(MSG,a)",
    b"%", b"X999999999", b"R1e9", b"/", b";", b"P999999999", b"X0.0000001", b"I1e-9", b"TRAORI",
]  # fmt: skip


def taken(data, tolerance=1.0):
    """Read bytes, both ways; anything but a path or one line of an error is a failure."""
    results = []
    for run in (PLAIN, lambda lines, at, first, motion: at):
        gcode.read_plain_lines = run
        try:
            with np.errstate(all="ignore"):
                results.append(
                    gcode.GcodeReader("f", len(data), tolerance, SHIFTED).read(io.BytesIO(data), lambda fraction: None)
                )
        except InputError as error:
            results.append(str(error))
    fast, slow = results
    if isinstance(slow, str):
        assert fast == slow and slow.startswith("f:") and slow.isprintable(), (data, fast, slow)
        return None
    same(fast, slow)
    assert np.isfinite(slow.tip).all()
    np.testing.assert_allclose((slow.axis**2).sum(axis=1), 1.0, atol=1e-12)
    assert (np.diff(slow.line) >= 0).all() and all(0 <= e.record <= len(slow) for e in slow.events)
    return slow


PLAIN = gcode.read_plain_lines


def mutated(data, rng):
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 3))):
        kind, k = rng.randrange(6), rng.randrange(len(data))
        if kind == 0:
            data[k] = rng.randrange(256)
        elif kind == 1:
            data[k] = ALPHABET[rng.randrange(len(ALPHABET))]
        elif kind == 2:
            del data[k : k + rng.randint(1, 6)]
        elif kind == 3:
            data[k:k] = rng.choice(PIECES)
        elif kind == 4:
            data[k:k] = data[rng.randrange(len(data)) :][:20]
        else:
            data[k] ^= 0x20
        data = data or bytearray(b"\n")
    return bytes(data)


SEEDS = [
    b"%\nN1 G21 G17 G90\nG0 X10 Y0 Z5 A0 B0\nG1 X1 F100 (MSG,a)\nG3 X1 Y10 J5 P2 F3\n%\n",
    b"G20 G91.1\nG0 X1 Y.5 Z2.5\nF30\nG1 X-2.\nA30 Y1\nG2 X3 Y3 R4\nM5\nM2\n",
    b"G0 X0 Y0 Z0\nG93 G1 X2 F4\nG18 G2 X4 Z1 I1 K.5 B7 F2\nG91 G1 C3 F1\nM30\nX1",
]


@pytest.mark.parametrize("seed", range(4))
def test_mutated_bytes(monkeypatch, seed):
    monkeypatch.setattr(gcode, "read_plain_lines", PLAIN)
    rng, read_ones = random.Random(seed), 0
    for _ in range(15_000):
        path = taken(mutated(rng.choice(SEEDS), rng))
        read_ones += path is not None
    assert read_ones > 1500


def test_random_pieces(monkeypatch):
    monkeypatch.setattr(gcode, "read_plain_lines", PLAIN)
    rng, read_ones = random.Random(0), 0
    for _ in range(15_000):
        data = b"G0 X1 Y2 Z3 F9\n" + b" ".join(rng.choices(PIECES, k=rng.randint(1, 9)))
        read_ones += taken(data) is not None
    assert read_ones > 500


def test_random_bytes(monkeypatch):
    monkeypatch.setattr(gcode, "read_plain_lines", PLAIN)
    rng = random.Random(0)
    for _ in range(13_000):
        taken(rng.randbytes(rng.randint(0, 40)))
        taken(bytes(rng.choices(ALPHABET, k=rng.randint(0, 60))))
