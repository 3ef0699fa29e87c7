"""How many steps or counts a joint has for a mm or degree."""

from __future__ import annotations

from math import floor, log10

from ....errors import InputError
from ....model.elements import Drive
from ....units import name_display_unit, to_display
from ..axis_rates import choose_drive_rates

RESERVE = 1.25  # of a joint's speed and acceleration, for corrections of a loop
_FINEST = 1000.0  # steps a mm or degree that are chosen at most


def find_scale(drive: Drive, most_rate: float, title: str) -> tuple[float, bool]:
    """Find a drive's steps or counts a mm or degree, signed, and whether the description says them.

    Where it does not, a round number is chosen with which the card can follow the joint's speed.

    Raises :class:`InputError` where counts or lead alone is given, or where the card is too slow for both.
    """
    speed = to_display(choose_drive_rates(drive)[0], drive.unit)
    if drive.counts is None and drive.lead is None:
        return _round_down(min(_FINEST, most_rate / (RESERVE * speed))), False
    if drive.counts is None or drive.lead is None:
        missing = "counts" if drive.counts is None else "lead"
        raise InputError(f"joint {drive.name} has no {missing}, expected counts and lead, or neither")
    scale = drive.counts / to_display(drive.lead, drive.unit)
    rate = RESERVE * speed * abs(scale)
    if rate > most_rate:
        unit = name_display_unit(drive.unit)
        raise InputError(
            f"joint {drive.name}: {speed:g} {unit}/s at {abs(scale):g} steps a {unit} and {RESERVE - 1.0:.0%} for "
            f"corrections are {rate:.0f} steps a second, the {title} makes at most {most_rate:.0f}"
        )
    return scale, True


def _round_down(value: float) -> float:
    """Round down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** floor(log10(value))
    return max(digit * power for digit in (1.0, 2.0, 5.0) if digit * power <= value * (1.0 + 1e-9))
