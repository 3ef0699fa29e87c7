"""Say in words what limits a machine, for its operator."""

from __future__ import annotations

from ....export.number_format import format_value
from ....machine import Machine
from ....model.limits import Limit
from ....performance.singularities import list_margin_names


def describe_limits(machine: Machine) -> list[str]:
    """Describe limits and singularities, in the order in which the guard counts them."""
    limits = [describe_limit(limit) for limit in machine.limit_definitions]
    return limits + [f"singularity: {name}" for name in list_margin_names(machine)]


def describe_limit(limit: Limit) -> str:
    """Describe a limit: ``leg d1: at most 1,520.0 mm``."""
    if limit.side == "reach":
        return f"{limit.subject}: end of its reach"
    word = "at most" if limit.side == "max" else "at least"
    return f"{limit.subject}: {word} {format_value(limit.bound, limit.unit)}"
