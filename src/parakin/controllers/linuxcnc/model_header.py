"""Write the model of a machine in C: a header that the realtime modules share, which LinuxCNC loads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from importlib.resources import files

import numpy as np

from ...algebra import Trace, absolute, expand_determinant, norm
from ...arrays import Array
from ...kernels.newton import SLOW, WORTH
from ...kernels.tape import Tape, compile_tape
from ...kernels.tape_text import InputVector
from ...kinematics.closure_roots import MOST_STEPS, list_step_caps
from ...kinematics.forward import OF_AGREEMENT
from ...kinematics.turns import TURN
from ...kinematics.wrist.pole_crossing import GAIN, compile_way_comparison
from ...kinematics.wrist.pole_thresholds import EXACT, NEAR_MODE, SAME_AXIS, STANDING, SWING
from ...machine import Machine
from ...model.limits import Limit
from ...model.rates import trace_determinant
from ...performance.characteristic_length import choose_characteristic_length
from ...performance.jacobians import (
    get_serial_factor,
    list_column_scales,
    list_constraint_scales,
    trace_unit_wrenches,
)
from ...performance.singularities import (
    CONSTRAINT,
    compute_singularity_margins,
    find_home_signs,
    has_serial_turns,
    list_margin_names,
)
from .axis_rates import choose_drive_rates
from .certainty import write_certainty
from .home_pose import find_home_pose
from .margin_signs import find_cheap_sign
from .tape_to_c import format_c, write_function, write_test

AGREEMENT = 1.0  # mm: joints of more drives than freedoms disagree by their following errors
NO_SIDE = 1e-6  # of home's determinant: less is a singularity, of no side
TELLS = 0.02  # of a leg: a pose from which the legs are farther off is a guess, and its side says nothing
LEAST_REGULARITY = (
    0.02  # of home's singularity margin (of 1 for a leg's serial one): no pose is nearer to a singularity
)
CYCLE = 0.001  # s: the servo period
STEP_FACTOR = 2.0  # of a joint's speed: LinuxCNC's own planner exceeds it for moments in foreign programs
COMMAND_LAG = 3.0  # cycles by which LinuxCNC's interpolation trails, and one more
_FIELDS = {"X": "tran.x", "Y": "tran.y", "Z": "tran.z", "A": "a", "B": "b", "C": "c"}

# How near to a limit jogs stop, by the limit's unit. A reach in mm² is brought to mm by twice the rod.
NEAR_LIMIT = {"mm": 1.0, "rad": np.radians(0.5), "1": 0.01, "mm²": 1.0}

GPL = """\
It is compiled against LinuxCNC's headers and loaded into its programs. These are under the GNU General Public
   License, and so is this file: you may redistribute and modify it under that licence, version 2 or, at your option,
   any later one. It comes WITHOUT ANY WARRANTY."""

_HEADER = """\
/* {name}_model.h: the model of {machine}, {title}, for LinuxCNC.

   Made by parakin from the machine's description; make it anew rather than edit it. The kinematics includes it, and
   whatever else needs joints, rates, limits or singularities of a pose; before it come LinuxCNC's kinematics.h and
   rtapi_math.h.
   {gpl} */

#define MODEL static __attribute__((unused))
"""

_ELEMENTARY = """\
/* As in parakin: NaN goes through, and no direction has the angle 0. */
MODEL double lesser(double x, double y) { return y != y ? y : y < x ? y : x; }
MODEL double greater(double x, double y) { return y != y ? y : y > x ? y : x; }
MODEL double with_sign(double x, double y) { return (y < 0.0 ? -fabs(x) : fabs(x)) + 0.0 * y; }
MODEL double angle_of(double y, double x) { return atan2(y + 0.0, x + 0.0); }

/* The same sine is computed once in a function, and in those that are compiled into it. */
MODEL __attribute__((const, noinline)) double sine(double x) { return sin(x); }
MODEL __attribute__((const, noinline)) double cosine(double x) { return cos(x); }
"""


def format_title(machine: Machine) -> str:
    """Format a machine's title for a comment of C."""
    return " ".join(machine.spec.title.split()).replace("*/", "* /")


def name_model(machine: Machine) -> str:
    """Name the header."""
    return f"{machine.name}_model.h"


