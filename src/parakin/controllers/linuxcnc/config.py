"""Write the files that describe a machine to LinuxCNC: ini, HAL for a simulation or a card, tool table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import ceil, isfinite, pi
from typing import Literal

from ...machine import Machine
from ...model.elements import Drive
from ...units import to_display
from .axis_ranges import estimate_axis_ranges
from .axis_rates import choose_drive_rates, choose_unit_rates, find_slowest_drive
from .guard import hash_guard, name_guard
from .hand_box import HandBox, find_hand_box
from .hardware import Equipment, wiring
from .home_pose import find_home_pose
from .kinematics_module import hash_kinematics, name_kinematics
from .kinematics_switch import list_remaps
from .number_text import format_number
from .planner import hash_planner, name_planner
from .screen import name_screen_settings

_JOG = 0.25  # of the speed of moves by hand: what the screen begins with
_END_DIGIT = 0.01  # mm and degrees
_LAG = 0.01  # s: following error allowed, as time at full speed; the simulation lags by 0.001 s or two

# The guard's pins for an axis, and the keys of the ini file that they have their values from.
_KEYS = {"min": "MIN_LIMIT", "max": "MAX_LIMIT", "velocity": "MAX_VELOCITY", "acceleration": "MAX_ACCELERATION"}

_INI = """\
# {title}, for LinuxCNC 2.9. Made by parakin from the machine's description.
# {purpose}

[EMC]
VERSION = 1.1
MACHINE = {name}

[DISPLAY]
DISPLAY = {screen}
CYCLE_TIME = 0.1
POSITION_OFFSET = RELATIVE
POSITION_FEEDBACK = ACTUAL
PROGRAM_PREFIX = .
OPEN_FILE = ./{name}.ngc
USER_COMMAND_FILE = {settings}
GEOMETRY = {letters}
DEFAULT_LINEAR_VELOCITY = {jog}
MAX_LINEAR_VELOCITY = {by_hand}
DEFAULT_ANGULAR_VELOCITY = {turn_jog}
MAX_ANGULAR_VELOCITY = {turn_by_hand}
# Faster than programmed the joints would pass their speeds.
MAX_FEED_OVERRIDE = 1.0

[TASK]
TASK = milltask
CYCLE_TIME = 0.001

[RS274NGC]
PARAMETER_FILE = {name}.var
{remaps}

[EMCMOT]
EMCMOT = motmod
# Longer than a servo thread of an ordinary kernel stands still: LinuxCNC drops a command that is not taken by then.
COMM_TIMEOUT = 5.0
SERVO_PERIOD = 1000000
{base_period}
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.100
TOOL_TABLE = {name}.tbl

[HAL]
HALFILE = {name}.hal
HALCMD = source {name}_rates.hal

[KINS]
KINEMATICS = {kinematics}
JOINTS = {joints}

[TRAJ]
# It keeps the joints' limits in programs and MDI. LinuxCNC's own planner would not: never run without this line.
TPMOD = {planner} made={planner_made}
COORDINATES = {axes}
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = {jog}
MAX_LINEAR_VELOCITY = {fast}
MAX_LINEAR_ACCELERATION = {acceleration}
# X Y Z of the pose that belongs to the joints' HOME; LinuxCNC reads no more, the kinematics knows its turns.
HOME = {home}
{spindle}
# MIN_LIMIT, MAX_LIMIT and the rates of an axis are for moves by hand: in that box every pose is proved to be allowed,
# and all axes at once keep every joint within its speed. Programs have the PROGRAM_ values, which {guard}
# puts in force: the machine's true ranges, and rates that bind nothing, for {planner} keeps the joints within theirs.
"""


_SIMULATION = """\
# {name} as a simulation: every joint is at once where it is sent.
# For a machine of your own put its drives in the place of these loops, or write it for a card (--hardware).
"""

_REAL = """\
# {name} on {card}. {name}.md says what is left to the hand.
# Pins as documented in {source}.
"""

_HAL = """\
{head}
loadrt [KINS]KINEMATICS made={made}
loadrt [EMCMOT]EMCMOT {base_period}servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
{loading}addf motion-command-handler servo-thread
addf kins.begin-steps servo-thread
addf motion-controller servo-thread
addf kins.end-steps servo-thread

{loops}

# What the kinematics has to know: where the joints are told to be, the tool's length, and who moves the machine.
{told}
net tool-offset motion.tooloffset.z => kins.tool-offset
net teleop motion.teleop-mode => kins.teleop-mode
net coordinated motion.coord-mode => kins.coord-mode
net homed motion.is-all-homed => kins.homed
net in-position motion.in-position => kins.in-position

