"""LinuxCNC: kinematics in C, the configuration that it starts with, and programs."""

from ..controller import Controller
from .predicted_time import predict_linuxcnc_time
from .program import make_linuxcnc_program

CONTROLLER = Controller(
    title="LinuxCNC",
    interpolation="pose",
    make_program=lambda trajectory, forced, tolerance: make_linuxcnc_program(
        trajectory, forced=forced, tolerance=tolerance
    ),
    predict_time=predict_linuxcnc_time,
)
