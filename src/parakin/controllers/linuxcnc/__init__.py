"""LinuxCNC: kinematics and planner in C, the configuration that it starts with, and programs."""

from ..controller import Controller, ControllerRun
from .program import make_linuxcnc_program

CONTROLLER = Controller(
    title="LinuxCNC",
    interpolation="pose",
    build_run=lambda trajectory: ControllerRun(
        lambda forced, tolerance: make_linuxcnc_program(trajectory, forced=forced)
    ),
)
