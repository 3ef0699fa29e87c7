"""Write what of a configuration a card changes: loops, signals, and the keys of joints."""

from __future__ import annotations

from collections.abc import Iterator

from ....machine import Machine
from ....units import name_display_unit, to_display
from ..axis_rates import choose_drive_rates
from ..home_pose import find_home_pose
from ..homing import JointHoming
from ..homing.homing_plan import SEARCH, pace_return
from ..number_text import format_number
from . import absolute
from .equipment import ESTOP, PROBE, Equipment

_LATCH = 0.05  # of the speed of search
_GATE = 2  # inputs that a gate has at least

SPINDLE_INI = """\

[SPINDLE_0]
# rpm at the analog output's full scale: set what the spindle's drive has.
MAX_FORWARD_VELOCITY = 24000
"""


def list_loading(equipment: Equipment) -> list[str]:
    """List the HAL lines that load the card's driver and add what it reads to the threads."""
    layout = equipment.layout
    fast = [f"addf {function} base-thread" for function in layout.fast]
    reading = [f"addf {function} servo-thread" for function in layout.read]
    encoders = _list_beside_steps(equipment)
    return ["", *layout.load, "", *fast, *reading, *(absolute.list_loading(encoders) if encoders else ())]


def _list_beside_steps(equipment: Equipment) -> list[int]:
    """List the joints whose absolute encoders stand beside a step generator."""
    switches = enumerate(equipment.switches)
    return [i for i, switch in switches if switch is None] if equipment.card.has_steps else []


def list_writing(equipment: Equipment) -> list[str]:
    """List the HAL lines that add what the card writes to the servo thread; they come last."""
    encoders = absolute.list_writing(_list_beside_steps(equipment))
    return [*encoders, *(f"addf {function} servo-thread" for function in equipment.layout.write)]


def list_loops(machine: Machine, equipment: Equipment) -> Iterator[str]:
    """List the HAL lines of every joint: loop, home switch, enabling."""
    encoders = _list_beside_steps(equipment)
    for i, (name, switch) in enumerate(zip(machine.joints, equipment.switches, strict=True)):
        yield f"# {name}"
        yield f"net joint-{i}-enable joint.{i}.amp-enable-out"
        if i in encoders:
            yield from absolute.list_loop(i, name)
            yield from equipment.layout.loops[i]
        else:
            yield f"net joint-{i}-command joint.{i}.motor-pos-cmd"
            yield from equipment.layout.loops[i]
            yield f"net joint-{i}-feedback => joint.{i}.motor-pos-fb"
        if switch is not None:
            yield f"net joint-{i}-home {switch} => joint.{i}.home-sw-in"
        yield ""


def list_signals(equipment: Equipment) -> Iterator[str]:
    """List the HAL lines of the chain of the emergency stop, spindle, coolant, probe and tool change."""
    layout = equipment.layout
    faults = [("estop-open", f"{layout.inputs[ESTOP]}-not")]
    faults += [(f"card-fault-{i}", pin) for i, pin in enumerate(layout.faults)]
    yield "# Emergency stop: the chain's closed contact is true. A fault stops till it is gone and reset on the screen."
    yield f"loadrt logic names=faults personality=0x{0x200 + max(_GATE, len(faults)):x}"
    yield "loadrt estop_latch"
    yield "addf faults servo-thread"
    yield "addf estop-latch.0 servo-thread"
    for i, (name, fault) in enumerate(faults):
        yield f"net {name} {fault} => faults.in-{i:02d}"
    yield "net fault faults.or => estop-latch.0.fault-in"
    yield "net user-enable iocontrol.0.user-enable-out => estop-latch.0.ok-in"
    yield "net estop-reset iocontrol.0.user-request-enable => estop-latch.0.reset"
    yield "net estop estop-latch.0.ok-out => iocontrol.0.emc-enable-in"
    yield ""
    yield "net probe " + layout.inputs[PROBE] + " => motion.probe-input"
    yield "net spindle-on spindle.0.on"
    yield "net spindle-speed spindle.0.speed-out-abs"
    yield from layout.spindle
    pins = iter(layout.outputs)
    for signal in layout.signals:
        source = f" {signal.source}" if signal.source else ""
        pin = next(pins, None)
        yield f"# {signal.switches}" if pin else f"# {signal.switches}: no output is left for it"
        if pin:
            yield f"net {signal.name}{source} => {pin}"
    yield ""
    yield "# Tools are changed by hand, where the screen says so."
    yield "loadusr -W hal_manualtoolchange"
    yield "net tool-prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared"
    yield "net tool-number iocontrol.0.tool-prep-number => hal_manualtoolchange.number"
    yield "net tool-change iocontrol.0.tool-change => hal_manualtoolchange.change"
    yield "net tool-changed hal_manualtoolchange.changed => iocontrol.0.tool-changed"


def list_joint_keys(machine: Machine, equipment: Equipment, index: int) -> Iterator[str]:
    """List a joint's keys in the ini file: how it is homed, and what its loop needs."""
    drive, homing = machine.drives[index], equipment.homing.joints[index]
    home = float(machine.inverse(find_home_pose(machine))[index])
    yield f"HOME = {format_number(to_display(home, drive.unit))}"
    yield from _list_homing(machine, equipment, index, homing)
    scale, is_said = equipment.scales[index]
    unit = name_display_unit(drive.unit)
    if not is_said:
        yield "# chosen, for the machine's description does not say it: counts and lead. Set what your drive has."
    yield f"# steps or counts a {unit}"
    yield f"SCALE = {format_number(scale)}"
    yield from equipment.card.list_keys(drive, scale)


def _list_homing(machine: Machine, equipment: Equipment, index: int, homing: JointHoming) -> Iterator[str]:
    """List the keys of homing; a negative sequence forbids moving legs one by one before they are homed."""
    drive = machine.drives[index]
    legs = index < machine.leg_count
    sequence = f"HOME_SEQUENCE = {'-' if legs else ''}{homing.sequence}"
    if homing.switch is None:
        yield "# added to what the encoder reads: set it so that the joint reads right"
        yield from ("HOME_OFFSET = 0", "HOME_SEARCH_VEL = 0", "HOME_LATCH_VEL = 0")
        yield from ("HOME_ABSOLUTE_ENCODER = 2", sequence)
        return
    search = homing.direction * SEARCH * to_display(choose_drive_rates(drive)[0], drive.unit)
    if drive.homing is None:
        yield "# where the home switch trips: an end of the range, for the machine's description does not say it"
    yield f"HOME_OFFSET = {format_number(to_display(homing.switch, drive.unit))}"
    yield f"HOME_SEARCH_VEL = {format_number(search)}"
    yield f"HOME_LATCH_VEL = {format_number(-_LATCH * search)}"
    yield f"HOME_FINAL_VEL = {format_number(to_display(pace_return(machine, equipment.homing)[index], drive.unit))}"
    yield sequence
    if equipment.card.has_steps:
        yield "# steps that were not made while the drive was off are lost"
        yield "VOLATILE_HOME = 1"
