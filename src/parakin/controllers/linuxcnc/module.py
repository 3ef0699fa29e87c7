"""Write the kinematics module: a machine's mathematics as C, with the runtime that LinuxCNC calls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from hashlib import sha256
from importlib.resources import files

import numpy as np

from ...algebra import Trace
from ...kernels.newton import SLOW, WORTH
from ...kernels.tape import Tape, compile_tape
from ...kinematics.forward import MOST_STEPS, SETTLED, STEADY
from ...kinematics.turns import TURN
from ...kinematics.wrist import EXACT, GAIN, NEAR_MODE, STANDING, SWING
from ...machine import Machine
from ...model.limits import Limit
from .tape_to_c import CVector, format_c, write_function, write_test

NO_SIDE = 1e-6  # of home's determinant: less is a singularity, of no side
TELLS = 0.02  # of a leg: a pose from which the legs are farther off is a guess, and its side says nothing
_FIELDS = {"X": "tran.x", "Y": "tran.y", "Z": "tran.z", "A": "a", "B": "b", "C": "c"}

_HEADER = """\
/* {name}.c: LinuxCNC's kinematics of {machine}, {title}.

   Made by parakin from the machine's description; make it anew rather than edit it.
   It is compiled against LinuxCNC's headers and loaded into its programs. These are under the GNU General Public
   License, and so is this file: you may redistribute and modify it under that licence, version 2 or, at your option,
   any later one. It comes WITHOUT ANY WARRANTY.

   Build and install:  sudo halcompile --install {name}.c */

#pragma GCC optimize ("O3")

#include "rtapi.h"
#include "rtapi_app.h"
#include "rtapi_math.h"
#include "rtapi_string.h"
#include "hal.h"
#include "kinematics.h"
"""

_ELEMENTARY = """\
/* As in parakin: NaN goes through, and no direction has the angle 0. */
static inline double lesser(double x, double y) { return x < y || x != x ? x : y; }
static inline double greater(double x, double y) { return x > y || x != x ? x : y; }
static inline double with_sign(double x, double y) { return (y < 0.0 ? -fabs(x) : fabs(x)) + 0.0 * y; }
static inline double angle_of(double y, double x) { return atan2(y + 0.0, x + 0.0); }
"""


def name_kinematics(machine: Machine) -> str:
    """Name the kinematics module; of LinuxCNC's own only ``xyzab_tdr_kins`` is built likewise."""
    return f"{machine.name}_kins"


def write_module(machine: Machine) -> str:
    """Write the C source of a machine's kinematics module, complete in one file."""
    name = name_kinematics(machine)
    title = " ".join(machine.spec.title.split()).replace("*/", "* /")
    head = _HEADER.format(name=name, machine=machine.name, title=title)
    return "\n".join(
        [
            head,
            f'#define MADE "{hash_kinematics(machine)}" /* what the configuration of the same making names */',
            *_write_body(machine),
        ]
    )


def hash_kinematics(machine: Machine) -> str:
    """Hash a machine's kinematics, so that a module of an older description is recognised."""
    return sha256("\n".join(_write_body(machine)).encode()).hexdigest()[:16]


def _write_body(machine: Machine) -> list[str]:
    runtime = files(__package__).joinpath("runtime.c").read_text(encoding="utf-8")
    for name, value in {"SWING": SWING / TURN, "GAIN": GAIN}.items():
        runtime = runtime.replace(f"@{name}@", format_c(value))
    numbers = _write_numbers(machine, name_kinematics(machine))
    return [numbers, _write_transfer(machine), _ELEMENTARY, *_write_mathematics(machine), runtime]


def _write_numbers(machine: Machine, name: str) -> str:
    """Write the sizes of everything, and the constants of the method; mm and rad."""
    by_spheres, open_by = int(machine.has_closed_forward), format_c(machine.closure_tolerance)
    lines = [
        f'#define MODULE "{name}"',
        f"#define AXES {len(machine.axes)}",
        f"#define JOINTS {len(machine.joints)}",
        f"#define CLOSURES {machine.leg_count}",
        f"#define SPHERES {by_spheres} /* the forward in closed form: the common point of spheres */",
        f"#define WRIST {int(machine.wrist is not None)} /* two turning joints point the tool */",
        f"#define TOOL_AXIS {int(machine.has_direction)} /* of the orientation only the tool's axis counts */",
        f"#define LEG_MODES {_count_leg_modes(machine)} /* choices of the legs' inverse */",
        f"#define SAME {format_c(NEAR_MODE)} /* mm or rad: joints nearer to each other stand in one working mode */",
        f"#define TURN {format_c(TURN)}",
        f"#define DEGREE {format_c(np.pi / 180.0)}",
        f"#define FREE {format_c(STANDING)} "
        "/* rad: nearer to a turning axis the tool's tells no angle in a program's digits: it stands still */",
        f"#define UPRIGHT {format_c(EXACT)} /* rad: nearer to upright C is told by rounding only */",
        f"#define TOLERANCE {open_by} /* mm by which the legs of an answer may fail to close */",
        *_write_wrist(machine),
        *_write_sides(machine),
        *_write_newton(machine),
        _write_array("double", "home", [format_c(value) for value in machine.home]),
        _write_array("int", "turning", [str(int(unit == "rad")) for unit in machine.joint_units]),
    ]
    lines.append(_write_array("int", "turning_axis", [str(int(unit == "rad")) for unit in machine.axis_units]))
    return "\n".join(lines) + "\n"


