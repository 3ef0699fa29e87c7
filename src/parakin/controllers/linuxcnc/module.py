"""Write the kinematics module: how LinuxCNC asks for a machine's model."""

from __future__ import annotations

from hashlib import sha256
from importlib.resources import files

from ...machine import Machine
from .model_header import GPL, format_title, name_model, write_model

_HEADER = """\
/* {name}.c: LinuxCNC's kinematics of {machine}, {title}.

   Made by parakin from the machine's description; make it anew rather than edit it.
   {gpl}

   Build and install:  sudo halcompile --install {name}.c
   {model} must lie beside it. */

#pragma GCC optimize ("O3")

#include "rtapi.h"
#include "rtapi_app.h"
#include "rtapi_math.h"
#include "rtapi_string.h"
#include "hal.h"
#include "kinematics.h"

#define MODULE "{name}"
#define MADE "{made}" /* what the configuration of the same making names */

#include "{model}"
"""


def name_kinematics(machine: Machine) -> str:
    """Name the kinematics module; of LinuxCNC's own only ``xyzab_tdr_kins`` is built likewise."""
    return f"{machine.name}_kins"


def write_module(machine: Machine) -> str:
    """Write the C source of a machine's kinematics module; it includes :func:`~.model_header.write_model`."""
    head = _HEADER.format(
        name=name_kinematics(machine),
        machine=machine.name,
        title=format_title(machine),
        gpl=GPL,
        model=name_model(machine),
        made=hash_kinematics(machine),
    )
    return f"{head}\n{_read_runtime()}"


def hash_kinematics(machine: Machine) -> str:
    """Hash a machine's kinematics, so that a module of an older description is recognised."""
    return sha256(f"{write_model(machine)}\n{_read_runtime()}".encode()).hexdigest()[:16]


def _read_runtime() -> str:
    return files(__package__).joinpath("runtime.c").read_text(encoding="utf-8")
