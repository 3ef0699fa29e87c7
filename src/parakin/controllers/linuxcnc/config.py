"""Write the files that describe a machine to LinuxCNC: ini, HAL for a simulation, tool table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import isfinite

from ...machine import Machine
from ...model.elements import Drive
from ...units import to_display
from .axis_ranges import estimate_axis_ranges
from .axis_rates import choose_drive_rates, choose_unit_rates, find_slowest_drive
from .module import hash_kinematics, name_kinematics

_LAG = 0.01  # s: following error allowed, as time at full speed; the simulation lags by 0.001 s or two

_INI = """\
# {title}, for LinuxCNC 2.9. Made by parakin from the machine's description.
# It runs as a simulation; for a machine of your own change {name}.hal and the homing of the joints.

[EMC]
VERSION = 1.1
MACHINE = {name}

[DISPLAY]
DISPLAY = axis
CYCLE_TIME = 0.1
POSITION_OFFSET = RELATIVE
POSITION_FEEDBACK = ACTUAL
PROGRAM_PREFIX = .
OPEN_FILE = ./{name}.ngc
GEOMETRY = {letters}
DEFAULT_LINEAR_VELOCITY = {jog}
MAX_LINEAR_VELOCITY = {fast}
DEFAULT_ANGULAR_VELOCITY = {turn_jog}
MAX_ANGULAR_VELOCITY = {turn_fast}
# Faster than programmed the joints would pass their speeds.
MAX_FEED_OVERRIDE = 1.0

[TASK]
TASK = milltask
CYCLE_TIME = 0.010

[RS274NGC]
PARAMETER_FILE = {name}.var

[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 1.0
SERVO_PERIOD = 1000000

[EMCIO]
EMCIO = io
CYCLE_TIME = 0.100
TOOL_TABLE = {name}.tbl

[HAL]
HALFILE = {name}.hal

[KINS]
KINEMATICS = {kinematics}
JOINTS = {joints}

[TRAJ]
COORDINATES = {axes}
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = {jog}
MAX_LINEAR_VELOCITY = {fast}
MAX_LINEAR_ACCELERATION = {acceleration}
# X Y Z of the pose that belongs to the joints' HOME; LinuxCNC reads no more, the kinematics knows its turns.
HOME = {home}

# The axes bound the end points of moves. Their ranges hold all poses that the machine can take; whether it can take a
# certain one the kinematics decides, and the joints' limits. Their accelerations are more than the drives' own, and so
# are the speeds of turning axes: LinuxCNC begins and ends every motion that turns the tool as if it stood still there,
# and could not keep up with a program of short motions otherwise. Programs of parakin post bring speeds that the joints
# can take; those by hand should go slowly.
"""


_HAL = """\
# {name} as a simulation: every joint is at once where it is sent.
# For a machine of your own put its drives in the place of these loops.

loadrt [KINS]KINEMATICS made={made}
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
addf motion-command-handler servo-thread
addf motion-controller servo-thread

{loops}

# What the kinematics has to know: where the joints are told to be, the tool's length, and who moves the machine.
{told}
net tool-offset motion.tooloffset.z => {kinematics}.tool-offset
net teleop motion.teleop-mode => {kinematics}.teleop-mode
net coordinated motion.coord-mode => {kinematics}.coord-mode

net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net tool-prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net tool-change iocontrol.0.tool-change => iocontrol.0.tool-changed
"""


def write_ini(machine: Machine) -> str:
    """Write the ini file."""
    (fast, acceleration), turning = choose_unit_rates(machine, "mm"), find_slowest_drive(machine, "rad")[0]
    home = dict(zip(machine.axes, machine.home.tolist(), strict=True))
    head = _INI.format(
        title=" ".join(machine.spec.title.split()),
        name=machine.name,
        axes=" ".join(machine.axes),
        letters="".join(machine.axes),
        joints=len(machine.joints),
        kinematics=name_kinematics(machine),
        home=" ".join(format_number(home.get(axis, 0.0)) for axis in "XYZ"),
        jog=format_number(0.25 * fast),
        fast=format_number(fast),
        turn_jog=format_number(to_display(0.25 * turning, "rad")),
        turn_fast=format_number(to_display(turning, "rad")),
        acceleration=format_number(acceleration),
    )
    low, high = (ends.tolist() for ends in estimate_axis_ranges(machine))
    axes = [
        _format_section(
            f"AXIS_{axis}", [*_format_range(a, b, unit), *_format_rates(*choose_unit_rates(machine, unit), unit)]
        )
        for axis, unit, a, b in zip(machine.axes, machine.axis_units, low, high, strict=True)
    ]
    at_home = machine.inverse(machine.home).tolist()
    joints = [_format_joint(i, drive, q) for i, (drive, q) in enumerate(zip(machine.drives, at_home, strict=True))]
    return "\n".join([head, *axes, *joints])


def format_number(value: float) -> str:
    """Format with nine digits after the point at most, a thousandth of a nanometre."""
    text = f"{value:.9f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _format_section(name: str, lines: Iterable[str]) -> str:
    return "\n".join([f"[{name}]", *lines, ""])


def _format_range(low: float, high: float, unit: str) -> Iterator[str]:
    yield f"MIN_LIMIT = {format_number(to_display(low, unit))}"
    yield f"MAX_LIMIT = {format_number(to_display(high, unit))}"


def _format_rates(speed: float, acceleration: float, unit: str) -> Iterator[str]:
    yield f"MAX_VELOCITY = {format_number(to_display(speed, unit))}"
    yield f"MAX_ACCELERATION = {format_number(to_display(acceleration, unit))}"


def _format_joint(index: int, drive: Drive, home: float) -> str:
    unit = drive.unit
    missing = [what for what in ("speed", "acceleration") if not isfinite(getattr(drive, what))]
    speed, acceleration = choose_drive_rates(drive)
    lag = to_display(_LAG * speed, unit)
    lines = [
        f"# {drive.name}",
        f"TYPE = {'ANGULAR' if unit == 'rad' else 'LINEAR'}",
        *_format_range(drive.low, drive.high, unit),
        *([f"# chosen, for the machine's description does not say it: {' and '.join(missing)}"] if missing else []),
        *_format_rates(speed, acceleration, unit),
        f"FERROR = {format_number(lag)}",
        f"MIN_FERROR = {format_number(0.1 * lag)}",
        f"HOME = {format_number(to_display(home, unit))}",
        f"HOME_OFFSET = {format_number(to_display(home, unit))}",
        "HOME_SEARCH_VEL = 0",
        "HOME_LATCH_VEL = 0",
        "HOME_SEQUENCE = 0",
    ]
    return _format_section(f"JOINT_{index}", lines)


def write_hal(machine: Machine) -> str:
    """Write the HAL file of a simulation: every joint is at once where it is sent."""
    loops = [
        f"net joint-{i} joint.{i}.motor-pos-cmd => joint.{i}.motor-pos-fb  # {name}"
        for i, name in enumerate(machine.joints)
    ]
    kinematics = name_kinematics(machine)
    told = [f"net told-{i} joint.{i}.pos-cmd => {kinematics}.joint-{i}" for i in range(len(machine.joints))]
    return _HAL.format(
        name=machine.name,
        made=hash_kinematics(machine),
        loops="\n".join(loops),
        told="\n".join(told),
        kinematics=kinematics,
    )


def write_tool_table(machine: Machine) -> str:
    """Write the tool table: one tool, whose length the machine's description has already."""
    return f"T1 P1 Z0 D0 ;the tool of {machine.name}, whose length the kinematics knows\n"