@lru_cache(maxsize=32)
def write_model(machine: Machine) -> str:
    """Write the header: numbers, mathematics, and the questions that all modules ask, without any state."""
    core = files(__package__).joinpath("core.c").read_text(encoding="utf-8")
    for name, value in {"SWING": SWING / TURN, "GAIN": GAIN}.items():
        core = core.replace(f"@{name}@", format_c(value))
    head = _HEADER.format(name=machine.name, machine=machine.name, title=format_title(machine), gpl=GPL)
    return "\n".join(
        [head, _write_numbers(machine), _write_transfer(machine), _ELEMENTARY, *_write_mathematics(machine), core]
    )


def _write_numbers(machine: Machine) -> str:
    """Write the sizes of everything, and the constants of the method; mm and rad."""
    by_spheres, open_by = int(machine.has_closed_forward), format_c(machine.closure_tolerance)
    names = list_margin_names(machine)
    lines = [
        f"#define AXES {len(machine.axes)}",
        f"#define JOINTS {len(machine.joints)}",
        f"#define CLOSURES {machine.leg_count}",
        f"#define MOTIONS {len(machine.structure.coordinates)} /* what the forward finds */",
        f"#define REDUNDANT {int(machine.is_redundant)} /* more drives than freedoms: the joints follow the pose */",
        f"#define SERIAL {len(machine.joints) - machine.leg_count} /* joints of head and table */",
        f"#define LIMITS {len(machine.limits)} /* of the machine's description */",
        f"#define SINGULARITIES {len(names)}",
        f"#define CONSTRAINT {names.index(CONSTRAINT) if machine.constraints else 0} "
        "/* the margin of the constraints, the parallel one where there are none */",
        f"#define SPHERES {by_spheres} /* the forward in closed form: the common point of spheres */",
        f"#define WRIST {int(machine.wrist is not None)} /* two turning joints point the tool */",
        f"#define TOOL_AXIS {int(machine.has_direction)} /* of the orientation only the tool's axis counts */",
        f"#define LEG_MODES {_count_leg_modes(machine)} /* choices of the legs' inverse */",
        f"#define TURN {format_c(TURN)}",
        f"#define DEGREE {format_c(np.pi / 180.0)}",
        f"#define FREE {format_c(STANDING)} "
        "/* rad: nearer to a turning axis the tool's tells no angle in a program's digits: it stands still */",
        f"#define UPRIGHT {format_c(EXACT)} /* rad: nearer to upright C is told by rounding only */",
        f"#define SAME_AXIS {format_c(SAME_AXIS)} /* what a tool's axis may be off another one by rounding */",
        f"#define TOLERANCE {open_by} /* mm by which the legs of an answer may fail to close, */",
        f"#define AGREEMENT {format_c(AGREEMENT) if machine.is_redundant else open_by} "
        "/* and joints that are measured may disagree */",
        *_write_wrist(machine),
        *_write_sides(machine),
        *write_certainty(machine),
        *_write_newton(machine),
        *_write_limits(machine),
        f"#define CYCLE {format_c(CYCLE)} /* s: the servo period */",
        f"#define STEP_FACTOR {format_c(STEP_FACTOR)} /* a joint's step beyond so much of its speed is refused */",
        f"#define COMMAND_LAG {format_c(COMMAND_LAG)} /* steps by which a commanded joint may trail */",
        write_array("double", "home", [format_c(value) for value in find_home_pose(machine).tolist()]),
        write_array("double", "same_mode", [format_c(value) for value in _list_mode_tolerances(machine)])
        + " /* mm, rad: joints nearer to each other stand in one working mode */",
        write_array("int", "turning", [str(int(unit == "rad")) for unit in machine.joint_units]),
    ]
    columns = {axis: column for column, axis in enumerate(machine.axes)}
    lines.append(f'MODEL const char axis_letters[] = "{"".join(machine.axes).lower()}";')
    lines.append(write_array("int", "axis_numbers", [str(list(_FIELDS).index(axis)) for axis in machine.axes]))
    places_and_turns = [str(columns.get(axis, -1)) for axis in _FIELDS]
    lines.append(write_array("int", "place_columns", places_and_turns[:3]))
    lines.append(write_array("int", "turn_columns", places_and_turns[3:]))
    lines.append(write_array("int", "turning_axis", [str(int(unit == "rad")) for unit in machine.axis_units]))
    return "\n".join(lines) + "\n"


