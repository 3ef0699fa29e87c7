"""Write a machine's placement, traced from its description, as a Python function without loops."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

from ....algebra import Mat, Scalar, Trace, Vec, apply, make_axis_rotation, sincos
from ....export.machine.scene import trace_scene
from ....kernels import tape as t
from ....kernels.tape import compile_tape
from ....kernels.tape_text import InputVector, Language, list_statements
from ....kinematics.rotations import TURNS
from ....machine import Machine
from ....model.chain import UNIT

_PYTHON = Language(
    {
        t.SINCOS: "sin({0}) cos({0})",
        t.DIV: "{0} / {1}",
        t.SQRT: "sqrt({0})",
        t.ATAN2: "atan2({0} + 0.0, {1} + 0.0)",
        t.MIN: "min({0}, {1})",
        t.MAX: "max({0}, {1})",
        t.ABS: "fabs({0})",
        t.COPYSIGN: "copysign({0}, {1})",
        t.SELECT: "{2} if {0} < {1} else {3}",
    },
    "1e999",
)
_FUNCTION = '''\
def place_points(pose, joints, tool):
    """Place all points of the machine: pose, joints and tool length as LinuxCNC has them, mm and degrees."""
{lines}
    return [
{results}
    ]
'''
_DEGREE = pi / 180.0


def write_placement(machine: Machine) -> str:
    """Write ``place_points(pose, joints, tool)``: the coordinates in M of all points of home's scene, one by one.

    Behind them come the rotation, row by row, and the origin of the frame in which poses are given.
    """
    trace, axes, joints = Trace(), len(machine.axes), len(machine.joints)
    given = trace.inputs(axes + joints + 1)
    pose = _convert_to_radians(given[:axes], machine.axis_units)
    q = _convert_to_radians(given[axes:-1], machine.joint_units)
    points, frame = trace_scene(machine, shift_tip(machine, pose, given[-1]), q)
    results = [value for item in points for value in item.ravel().tolist()]
    results += [*frame[:, :3].ravel().tolist(), *frame[:, 3].tolist()]
    inputs = [InputVector("pose", axes), InputVector("joints", joints), InputVector("tool", 1)]
    statements, names = list_statements(compile_tape(trace, results, axes + joints + 1), inputs, _PYTHON)
    lines = [f"    {name} = {value}".replace("tool[0]", "tool") for name, value in statements]
    return _FUNCTION.format(
        lines="\n".join(lines),
        results="\n".join(f"        {', '.join(names[i : i + 3])}," for i in range(0, len(names), 3)),
    )


def shift_tip(machine: Machine, pose: Sequence[Scalar], length: Scalar) -> list[Scalar]:
    """Shift a pose of LinuxCNC to the machine's own tip, of a tool longer by ``length``.

    LinuxCNC adds the length along Z; the tool's axis Rz(C)·Ry(B)·Rx(A)·z leads from the tip into the holder.
    """
    k: Vec = UNIT["tz"]
    for letter, word in zip(TURNS, ("rx", "ry", "rz"), strict=True):
        if letter in machine.axes:
            turn: Mat = make_axis_rotation(word, *sincos(pose[machine.axes.index(letter)]))
            k = apply(turn, k)
    shift = dict(zip("XYZ", (k[0], k[1], k[2] - 1.0), strict=True))
    return [
        value + length * shift[axis] if axis in shift else value for axis, value in zip(machine.axes, pose, strict=True)
    ]


def _convert_to_radians(values: Sequence[Scalar], units: Sequence[str]) -> list[Scalar]:
    return [value * _DEGREE if unit == "rad" else value for value, unit in zip(values, units, strict=True)]
