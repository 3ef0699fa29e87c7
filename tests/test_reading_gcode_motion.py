"""G-code: motion, feeds, turns and modes, code by code."""

import math

import numpy as np
import pytest
from gcode_reading import SHIFTED, both_error, both_reader, notes, refused, told

from parakin.errors import InputError


@pytest.fixture
def both(tmp_path, monkeypatch):
    return both_reader(tmp_path, monkeypatch)


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
    assert [n.line for n in p.notes if "without tool centre point control" in n.text] == [3]


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
        ("G43 H1\nG43.1 X5\nG53 G0 Z0\n", 3, ["G53", "G43.1"]),
        ("G43.1 Z5\nG20\nG53 G0 Z0\n", 3, ["G53", "unit"]),
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


def test_tool_length_offsets_of_unknown_length_move_nothing(both):
    p = both("G0 X0 Y0 Z9\nG43 H2\nX1\nG43 Z7\nG49 X0\nG43 H0 Y1\n")
    assert p.tip.tolist() == [[0, 0, 9], [1, 0, 9], [1, 0, 7], [0, 0, 7], [0, 1, 7]]
    assert [e.text for e in p.events] == ["G43 H2", "G43", "G49", "G43 H0"]
    assert [(n.line, "(2 times)" in n.text) for n in notes(p)] == [(2, True)]


def test_tool_lengths(both):
    """The holder stays where it is, so the tip is elsewhere."""
    p = both("G0 X0 Y0 Z9\nG43.1 X1 Z2.5\nY1\nG43.2 H3\nZ6\nY2\n", tools={3: 4.0})
    assert p.tip.tolist() == [[0, 0, 9], [-1, 1, 6.5], [-1, 1, 6], [-1, 2, 6]]
    assert [e.text for e in p.events] == ["G43.1 X1 Z2.5", "G43.2 H3"]
    p = both(
        "T1 M6\nG0 X0 Y0 Z90\nG43\nX1\nT2 M6\nG43 Z5\nG43 H1\nX2\nG49\nX3\nG53 Z9\n",
        tools={1: 50, 2: 80},
        workpiece=SHIFTED,
    )
    assert p.tip[:, 2].tolist() == [90, 40, 5, 35, 85, 1409]
    assert p.tool == {"number": 1.0, "length": 50.0}
    assert both("G0 X0 Y0 Z9\nG43 H1\nG53 Z9\n", tools={1: 50}, workpiece=SHIFTED).tip[-1].tolist() == [0, 0, 1359]
    assert both("G0 X0 Y0 Z9\nG10 L1 P7 Z3\nG43 H7\nX1\n").tip[-1].tolist() == [1, 0, 6]
    refused(both_error(both), "G0 Z1\nG43 H5\n", 2, "G43 for tool 5", "table", tools={1: 50})


def test_tool_centre_point_control(both):
    p = both("G43.4 H1\nG0 X0 Y0 Z9 B0\n")
    assert told(p) == [(0, 1, "G43.4 H1")] and [n.line for n in p.notes if "tool centre" in n.text] == [1]
    p = both("G0 B10\nG43.4 H1\nG0 X0 Y0 Z9\nB20\nG49\nX1\nB0\n")
    assert [n.line for n in p.notes if n.text.startswith("A, B or C without")] == [7]
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
