"""The options --workpiece and --place: what they accept, and what they say of the rest."""

import math

import numpy as np
import pytest

import parakin as pk
from parakin.commands.workpiece import parse_bounds, parse_workpiece


@pytest.mark.parametrize(
    ("text", "point", "image"),
    [
        ("1,2,3", (1, 1, 1), (2, 3, 4)),
        ("X=1in, C=90", (1, 0, 0), (25.4, 1, 0)),
        ("a=90", (0, 1, 0), (0, 0, 1)),
        ("b=90", (0, 0, 1), (1, 0, 0)),
        ("C=0.5rad", (1, 0, 0), (math.cos(0.5), math.sin(0.5), 0)),
        ("0,0,0,90,0,90", (0, 1, 0), (0, 0, 1)),  # A first, then C
        ("-1,-2,-3", (0, 0, 0), (-1, -2, -3)),
    ],
)
def test_workpiece(text, point, image):
    frame = parse_workpiece(text)
    np.testing.assert_allclose(frame[:, :3] @ point + frame[:, 3], image, atol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "1,2",
        "1,2,3,4",
        "1,2,3,4,5,6,7",
        "1,2,x",
        "nan,0,0",
        "1e99,0,0",
        "X=1,2,3",
        "X=1,X=2",
        "Q=3",
        "X=1deg",
        "1_0,0,0",
    ],
)
def test_bad_workpiece(text):
    with pytest.raises(pk.InputError) as caught:
        parse_workpiece(text)
    assert str(caught.value).startswith("--workpiece: ")
    assert "\n" not in str(caught.value)


def test_bounds():
    found = parse_bounds("x=-100:100, Y=2in ,Z=-1.7m:-1500mm,C=-90:0.5rad")
    assert list(found) == ["X", "Y", "Z", "C"]
    assert found["X"] == (-100.0, 100.0)
    assert found["Y"] == (50.8, 50.8)
    assert found["Z"] == pytest.approx((-1700.0, -1500.0))
    assert found["C"] == pytest.approx((-math.pi / 2, 0.5))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "X",
        "X=",
        "=3",
        "X=1:",
        "X=:1",
        "X=1:2:3",
        "X=5:4",
        "X=1,X=2:3",
        "Q=1",
        "X=1,,Y=2",
        "X=1deg",
        "C=1mm",
        "X=nan:1",
    ],
)
def test_bad_bounds(text):
    with pytest.raises(pk.InputError) as caught:
        parse_bounds(text)
    assert str(caught.value).startswith("--place: ")
    assert "\n" not in str(caught.value)
