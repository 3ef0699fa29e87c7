"""Write the kinematics module: how LinuxCNC asks for a machine's model."""

from __future__ import annotations

from ...machine import Machine
from .hand_box import HandBox
from .model_header import write_array
from .realtime_module import RealtimeModule, hash_realtime_module, read_source, write_realtime_module
from .tape_to_c import format_c

_FILES = ("state.c", "inverse.c", "forward.c", "switch.c", "jacobian.c", "set_up.c")


def name_kinematics(machine: Machine) -> str:
    """Name the kinematics module; of LinuxCNC's own only ``xyzab_tdr_kins`` is built likewise."""
    return f"{machine.name}_kins"


def write_module(machine: Machine, box: HandBox | None = None) -> str:
    """Write the C source of a machine's kinematics module.

    box : in which every pose is proved to be inside all limits and clear of singularities; None: each pose is measured
    """
    return write_realtime_module(machine, _make_module(machine, box))


def hash_kinematics(machine: Machine, box: HandBox | None = None) -> str:
    """Hash a machine's kinematics, so that a module of an older description is recognised."""
    return hash_realtime_module(machine, _make_module(machine, box))


def _make_module(machine: Machine, box: HandBox | None) -> RealtimeModule:
    sources = f"{_write_box(box)}\n{read_source(f'{__package__}.kins', *_FILES)}"
    return RealtimeModule(name_kinematics(machine), "LinuxCNC's kinematics of", sources, ("emcmotcfg.h",))


def _write_box(box: HandBox | None) -> str:
    lines = [f"#define HAND_BOX {int(box is not None)} /* poses in it need no measuring: mm, rad */"]
    if box is not None:
        ends = (("box_low", box.low), ("box_high", box.high))
        lines += [write_array("double", name, [format_c(value) for value in end.tolist()]) for name, end in ends]
    return "\n".join([*lines, ""])
