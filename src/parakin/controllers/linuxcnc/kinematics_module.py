"""Write the kinematics module: how LinuxCNC asks for a machine's model."""

from __future__ import annotations

from ...machine import Machine
from .realtime_module import RealtimeModule, hash_realtime_module, read_source, write_realtime_module

_FILES = ("state.c", "inverse.c", "forward.c", "switch.c", "jacobian.c", "set_up.c")


def name_kinematics(machine: Machine) -> str:
    """Name the kinematics module; of LinuxCNC's own only ``xyzab_tdr_kins`` is built likewise."""
    return f"{machine.name}_kins"


def write_module(machine: Machine) -> str:
    """Write the C source of a machine's kinematics module."""
    return write_realtime_module(machine, _make_module(machine))


def hash_kinematics(machine: Machine) -> str:
    """Hash a machine's kinematics, so that a module of an older description is recognised."""
    return hash_realtime_module(machine, _make_module(machine))


def _make_module(machine: Machine) -> RealtimeModule:
    sources = read_source(f"{__package__}.kins", *_FILES)
    return RealtimeModule(name_kinematics(machine), "LinuxCNC's kinematics of", sources, ("emcmotcfg.h",))
