"""Machine files: what is read, and every kind of error with its text and line."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import fields
from itertools import product
from math import cos, hypot, inf, isfinite, pi, radians, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from parakin.description import find_machine_file, list_shipped_machines, read_machine
from parakin.errors import InputError, InputErrors
from parakin.model.legs import KINDS
from parakin.model.parts import Cone, Drive, Gap, Range, Step
from parakin.units import (
    ANGLE,
    LENGTH,
    NUMBER,
    SPEED,
    UNITS,
    Quantity,
    QuantityError,
    evaluate_expression,
    parse_quantity,
)

RPR3 = Path(__file__).parent / "machines" / "rpr3.yaml"
GOOD = """\
name: bench
source: Sizes were chosen.
sizes:
  R: 500 mm
  r: 0.2 * R
motion: tx ty rz
legs:
  kind: length
  joints: [q1, q2, q3]
  foot: {circle: R, at: [90 deg, 210 deg, 330 deg]}
  platform: {circle: r, at: [90 deg, 210 deg, 330 deg]}
  range: [200 mm, 650 mm]
head:
  - rz: {joint: turn, range: [-90 deg, 90 deg], reverse: true, offset: 90 deg, speed: 10 rpm}
  - tz: -r
limits:
  gaps: [{between: [q1, q2], range: [-300 mm, 300 mm]}]
  clearance: 50 mm