def _count_leg_modes(machine: Machine) -> int:
    return len(machine.mode) - (machine.wrist is not None)


def _write_array(kind: str, name: str, values: Sequence[str]) -> str:
    return f"static const {kind} {name}[] = {{{', '.join(values)}}};"


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
    least, most, middle = min(machine.leg_sizes), max(machine.leg_sizes), machine.structure.middle_turn
    yield f"#define SIZE {format_c(least)} /* of the legs, mm */"
    yield f"#define LONGEST {format_c(most)}"
    yield f"#define HOME_SIDE {format_c(side)} /* of the singularities; on the other one is another assembly */"
    yield f"#define NO_SIDE {format_c(NO_SIDE * abs(determinant))} /* the least determinant that tells a side */"
    yield f"#define TELLS {format_c(TELLS * least)} /* mm: legs farther off do not stand at a given pose */"
    yield f"#define SETTLED {format_c(SETTLED * most)} /* mm: an answer as near to a given pose has its side, */"
    yield f"#define STEADY {format_c(STEADY)} /* where the determinant changes by no more than this part */"
    yield f"#define MIDDLE_TURN {-1 if middle is None else middle} /* whose ±90° is singular to a pose's angles */"


def _write_newton(machine: Machine) -> Iterator[str]:
    tapes = machine.tapes(machine.mode)
    if tapes.newton is not None:
        most = max(machine.leg_sizes)
        yield f"#define FINE {format_c(0.01 * machine.closure_tolerance)} /* mm: where Newton's method has arrived */"
        worth = format_c(WORTH)
        yield f"#define WORTH {worth} /* mm: where a step will end no worse than this, the matrix serves on */"
        yield f"#define SLOW {format_c(SLOW)} /* a kept matrix that gains less than this a step is made anew */"
        yield f"#define MOST_STEPS {MOST_STEPS}"
        caps = [most / 3.0 if word.startswith("t") else 0.5 for word in tapes.coordinates]
        yield _write_array("double", "caps", [format_c(cap) for cap in caps]) + " /* greatest step */"


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
        "\n".join([f"static void {head}", "{", *(f"    {line}" for line in lines), "}", ""])
        for head, lines in bodies.items()
    )


def _scale_inward(unit: str) -> str:
    return " * DEGREE" if unit == "rad" else ""


def _scale_outward(unit: str) -> str:
    return " / DEGREE" if unit == "rad" else ""


def _write_mathematics(machine: Machine) -> Iterator[str]:
    """Yield the machine's tapes as functions, in the order of their use."""
    tapes, wrist = machine.tapes(machine.mode), machine.wrist
    x, q = CVector("x", len(machine.axes)), CVector("q", len(machine.joints))
    near, first = CVector("near", len(machine.axes)), CVector("first", 1)
    f = CVector("f", machine.leg_count)
    yield write_function("inverse", tapes.inverse, [x], [q])
    if wrist is not None:
        yield write_function("freedom", wrist.freedom_tape(), [x], [CVector("lean", 1)])
        yield write_function("inverse_held", wrist.first_given_tape(machine.mode), [x, first], [q])
        yield write_function("inverse_over", machine.tapes(wrist.other_mode(machine.mode)).inverse, [x], [q])
    yield write_test("allowed", _compile_limits(machine), [x, q])
    if tapes.spheres is not None:
        square, side = CVector("square", 1), CVector("side", 1)
        yield write_function("common_point", tapes.spheres.nearest, [q, near], [x, f, square])
        yield write_function("common_point_on", tapes.spheres.on_side, [q, side], [x, f])
        yield write_function("own_side", tapes.spheres.own_side, [near], [side])
        if tapes.spheres.own_side_over is not None:
            yield write_function("own_side_over", tapes.spheres.own_side_over, [near], [side])
    if tapes.newton is not None:
        y, newton = CVector("y", len(tapes.coordinates)), tapes.newton
        yield write_function("begin", newton.begin, [near, q], [y])
        yield write_function("closures", newton.closures, [y, q], [f])
        yield write_function(
            "closures_and_slopes", newton.closures_and_slopes, [y, q], [f, CVector("a", f.length * y.length)]
        )
        yield write_function("end", newton.end, [y, q], [x])


def _compile_limits(machine: Machine) -> Tape:
    """Compile pose, joints -> every margin but those of the drives' ranges, which LinuxCNC watches by its ini file."""
    trace = Trace()
    pose = trace.inputs(len(machine.axes))
    joints = trace.inputs(len(machine.joints), len(machine.axes))
    margins = zip(machine.limit_parts, machine.trace_margins(pose, machine.mode, joints), strict=True)
    watched = [margin for limit, margin in margins if not bounds_drive(machine, limit)]
    return compile_tape(trace, watched, len(pose) + len(joints))


def bounds_drive(machine: Machine, limit: Limit) -> bool:
    """Tell whether a limit is one end of a drive's range."""
    return limit.side != "reach" and limit.subject in {
        f"{what} {name}" for name in machine.joints for what in ("leg", "joint")
    }
