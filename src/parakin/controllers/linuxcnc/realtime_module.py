"""Write a realtime module of LinuxCNC in C around its body: the head and the start are the same for all."""

from __future__ import annotations

from hashlib import sha256
from importlib.resources import files
from typing import NamedTuple

from ...machine import Machine
from .model_header import GPL, format_title, name_model, write_model

_HEAD = """\
/* {name}.c: {purpose} {machine}, {title}.

   {note}Made by parakin from the machine's description; make it anew rather than edit it.
   {gpl}

   Build and install:  sudo halcompile --install {name}.c
   {model} must lie beside it. */

#ifndef __clang__ /* which knows no such pragma */
#pragma GCC optimize ("O3")
#endif

{headers}

{pins}
#define MODULE "{name}"
#define MADE "{made}" /* what the configuration of the same making names */

#include "{model}"

static int component;

"""

_HEADERS = ("rtapi.h", "rtapi_app.h", "rtapi_math.h", "rtapi_string.h", "hal.h", "kinematics.h")


class RealtimeModule(NamedTuple):
    """A realtime module: what it has of its own.

    name : of the module
    purpose : words that end in "of" or the like, before the machine's name
    body : C that defines ``set_up``, which makes pins and functions for ``component``, and is zero where it could
    headers : of LinuxCNC, besides those of all modules
    note : sentences in the head
    """

    name: str
    purpose: str
    body: str
    headers: tuple[str, ...] = ()
    note: str = ""


def write_realtime_module(machine: Machine, module: RealtimeModule) -> str:
    """Write the C source of a module; it includes :func:`~.model_header.write_model`."""
    head = _HEAD.format(
        name=module.name,
        purpose=module.purpose,
        machine=machine.name,
        title=format_title(machine),
        note=module.note,
        gpl=GPL,
        model=name_model(machine),
        headers="\n".join(f'#include "{header}"' for header in (*_HEADERS, *module.headers)),
        pins=read_source(__package__, "hal_pins.c"),
        made=hash_realtime_module(machine, module),
    )
    return head + _join_sources(module)


def hash_realtime_module(machine: Machine, module: RealtimeModule) -> str:
    """Hash a module with the machine's model, so that one of an older description is recognised."""
    return sha256(f"{write_model(machine)}\n{_join_sources(module)}".encode()).hexdigest()[:16]


def _join_sources(module: RealtimeModule) -> str:
    return f"{module.body}\n{read_source(__package__, 'module_start.c')}"


def read_source(package: str, *names: str) -> str:
    """Read C sources that lie in a package, one after the other."""
    return "\n".join(files(package).joinpath(name).read_text(encoding="utf-8") for name in names)