home: {X: 0 mm, Y: 0 mm, C: 0 deg}
"""


def write(tmp_path, text, name="m.yaml"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def errors_of(tmp_path, text, parameters=None):
    """The lines of the error, without the folder."""
    with pytest.raises(InputError) as caught:
        read_machine(write(tmp_path, text), parameters)
    return str(caught.value).replace(f"{tmp_path}/", "").split("\n")


# What is read.


def test_good_file(tmp_path):
    spec = read_machine(write(tmp_path, GOOD))
    assert (spec.name, spec.title, spec.source) == ("bench", "bench", "Sizes were chosen.")
    assert spec.motion == ("tx", "ty", "rz")
    assert spec.sizes == {"R": 500.0, "r": 100.0}
    assert [leg.kind for leg in spec.legs] == ["length"] * 3
    assert spec.legs[0].foot == (0.0, 500.0, 0.0)
    assert spec.legs[1].platform == pytest.approx((-50 * sqrt(3), -50, 0))
    assert spec.legs[2].drives == (Drive("q3", "mm", 200.0, 650.0),)
    turn = Drive("turn", "rad", -pi / 2, pi / 2, pytest.approx(2 * pi / 6))
    assert spec.head == (Step("rz", pi / 2, turn, -1.0), Step("tz", -100.0))
    assert spec.limits.gaps == (Gap("q1", "q2", -300.0, 300.0),)
    assert spec.limits.clearance == 50.0
    assert spec.home == {"X": 0.0, "Y": 0.0, "C": 0.0}
    assert [d.name for d in spec.drives] == ["q1", "q2", "q3", "turn"]
    assert all(type(d.name) is str for d in spec.drives)
    assert type(spec.source) is str


def test_users_file():
    spec = read_machine(RPR3)
    assert spec.name == "rpr3"
    assert spec.limits.passive == (Range("rz", radians(-45), radians(45)),)
    assert spec.legs[0].drives[0].speed == pytest.approx(20_000 / 60)
    assert len(RPR3.read_text().splitlines()) <= 25


def test_name_defaults_to_the_file(tmp_path):
    text = GOOD.replace("name: bench\n", "")
    assert read_machine(write(tmp_path, text, "mine.yaml")).name == "mine"
    with pytest.raises(InputError, match=r'm-1.yaml:1: file name "m-1" is not a plain word, expected a key "name"'):
        read_machine(write(tmp_path, text, "m-1.yaml"))


@pytest.mark.parametrize(
    ("words", "steps"),
    [
        ("vertical", ()),
        ("horizontal", (Step("rx", pi / 2),)),
        ("inclined 45 deg", (Step("rx", pi / 4),)),
        ("[rx: 90 deg, tz: 2 * R]", (Step("rx", pi / 2), Step("tz", 1000.0))),
    ],
)
def test_mounting(tmp_path, words, steps):
    assert read_machine(write(tmp_path, GOOD + f"mounting: {words}\n")).mounting == steps


def legs(tmp_path, motion, text):
    """The legs of a file made of a motion and the lines of its legs."""
    body = "".join(f"  {line}\n" for line in text.strip().split("\n"))
    return read_machine(write(tmp_path, f"source: x\nmotion: {motion}\nlegs:\n{body}home: {{X: 0}}\n")).legs


def test_values_for_all_legs_or_one_a_leg(tmp_path):
    two = legs(
        tmp_path,
        "tx ty",
        """
        kind: slider
        joints: [a, b]
        foot: [1 mm, 2 mm, 3 mm]
        platform: [[0, 0, 0], [1 in, 0, 0]]
        rail: [[2, 0, 0], [3, 4, 0]]
        rod: [400 mm, 0.5 m]
        branch: "+"
        range: [[0 mm, 10 mm], [0 mm, 20 mm]]
        speed: [1 m/s, 2 m/s]
        acceleration: 5 m/s^2""".replace("\n        ", "\n"),
    )
    assert [leg.foot for leg in two] == [(1.0, 2.0, 3.0)] * 2
    assert two[1].platform == (25.4, 0.0, 0.0)
    assert [leg.rail for leg in two] == [(1.0, 0.0, 0.0), pytest.approx((0.6, 0.8, 0.0))]
    assert [leg.rod for leg in two] == [400.0, 500.0]
    assert [leg.branch for leg in two] == ["+", "+"]
    assert [leg.drives[0] for leg in two] == [
        Drive("a", "mm", 0.0, 10.0, 1000.0, 5000.0),
        Drive("b", "mm", 0.0, 20.0, 2000.0, 5000.0),
    ]


COLUMN = """kind: column
joints: [[a1, h1], [a2, h2]]
platform: [0, 0, 0]
radius: 300 mm
rod: 400 mm
"""


def test_two_joints_a_leg(tmp_path):
    column = legs(
        tmp_path, "tx ty tz rx", COLUMN + "range: [[-60 deg, 60 deg], [0 mm, 500 mm]]\nspeed: [90 deg/s, 1 m/s]"
    )
    assert column[1].drives == (
        Drive("a2", "rad", pytest.approx(-pi / 3), pytest.approx(pi / 3), pytest.approx(pi / 2)),
        Drive("h2", "mm", 0.0, 500.0, 1000.0),
    )
    assert column[0].branch == "-"
    each = "range: [[[-60 deg, 60 deg], [0 mm, 500 mm]], [[0 deg, 1 rad], [0 mm, 9 mm]]]"
    assert [d.high for d in legs(tmp_path, "tx ty tz rx", COLUMN + each)[1].drives] == [1.0, 9.0]
    message = 'm.yaml:9: range: "0 mm" is a length, expected an angle (deg, rad)'
    with pytest.raises(InputError, match=re.escape(message)):
        legs(tmp_path, "tx ty tz rx", COLUMN + "range: [0 mm, 500 mm]")


CRANK = """kind: crank
joints: [a]
platform: [0, 0, 0]
pivot: [0, 0, 0]
axis: [0, 0, 2]
zero: [1, 1, 0]
arm: 100 mm
rod: 300 mm
range: [0 deg, 90 deg]"""


def test_directions(tmp_path):
    (leg,) = legs(tmp_path, "tx", CRANK)
    assert leg.axis == (0.0, 0.0, 1.0)
    assert leg.zero == pytest.approx((sqrt(0.5), sqrt(0.5), 0.0))
    with pytest.raises(InputError, match=r"m.yaml:9: zero: this direction is not at right angles to axis, expected"):
        legs(tmp_path, "tx", CRANK.replace("[1, 1, 0]", "[1, 1, 1]"))
    with pytest.raises(InputError, match=r"m.yaml:8: axis: the zero vector, expected a direction"):
        legs(tmp_path, "tx", CRANK.replace("[0, 0, 2]", "[0, 0, 0]"))


def test_cones(tmp_path):
    text = GOOD.replace(
        "limits:\n", "limits:\n  cones: [{at: foot, angle: 50 deg, axis: [0, 0, -2]}, {at: platform, angle: 1 rad}]\n"
    )
    assert read_machine(write(tmp_path, text)).limits.cones == (
        Cone("foot", radians(50), (0.0, 0.0, -1.0)),
        Cone("platform", 1.0),
    )


def test_every_kind_has_a_reader(tmp_path):
    """A kind's own fields are read by their type hints: an empty group names exactly those without a default."""
    for name, kind in KINDS.items():
        with pytest.raises(InputErrors) as caught:
            legs(tmp_path, "tx", f"kind: {name}")
        missing = {re.search(r'missing key "(\w+)" in legs', str(e))[1] for e in caught.value.errors}
        hints = {f.name for f in fields(kind)} - {"drives", "branch"}
        assert missing == hints | {"joints", "range"}


# Errors.

