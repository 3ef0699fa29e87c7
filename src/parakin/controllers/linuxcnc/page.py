"""Write the page that says how to use a configuration."""

from __future__ import annotations

from html import escape

from ...machine import Machine
from ...units import to_display
from .guard import name_guard
from .hardware import Equipment
from .hardware.hardware_page import describe_equipment, list_files
from .home_pose import find_home_pose
from .kinematics_module import name_kinematics
from .model_header import LEAST_REGULARITY, list_limit_names
from .number_text import format_number
from .planner import NO_TOLERANCE, name_planner
from .screen import name_screen_settings

_PAGE = """\
# {title} under LinuxCNC

For LinuxCNC 2.9, {purpose}.

| file | what it is |
|---|---|
| `{kinematics}.c` | the kinematics: {joints} from {axes} and back |
| `{guard}.c` | the guard: it keeps moves by hand within the limits |
| `{name}_model.h` | the machine's mathematics, which all include |
| `{planner}.c` | the trajectory planner, which keeps the joints' limits |
| `{name}.ini` | ranges, speeds and home |
| `{name}.hal`, `{name}_rates.hal` | {drives}, the guard, the axes' rates |
{files}| `{name}_screen.py`, `{name}_screen.hal` | the window that shows the machine, and what brings it the joints |
| `{settings}` | what LinuxCNC's screen does at its start |
| `{name}.tbl` | the tool |
| `{switches}_m428.ngc` to `m430` | M428 and M429, which choose the kinematics |
| `{name}.ngc` | a first program: a square at home |

Install the three modules once and start:

```
sudo apt-get install linuxcnc-uspace linuxcnc-uspace-dev
sudo halcompile --install {kinematics}.c
sudo halcompile --install {guard}.c
sudo halcompile --install {planner}.c
linuxcnc {name}.ini
```

`halcompile` needs a folder whose path has no blanks. Once the description has changed, install them anew:
with one of an older making LinuxCNC does not start, and says so.

Switch the machine on and home it: {standing}{home}.
Programs are in millimetres and degrees; {frame}.

A window beside LinuxCNC's own screen shows the machine as it moves, with position, joints, and the nearest limit in
words; drag turns it, the right button moves it, the wheel zooms, a double click goes back. Pale blue is what is reached
straight from home with home's orientation. Without a display, or once it is closed, the machine runs as well. To do
without it take the line with `{name}_screen.hal` out of `{name}.hal`.

{equipment}## What to know

- A pose that a leg can't reach, that a limit of the machine's description forbids, or that is nearer to a singularity
  than {least} % of home's margin, is refused by the kinematics ("fails kinematicsInverse"); so is a step of a joint
  beyond twice its speed in a cycle. The drives' ranges LinuxCNC watches itself.
- Jogs are for the box of `{name}.ini` (MIN_LIMIT, MAX_LIMIT of the axes): in it every pose is allowed, and all axes
  at once keep every joint within its speed and acceleration. The guard stops a jog softly at the box's end, before a
  limit, and where a joint would pass its speed; what leads back goes on. Outside of the box, after a program, jogs
  lead inward.
- Programs and MDI have the machine's whole range (PROGRAM_ in `{name}.ini`, which the guard puts in force in
  coordinated motion). The planner `{planner}` looks ahead along the path and keeps every joint within its speed, its
  acceleration and its range: in programs from anywhere, at any override, in a pause and in a stop. A motion that leaves
  the workspace, or that a joint would have to jump in, is refused with its line before it begins. The screen may ask
  whether to run a program beyond the box: that is no fault of it.
- `parakin post PART --machine {name} --target linuxcnc` writes programs with times, which the planner keeps exactly;
  other programs it runs as fast as joints and feed allow. Corners are cut within the tolerance of G64 P; without a P by
  {no_tolerance} mm. Turning motions count a degree as a millimetre.
- `guard.distance` tells how far the nearest limit is (0 where it is reached, 1 where jogs stop), `guard.nearest` which:

{limits}

{pole}- A tool length offset (G43) counts along the tool: what the tool is longer than the machine's own. As it is
  switched on or off the joints stay and the position follows, of a tilted tool X and Y too. A program's next motion
  that takes a coordinate from before is refused: name X Y Z in it, or put `M66 E0 L0` behind G43.
{by_joints}- Speeds and accelerations that the description does not say were chosen, and are marked so in the ini file.

The kinematics is compiled against LinuxCNC's headers and loaded into its programs, which are under the GNU General
Public License; therefore `{kinematics}.c` is, too.
"""

_POLE = """\
- Where the tool lies along the wrist's first axis, that axis is free and stays where it is. From there a tilt in
  another direction makes it turn at once, which is refused; so home lies aside. Begin a program with the tool tilted
  the way it goes on.
"""

_JOINTS = """\
- M429 has every axis move the joint of its number (X the first joint), by MDI, programs and jogs, so that a machine
  which stands at a singularity or a limit can be driven out joint by joint; give places with G53. M428 goes back to
  the machine's kinematics. It is refused while the joints are beyond a singularity or a limit, and, until the machine
  is homed again, once they have been so near to a singularity that they don't tell the pose. The window shows the true
  pose meanwhile, and the guard stops jogs.
"""

_REDUNDANT_JOINTS = """\
- There are more drives than freedoms, so no joint of a leg may move by itself: the encoders are absolute, M429 is
  refused, and LinuxCNC refuses to jog one, for its HOME_SEQUENCE is negative. Drives that are a following error apart
  pull at each other; the position shown is that of least squares, and none is where they disagree by more than 1 mm.
"""

_DIRECTION = "the tool's axis is Rz(C)·Ry(B)·z, from the tip into the holder"
_ORIENTATION = "the tool's frame is Rz(C)·Ry(B)·Rx(A)"
_PLACE = "the axes are those of the machine's frame"


def write_page(machine: Machine, equipment: Equipment | None = None, screen: str = "axis") -> str:
    """Write the page, Markdown."""
    home = zip(machine.axes, find_home_pose(machine).tolist(), machine.axis_units, strict=True)
    words = [f"{axis} {format_number(to_display(value, unit))}" for axis, value, unit in home]
    return _PAGE.format(
        title=escape(" ".join(machine.spec.title.split()), quote=False),
        name=machine.name,
        settings=name_screen_settings(machine, screen),
        switches=machine.name.lower(),
        kinematics=name_kinematics(machine),
        guard=name_guard(machine),
        planner=name_planner(machine),
        no_tolerance=format_number(NO_TOLERANCE),
        joints=" ".join(machine.joints),
        axes=" ".join(machine.axes),
        home=", ".join(words),
        purpose=f"on {equipment.card.title}" if equipment else "as a simulation without hardware",
        drives="the card's drives and signals" if equipment else "loops in the place of drives",
        files=list_files(equipment) if equipment else "",
        standing="joints with home switches are then at home, " if equipment else "it then stands at ",
        equipment=describe_equipment(machine, equipment) if equipment else "",
        frame=_DIRECTION if machine.has_direction else _ORIENTATION if len(machine.axes) == 6 else _PLACE,
        pole=_POLE if machine.wrist is not None else "",
        by_joints=_REDUNDANT_JOINTS if machine.is_redundant else _JOINTS,
        least=format_number(100.0 * LEAST_REGULARITY),
        limits="\n".join(f"  - {i}: {escape(name, quote=False)}" for i, name in enumerate(list_limit_names(machine))),
    )
