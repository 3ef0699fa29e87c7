"""Quantities and expressions: what is read, and every kind of error."""

from __future__ import annotations

from math import isfinite, pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
    names = {"a": Quantity(3.0, (1, 0, 0, 0)), "b": Quantity(2.0, (1, 0, 0, 0)), "w": Quantity(pi / 3, (0, 1, 0, 0))}
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
        ("nan", '"nan": expected a number, got "nan"'),
        ("inf mm", '"inf mm": expected a number, got "inf"'),
        ("1e300 * 1e300", '"1e300 * 1e300" is not a finite value'),
        ("__import__('os')", '"__import__(\'os\')": expected a number, got "__import__"'),
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


@settings(max_examples=300, deadline=None)
@given(text=st.text(alphabet="0123456789.eE+-*/() abmdegin\tsqrt/^²°,'\n", max_size=30))
def test_any_expression(text):
    try:
        assert isfinite(evaluate_expression(text, {"a": Quantity(2.0, (1, 0, 0, 0))}).value)
    except QuantityError as error:
        assert str(error).isprintable()
