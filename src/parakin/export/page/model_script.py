"""Write a machine's equations as JavaScript functions, which a page and its worker share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...algebra import Scalar, Trace
from ...kernels.tape import Tape, compile_tape
from ...kernels.tape_text import InputVector
from ...machine import Machine
from ...performance.characteristic_length import choose_characteristic_length
from ...performance.jacobians import trace_unit_wrenches
from ..machine.scene import trace_scene
from .mode_traces import trace_inverse, trace_margins
from .tape_to_js import write_function


def write_model(machine: Machine) -> str:
    """Write the functions of a machine; all take and return arrays, mm and rad.

    ================= =================================================================================================
    inverse           pose, signs of the working mode -> joints; NaN out of reach
    inverseWithFirst  pose, signs, [first joint of the wrist] -> joints; only of a machine with a wrist
    freedom           pose -> [sin² of the angle off the wrist's pole]
    margins           pose, joints, signs -> every limit's margin
    begin             near pose, joints -> the motion's coordinates
    closures          coordinates, joints -> closures, mm, then their derivatives by the coordinates, row by row
    end               coordinates, joints -> pose
    wrenches          pose, joints -> the rows of A that tell parallel singularities, in one unit
    placePoints       pose, joints -> the points of home's scene in M; then rotation and origin of the poses' frame
    ================= =================================================================================================
    """
    functions = dict(_write_functions(machine))
    return f"const model = (() => {{\n{''.join(functions.values())}return {{{', '.join(functions)}}};\n}})();\n"


def _write_functions(machine: Machine) -> Iterator[tuple[str, str]]:
    """Yield names and definitions."""
    pose, joints = InputVector("x", len(machine.axes)), InputVector("q", len(machine.joints))
    signs, first = InputVector("s", len(machine.mode)), InputVector("first", 1)
    coordinates = InputVector("y", len(machine.structure.coordinates))

    def write(name: str, vectors: Sequence[InputVector], outputs: Sequence[Scalar], trace: Trace) -> tuple[str, str]:
        return write_tape(name, vectors, compile_tape(trace, outputs, sum(vector.length for vector in vectors)))

    def write_tape(name: str, vectors: Sequence[InputVector], tape: Tape) -> tuple[str, str]:
        return name, write_function(name, tape, vectors)

    trace, (x, s) = _take_inputs(pose, signs)
    yield write("inverse", [pose, signs], trace_inverse(machine, x, s), trace)
    if machine.wrist is not None:
        trace, (x, s, given) = _take_inputs(pose, signs, first)
        yield write("inverseWithFirst", [pose, signs, first], trace_inverse(machine, x, s, given[0]), trace)
        yield write_tape("freedom", [pose], machine.wrist.freedom_tape())
    trace, (x, q, s) = _take_inputs(pose, joints, signs)
    yield write("margins", [pose, joints, signs], trace_margins(machine, x, q, s), trace)
    newton = machine.newton_tapes()
    yield write_tape("begin", [pose, joints], newton.begin)
    yield write_tape("closures", [coordinates, joints], newton.closures_and_slopes)
    yield write_tape("end", [coordinates, joints], newton.end)
    trace, (x, q) = _take_inputs(pose, joints)
    rows = trace_unit_wrenches(machine, machine.trace_rates(x, q), choose_characteristic_length(machine))
    yield write("wrenches", [pose, joints], [value for row in rows for value in row], trace)
    points, frame = trace_scene(machine, x, q)
    placed = [value for item in points for value in item.ravel().tolist()]
    placed += [*frame[:, :3].ravel().tolist(), *frame[:, 3].tolist()]
    yield write("placePoints", [pose, joints], placed, trace)


def _take_inputs(*vectors: InputVector) -> tuple[Trace, list[list[Scalar]]]:
    """Make a trace with vectors of inputs, one after the other."""
    trace, start, made = Trace(), 0, []
    for vector in vectors:
        made.append(trace.inputs(vector.length, start))
        start += vector.length
    return trace, made
