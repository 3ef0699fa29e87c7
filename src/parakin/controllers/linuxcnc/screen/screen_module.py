"""Write the window that shows the moving machine beside LinuxCNC's own screen, in Python with OpenGL and Tk."""

from __future__ import annotations

from importlib.resources import files
from math import isfinite
from pprint import pformat
from typing import Any

import numpy as np

from ....export.machine.scene import Scene, build_scene
from ....export.machine.solids import LOOKS
from ....machine import Machine
from ....units import to_display
from ..home_pose import find_home_pose
from ..model_header import format_title
from .hull import find_workspace_hull, list_hull_lines
from .limit_words import describe_limits
from .placement_code import write_placement

_HEADER = '''\
#!/usr/bin/python3
"""{name}: {machine}, {title}, on LinuxCNC's screen.

Made by parakin from the machine's description; make it anew rather than edit it. LinuxCNC starts it from
{machine}_screen.hal, with its own Python. Where there is no display it only waits. It uses modules of LinuxCNC that
are under the GNU General Public License, and so is this file: you may redistribute and modify it under that licence,
version 2 or, at your option, any later one. It comes WITHOUT ANY WARRANTY.
"""

import signal
import sys
import time
from math import atan2, copysign, cos, degrees, fabs, pi, sin, sqrt

import hal

'''

_HAL = """\
# {machine}: the window that shows the machine. Without a display it waits and does nothing.

loadusr -Wn {name} /usr/bin/python3 {name}.py
{nets}
"""

_AXIS = """\
# AXIS reads this once it has started. The numbers that it writes over its picture stand in the tab DRO as well, and in
# the window of {machine}: they don't cover the path here.

o.enable_dro = False
o.show_overlay = False
if root_window.winfo_screenwidth() >= 1800:
    root_window.tk.call("wm", "geometry", ".", "%dx%d+0+0" % (root_window.winfo_screenwidth() // 2 - 20, 820))

# The greatest speed of jogs, MAX_LINEAR_VELOCITY of [DISPLAY], would be AXIS' greatest speed of programs, too, which it
# tells LinuxCNC at once: posted programs would take longer than told. Its slider ends where [TRAJ] does, far off.

fastest = float(inifile.find("TRAJ", "MAX_LINEAR_VELOCITY"))
vars.max_maxvel.set(fastest)
c.maxvel(fastest)
root_window.tk.eval("${{pane_top}}.maxvel.l configure -width 9")
"""

_GMOCCAPY = """\
# gmoccapy runs this at the end of its start. By itself it opens only the program that its own settings name; where they
# name none it now opens OPEN_FILE of the ini file of {machine}, as AXIS does.

if not self.prefs.getpref("open_file", "", str).strip():
    opened = os.path.join(CONFIGPATH, self.get_ini_info.inifile.find("DISPLAY", "OPEN_FILE"))
    self.command.program_open(os.path.abspath(opened))

# Its sliders for jogs count by the minute. The ini file tells their speeds by the second, as LinuxCNC wants it, but
# gmoccapy takes the turning ones' as they are, and for the greatest of the others that of programs.

ini = self.get_ini_info.inifile
for slider, kind in ((self.widgets.spc_lin_jog_vel, "LINEAR"), (self.widgets.spc_ang_jog_vel, "ANGULAR")):
    slider.set_property("max", 60.0 * float(ini.find("DISPLAY", "MAX_%s_VELOCITY" % kind)))
    slider.set_value(60.0 * float(ini.find("DISPLAY", "DEFAULT_%s_VELOCITY" % kind)))
self.jog_rate_max = self.widgets.spc_lin_jog_vel.get_property("max")
"""

_SETTINGS = {"axis": _AXIS, "gmoccapy": _GMOCCAPY}


def name_screen(machine: Machine) -> str:
    """Name the window's program, and its component in HAL."""
    return f"{machine.name}_screen"


def write_screen(machine: Machine) -> str:
    """Write the program of the window: what the machine is as data, how it moves as a function, and the viewer."""
    head = _HEADER.format(
        name=name_screen(machine), machine=machine.name, title=format_title(machine).replace('"', "'")
    )
    data = "".join(f"{name} = {_format_data(value)}\n" for name, value in _collect_data(machine).items())
    viewer = files(__package__).joinpath("viewer.txt").read_text(encoding="utf-8")
    return f"{head}{data}\n\n{write_placement(machine)}\n\n{viewer}"


