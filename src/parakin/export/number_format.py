"""Format values, bounds, counts and times for people."""

from __future__ import annotations

from math import degrees, isfinite


def format_fixed(value: float, digits: int, thousands: str = ",") -> str:
    """Format a number with fixed digits after the point; zero has no sign."""
    return format(round(value, digits) + 0.0, f"{thousands}.{digits}f")


def format_value(value: float, unit: str) -> str:
    """Format a value in mm, rad or 1: ``1,533.2 mm``, ``12.34°``; a small one with more digits; a dash for none."""
    if not isfinite(value):
        return "–"
    number, digits, mark = (degrees(value), 2, "°") if unit == "rad" else (value, 1, "" if unit == "1" else f" {unit}")
    while 1e-9 < abs(number) < 10.0**-digits and digits < 9:
        digits += 1
    return f"{format_fixed(number, digits)}{mark}"


def format_bound(value: float, unit: str) -> str:
    """Format a limit's bound without a unit of length and without trailing zeros: ``1,520``, ``-60°``."""
    number = f"{degrees(value) if unit == 'rad' else value:,.3f}".rstrip("0").rstrip(".")
    return f"{number}°" if unit == "rad" else number


def format_count(count: int, noun: str) -> str:
    """Format a count with its noun: ``1 record``, ``5,011 records``."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def format_duration(seconds: float) -> str:
    """Format a time: ``12.3 s``, ``4 min 34 s``, ``1 h 0 min 5 s``."""
    whole = round(seconds, 1) if seconds < 60.0 else round(seconds)
    if whole < 60:
        return f"{whole:g} s"
    hours, rest = divmod(int(whole), 3600)
    return f"{f'{hours:,} h ' if hours else ''}{rest // 60} min {rest % 60} s"


def format_use(value: float, limit: float, unit: str) -> str:
    """Format a value beside its limit, where there is one."""
    of_limit = f" of {limit:g}" if isfinite(limit) else ""
    return f"{format_fixed(value, 1)}{of_limit} {unit}"