MISTAKES = [
    ("clearance: 50", "clearence: 50", ['m.yaml:18: unknown key "clearence" in limits, did you mean "clearance"?']),
    ("motion:", "moton:", ['m.yaml:1: missing key "motion"', 'm.yaml:6: unknown key "moton", did you mean "motion"?']),
    (
        "  range: [200",
        "  rnage: [200",
        ['m.yaml:7: missing key "range" in legs', 'm.yaml:12: unknown key "rnage" in legs, did you mean "range"?'],
    ),
    ("[200 mm,", "[200,", ['m.yaml:12: range: "200" needs a unit: mm, cm, m, in']),
    ("[200 mm,", "[200 deg,", ['m.yaml:12: range: "200 deg" is an angle, expected a length (mm, cm, m, in)']),
    ("[200 mm,", "[700 mm,", ["m.yaml:12: range: [700 mm, 650 mm] is empty, expected [low, high] with low < high"]),
    ("[200 mm, 650 mm]", "[200 mm]", ["m.yaml:12: range: expected a pair [low, high], got 1 value"]),
    ("[200 mm, 650 mm]", "650 mm", ['m.yaml:12: range: expected a pair [low, high], got "650 mm"']),
    ("[200 mm,", "[.nan,", ['m.yaml:12: range: ".nan": can\'t read "."']),
    ("[200 mm,", "[1e999 mm,", ['m.yaml:12: range: "1e999 mm" is not a finite value']),
    ("[200 mm,", "[-3000 km,", ['m.yaml:12: range: "-3000 km": unknown unit "km", did you mean "m"?']),
    ("[200 mm,", "[-3000 m,", ['m.yaml:12: range: "-3000 m" is out of range, expected -1 km to 1 km']),
    (" 50 mm", " -50 mm", ['m.yaml:18: clearance: "-50 mm" is out of range, expected more than 0 mm, at most 1 km']),
    ("circle: r,", "circle: -r,", ['m.yaml:11: circle: "-r" is out of range, expected more than 0 mm, at most 1 km']),
    ("circle: r,", "circle: l4,", ['m.yaml:11: circle: "l4": undefined size "l4", expected one of R, r']),
    ("0.2 * R", "0.2 * RR", ['m.yaml:5: r: "0.2 * RR": undefined size "RR", did you mean "R"?']),
    ("circle: R", "circle: R / r", ['m.yaml:10: circle: "R / r" is a number, expected a length (mm, cm, m, in)']),
    (
        "  r: 0.2",
        "  mm: 5 mm\n  r: 0.2",
        ["m.yaml:5: mm: a unit or a function has this name, expected another for a size"],
    ),
    ("kind: length", "kind: lenght", ['m.yaml:8: legs: unknown leg kind "lenght", did you mean "length"?']),
    (
        "  kind: length\n",
        "",
        ['m.yaml:7: legs: missing key "kind", expected one of column, crank, lambda, length, slider'],
    ),
    ("tx ty rz", "tx ty rw", ['m.yaml:6: motion: unknown word "rw", expected one of tx, ty, tz, rx, ry, rz']),
    (
        "sizes:\n",
        "sizes:\n  2R: 5 mm\n",
        ['m.yaml:4: size "2R" is no name, expected a plain word (letters, digits, _; at most 40)'],
    ),
    (
        "tx ty rz",
        "tx ty",
        ["m.yaml:7: legs: 3 joints (q1, q2, q3) for 2 words of motion (tx ty), expected as many joints as words"],
    ),
    ("[q1, q2, q3]", "[q1, q2, q1]", ['m.yaml:9: joint "q1" is used twice, first in line 9']),
    ("joint: turn", "joint: q2", ['m.yaml:14: joint "q2" is used twice, first in line 9']),
    (
        "[q1, q2, q3]",
        "[q1, q2, 3q]",
        ['m.yaml:9: joints: expected a plain word (letters, digits, _; at most 40), got "3q"'],
    ),
    ("[q1, q2]", "[q1, q_2]", ['m.yaml:17: between: unknown joint "q_2", did you mean "q2"?']),
    ("[q1, q2]", "[q1, turn]", ['m.yaml:17: between: joint "turn" turns, expected one that slides']),
    (
        "210 deg, 330 deg]}\n  r",
        "210 deg]}\n  r",
        ["m.yaml:11: platform: 2 values for 3 legs, expected one for all or one a leg"],
    ),
    ("true", "yes", ['m.yaml:14: reverse: expected true or false, got "yes"']),
    ("10 rpm", "10 mm/s", ['m.yaml:14: speed: "10 mm/s" is a speed, expected an angular speed (deg/s, rad/s, rpm)']),
    ("10 rpm", "0 rpm", ['m.yaml:14: speed: "0 rpm" is out of range, expected more than 0 (deg/s, rad/s, rpm)']),
    ("- tz: -r", "- -r", ['m.yaml:15: head: expected one transform such as tz: 100 mm, got "-r"']),
    ("- tz: -r", "- tw: -r", ['m.yaml:15: head: unknown transform "tw", expected one of tx, ty, tz, rx, ry, rz']),
    ("C: 0 deg", "C: 5 mm", ['m.yaml:19: C: "5 mm" is a length, expected an angle (deg, rad)']),
    ("C: 0 deg", "c: 0 deg", ['m.yaml:19: unknown key "c" in home, did you mean "C"?']),
    (
        "  clearance: 50 mm",
        "  passive: {tz: [0 mm, 1 mm]}",
        ["m.yaml:18: passive limit of tz, which is not in the motion tx ty rz"],
    ),
    ("motion:", "name: again\nmotion:", ['m.yaml:6: key "name" is written twice, first in line 1']),
    (
        "name: bench",
        "name: my bench",
        ['m.yaml:1: name: expected a plain word (letters, digits, _; at most 40), got "my bench"'],
    ),
    ("Sizes were chosen.", "", ['m.yaml:2: source: expected some words, got ""']),
    ("home: {", "home: [", ["m.yaml:19: not valid YAML: expected ',' or ']', but got '}'"]),
    ("  r: 0.2", "\tr: 0.2", ["m.yaml:5: not valid YAML: found character '\\t' that cannot start any token"]),
    (
        "name: bench",
        "name: !!python/name:os.system x",
        ['m.yaml:1: tag "tag:yaml.org,2002:python/name:os.system" is not known here, expected none'],
    ),
    (
        "name: bench",
        "mounting: inclned 3 deg\nname: x",
        ['m.yaml:1: mounting: unknown mounting "inclned 3 deg", did you mean "inclined"?'],
    ),
    (
        "name: bench",
        "mounting: [rz: {joint: q, range: [0 deg, 1 deg]}]",
        ['m.yaml:1: mounting: joint "q" can\'t be in the mounting, expected head or table'],
    ),
]


