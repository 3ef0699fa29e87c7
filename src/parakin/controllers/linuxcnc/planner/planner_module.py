"""Write the planner module: LinuxCNC's coordinated motion within the joints' limits."""

from __future__ import annotations

from ....machine import Machine
from ..realtime_module import RealtimeModule, hash_realtime_module, read_source, write_realtime_module
from ..tape_to_c import format_c

# A timed motion may pass a joint's speed and acceleration by this factor before it is slowed: a spline through the
# points of a trajectory that uses the limits fully is beyond them by a little here and there.
TIMED_SLACK = 1.02
NO_TOLERANCE = 0.1  # mm by which corners are cut where a program says G64 without a tolerance
CHECKS = 16  # places in which a motion is looked at before it is taken
SIGNAL = 63  # the analog output by which a program says that its motions have given times
_FILES = ("state.c", "queue.c", "path.c", "profile.c", "execution.c", "tool.c", "admission.c", "interface.c")
_NOTE = """\
It keeps every joint's speed and acceleration, in programs, MDI and probing, at any feed override and in every pause.
   The ini file names it: [TRAJ] TPMOD.
   """


def name_planner(machine: Machine) -> str:
    """Name the planner module."""
    return f"{machine.name}_tp"


def write_planner(machine: Machine) -> str:
    """Write the C source of a machine's planner."""
    return write_realtime_module(machine, _make_module(machine))


def hash_planner(machine: Machine) -> str:
    """Hash a machine's planner and model, so that a module of an older description is recognised."""
    return hash_realtime_module(machine, _make_module(machine))


def _make_module(machine: Machine) -> RealtimeModule:
    return RealtimeModule(
        name_planner(machine),
        "LinuxCNC's trajectory planner of",
        f"{_write_numbers()}\n{read_source(__package__, *_FILES)}",
        ("motion.h", "tp.h", "emccfg.h"),
        _NOTE,
    )


def _write_numbers() -> str:
    return "\n".join(
        [
            f"#define TIMED_SLACK {format_c(TIMED_SLACK)} /* by which a timed motion may pass a joint's limits */",
            f"#define NO_TOLERANCE {format_c(NO_TOLERANCE)} /* mm: where a program says G64 without one */",
            f"#define CHECKS {CHECKS} /* places in which a motion is looked at before it is taken */",
            f"#define SIGNAL {SIGNAL} /* M67 E{SIGNAL} Q1: the motions that follow have given times; Q0 ends that */",
            "",
        ]
    )