# M428 and M429 choose the kinematics: 0 the machine's, 1 every axis moves the joint of its number.
net kinematics-type motion.analog-out-03 => motion.switchkins-type
net identity kins.identity => planner.identity
net tool-offset => planner.tool-offset

# The guard: it stops jogs before a limit, and gives the axes' rates.
loadrt {guard} made={guard_made}
addf guard.watch servo-thread
net tool-offset => guard.tool-offset
net identity => guard.identity
net pose-known kins.pose-known => guard.pose-known
net teleop => guard.teleop-mode
net coordinated => guard.coord-mode
net homed => guard.homed
net enabled motion.motion-enabled => guard.enabled
net jog-stop guard.jog-stop => motion.jog-stop
{watched}
{signals}

# The window that shows the machine.
source {name}_screen.hal
"""

_LOOPBACKS = """\
net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net tool-prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net tool-change iocontrol.0.tool-change => iocontrol.0.tool-changed"""


_RATES_HAL = """\
# {name}: limits and rates of the axes, from the guard. The pins ini.* appear once LinuxCNC's task has started, for
# which the threads must run: sleep only stands for a program to wait with.

start
loadusr -Wn inihal sleep 60

{nets}
"""


def write_ini(
    machine: Machine, equipment: Equipment | None = None, screen: Literal["axis", "gmoccapy"] = "axis"
) -> str:
    """Write the ini file, for a simulation or for what drives the machine, with a screen."""
    (fast, acceleration), pose = choose_unit_rates(machine, "mm"), find_home_pose(machine)
    home, box = dict(zip(machine.axes, pose.tolist(), strict=True)), find_hand_box(machine)
    by_hand = _find_unit_speeds(machine, box)
    head = _INI.format(
        title=" ".join(machine.spec.title.split()),
        purpose=_describe_purpose(machine, equipment),
        base_period=f"BASE_PERIOD = {equipment.card.period}\n" if equipment and equipment.card.period else "",
        spindle=wiring.SPINDLE_INI if equipment else "",
        name=machine.name,
        screen=screen,
        settings=name_screen_settings(machine, screen),
        axes=" ".join(machine.axes),
        letters="".join(machine.axes),
        joints=len(machine.joints),
        kinematics=name_kinematics(machine),
        guard=name_guard(machine),
        planner=name_planner(machine),
        planner_made=hash_planner(machine),
        home=" ".join(format_number(home.get(axis, 0.0)) for axis in "XYZ"),
        jog=format_number(_JOG * by_hand["mm"]),
        by_hand=format_number(by_hand["mm"]),
        fast=format_number(fast),
        turn_jog=format_number(to_display(_JOG * by_hand["rad"], "rad")),
        turn_by_hand=format_number(to_display(by_hand["rad"], "rad")),
        acceleration=format_number(acceleration),
        remaps=list_remaps(machine),
    )
    axes = [_format_axis(machine, box, column) for column in range(len(machine.axes))]
    at_home = machine.inverse(pose).tolist()
    homing = [
        _list_immediate_homing(machine, i, q) if equipment is None else wiring.list_joint_keys(machine, equipment, i)
        for i, q in enumerate(at_home)
    ]
    joints = [_format_joint(i, drive, homing[i]) for i, drive in enumerate(machine.drives)]
    return "\n".join([head, *axes, *joints])


def _describe_purpose(machine: Machine, equipment: Equipment | None) -> str:
    if equipment is None:
        change = f"change {machine.name}.hal and the homing of the joints"
        return f"It runs as a simulation; for a machine of your own {change}."
    return f"It drives the machine by {equipment.card.title}; {machine.name}.md says what is left to the hand."


def _find_unit_speeds(machine: Machine, box: HandBox) -> dict[str, float]:
    """Find the speed of moves by hand for each unit; a machine without one has that of the slowest drive."""
    speeds = {unit: find_slowest_drive(machine, unit)[0] for unit in ("mm", "rad")}
    return speeds | {unit: float(speed) for unit, speed in zip(machine.axis_units, box.speed, strict=True)}


def _format_axis(machine: Machine, box: HandBox, column: int) -> str:
    """Format an axis: its ends and rates for moves by hand, then those for programs."""
    unit = machine.axis_units[column]
    speed, acceleration = choose_unit_rates(machine, unit)
    low, high = estimate_axis_ranges(machine)
    lines = [
        *_format_range(_round_inward(box.low[column], unit, 1.0), _round_inward(box.high[column], unit, -1.0), unit),
        *_format_rates(float(box.speed[column]), float(box.acceleration[column]), unit),
        *(f"PROGRAM_{line}" for line in _format_range(float(low[column]), float(high[column]), unit)),
        *(f"PROGRAM_{line}" for line in _format_rates(speed, acceleration, unit)),
    ]
    return _format_section(f"AXIS_{machine.axes[column]}", lines)


def _round_inward(end: float, unit: str, sign: float) -> float:
    """Round an end of the box inward to a hundredth of a mm or degree; ``sign`` is 1 for the low end, else -1."""
    digit = _END_DIGIT if unit == "mm" else _END_DIGIT * pi / 180.0
    return sign * ceil(sign * float(end) / digit) * digit


def _format_section(name: str, lines: Iterable[str]) -> str:
    return "\n".join([f"[{name}]", *lines, ""])


def _format_range(low: float, high: float, unit: str) -> Iterator[str]:
    yield f"MIN_LIMIT = {format_number(to_display(low, unit))}"
    yield f"MAX_LIMIT = {format_number(to_display(high, unit))}"


def _format_rates(speed: float, acceleration: float, unit: str) -> Iterator[str]:
    yield f"MAX_VELOCITY = {format_number(to_display(speed, unit))}"
    yield f"MAX_ACCELERATION = {format_number(to_display(acceleration, unit))}"


def _list_immediate_homing(machine: Machine, index: int, home: float) -> Iterator[str]:
    """List the keys of homing of a simulation: a joint is at home at once."""
    at_home = format_number(to_display(home, machine.drives[index].unit))
    yield from (f"HOME = {at_home}", f"HOME_OFFSET = {at_home}", "HOME_SEARCH_VEL = 0", "HOME_LATCH_VEL = 0")
    if machine.is_redundant and index < machine.leg_count:
        yield "# The legs' joints move together only: LinuxCNC jogs none whose sequence is negative."
        yield "HOME_SEQUENCE = -1"
    else:
        yield "HOME_SEQUENCE = 0"


def _format_joint(index: int, drive: Drive, homing: Iterable[str]) -> str:
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
        *homing,
    ]
    return _format_section(f"JOINT_{index}", lines)


def write_hal(machine: Machine, equipment: Equipment | None = None) -> str:
    """Write the HAL file: of a simulation, where every joint is at once where it is sent, or of a card."""
    if equipment is None:
        head = _SIMULATION.format(name=machine.name)
        loading, signals = [""], [_LOOPBACKS]
        loops = [
            f"net joint-{i} joint.{i}.motor-pos-cmd => joint.{i}.motor-pos-fb  # {name}"
            for i, name in enumerate(machine.joints)
        ]
    else:
        head = _REAL.format(name=machine.name, card=equipment.card.title, source=equipment.card.source)
        loading = [*wiring.list_loading(equipment), ""]
        loops = list(wiring.list_loops(machine, equipment))[:-1]
        signals = [*wiring.list_signals(equipment), "", *wiring.list_writing(equipment)]
    watched = [f"net told-{i} => guard.joint-{i}" for i in range(len(machine.joints))]
    for axis in machine.axes:
        letter = axis.lower()
        watched.append(f"net {letter}-pose kins.{letter} => guard.{letter}.pose")
        watched.append(f"net {letter}-position axis.{letter}.pos-cmd => guard.{letter}.position")
        for whose, section in (("hand", ""), ("program", "PROGRAM_")):
            watched += [f"setp guard.{letter}.{whose}-{pin} [AXIS_{axis}]{section}{key}" for pin, key in _KEYS.items()]
    commanded = [f"net told-{i} joint.{i}.pos-cmd => kins.joint-{i}" for i in range(len(machine.joints))]
    return _HAL.format(
        name=machine.name,
        made=hash_kinematics(machine, find_hand_box(machine)),
        head=head,
        base_period="base_period_nsec=[EMCMOT]BASE_PERIOD " if equipment and equipment.card.period else "",
        loading="\n".join(loading),
        signals="\n".join(signals),
        loops="\n".join(loops),
        told="\n".join(commanded),
        guard=name_guard(machine),
        guard_made=hash_guard(machine),
        watched="\n".join([*watched, ""]),
    )


def write_rates_hal(machine: Machine) -> str:
    """Write the HAL file that puts the guard's limits and rates of the axes in force, for LinuxCNC's task to read."""
    letters = [axis.lower() for axis in machine.axes]
    nets = [
        f"net {letter}-{pin} guard.{letter}.{pin} => ini.{letter}.{pin.replace('-', '_')}"
        for letter in letters
        for pin in ("min-limit", "max-limit", "max-velocity", "max-acceleration")
    ]
    return _RATES_HAL.format(name=machine.name, nets="\n".join(nets))


def write_tool_table(machine: Machine) -> str:
    """Write the tool table: one tool, whose length the machine's description has already."""
    return f"T1 P1 Z0 D0 ;the tool of {machine.name}, whose length the kinematics knows\n"
