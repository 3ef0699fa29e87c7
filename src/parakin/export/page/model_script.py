"""Write a machine's equations as JavaScript functions, which a page and its worker share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from ...algebra import Scalar, derivative
from ...kernels.tape import compile_tape
from ...kernels.tape_text import InputVector
from ...machine import Machine
from ...model.equations import Equations
from ...model.nominal_values import SizedTrace
from ...performance.characteristic_length import choose_characteristic_length
from ...performance.jacobians import trace_unit_wrenches
from ..machine.scene import trace_scene
from .mode_traces import trace_inverse, trace_margins
from .tape_to_js import write_function

_Vectors = list[list[Scalar]]
_Outputs = Callable[[Equations, _Vectors], Sequence[Scalar]]


def write_model(machine: Machine) -> str:
    """Write the functions of a machine; all take and return arrays, mm and rad, and follow ``model.sizes``.

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
    given             nothing -> home's pose, every limit's bound, every drive's low and high end
    ================= =================================================================================================
    """
    functions = dict(_write_functions(machine))
    sizes = ", ".join(map(repr, machine.size_rates.nominal))
    names = ", ".join([*functions, "sizes: z"])
    return f"const model = (() => {{\nconst z = [{sizes}];\n{''.join(functions.values())}return {{{names}}};\n}})();\n"


def _write_functions(machine: Machine) -> Iterator[tuple[str, str]]:
    """Yield names and definitions."""
    pose, joints = InputVector("x", len(machine.axes)), InputVector("q", len(machine.joints))
    signs, first = InputVector("s", len(machine.mode)), InputVector("first", 1)
    coordinates = InputVector("y", len(machine.structure.coordinates))
    nominal = machine.size_rates.nominal

    def write(name: str, vectors: Sequence[InputVector], outputs: _Outputs) -> tuple[str, str]:
        width = sum(vector.length for vector in vectors)
        trace = SizedTrace(width, nominal)
        made = outputs(machine.trace_sized_equations(trace), _split_inputs(trace, vectors))
        tape = compile_tape(trace, made, width + len(nominal))
        return name, write_function(name, tape, vectors, [InputVector("z", len(nominal))])

    yield write("inverse", [pose, signs], lambda e, v: trace_inverse(e, *v))
    if machine.wrist is not None:
        yield write("inverseWithFirst", [pose, signs, first], lambda e, v: trace_inverse(e, v[0], v[1], v[2][0]))
        yield write("freedom", [pose], lambda e, v: [e.structure.place(v[0], e.structure.branches).freedom])
    yield write("margins", [pose, joints, signs], lambda e, v: trace_margins(e, *v))
    yield write(
        "begin", [pose, joints], lambda e, v: e.structure.place_with_joints(v[0], e.list_serial(v[1])).coordinates
    )
    yield write("closures", [coordinates, joints], lambda e, v: _trace_closures(machine, e, *v))
    yield write("end", [coordinates, joints], lambda e, v: e.compute_pose(*v))
    yield write("wrenches", [pose, joints], lambda e, v: _trace_wrenches(machine, e, *v))
    yield write("placePoints", [pose, joints], lambda e, v: _trace_points(machine, e, *v))
    yield write("given", [], lambda e, v: _list_given(e))


def _split_inputs(trace: SizedTrace, vectors: Sequence[InputVector]) -> _Vectors:
    start, made = 0, []
    for vector in vectors:
        made.append(list(trace.inputs(vector.length, start)))
        start += vector.length
    return made


def _trace_closures(
    machine: Machine, equations: Equations, coordinates: list[Scalar], joints: list[Scalar]
) -> list[Scalar]:
    closures = equations.closures(*equations.structure.frame(coordinates), joints)
    scaled = [closure * (1.0 / size) for closure, size in zip(closures, machine.leg_sizes, strict=True)]
    return scaled + [derivative(row, y) for row in scaled for y in coordinates]


def _trace_wrenches(machine: Machine, equations: Equations, pose: list[Scalar], joints: list[Scalar]) -> list[Scalar]:
    trace = pose[0].trace
    given = trace.inputs(trace.first + len(trace.nominal))
    rates = equations.compute_twist_rates(pose, joints, given)
    rows = trace_unit_wrenches(machine, rates, choose_characteristic_length(machine))
    return [value for row in rows for value in row]


def _trace_points(machine: Machine, equations: Equations, pose: list[Scalar], joints: list[Scalar]) -> list[Scalar]:
    points, frame = trace_scene(machine, pose, joints, equations)
    placed = [value for item in points for value in item.ravel().tolist()]
    return [*placed, *frame[:, :3].ravel().tolist(), *frame[:, 3].tolist()]


def _list_given(equations: Equations) -> list[Scalar]:
    bounds = [limit.bound for limit, _ in equations.own_margins(equations.home, equations.mode)]
    ends = [end for drive in equations.drives for end in (drive.low, drive.high)]
    return [*equations.home, *bounds, *ends]