@pytest.mark.parametrize(("old", "new", "expected"), MISTAKES, ids=[m[1].strip()[:30] for m in MISTAKES])
def test_mistake(tmp_path, old, new, expected):
    assert old in GOOD
    assert errors_of(tmp_path, GOOD.replace(old, new, 1)) == expected


def test_several_errors_in_line_order(tmp_path):
    text = GOOD.replace("50 mm\n", "50\n").replace("R: 500 mm", "R: 500 furlong").replace("rz: {joint: turn,", "rz: {")
    text = text.replace("kind: length", "kind: length\n  branch: '+'")
    assert errors_of(tmp_path, text) == [
        'm.yaml:4: R: "500 furlong": unknown unit "furlong", expected a unit such as mm, in or deg',
        'm.yaml:9: unknown key "branch" in legs, expected one of '
        "kind, joints, range, speed, acceleration, jerk, platform, foot",
        'm.yaml:15: missing key "joint" in head',
        'm.yaml:19: clearance: "50" needs a unit: mm, cm, m, in',
    ]
    with pytest.raises(InputErrors) as caught:
        read_machine(write(tmp_path, text))
    assert [e.line for e in caught.value.errors] == [4, 9, 15, 19]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "m.yaml:1: empty, expected a machine's description"),
        (b"# only a comment\n", "m.yaml:1: empty, expected a machine's description"),
        (b"- a\n- b\n", "m.yaml:1: expected keys such as name, motion and legs, got a list"),
        (b"just words\n", 'm.yaml:1: expected keys such as name, motion and legs, got "just words"'),
        (b"a: 1\nb: \xff\xfe\n", "m.yaml:2: not a text file in UTF-8, expected YAML"),
        (b"a: 1\n\x00\n", "m.yaml:2: holds a character that YAML does not allow, expected text"),
        (b"a: 1\n---\nb: 2\n", "m.yaml:2: not valid YAML: but found another document"),
        (b"a: &x [*x]\n", "m.yaml:1: nested too deeply (does an alias hold itself?)"),
        (b"[" * 3000, "m.yaml: nested too deeply"),
        (b"x" * 200_000, "m.yaml: longer than 100000 bytes, expected a YAML file of some twenty lines"),
        (
            b"".join(b"%c: &%c [%s]\n" % (c, c, b"*%c,1," % (c - 1) * 8 if c > 97 else b"1") for c in b"abcdef"),
            "m.yaml:3: more than 20000 values, aliases included",
        ),
    ],
)  # fmt: skip
def test_no_machine_at_all(tmp_path, content, message):
    path = tmp_path / "m.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_machine(path)
    assert str(caught.value) == f"{tmp_path}/{message}"


