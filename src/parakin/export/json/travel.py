"""The travel left at a pose as an object for JSON, ``parakin.reach/1``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ...units import name_display_unit, to_display
from .performance import encode_pose

if TYPE_CHECKING:
    from ...arrays import Array
    from ...kinematics.travel import Travel, TravelEnd
    from ...machine import Machine


def encode_travel(machine: Machine, pose: Array, travels: Mapping[str, Travel]) -> dict[str, Any]:
    """Encode the travel along axes or directions, by their names, both ways; mm and degrees."""
    units = dict(zip(machine.axes, machine.axis_units, strict=True))
    return {
        "schema": "parakin.reach/1",
        "machine": machine.name,
        "pose": encode_pose(machine, pose),
        "travel": [
            {
                "along": along,
                "unit": name_display_unit(units[along]) if along in units else "times",
                "back": _encode_end(machine, travel.back, units.get(along, "1")),
                "ahead": _encode_end(machine, travel.ahead, units.get(along, "1")),
            }
            for along, travel in travels.items()
        ],
    }


def _encode_end(machine: Machine, end: TravelEnd, unit: str) -> dict[str, Any]:
    return {
        "distance": to_display(end.distance, unit),
        "limit": end.limit,
        "pose": encode_pose(machine, end.pose),
    }
