"""LinuxCNC: kinematics in C, the configuration that it starts with, and programs."""

from ..controller import Controller
from .program import make_linuxcnc_program, predict_linuxcnc_seconds

CONTROLLER = Controller(
    title="LinuxCNC",
    interpolation="pose",
    make_program=lambda trajectory, forced, tolerance: make_linuxcnc_program(
        trajectory, forced=forced, tolerance=tolerance
    ),
    predict_seconds=predict_linuxcnc_seconds,
)