def _format_data(value: Any) -> str:
    return pformat(value, width=118, compact=True)


def _collect_data(machine: Machine) -> dict[str, Any]:
    """Collect the constants of the viewer, in mm and degrees."""
    home = find_home_pose(machine)
    scene, at_home = build_scene(machine, home), machine.inverse(home)
    hull, triangles = find_workspace_hull(machine, home, scene)
    size = build_scene(machine).size
    return {
        "MACHINE": machine.name,
        "TITLE": " ".join((machine.spec.title or machine.name).split()),
        "COMPONENT": name_screen(machine),
        "AXES": [_name_unit(axis, unit) for axis, unit in zip(machine.axes, machine.axis_units, strict=True)],
        "JOINTS": [
            (*_name_unit(drive.name, drive.unit), _find_end(drive.low, drive.unit), _find_end(drive.high, drive.unit))
            for drive in machine.drives
        ],
        "HOME_POSE": _round_display(home, machine.axis_units),
        "HOME_JOINTS": _round_display(at_home, machine.joint_units),
        "LIMITS": describe_limits(machine),
        "LOOKS": {kind: _describe_look(kind, size) for kind in LOOKS},
        "ITEMS": [(item.kind, len(item.points), item.closed) for item in scene.items],
        "HULL": np.round(hull, 1).tolist(),
        "HULL_FACES": triangles.tolist(),
        "HULL_LINES": list_hull_lines(machine.axis_units.count("mm")),
        "BOX": _find_box(scene, hull).round(1).tolist(),
        "FLOOR": round(float(min(scene.box[0, 2], hull[:, 2].min())), 1),
        "NORMAL": None if scene.normal is None else scene.normal.tolist(),
    }


def _name_unit(name: str, unit: str) -> tuple[str, str]:
    return name, "deg" if unit == "rad" else unit


def _find_end(value: float, unit: str) -> float | None:
    return round(to_display(value, unit), 6) if isfinite(value) else None


def _round_display(values: Any, units: tuple[str, ...]) -> list[float]:
    return [round(to_display(value, unit), 9) for value, unit in zip(values.tolist(), units, strict=True)]


def _describe_look(kind: str, size: float) -> tuple[float, float, float, float]:
    """Describe colour, red, green and blue of 1, and thickness in mm."""
    look = LOOKS[kind]
    red, green, blue = (round(int(look.colour[i : i + 2], 16) / 255.0, 3) for i in (1, 3, 5))
    return red, green, blue, round(look.radius * size, 3)


def _find_box(scene: Scene, hull: Any) -> Any:
    """Find the box (2, 3) that the first view shows: the machine, and half of what lies around it."""
    points = np.vstack([scene.box, hull])
    return 0.5 * (scene.box + [points.min(0), points.max(0)])


def write_screen_hal(machine: Machine) -> str:
    """Write the HAL file that starts the window and brings it what moves; it comes after the machine's own."""
    name = name_screen(machine)
    nets = [f"net {axis.lower()}-pose => {name}.{axis.lower()}" for axis in machine.axes]
    nets += [f"net told-{i} => {name}.joint-{i}" for i in range(len(machine.joints))]
    nets += [f"net {signal} => {name}.{signal}" for signal in ("tool-offset", "homed", "enabled", "jog-stop")]
    nets += [f"net {pin} guard.{pin} => {name}.{pin}" for pin in ("distance", "nearest")]
    return _HAL.format(machine=machine.name, name=name, nets="\n".join(nets))


def name_screen_settings(machine: Machine, screen: str) -> str:
    """Name the file that LinuxCNC's screen runs at its start."""
    return f"{machine.name}_{screen}.py"


def write_screen_settings(machine: Machine, screen: str) -> str:
    """Write what LinuxCNC's screen runs at its start: AXIS leaves its picture free, gmoccapy gets a program, speeds."""
    return _SETTINGS[screen].format(machine=machine.name)