def test_no_file(tmp_path):
    with pytest.raises(InputError, match="can't read this file: No such file or directory"):
        read_machine(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="can't read this file: Is a directory"):
        read_machine(tmp_path)


def test_machine_file(tmp_path):
    assert find_machine_file("tricept") == list_shipped_machines()["tricept"]
    assert find_machine_file(tmp_path / "x.yaml") == tmp_path / "x.yaml"
    with pytest.raises(InputError, match=r'unknown machine "tricpt", did you mean "tricept"\?'):
        find_machine_file("tricpt")


# Sizes from outside.


def test_parameters(tmp_path):
    path = write(tmp_path, GOOD)
    assert read_machine(path, {"R": 600.0}).sizes == {"R": 600.0, "r": pytest.approx(120.0)}
    assert read_machine(path, {"R": "10 in", "r": np.float64(7)}).sizes == {"R": pytest.approx(254.0), "r": 7.0}
    assert read_machine(path, {"r": "R / 2"}).legs[0].platform == (0.0, 250.0, 0.0)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"RR": 1.0}, 'parameters: unknown size "RR", did you mean "R"?'),
        ({"q": 1.0}, 'parameters: unknown size "q", expected one of R, r'),
        ({"R": "60 deg"}, 'parameters: R: "60 deg" is an angle, expected a length'),
        ({"R": "60"}, 'parameters: R: "60" is a number, expected a length'),
        ({"R": "60 mm +"}, 'parameters: R: "60 mm +": the end is not expected here'),
        ({"R": inf}, 'parameters: R: expected a finite number or text with a unit, got "inf"'),
        ({"R": None}, 'parameters: R: expected a finite number or text with a unit, got "None"'),
    ],
)
def test_bad_parameters(tmp_path, parameters, message):
    assert errors_of(tmp_path, GOOD, parameters) == [message]


# Quantities.


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("350 mm", LENGTH, 350.0),
        ("350mm", LENGTH, 350.0),
        ("13.78 in", LENGTH, 350.012),
        ("1.2 m", LENGTH, 1200.0),
        ("2 cm", LENGTH, 20.0),
        ("60 deg", ANGLE, pi / 3),
        ("60°", ANGLE, pi / 3),
        ("0.5 rad", ANGLE, 0.5),
        ("30 m/min", SPEED, 500.0),
        ("500 mm/s", SPEED, 500.0),
        ("0", LENGTH, 0.0),
        ("-0", ANGLE, 0.0),
        ("-(a + b)", LENGTH, -5.0),
        ("- -a", LENGTH, 3.0),
        ("2 * a - b / 2", LENGTH, 5.0),
        ("sqrt(a*a + 16 mm * 1 mm)", LENGTH, 5.0),
        ("a * sin(30 deg)", LENGTH, 1.5),
        ("a * cos(w)", LENGTH, 1.5),
        ("a * tan(w) / sqrt(3)", LENGTH, 3.0),
        ("a / b", NUMBER, 1.5),
        ("1e1 * .5", NUMBER, 5.0),
        ("6 mm / a", NUMBER, 2.0),
    ],
)
def test_quantities(text, kind, value):
    names = {"a": Quantity(3.0, (1, 0, 0)), "b": Quantity(2.0, (1, 0, 0)), "w": Quantity(pi / 3, (0, 1, 0))}
    assert parse_quantity(text, kind, names) == pytest.approx(value, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "value"),
    [("60 deg/s", pi / 3), ("10 rpm", pi / 3), ("5 m/s2", 5000.0), ("5 m/s^2", 5000.0), ("5 m/s²", 5000.0),
     ("180 deg/s2", pi), ("254 in/min", 254 * 25.4 / 60), ("3 rad/min", 0.05)],
)  # fmt: skip
def test_rates(text, value):
    assert evaluate_expression(text).value == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("unit", UNITS)
