"""Write the guard: a realtime component that watches how near the machine is to its limits."""

from __future__ import annotations

from importlib.resources import files

from ...machine import Machine
from .model_header import GPL, format_title, name_model
from .tape_to_c import format_c

_HEADER = """\
/* {name}.c: keeps moves by hand within the limits of {machine}, {title}.

   Made by parakin from the machine's description; make it anew rather than edit it.
   {gpl}

   Build and install:  sudo halcompile --install {name}.c
   {model} must lie beside it. */

#pragma GCC optimize ("O3")

#include "rtapi.h"
#include "rtapi_app.h"
#include "rtapi_math.h"
#include "hal.h"
#include "kinematics.h"

#include "{model}"

#define MODULE "{name}"
{numbers}
static const char axis_letters[] = "{letters}";

"""

_NUMBERS = {
    "TRAILS": (10.0, "cycles at full speed by which interpolated joints may be behind the pose"),
    "LATENCY": (4.0, "cycles from a command to the axes' answer"),
    "PARTS": (4, "of the way to where the machine stops, at whose ends joints' speeds are looked at"),
    "SWINGS": (1.0, "of a joint's speed: the most that a jog may ask for"),
}


def name_guard(machine: Machine) -> str:
    """Name the guard."""
    return f"{machine.name}_guard"


def write_guard(machine: Machine) -> str:
    """Write the C source of a machine's guard; it includes :func:`~.model_header.write_model`."""
    numbers = "".join(f"#define {name} {format_c(value)} /* {why} */\n" for name, (value, why) in _NUMBERS.items())
    head = _HEADER.format(
        name=name_guard(machine),
        machine=machine.name,
        title=format_title(machine),
        gpl=GPL,
        model=name_model(machine),
        numbers=numbers.replace("PARTS 4.0", "PARTS 4"),
        letters="".join(machine.axes).lower(),
    )
    return head + files(__package__).joinpath("guard.c").read_text(encoding="utf-8")
