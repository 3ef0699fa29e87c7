"""Programs for controllers: a trajectory as G-code."""

from .joints.program import joint_program
from .joints.reader import JointProgram, read_joint_program
from .linuxcnc.program import linuxcnc_program, program_seconds

__all__ = ["JointProgram", "joint_program", "linuxcnc_program", "program_seconds", "read_joint_program"]