def test_unit(unit):
    factor, dimension = UNITS[unit]
    assert evaluate_expression(f"2 {unit}") == Quantity(2 * factor, dimension)
    assert evaluate_expression(f"(2{unit}) * 3").dimension == dimension


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("3 mm + 2 deg", '"3 mm + 2 deg": can\'t add a length and an angle'),
        ("3 mm - 2", '"3 mm - 2": can\'t subtract a length and a number'),
        ("3 mm * 2 mm", '"3 mm * 2 mm" is a product of dimension length^2, expected a length (mm, cm, m, in)'),
        ("sin(3 mm) * 1 mm", '"sin(3 mm) * 1 mm": sin of a length, expected an angle (deg, rad)'),
        ("sqrt(3 mm)", '"sqrt(3 mm)": square root of a length'),
        ("sqrt(-3)", '"sqrt(-3)": square root of a negative value'),
        ("1 mm / 0", '"1 mm / 0": division by zero'),
        ("sin 3", '"sin 3": sin needs its argument in brackets'),
        ("(3 mm", '"(3 mm": a bracket is not closed'),
        ("3 mm)", '"3 mm)": ")" is not expected here'),
        ("3 mm +", '"3 mm +": the end is not expected here'),
        ("2 ** 3", '"2 ** 3": "*" is not expected here'),
        ("nan", '"nan": undefined size "nan"'),
        ("inf mm", '"inf mm": undefined size "inf"'),
        ("1e300 * 1e300", '"1e300 * 1e300" is not a finite value'),
        ("__import__('os')", '"__import__(\'os\')": undefined size "__import__"'),
        ("9" * 400 + " mm", f'"{"9" * 57}..." is not a finite value'),
        ("(" * 90 + "1", f'"{"(" * 57}..." is nested too deeply'),
        ("- " * 90 + "1", f'"{"- " * 28}-..." is nested too deeply'),
        ("   ", "nothing here, expected a number with its unit or an expression"),
    ],
)  # fmt: skip
def test_bad_quantities(text, message):
    with pytest.raises(QuantityError) as caught:
        parse_quantity(text, LENGTH)
    assert str(caught.value) == message


# Fuzz: whatever a file holds, it is read or refused with a place.

SOURCES = [GOOD, *(p.read_text(encoding="utf-8") for p in list_shipped_machines().values())]
JUNK = st.one_of(
    st.text(max_size=12),
    st.sampled_from(list("{}[],:-&*!|>'\"%@`#\t\n?~0/")),
    st.sampled_from([".nan", ".inf", "0x10", "1e999", "<<:", "&a", "*a", "!!int", "---", "...", "()", "sqrt(", "mm"]),
    st.sampled_from(["9" * 500, "[" * 60, "(" * 60, "- " * 30, "a: {b: [c", "%YAML 9.9\n---"]),
    st.sampled_from(["\ud7ff", "\u2028", "\x85", "\ufeff", "null", "true"]),
)


def read_or_refuse(path):
    try:
        spec = read_machine(path)
    except InputError as error:
        for line in str(error).split("\n"):
            assert re.match(r"(parameters|.*\.yaml(:\d+)?): \S", line), line
            assert line.isprintable()
    else:
        assert all(isfinite(v) for v in spec.home.values())
        assert all(d.low < d.high for d in spec.drives)


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_mutated_files(tmp_path, data):
    text = data.draw(st.sampled_from(SOURCES))
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(text)))
        length = data.draw(st.integers(0, 12))
        text = text[:start] + data.draw(JUNK) + text[start + length :]
    path = tmp_path / "f.yaml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    read_or_refuse(path)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_swapped_values(tmp_path, data):
    """Pieces between YAML's signs change places, so most files still are YAML and the mistakes lie deeper."""
    text = data.draw(st.sampled_from(SOURCES))
    pieces = re.split(r"([\n,:\[\]{}])", text)
    for _ in range(data.draw(st.integers(1, 4))):
        at = 2 * data.draw(st.integers(0, len(pieces) // 2))
        pieces[at] = data.draw(st.sampled_from(pieces[::2])).replace("#", "")
    path = tmp_path / "f.yaml"
    path.write_text("".join(pieces), encoding="utf-8")
    read_or_refuse(path)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=200))
def test_binary(tmp_path, content):
    path = tmp_path / "f.yaml"
    path.write_bytes(content)
    read_or_refuse(path)


@settings(max_examples=300, deadline=None)
@given(text=st.text(alphabet="0123456789.eE+-*/() abmdegin\tsqrt/^²°,'\n", max_size=30))
def test_any_expression(text):
    try:
        assert isfinite(evaluate_expression(text, {"a": Quantity(2.0, (1, 0, 0))}).value)
    except QuantityError as error:
        assert str(error).isprintable()


# The shipped machines.


@pytest.mark.parametrize("name", list_shipped_machines())
def test_shipped(name):
    text = list_shipped_machines()[name].read_text(encoding="utf-8")
    spec = read_machine(list_shipped_machines()[name])
    assert spec.name == name
    assert text.startswith("#"), "says what the machine is"
    assert len(spec.source) > 60
    assert "chosen" in spec.source
    assert all(isfinite(d.low) and isfinite(d.high) for d in spec.drives)


