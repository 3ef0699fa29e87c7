"""What all cards that make steps have in common: the keys of a joint in the ini file."""

from __future__ import annotations

from ....model.elements import Drive
from ....units import to_display
from ..axis_rates import choose_drive_rates
from ..number_text import format_number
from .scale import RESERVE


def list_step_keys(drive: Drive, pulse: float, direction: float) -> list[str]:
    """List timing and bounds of a step generator; the shortest pulse and the time beside a change of direction, ns."""
    speed, acceleration = (to_display(rate, drive.unit) for rate in choose_drive_rates(drive))
    return [
        f"STEPLEN = {pulse:.0f}",
        f"STEPSPACE = {pulse:.0f}",
        f"DIRSETUP = {direction:.0f}",
        f"DIRHOLD = {direction:.0f}",
        f"STEPGEN_MAXVEL = {format_number(RESERVE * speed)}",
        f"STEPGEN_MAXACCEL = {format_number(RESERVE * acceleration)}",
    ]


def list_step_settings(channel: str, index: int) -> list[str]:
    """List the lines that give a step generator the values of the ini file; ``channel`` is its pins' prefix."""
    keys = {
        "position-scale": "SCALE",
        "steplen": "STEPLEN",
        "stepspace": "STEPSPACE",
        "dirsetup": "DIRSETUP",
        "dirhold": "DIRHOLD",
        "maxvel": "STEPGEN_MAXVEL",
        "maxaccel": "STEPGEN_MAXACCEL",
    }
    return [f"setp {channel}.{pin} [JOINT_{index}]{key}" for pin, key in keys.items()]
