"""Write the page that says how to use a configuration."""

from __future__ import annotations

from html import escape

from ...machine import Machine
from ...units import to_display
from .config import format_number
from .home_pose import find_home_pose
from .module import name_kinematics

_PAGE = """\
# {title} under LinuxCNC

For LinuxCNC 2.9, as a simulation without hardware.

| file | what it is |
|---|---|
| `{kinematics}.c` | the kinematics: {joints} from {axes} and back |
| `{name}_model.h` | the machine's mathematics, which the kinematics includes |
| `{name}.ini` | ranges, speeds and home |
| `{name}.hal` | loops in the place of drives |
| `{name}.tbl` | the tool |
| `{name}.ngc` | a first program: a square at home |

Install the kinematics once and start:

```
sudo apt-get install linuxcnc-uspace linuxcnc-uspace-dev
sudo halcompile --install {kinematics}.c
linuxcnc {name}.ini
```

`halcompile` needs a folder whose path has no blanks. Once the description has changed, install the kinematics anew:
with one of an older making LinuxCNC does not start, and says so.

Switch the machine on and home it: it then stands at {home}.
Programs are in millimetres and degrees; {frame}.

## What to know

- A pose that a leg can't reach, or that a limit of the machine's description forbids, is refused by the kinematics
  ("fails kinematicsInverse"); the drives' ranges LinuxCNC watches itself.
- Before a move LinuxCNC looks at its end point only; in between it stops where a limit is met.
- In coordinated moves LinuxCNC bounds the speeds of the axes, not those of the joints. Near a singularity joints run
  faster than the tool: the program has to carry feeds that keep them within their speeds. `parakin post PART --machine
  {name} --target linuxcnc` writes such programs; run them from home.
- The axes' accelerations in `{name}.ini` are more than the drives' own, or LinuxCNC could not keep up with short
  motions that turn the tool. These programs need them; moves by hand should be slow. The feed can't be overridden to
  more than 100 %.
{pole}- The tool's length is part of the machine's description. Leave tool length offsets (G43) at 0: LinuxCNC adds them
  along Z, wherever the tool points.
- Speeds and accelerations that the description does not say were chosen, and are marked so in the ini file.

The kinematics is compiled against LinuxCNC's headers and loaded into its programs, which are under the GNU General
Public License; therefore `{kinematics}.c` is, too.
"""

_POLE = """\
- Where the tool lies along the wrist's first axis, that axis is free and stays where it is. From there a tilt in
  another direction makes it turn at once: begin a program with the tool tilted the way it goes on.
"""

_DIRECTION = "the tool's axis is Rz(C)·Ry(B)·z, from the tip into the holder"
_ORIENTATION = "the tool's frame is Rz(C)·Ry(B)·Rx(A)"
_PLACE = "the axes are those of the machine's frame"


def write_page(machine: Machine) -> str:
    """Write the page, Markdown."""
    home = zip(machine.axes, find_home_pose(machine).tolist(), machine.axis_units, strict=True)
    words = [f"{axis} {format_number(to_display(value, unit))}" for axis, value, unit in home]
    return _PAGE.format(
        title=escape(" ".join(machine.spec.title.split()), quote=False),
        name=machine.name,
        kinematics=name_kinematics(machine),
        joints=" ".join(machine.joints),
        axes=" ".join(machine.axes),
        home=", ".join(words),
        frame=_DIRECTION if machine.has_direction else _ORIENTATION if len(machine.axes) == 6 else _PLACE,
        pole=_POLE if machine.wrist is not None else "",
    )