def test_shipped_names():
    assert sorted(list_shipped_machines()) == [
        "hbg80_2d", "hbg80_3d", "hexapod", "lambda6", "linear_delta", "orthoglide", "orthoglide5_head",
        "orthoglide5_table", "tricept",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "sizes"),
    [
        ("tricept", {"R": 350, "r": 100, "l1": 300, "l2": 150}),
        ("hbg80_2d", {"l1": 400, "l2": 400}),
        ("hbg80_3d", {"l0": 600, "xPT1": 80, "yPT1": 80, "h": 120}),
        ("lambda6", {"C": 900, "D": 230, "c": 1200, "u": 800, "r": 300}),
    ],
)
def test_published_sizes(name, sizes):
    assert read_machine(list_shipped_machines()[name]).sizes == sizes


def ranges(name):
    return {d.name: (d.low, d.high) for d in read_machine(list_shipped_machines()[name]).drives}


def assert_inside(name, joints):
    for drive, q in zip(read_machine(list_shipped_machines()[name]).drives, joints, strict=True):
        assert drive.low < q < drive.high, drive


def test_tricept():
    assert ranges("tricept")["d1"] == (934, 1520)
    spec = read_machine(list_shipped_machines()["tricept"])
    assert [(s.axis, s.value, s.sign) for s in spec.head] == [
        ("tz", -300, 1), ("rz", 0, 1), ("ry", 0, -1), ("tz", -150, 1)
    ]  # fmt: skip
    assert spec.limits.passive == tuple(Range(n, pytest.approx(-pi / 3), pytest.approx(pi / 3)) for n in ("rx", "ry"))
    # (26)-(28) at some tilt, from the feet and platform points as read
    psi, theta, p = 0.3, -0.4, 1100.0
    sp, cp, st_, ct = sin(psi), cos(psi), sin(theta), cos(theta)
    rotation = np.array([[ct, 0, st_], [sp * st_, cp, -sp * ct], [-cp * st_, sp, cp * ct]])
    d = [hypot(*(rotation @ (np.array(leg.platform) - [0, 0, p]) - leg.foot)) for leg in spec.legs]
    big, small = 350.0, 100.0
    common = p * p + small**2 + big**2
    half = small * big / 2
    assert [x * x for x in d] == pytest.approx(
        [
            common - 2 * p * big * ct * sp - 2 * small * big * cp,
            common + p * big * (ct * sp - sqrt(3) * st_) + half * (-3 * ct - sqrt(3) * st_ * sp - cp),
            common + p * big * (ct * sp + sqrt(3) * st_) + half * (-3 * ct + sqrt(3) * st_ * sp - cp),
        ]
    )
    p = -spec.home["Z"] - 450
    assert_inside("tricept", [hypot(p, 250)] * 3 + [0, 0])


def test_hbg80():
    assert set(ranges("hbg80_2d").values()) == {(-400, 200)}
    home = read_machine(list_shipped_machines()["hbg80_2d"]).home
    x, y = home["X"], home["Y"]
    assert_inside("hbg80_2d", [x - sqrt(400**2 - y * y), y - sqrt(400**2 - x * x)])
    assert ranges("hbg80_3d") == dict.fromkeys(("Xhbg", "Yhbg", "Zhbg"), (-750, -350))
    spec = read_machine(list_shipped_machines()["hbg80_3d"])
    assert spec.home == {"X": 80, "Y": 80, "Z": -120}
    assert {leg.platform for leg in spec.legs} == {(-80, -80, 120)}
    assert [leg.rail for leg in spec.legs] == [(1, 0, 0), (0, 1, 0), (0, 0, -1)]
    assert_inside("hbg80_3d", [-600] * 3)


def test_lambda6():
    spec = read_machine(list_shipped_machines()["lambda6"])
    assert [d.name for d in spec.drives] == ["l1", "l2", "l3", "l4", "l5", "l6"]
    assert [leg.foot[:2] for leg in spec.legs] == [
        pytest.approx((900 * cos(radians(a)), 900 * sin(radians(a))), abs=1e-9) for a in (180, 60, -60)
    ]
    rise = sqrt(1200**2 - 670**2)
    reach = 0.75 * rise
    gap = reach + sqrt(reach**2 - 900**2 + 800**2)
    low = spec.home["Z"] - rise
    home = (*[low] * 3, *[low + gap] * 3)
    table = [
        (398.89, 299.68, 414.67, 1758.75, 1714.02, 1723.08),
        (164.59, 223.16, 467.37, 1587.58, 1565.02, 1514.00),
    ]
    for joints in (home, *table):
        assert_inside("lambda6", joints)
        for i, limit in enumerate(spec.limits.gaps):
            assert limit.low < joints[i + 3] - joints[i] < limit.high
            assert (limit.first, limit.second) == (f"l{i + 1}", f"l{i + 4}")


