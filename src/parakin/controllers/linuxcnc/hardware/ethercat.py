"""EtherCAT drives of CiA 402, one a joint, with a coupler for inputs, outputs and the spindle's speed.

Pins as in linuxcnc-ethercat: documentation/cia402.md and configuration-reference.md, and as exported by src/cia402.c,
src/devices/lcec_class_cia402.c, lcec_class_din.c, lcec_class_dout.c and lcec_el41x2.c.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, inf

from ....model.elements import Drive
from .card import FLOOD, MACHINE_ON, MIST, SPINDLE_ON, SPINDLE_REVERSE, Card, Layout

_MOST_JOINTS = 16  # that LinuxCNC has
_TERMINAL = 8  # channels of an EL1008 and an EL2008

_XML = """\
<?xml version="1.0" encoding="UTF-8"?>
<!-- The bus of {name}: a drive a joint, then a coupler with inputs, outputs and an analog output.
     Give each drive its vid and pid ("ethercat slaves -v"), or the type that linuxcnc-ethercat has for it. -->
<masters>
  <master idx="0" appTimePeriod="1000000" refClockSyncCycles="1000">
{slaves}
  </master>
</masters>
"""

_DRIVE = """\
    <slave idx="{index}" type="basic_cia402" vid="0x00000000" pid="0x00000000" name="{name}">
      <dcConf assignActivate="300" sync0Cycle="*1" sync0Shift="0"/>
      <modParam name="enableCSP" value="true"/>
      <modParam name="enablePP" value="false"/>
      <modParam name="enablePV" value="false"/>
    </slave>"""


def _arrange(name: str, joints: Sequence[str], inputs: int) -> Layout:
    terminals = [f"inputs{i}" for i in range(ceil(inputs / _TERMINAL))]
    count = len(joints)
    return Layout(
        load=(
            f"loadusr -W lcec_conf {name}_ethercat.xml",
            "loadrt lcec",
            f"loadrt cia402 count={count}",
            "loadrt not names=bus-down",
            "net bus-operates lcec.0.all-op => bus-down.in",
            "setp lcec.0.analog.aout-0-scale [SPINDLE_0]MAX_FORWARD_VELOCITY",
        ),
        read=("lcec.read-all", *(f"cia402.{i}.read-all" for i in range(count)), "bus-down"),
        write=(*(f"cia402.{i}.write-all" for i in range(count)), "lcec.write-all"),
        loops=tuple(_list_loop(i, f"lcec.0.{joint}.srv") for i, joint in enumerate(joints)),
        inputs=tuple(f"lcec.0.{terminal}.din-{i}" for terminal in terminals for i in range(_TERMINAL)),
        outputs=tuple(f"lcec.0.outputs.dout-{i}" for i in range(_TERMINAL)),
        spindle=(
            "net spindle-on => lcec.0.analog.aout-0-enable",
            "net spindle-speed => lcec.0.analog.aout-0-value",
        ),
        signals=(MACHINE_ON, SPINDLE_ON, FLOOD, MIST, SPINDLE_REVERSE),
        faults=("bus-down.out",),
        files={f"{name}_ethercat.xml": _write_bus(name, joints, terminals)},
        wiring=("the spindle's speed: channel 1 of the analog terminal, 0 to 10 V",),
    )


def _list_loop(index: int, drive: str) -> tuple[str, ...]:
    """List the lines of a joint: the drive closes the loop, cyclic synchronous position."""
    axis = f"cia402.{index}"
    return (
        f"setp {axis}.csp-mode 1",
        f"setp {axis}.pos-scale [JOINT_{index}]SCALE",
        f"setp {axis}.velo-scale [JOINT_{index}]SCALE",
        f"net drive-{index}-status {drive}-cia-statusword => {axis}.statusword",
        f"net drive-{index}-mode-told {drive}-opmode-display => {axis}.opmode-display",
        f"net drive-{index}-position {drive}-actual-position => {axis}.drv-actual-position",
        f"net drive-{index}-velocity {drive}-actual-velocity => {axis}.drv-actual-velocity",
        f"net drive-{index}-control {axis}.controlword => {drive}-cia-controlword",
        f"net drive-{index}-mode {axis}.opmode => {drive}-opmode",
        f"net drive-{index}-target {axis}.drv-target-position => {drive}-target-position",
        f"net joint-{index}-command => {axis}.pos-cmd",
        f"net joint-{index}-feedback {axis}.pos-fb",
        f"net joint-{index}-enable => {axis}.enable",
        f"net joint-{index}-fault {axis}.drv-fault => joint.{index}.amp-fault-in",
    )


def _write_bus(name: str, joints: Sequence[str], terminals: Sequence[str]) -> str:
    devices = [("EK1100", "coupler"), *(("EL1008", t) for t in terminals), ("EL2008", "outputs"), ("EL4102", "analog")]
    slaves = [_DRIVE.format(index=i, name=joint) for i, joint in enumerate(joints)]
    slaves += [
        f'    <slave idx="{i}" type="{kind}" name="{title}"/>' for i, (kind, title) in enumerate(devices, len(joints))
    ]
    return _XML.format(name=name, slaves="\n".join(slaves))


def _list_joint_keys(drive: Drive, scale: float) -> list[str]:
    return []


ETHERCAT = Card(
    title="EtherCAT drives",
    source="documentation/cia402.md and src/ of github.com/linuxcnc-ethercat/linuxcnc-ethercat",
    most_joints=_MOST_JOINTS,
    most_rate=inf,
    has_steps=False,
    arrange=_arrange,
    list_keys=_list_joint_keys,
    left=(
        "LinuxCNC needs linuxcnc-ethercat with its component `cia402`, and the EtherCAT master; neither is part of it.",
        "In the bus's file (`_ethercat.xml`) every drive has a vendor and product of 0, with which nothing runs: take "
        "them from `ethercat slaves -v`, or use the drive's own type, and put slaves in the order of the cable.",
        "Drives stand in cyclic synchronous position; their own following error, ramps for a stop and brake are set "
        "in the drives. Check the distributed clock (`dcConf`) against the drive's manual.",
    ),
)
