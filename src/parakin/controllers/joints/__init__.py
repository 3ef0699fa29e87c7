"""Controllers without kinematics: every joint is an axis, and every block moves the joints."""

from ..controller import Controller, ControllerRun
from .program import make_joint_program

CONTROLLER = Controller(
    title="a controller without kinematics",
    interpolation="joints",
    build_run=lambda trajectory: ControllerRun(lambda forced, tolerance: make_joint_program(trajectory, forced=forced)),
)