def _list_mode_tolerances(machine: Machine) -> list[float]:
    """List by how much joints may differ from those of their working mode, mm and rad."""
    if not machine.is_redundant:
        return [NEAR_MODE] * len(machine.joints)
    at_legs = dict(zip(machine.closure_joints, machine.leg_sizes, strict=True))
    rads = [1.0 / at_legs.get(i, 1.0) if unit == "rad" else 1.0 for i, unit in enumerate(machine.joint_units)]
    return [OF_AGREEMENT * AGREEMENT * rad for rad in rads]


def _count_leg_modes(machine: Machine) -> int:
    return len(machine.mode) - (machine.wrist is not None)


def write_array(kind: str, name: str, values: Sequence[str]) -> str:
    """Write a constant array of C."""
    return f"MODEL const {kind} {name}[] = {{{', '.join(values)}}};"


def _write_wrist(machine: Machine) -> Iterator[str]:
    wrist = machine.wrist
    if wrist is not None:
        yield f"#define FIRST {wrist.first} /* the wrist's joints, as its axes follow on each other */"
        yield f"#define SECOND {wrist.second}"
        yield f"#define SECOND_LOW {format_c(wrist.drive.low)}"
        yield f"#define SECOND_HIGH {format_c(wrist.drive.high)}"


def _write_sides(machine: Machine) -> Iterator[str]:
    """Write home's side of the singularities, and what tells that a given pose has a side of its own."""
    determinant = float(machine.sides(machine.home[None, :])[0])
    side = machine.home_side if machine.has_closed_forward else float(np.sign(determinant))
    least, most = min(machine.leg_sizes), max(machine.leg_sizes)
    middle = None if machine.is_redundant else machine.structure.middle_turn
    yield f"#define SIZE {format_c(least)} /* of the legs, mm */"
    yield f"#define LONGEST {format_c(most)}"
    yield f"#define HOME_SIDE {format_c(side)} /* of the singularities; on the other one is another assembly */"
    yield f"#define NO_SIDE {format_c(NO_SIDE * abs(determinant))} /* the least determinant that tells a side */"
    yield f"#define TELLS {format_c(TELLS * least)} /* mm: legs farther off do not stand at a given pose */"
    yield f"#define MIDDLE_TURN {-1 if middle is None else middle} /* whose ±90° is singular to a pose's angles */"


def _write_limits(machine: Machine) -> Iterator[str]:
    """Write the limits' and singularities' names, and how near to one a jog stops."""
    near = [NEAR_LIMIT[limit.unit] * _scale_reach(limit) for limit in machine.limit_definitions]
    least = find_least_margins(machine)
    rates = np.array([choose_drive_rates(drive) for drive in machine.drives])
    yield write_array("char *const", "limit_names", [f'"{name}"' for name in list_limit_names(machine)])
    yield write_array("double", "near_limit", [format_c(value) for value in near] or ["0.0"]) + " /* mm, rad */"
    yield write_array("double", "least_singularity", [format_c(value) for value in least])
    for name, values in (("joint_speed", rates[:, 0]), ("joint_acceleration", rates[:, 1])):
        yield write_array("double", name, [format_c(value) for value in values]) + " /* of the drives, mm, rad, s */"
    for name, ends in (("joint_low", "low"), ("joint_high", "high")):
        yield write_array("double", name, [format_c(getattr(drive, ends)) for drive in machine.drives])


def list_limit_names(machine: Machine) -> list[str]:
    """List the names of limits and singularities, in the order in which the C counts them."""
    return [*machine.limits, *(f"singularity, {name}" for name in list_margin_names(machine))]


def find_least_margins(machine: Machine) -> Array:
    """Find the least singularity margin (margins,) of a pose: a fraction of home's, or of 1 for a leg's drive.

    Wrists have none: on their pole nothing is lost but the first joint's angle.
    """
    home = compute_singularity_margins(machine, machine.home)
    least = np.full(len(home), LEAST_REGULARITY)
    least[0] *= abs(home[0])
    names = list_margin_names(machine)
    if CONSTRAINT in names:
        least[names.index(CONSTRAINT)] *= abs(home[names.index(CONSTRAINT)])
    if has_serial_turns(machine):
        least[1 + machine.leg_count] = -1.0
    return least


