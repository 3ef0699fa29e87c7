"""G-code: arcs against closed forms, and their refusals."""

import math

import numpy as np
import pytest
from gcode_reading import both_error, both_reader, refused, text_reader


@pytest.fixture
def read(tmp_path):
    return text_reader(tmp_path)


@pytest.fixture
def both(tmp_path, monkeypatch):
    return both_reader(tmp_path, monkeypatch)


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


def test_a_centre_alone_goes_on_with_a_full_circle(both):
    p = both("G0 X10 Y0 Z0\nG3 X-10 I-10 F9\nI10 P2\nG17 J5 S50 M3\nM2\n", arc_tolerance=0.05)  # rs274 reads so
    first, second = (np.flatnonzero(p.line == line) for line in (3, 4))
    check_arc(p.tip[first[0] - 1 : first[-1] + 1], "G17", (0, 0), 10, 4 * math.pi, 0, 0.05)
    check_arc(p.tip[second[0] - 1 :], "G17", (-10, 5), 5, 2 * math.pi, 0, 0.05)


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
        ("G3 X0 Y10 I-10 K1\n", 3, ["K for an arc in G17"]),
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
        ("G3 I-10\nR10\n", 4, ["R10"]),
        ("G3 I-10\nG1 I-10\n", 4, ["I-10"]),
    ],
)
def test_arcs_refused(both, text, line, words):
    refused(both_error(both), "G0 X10 Y0 Z0\nF10\n" + text, line, *words)
