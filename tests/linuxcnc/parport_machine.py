"""A machine on parallel ports under the real LinuxCNC: the template as it is written, and what hangs on its terminals.

LinuxCNC's sim_parport stands for the ports; steps are made by the real stepgen. Where the steps have brought a joint is
added up from where it stood at the start; home switches trip and absolute encoders read by that place.
"""

from __future__ import annotations

import re
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from simulation import HERE, Simulation, make_configuration, write_folder

from parakin.controllers.linuxcnc.hardware import equip_machine

BASE_PERIOD = 100_000  # ns: a busy computer makes no faster pulses
FASTER = 8.0  # than the template homes, for there is no machine to be careful with
LOOPBACKS = """\
net tool-prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net tool-change iocontrol.0.tool-change => iocontrol.0.tool-changed
"""


def write_terminals(machine, start):
    """HAL of places, switches and encoders, for joints (joints,) at the start, mm and rad.

    A switch's place is 1 in the direction of its search, for LinuxCNC's sim_home_switch trips above zero upward only.
    """
    equipment = equip_machine(machine, "parport")
    scale = np.where(np.array(machine.joint_units) == "rad", 180.0 / np.pi, 1.0)
    indices = range(len(machine.joints))
    switched = [i for i in indices if equipment.homing.joints[i].switch is not None]
    names = [*(f"place-{i}" for i in indices), *(f"toward-{i}" for i in switched)]
    lines = [f"loadrt scale names={','.join(names)}"]
    for i in indices:
        lines += [f"addf place-{i} servo-thread", f"setp place-{i}.offset {start[i] * scale[i]:.9f}"]
        lines += [f"setp place-{i}.gain 1", f"net joint-{i}-feedback => place-{i}.in", f"net place-{i} place-{i}.out"]
    if switched:
        lines.append(f"loadrt sim_home_switch names={','.join(f'switch-{i}' for i in switched)}")
    for i in switched:
        joint, pin = equipment.homing.joints[i], equipment.switches[i]
        lines += [f"addf toward-{i} servo-thread", f"addf switch-{i} servo-thread"]
        lines += [f"net place-{i} => toward-{i}.in", f"setp toward-{i}.gain {joint.direction:g}"]
        lines.append(f"setp toward-{i}.offset {1.0 - joint.direction * joint.switch * scale[i]:.9f}")
        lines += [f"net toward-{i} toward-{i}.out => switch-{i}.cur-pos", f"setp switch-{i}.hysteresis 0"]
        lines.append(f"net switch-{i} switch-{i}.home-sw => {pin}-fake")
    lines.append(f"setp {equipment.layout.inputs[0]}-fake 1")  # the emergency stop's closed contact
    return "\n".join([*lines, ""])


def write_sampler(machine):
    """HAL that writes down, every cycle, whether all joints are homed, and where they really are, mm and degrees."""
    joints = len(machine.joints)
    lines = [f"loadrt sampler depth=16000 cfg=b{'f' * joints}", "addf sampler.0 servo-thread"]
    lines += ["net homed => sampler.0.pin.0"]
    lines += [f"net place-{i} => sampler.0.pin.{i + 1}" for i in range(joints)]
    return "\n".join([*lines, ""])


def adapt_hal(machine, hal, start):
    """The template with simulated ports, encoders by the joints' places, and tools that change by themselves."""
    ports = len(re.search(r'loadrt hal_parport cfg="([^"]*)"', hal)[1].split()) // 2
    names = ",".join(f"parport.{i}" for i in range(ports))
    hal = re.sub(r"loadrt hal_parport .*", f"loadrt sim_parport names={names}", hal)
    hal = re.sub(r"(?s)loadusr -W hal_manualtoolchange.*?tool-changed\n", LOOPBACKS, hal, count=1)
    for i, joint in enumerate(machine.joints):
        hal = hal.replace(f"net joint-{i}-encoder ENCODER-{joint} ", f"net place-{i} ")
    # The places come first, for encoders are taken from them.
    return hal.replace("\nloadrt stepgen", f"\n{write_terminals(machine, start)}\nloadrt stepgen", 1)


def adapt_ini(ini):
    """Fewer pulses a second than a real port, a quicker homing, and steps that may come late from a busy computer."""
    ini = re.sub(r"\n((?:MIN_)?FERROR) = .*", r"\n\1 = 100", ini)
    ini = re.sub(r"BASE_PERIOD = .*", f"BASE_PERIOD = {BASE_PERIOD}", ini)
    ini = re.sub(r"(HOME_(?:SEARCH|LATCH|FINAL)_VEL) = (.*)", lambda m: f"{m[1]} = {float(m[2]) * FASTER:.9f}", ini)
    ini = ini.replace("DISPLAY = axis", "DISPLAY = ./ui.py")
    return ini.replace("[KINS]", "HALFILE = sampler.hal\n\n[KINS]")


@contextmanager
def driven_by_parport(machine, start):
    """A :class:`Simulation` of the template, with joints (joints,) that stand at ``start``, mm and rad."""
    with tempfile.TemporaryDirectory(dir="/var/tmp") as name:
        folder, files = Path(name), dict(make_configuration(machine, "parport"))
        files[f"{machine.name}.hal"] = adapt_hal(machine, files[f"{machine.name}.hal"], start)
        files[f"{machine.name}.ini"] = adapt_ini(files[f"{machine.name}.ini"])
        write_folder(folder, files | {"sampler.hal": write_sampler(machine)}, HERE / "operator_ui.py")
        yield Simulation(machine, folder)