def _scale_reach(limit: Limit) -> float:
    return 2.0 * max(limit.bound, 1.0) if limit.unit == "mm²" else 1.0


def _write_newton(machine: Machine) -> Iterator[str]:
    tapes = machine.tapes(machine.mode)
    if tapes.newton is not None:
        yield f"#define FINE {format_c(0.01 * machine.closure_tolerance)} /* mm: where Newton's method has arrived */"
        worth = format_c(WORTH)
        yield f"#define WORTH {worth} /* mm: where a step will end no worse than this, the matrix serves on */"
        yield f"#define SLOW {format_c(SLOW)} /* a kept matrix that gains less than this a step is made anew */"
        yield f"#define MOST_STEPS {MOST_STEPS}"
        caps = list_step_caps(tapes.coordinates, max(machine.leg_sizes))
        yield write_array("double", "caps", [format_c(cap) for cap in caps]) + " /* greatest step */"


def _write_transfer(machine: Machine) -> str:
    """Write the conversions of poses and joints between LinuxCNC's mm and degrees and the mathematics' mm and rad."""
    axes = list(zip((_FIELDS[axis] for axis in machine.axes), machine.axis_units, strict=True))
    joints = list(enumerate(machine.joint_units))
    idle = [field for field in _FIELDS.values() if field not in dict(axes)]
    bodies = {
        "read_pose(const EmcPose *world, double *x)": [
            f"x[{i}] = world->{field}{_scale_inward(unit)};" for i, (field, unit) in enumerate(axes)
        ],
        "write_pose(const double *x, EmcPose *world)": [
            *(f"world->{field} = x[{i}]{_scale_outward(unit)};" for i, (field, unit) in enumerate(axes)),
            *(f"world->{field} = 0.0;" for field in [*idle, "u", "v", "w"]),
        ],
        "read_joints(const double *joints, double *q)": [f"q[{i}] = joints[{i}]{_scale_inward(u)};" for i, u in joints],
        "write_joints(const double *q, double *joints)": [
            f"joints[{i}] = q[{i}]{_scale_outward(u)};" for i, u in joints
        ],
    }
    return "\n".join(
        "\n".join([f"MODEL void {head}", "{", *(f"    {line}" for line in lines), "}", ""])
        for head, lines in bodies.items()
    )


def _scale_inward(unit: str) -> str:
    return " * DEGREE" if unit == "rad" else ""


def _scale_outward(unit: str) -> str:
    return " / DEGREE" if unit == "rad" else ""


def _write_mathematics(machine: Machine) -> Iterator[str]:
    """Yield the machine's tapes as functions, in the order of their use."""
    tapes, wrist = machine.tapes(machine.mode), machine.wrist
    x, q = InputVector("x", len(machine.axes)), InputVector("q", len(machine.joints))
    near, first = InputVector("near", len(machine.axes)), InputVector("first", 1)
    f = InputVector("f", machine.leg_count)
    yield write_function("inverse", tapes.inverse, [x], [q])
    if wrist is not None:
        yield write_function("freedom", wrist.freedom_tape(), [x], [InputVector("lean", 1)])
        yield write_function("inverse_held", wrist.first_given_tape(machine.mode), [x, first], [q])
        yield write_function("inverse_over", machine.tapes(wrist.other_mode(machine.mode)).inverse, [x], [q])
    if machine.has_direction:
        ways = [InputVector("stay", 2), InputVector("flip", 2)]
        yield write_function("compare_ways", compile_way_comparison(), ways, [InputVector("excess", 1)])
    yield write_test("allowed", _compile_limits(machine, False), [x, q])
    yield write_function(
        "measure_limits", _compile_limits(machine, True), [x, q], [InputVector("margins", len(machine.limits))]
    )
    if _count_leg_modes(machine):
        yield write_test("legs_keep_mode", _compile_leg_signs(machine), [x, q])
    count = len(machine.joints)
    singularities = InputVector("margins", len(list_margin_names(machine)))
    yield write_function("measure_singularities", _compile_singularities(machine), [x, q], [singularities])
    jacobians = [InputVector("a", count * len(machine.axes)), InputVector("b", count * count)]
    yield write_function("jacobians", tapes.jacobians, [x, q], jacobians)
    if tapes.spheres is not None:
        square, side = InputVector("square", 1), InputVector("side", 1)
        yield write_function("common_point_at_home", tapes.spheres.at_home, [q], [x, f, square])
        yield write_function("common_point_on", tapes.spheres.on_side, [q, side], [x, f])
        yield write_function("own_side", tapes.spheres.own_side, [near], [side])
        if tapes.spheres.own_side_over is not None:
            yield write_function("own_side_over", tapes.spheres.own_side_over, [near], [side])
    if tapes.newton is not None:
        y, newton = InputVector("y", len(tapes.coordinates)), tapes.newton
        yield write_function("begin", newton.begin, [near, q], [y])
        yield write_function("closures", newton.closures, [y, q], [f])
        yield write_function(
            "closures_and_slopes", newton.closures_and_slopes, [y, q], [f, InputVector("a", f.length * y.length)]
        )
        yield write_function("end", newton.end, [y, q], [x])


