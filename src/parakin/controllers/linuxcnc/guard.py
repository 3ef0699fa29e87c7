"""Write the guard: a realtime component that watches how near the machine is to its limits."""

from __future__ import annotations

from ...machine import Machine
from .realtime_module import RealtimeModule, hash_realtime_module, read_source, write_realtime_module

_NUMBERS = {
    "TRAILS": ("10.0", "cycles at full speed by which interpolated joints may be behind the pose"),
    "LATENCY": ("4.0", "cycles from a command to the axes' answer"),
    "PARTS": ("4", "of the way to where the machine stops, at whose ends joints' speeds are looked at"),
    "FOR_CURVES": ("2.0", "times the way to a singularity that a stop takes: the law of its margin holds nearby only"),
    "SWINGS": ("1.0", "of a joint's speed: the most that a jog may ask for"),
}


def name_guard(machine: Machine) -> str:
    """Name the guard."""
    return f"{machine.name}_guard"


def write_guard(machine: Machine) -> str:
    """Write the C source of a machine's guard."""
    return write_realtime_module(machine, _make_module(machine))


def hash_guard(machine: Machine) -> str:
    """Hash a machine's guard, so that a module of an older description is recognised."""
    return hash_realtime_module(machine, _make_module(machine))


def _make_module(machine: Machine) -> RealtimeModule:
    numbers = [f"#define {name} {value} /* {why} */" for name, (value, why) in _NUMBERS.items()]
    body = "\n".join([*numbers, "", read_source(__package__, "guard.c")])
    return RealtimeModule(name_guard(machine), "keeps moves by hand within the limits of", body)