def test_orthoglide_is_designed_for_its_cube():
    """1/3 ≤ ψ ≤ 3 all over the cube and exactly 3 at two opposite corners; the strokes just cover the cube."""
    spec = read_machine(list_shipped_machines()["orthoglide"])
    length = spec.sizes["L"]
    assert length == pytest.approx(254.26446168553)
    a, b = -2 * length / sqrt(17), length / sqrt(11)
    assert b - a == pytest.approx(200)

    def roots(x, y, z):
        return [sqrt(length**2 - y * y - z * z), sqrt(length**2 - x * x - z * z), sqrt(length**2 - x * x - y * y)]

    def amplifications(x, y, z):
        s = roots(x, y, z)
        rods = np.array([[-s[0], y, z], [x, -s[1], z], [x, y, -s[2]]])
        return np.linalg.svd(np.linalg.solve(rods, np.diag([-v for v in s])), compute_uv=False)

    grid = list(product(np.linspace(a, b, 16), repeat=3))
    psi = np.array([amplifications(*p) for p in grid])
    assert psi.max() == pytest.approx(3)
    assert psi.min() > 1 / 3
    assert amplifications(a, a, a)[0] == pytest.approx(3)
    assert amplifications(b, b, b)[0] == pytest.approx(3)
    least = min(x + roots(x, y, z)[0] for x, y, z in grid)
    (low, high) = ranges("orthoglide")["rho_x"]
    assert low == pytest.approx(least)
    assert high == pytest.approx(b + length)
    for name in ("orthoglide", "orthoglide5_head", "orthoglide5_table"):
        assert ranges(name)["rho_y"] == (low, high)
    assert_inside("orthoglide", [length] * 3)
    assert_inside("orthoglide5_head", [length] * 3 + [0, 0])
    m = (a + b) / 2
    table = read_machine(list_shipped_machines()["orthoglide5_table"])
    assert [s.value for s in table.table[:3]] == pytest.approx([m, m, m - 100])
    assert_inside("orthoglide5_table", [m + sqrt(length**2 - 2 * m * m)] * 3 + [0, 0])


def test_hexapod():
    spec = read_machine(list_shipped_machines()["hexapod"])
    base = [(-22.95, 13.25), (22.95, 13.25), (22.95, 13.25), (0, -26.5), (0, -26.5), (-22.95, 13.25)]
    top = [(-1, 11.5), (1, 11.5), (10.459, -4.884), (9.459, -6.616), (-9.459, -6.616), (-10.459, -4.884)]
    assert np.allclose([leg.foot for leg in spec.legs], [(25.4 * x, 25.4 * y, 0) for x, y in base])
    assert np.allclose([leg.platform for leg in spec.legs], [(25.4 * x, 25.4 * y, 0) for x, y in top])
    tool = spec.sizes["tool"]
    z = spec.home["Z"] + tool
    assert_inside(
        "hexapod", [hypot(25.4 * (p[0] - f[0]), 25.4 * (p[1] - f[1]), z) for f, p in zip(base, top, strict=True)]
    )


def test_linear_delta():
    spec = read_machine(list_shipped_machines()["linear_delta"])
    rise = sqrt(spec.sizes["rod"] ** 2 - (spec.sizes["tower"] - spec.sizes["plate"]) ** 2)
    assert_inside("linear_delta", [spec.home["Z"] + spec.sizes["tool"] + rise] * 3)
    for x, y in [(200 * cos(w), 200 * sin(w)) for w in np.linspace(0, 2 * pi, 37)]:
        for leg in spec.legs:
            rod = np.array([leg.foot[0] - leg.platform[0] - x, leg.foot[1] - leg.platform[1] - y])
            assert 300 < sqrt(spec.sizes["rod"] ** 2 - rod @ rod) < 700


def test_quick():
    """Import and one file within a quarter of a second; the bound here is loose for a busy machine."""
    code = (
        "import time; t = time.perf_counter()\n"
        "from parakin.description import list_shipped_machines, read_machine\n"
        "read_machine(list_shipped_machines()['tricept']); print(time.perf_counter() - t)"
    )
    times = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(3)]
    assert min(times) < 0.6