def _compile_limits(machine: Machine, drives: bool) -> Tape:
    """Compile pose, joints -> every margin, or the signs of all but the drives' ranges, which LinuxCNC watches."""
    trace = Trace()
    pose = trace.inputs(len(machine.axes))
    joints = trace.inputs(len(machine.joints), len(machine.axes))
    margins = zip(machine.limit_definitions, machine.trace_margins(pose, machine.mode, joints), strict=True)
    watched = [margin for limit, margin in margins if drives or not bounds_drive(machine, limit)]
    return compile_tape(trace, watched if drives else [find_cheap_sign(m) for m in watched], len(pose) + len(joints))


def _compile_singularities(machine: Machine) -> Tape:
    """Compile pose, joints -> the parallel and the serial singularity margins, positive at home.

    They are those of :func:`~...performance.singularities.compute_singularity_margins`.
    """
    trace, legs, n = Trace(), machine.leg_count, len(machine.axes)
    rates = machine.trace_rates(trace.inputs(n), trace.inputs(len(machine.joints), n))
    length = choose_characteristic_length(machine)
    columns_b = list_column_scales(machine, length)[1].tolist()
    signs = find_home_signs(machine, length, machine.mode).tolist()
    turns = len(machine.joints) - legs
    factors = [*(1.0 / size for size in rates.wrench_norms), *[get_serial_factor(machine, length)] * turns]
    outputs = [signs[0] * trace_determinant(trace_unit_wrenches(machine, rates, length))]
    for number, joint in enumerate(machine.closure_joints):
        outputs.append(rates.b[number][joint] * factors[number] * (signs[1 + number] * columns_b[joint]))
    if has_serial_turns(machine):
        scale = float(np.prod(columns_b[legs:])) * length.factor**turns
        serial = [row[legs:] for row in rates.b[legs:]]
        first, last = serial[0], serial[-1]
        outputs.append(absolute(first[0] * last[1] - first[1] * last[0] if turns == 2 else first[0]) * scale)
    if machine.constraints:
        scales = list_constraint_scales(machine, length).tolist()
        constraints = machine.trace_constraint_rates(trace.inputs(n))
        scaled = [[rate * k for rate, k in zip(row, scales, strict=True)] for row in constraints]
        wrenches = [[rate * (1.0 / norm(row)) for rate in row] for row in scaled]
        outputs.append(signs[-1] * expand_determinant(wrenches))
    return compile_tape(trace, outputs, n + len(machine.joints))


def _compile_leg_signs(machine: Machine) -> Tape:
    """Compile pose, joints -> the slope of every leg's closure by its joint, positive in the machine's working mode.

    A leg closes at two places of its joint, and its closure rises at the one and falls at the other.
    """
    trace, n = Trace(), len(machine.axes)
    b = machine.trace_rates(trace.inputs(n), trace.inputs(len(machine.joints), n)).b
    signs = find_home_signs(machine, choose_characteristic_length(machine), machine.mode).tolist()
    slopes = [b[row][joint] * signs[1 + row] for row, joint in enumerate(machine.closure_joints)]
    return compile_tape(trace, slopes, n + len(machine.joints))


def bounds_drive(machine: Machine, limit: Limit) -> bool:
    """Tell whether a limit is one end of a drive's range."""
    return limit.side != "reach" and limit.subject in {
        f"{what} {name}" for name in machine.joints for what in ("leg", "joint")
    }
