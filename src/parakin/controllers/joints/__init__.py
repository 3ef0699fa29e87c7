"""Controllers without kinematics: every joint is an axis, and every block moves the joints.

``joint_motions.py`` is the common model of their programs, ``dialect.py`` how a control is told one. This folder's own
dialect is plain G-code; the others are files beside it, as ``fanuc.py``.
"""

from dataclasses import replace

from .gcode import GCODE
from .program import describe_joint_control

CONTROLLER = describe_joint_control(replace(GCODE, title="a controller without kinematics"), ".ngc")
