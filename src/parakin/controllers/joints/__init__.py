"""Controllers without kinematics: every joint is an axis, and every block moves the joints."""

from ..controller import Controller
from .program import make_joint_program

CONTROLLER = Controller(
    title="a controller without kinematics",
    interpolation="joints",
    make_program=lambda trajectory, forced, tolerance: make_joint_program(trajectory, forced=forced),
)
