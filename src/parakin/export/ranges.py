"""Values and bounds in words."""

from __future__ import annotations

from math import degrees, isfinite


def shown(value: float, unit: str) -> str:
    """A value for people: ``1,533.2 mm``, ``12.34°``; as many digits as a small one needs; a dash for none."""
    if not isfinite(value):
        return "–"
    number, digits, mark = (degrees(value), 2, "°") if unit == "rad" else (value, 1, "" if unit == "1" else f" {unit}")
    while 1e-9 < abs(number) < 10.0**-digits and digits < 9:
        digits += 1
    return f"{round(number, digits) + 0.0:,.{digits}f}{mark}"


def edge(value: float, unit: str) -> str:
    """A limit's bound, without a unit of length and without idle zeros: ``1,520``, ``-60°``."""
    number = f"{degrees(value) if unit == 'rad' else value:,.3f}".rstrip("0").rstrip(".")
    return f"{number}°" if unit == "rad" else number
