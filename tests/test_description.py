"""Machine files: what is read, and sizes from outside."""

from __future__ import annotations

import re
from dataclasses import fields
from math import inf, pi, radians, sqrt

import numpy as np
import pytest
from machine_texts import GOOD, RPR3, errors_of, write

from parakin.description import read_machine
from parakin.errors import InputError, InputErrors
from parakin.model.elements import Cone, Drive, Gap, Range, Step
from parakin.model.legs import KINDS

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
