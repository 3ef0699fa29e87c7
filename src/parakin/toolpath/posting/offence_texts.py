"""Offences in words: what would be, which limit it breaks, and where on the path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...model.limits import Limit
from .frames import PathLimit
from .posted import Offence, Posted


@dataclass(frozen=True)
class OffenceText:
    """An offence's text, and its numbers: value, bound, unit and excess."""

    text: str
    numbers: tuple[float, float, str, float]


def describe_path_limit(limits: Sequence[PathLimit], index: int, record: int) -> OffenceText:
    """Describe one of the path's own limits at a record; the one past the last is that joints do not exist."""
    if index == len(limits):
        return OffenceText("the machine can't take this pose", (math.nan, math.nan, "1", math.inf))
    limit = limits[index]
    value = float(limit.values[record])
    return OffenceText(limit.describe(format_measure(value, limit.unit, 0.0)), (value, 0.0, limit.unit, abs(value)))


def describe_broken_limit(limit: Limit, excess: float) -> OffenceText:
    """Describe a limit of the machine that is broken by ``excess``, the size of its negative margin."""
    if limit.side == "reach":
        return _describe_reach(limit, excess)
    if not math.isfinite(excess):
        return OffenceText(f"{limit.subject} can't be told at this pose", (math.nan, limit.bound, limit.unit, math.inf))
    value = limit.value(-excess)
    would_be, bound = format_measure(value, limit.unit, limit.bound), format_bound(limit.bound, limit.unit)
    text = f"{limit.subject} would be {would_be}, limit {bound}"
    return OffenceText(text, (value, limit.bound, limit.unit, excess))


def _describe_reach(limit: Limit, excess: float) -> OffenceText:
    if limit.unit == "1":
        return OffenceText("the head can't point the tool that way", (-excess, 0.0, "1", excess))
    text = f"{limit.subject} can't close"
    if not math.isfinite(excess):
        return OffenceText(text, (math.nan, 0.0, "mm", math.inf))
    if limit.bound > 0.0:
        rod = limit.bound
        needed = math.sqrt(rod * rod + excess)
        shown = format_measure(needed - rod, "mm", 0.0)
        return OffenceText(f"{text}: its rod would have to be {shown} longer", (needed, rod, "mm", needed - rod))
    return OffenceText(f"{text} there", (-math.sqrt(excess), 0.0, "mm", math.sqrt(excess)))


def describe_place(posted: Posted, offence: Offence, source: str | None = None) -> str:
    """Describe where an offence is: its source and line, on a motion with the place.

    ``part.cls:214`` at a record; ``part.cls:214: 37 % on the way there, X 12.3 Y -40.1 Z -1650.2`` on the motion to it,
    ``from 37 %`` where the offence begins there and its value is that of a later place. ``source`` is what the path's
    source is called, its own name by default.
    """
    where = f"{source or posted.path.source}:{offence.line}"
    if offence.share >= 1.0:
        return where
    start, end = posted.poses[offence.record - 1], posted.poses[offence.record]
    named = zip(posted.machine.axes, start + offence.begins * (end - start), strict=True)
    tip = " ".join(f"{letter} {value:.1f}" for letter, value in named if letter in "XYZ")
    since = "from " if offence.begins < offence.share else ""
    return f"{where}: {since}{_format_percent(offence.begins)} % on the way there, {tip}"


def _format_percent(fraction: float) -> str:
    percent = 100.0 * fraction
    return f"{percent:.0f}" if 1.0 <= percent <= 99.0 else f"{percent:.2f}"


def format_measure(value: float, unit: str, against: float) -> str:
    """Format a value with its unit, ``1,533.2 mm``, in as many digits as tell it from the value ``against``.

    Angles are given in rad and shown in degrees, ``12.34°``.
    """
    shown, other = (math.degrees(value), math.degrees(against)) if unit == "rad" else (value, against)
    digits = 1
    while digits < 9 and abs(shown - other) < 10.0**-digits:
        digits += 1
    return _append_unit(f"{shown:,.{digits}f}", unit)


def format_bound(value: float, unit: str) -> str:
    """Format a limit's bound, a round number without decimals: ``1,520``; angles in degrees, ``60°``."""
    shown = math.degrees(value) if unit == "rad" else value
    text = f"{shown:,.6f}".rstrip("0").rstrip(".")
    return f"{text}°" if unit == "rad" else text


def _append_unit(text: str, unit: str) -> str:
    return f"{text}°" if unit == "rad" else text if unit == "1" else f"{text} {unit}"
