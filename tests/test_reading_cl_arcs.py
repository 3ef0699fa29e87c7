"""CL files: arcs against closed forms, and drill cycles."""

import math

import numpy as np
import pytest
from cl_reading import both_reader, refused, text_reader, without_feeds  # noqa: F401  without_feeds is taken by every test

from parakin.errors import InputError


@pytest.fixture
def read(tmp_path):
    return text_reader(tmp_path)


@pytest.fixture
def both(tmp_path, monkeypatch):
    return both_reader(tmp_path, monkeypatch)


# arcs


def chord_error(points, centre, radius):
    """Largest distance of the chords between points on a circle from it."""
    middle = (points[1:] + points[:-1]) / 2 - centre
    return radius - np.linalg.norm(middle, axis=1).min()


def rotation(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def catia_arc(start, tangent, centre, radius, end):
    def text(values):
        return ",".join(f"{v:.15g}" for v in values)

    return (
        f"GOTO/{text(start)}\nINDIRV/{text(tangent)}\nTLON,GOFWD/(CIRCLE/{text(centre)},$\n{radius:.15g}),ON,2,INTOF,$\n"
        f"(LINE/{text(centre)},{text(end)})\n"
    )


@pytest.mark.parametrize("dialect", ["catia", "nx"])
@pytest.mark.parametrize("turn", [0.3, math.pi / 2, math.pi, 4.0, 6.28, 2 * math.pi])
@pytest.mark.parametrize("tolerance", [0.1, 0.01, 1e-4])
def test_arcs_in_space(both, dialect, turn, tolerance):
    rng = np.random.default_rng(int(turn * 1000))
    basis, centre, radius = rotation(rng), rng.normal(size=3) * 50, 20.0

    def at(angle):
        return centre + radius * (math.cos(angle) * basis[:, 0] + math.sin(angle) * basis[:, 1])

    start, end = at(0.0), at(turn) if turn < 6.283 else at(0.0)
    if dialect == "catia":
        text = catia_arc(start, basis[:, 1], centre, radius, end)
    else:  # NX turns clockwise about the axis it states
        values = ",".join(f"{v:.15g}" for v in (*centre, *-basis[:, 2], radius, 0.06, 0.5, 10, 0))
        text = "GOTO/{:.15g},{:.15g},{:.15g}\n".format(*start) + f"CIRCLE/{values}\n"
        text += "PAINT/COLOR,31\nGOTO/{:.15g},{:.15g},{:.15g}\n".format(*end)
    p = both(text, arc_tolerance=tolerance)
    local = (p.tip - centre) @ basis
    np.testing.assert_allclose(np.hypot(local[:, 0], local[:, 1]), radius, atol=1e-9)
    np.testing.assert_allclose(local[:, 2], 0.0, atol=1e-9)
    angle = np.unwrap(np.arctan2(local[:, 1], local[:, 0]), discont=math.pi)
    assert (np.diff(angle) > 0).all()
    assert angle[-1] - angle[0] == pytest.approx(turn, abs=1e-9)
    np.testing.assert_allclose(p.tip[-1], end, atol=1e-12)
    error = chord_error(p.tip, centre, radius)
    assert error <= tolerance * (1 + 1e-9)
    # no more points than the tolerance asks for
    step = min(2 * math.acos(1 - tolerance / radius), math.pi / 4)
    assert len(p) - 1 <= math.ceil(turn / step - 1e-9) + 1


def test_indirv_decides_the_way_round(both):
    left = both(catia_arc((15, 0, 0), (0, 1, 0), (0, 0, 0), 15, (0, 15, 0)))
    right = both(catia_arc((15, 0, 0), (0, -1, 0), (0, 0, 0), 15, (0, 15, 0)))
    assert (left.tip[1:, 1] > 0).all() and (right.tip[1:3, 1] < 0).all()
    assert len(right) - 1 == pytest.approx(3 * (len(left) - 1), abs=2)
    half = both(catia_arc((15, 0, 0), (0, 0, 1), (0, 0, 0), 15, (-15, 0, 0)))
    assert (half.tip[1:-1, 2] > 0).all() and np.allclose(half.tip[:, 1], 0)


@pytest.mark.parametrize(("sign", "steps_up"), [(1, False), (-1, True)])
def test_nx_axis_sign_decides_the_way_round(both, sign, steps_up):
    p = both(f"GOTO/10,0,0\nCIRCLE/0,0,0,0,0,{sign},10,.1,.5,0,0\nGOTO/-10,0,0\n")
    assert (p.tip[1:-1, 1] > 0).all() == steps_up and (p.tip[1:-1, 1] < 0).all() != steps_up


def test_rounded_arcs_keep_their_given_ends(both):
    a, b = 12.345, 71.2345
    start = [round(7.5 * math.cos(math.radians(a)), 3), round(7.5 * math.sin(math.radians(a)), 3), 0]
    end = [round(7.5 * math.cos(math.radians(b)), 3), round(7.5 * math.sin(math.radians(b)), 3), 0]
    p = both(catia_arc(start, (-0.213, 0.977, 0), (0, 0, 0), 7.5, end))
    np.testing.assert_array_equal(p.tip[[0, -1]], [start, end])
    np.testing.assert_allclose(np.linalg.norm(p.tip[1:-1], axis=1), 7.5, atol=1e-12)


def test_arcs_in_inches(both):
    p = both("UNITS/INCHES\n" + catia_arc((1, 0, 0), (0, 1, 0), (0, 0, 0), 1, (0, 1, 0)), arc_tolerance=0.001)
    np.testing.assert_allclose(np.linalg.norm(p.tip, axis=1), 25.4, atol=1e-12)
    assert chord_error(p.tip, np.zeros(3), 25.4) <= 0.001 * (1 + 1e-9)


def test_the_axis_turns_on_the_arc(both):
    p = both("GOTO/10,0,0,0,0,1\nCIRCLE/0,0,0,0,0,-1,10,.1,.5,0,0\nGOTO/0,10,0,1,0,0\n", arc_tolerance=0.001)
    np.testing.assert_allclose(np.linalg.norm(p.axis, axis=1), 1, atol=1e-14)
    turned = np.arctan2(p.axis[:, 0], p.axis[:, 2])
    along = np.arctan2(p.tip[:, 1], p.tip[:, 0])
    np.testing.assert_allclose(turned, along, atol=1e-12)
    np.testing.assert_array_equal(p.axis[-1], [1, 0, 0])


def test_rapid_feed_and_lines_of_arcs(both):
    p = both("GOTO/10,0,0\nFEDRAT/5\nCIRCLE/0,0,0,0,0,1,10,.1,.5,0,0\nRAPID\nGOTO/0,10,0\nGOTO/9,9,9\n")
    assert p.rapid.tolist() == [False] + [True] * (len(p) - 2) + [False]
    assert set(p.line[1:-2]) == {3} and p.line[-2] == 5 and set(p.feed[1:]) == {5.0}


def test_nx_helix(both):
    p = both("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,-1,10,.1,.5,0,0\nGOTO/0,10,-3\n")
    np.testing.assert_allclose(np.hypot(p.tip[:, 0], p.tip[:, 1]), 10, atol=1e-12)
    np.testing.assert_allclose(p.tip[:, 2], -3 * np.arctan2(p.tip[:, 1], p.tip[:, 0]) / (math.pi / 2), atol=1e-12)
    assert "helix" in p.notes[1].text


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (catia_arc((15, 0, 0), (0, 1, 0), (0, 0, 0), 15, (0, 15.1, 0)), 3, ["end", "0.1 mm"]),
        (catia_arc((15, 0.6, 0), (0, 1, 0), (0, 0, 0), 15, (0, 14.9, 0)), 3, ["start"]),
        (catia_arc((15, 0, 0), (1, 0, 0), (0, 0, 0), 15, (0, 15, 0)), 3, ["INDIRV"]),
        (catia_arc((15, 0, 0), (0, 0, 1), (0, 0, 0), 15, (0, 15, 0)), 3, ["INDIRV"]),
        (catia_arc((0, 0, 0), (0, 1, 0), (0, 0, 0), 0, (0, 0, 0)), 3, ["radius"]),
        ("GOTO/1,0,0\nTLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,0,1,0)\n", 2, ["INDIRV"]),
        ("INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,0,1,0)\n", 2, ["position"]),
        ("GOTO/1,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,1),ON,(LINE/0,0,0,0,1,0)\n", 3, ["TLON"]),
        ("GOTO/1,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,0,1,q)\n", 3, ["'Q'"]),
        ("GOTO/1,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(LINE/0,0,0,1)\n", 3, ["TLON,GOFWD/(CIRCLE"]),
        ("GOTO/1,0,0\nINDIRV/0,0,0\n", 2, ["INDIRV"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10,0,0,0,0\nGOTO/0,10.5,0\n", 3, ["end", "0.5 mm"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,0,10,0,0,0,0\nGOTO/0,10,0\n", 2, ["CIRCLE"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,-10,0,0,0,0\nGOTO/0,10,0\n", 3, ["radius"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0\nGOTO/0,10,0\n", 2, ["radius"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10,0,0,0,0,TIMES,2\nGOTO/0,10,0\n", 3, ["TIMES"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\n", 2, ["GOTO"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nFINI\n", 3, ["CIRCLE"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nGODLTA/1,1,1\n", 3, ["GOTO"]),
        ("CIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\n", 2, ["position"]),
        ("GOTO/10,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0,0,0,-1\n", 3, ["180"]),
    ],
)
def test_arcs_refused(both, read, text, line, words):
    refused(read, text, line, *words)
    with pytest.raises(InputError):
        both(text)


def test_an_arc_of_too_many_points(read):
    text = "GOTO/1e8,0,0\nCIRCLE/0,0,0,0,0,1,1e8\nGOTO/0,1e8,0\n"
    refused(read, text, 3, "points", arc_tolerance=1e-7)


# drill cycles


def test_drilling(both):
    p = both(
        "FEDRAT/MMPM,900\nGOTO/0,0,50,0,0,1\nCYCLE/DRILL,RAPTO,3.0000,FEDTO,-33.0,RTRCTO,AUTO,MMPM,250.0000\n"
        "GOTO/10,0,0\nPAINT/COLOR,31\nGOTO/20,0,5\nCYCLE/OFF\nGOTO/0,0,60\n"
    )
    expected = [
        (0, 0, 50, False, 900),
        (10, 0, 50, True, 900),
        (10, 0, 3, True, 900),
        (10, 0, -33, False, 250),
        (10, 0, 50, True, 900),
        (20, 0, 50, True, 900),
        (20, 0, 8, True, 900),
        (20, 0, -28, False, 250),
        (20, 0, 50, True, 900),
        (0, 0, 60, False, 900),
    ]
    np.testing.assert_array_equal(np.column_stack([p.tip, p.rapid, p.feed]), np.array(expected, float))
    assert p.line.tolist() == [2, 4, 4, 4, 4, 6, 6, 6, 6, 8]
    assert [(n.line, "(2 times)" in n.text) for n in p.notes] == [(4, True), (5, False)]


def test_drilling_at_the_clearance_and_along_a_tilted_axis(both):
    p = both(
        "GOTO/9,0,0,1,0,0\nCYCLE/DRILL,RAPTO,2,FEDTO,-5\nGOTO/0,1,0\nGOTO/3,1,4\nCYCLE/OFF\nCYCLE/ON\nGOTO/0,0,0\n"
    )
    tip = [[9, 0, 0], [9, 1, 0], [2, 1, 0], [-5, 1, 0], [2, 1, 0]]
    # the second hole's clearance is higher: up first, then across
    tip += [[5, 1, 0], [5, 1, 4], [-2, 1, 4], [5, 1, 4], [5, 0, 0], [2, 0, 0], [-5, 0, 0], [2, 0, 0]]
    np.testing.assert_array_equal(p.tip, tip)
    np.testing.assert_array_equal(p.axis, np.tile([1.0, 0, 0], (len(tip), 1)))


@pytest.mark.parametrize(
    "cycle",
    [
        "CYCLE/MILL,RAPTO,3,FEDTO,-5",
        "CYCLE/DRILL,DEEP,RAPTO,3,FEDTO,-5",
        "CYCLE/DRILL,126.0,85.0,1.0,MMPR",
        "CYCLE/DRILL,RAPTO,3,FEDTO,-5,STEP,1",
        "CYCLE/DRILL,RAPTO,3",
        "CYCLE/DRILL,RAPTO,3,FEDTO",
        "CYCLE/DRILL,RAPTO,3,FEDTO,abc",
        "CYCLE/DRILL,RAPTO,3,FEDTO,4",
        "CYCLE/DRILL,RAPTO,3,FEDTO,-4,RTRCTO,1",
        "CYCLE/ON",
        "CYCLE/",
    ],
)
def test_cycles_that_are_not_motion_are_refused(read, cycle):
    refused(read, f"GOTO/0,0,9\n{cycle}\nGOTO/0,0,0\n", 2, "CYCLE")


def test_motion_other_than_goto_in_a_cycle_is_refused(read):
    start = "GOTO/0,0,9\nCYCLE/DRILL,RAPTO,3,FEDTO,-5,RTRCTO,AUTO\n"
    for word in ("GODLTA/1,1,1", "FROM/1,1,1", "CIRCLE/0,0,0,0,0,1,10", "UNITS/MM", "MSYS/0,0,0,1,0,0,0,1,0"):
        refused(read, f"{start}{word}\n", 3)
    refused(read, f"{start}GOTO/0,0,0,1,0,0\n", 3, "AUTO")
    refused(read, "CYCLE/DRILL,RAPTO,3,FEDTO,-5,RTRCTO,AUTO\nGOTO/0,0,0\n", 2, "AUTO")
