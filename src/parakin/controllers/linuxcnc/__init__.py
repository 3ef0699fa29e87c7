"""LinuxCNC: kinematics in C, the configuration that it starts with, and programs."""

from ..controller import Controller
from .program import build_linuxcnc_run

CONTROLLER = Controller(title="LinuxCNC", interpolation="pose", build_run=build_linuxcnc_run)
