"""The shipped machines that tests run over: all of them, or, where a test takes long, those that stand for the rest.

The conformance suite and all that is quick run over every machine. Of every set of axes, structure and leg kind there
is a machine among the representatives, which the conformance suite tests. LinuxCNC runs one machine of every kind of
motion, or, with PARAKIN_LINUXCNC=all, all representatives, and an operator's long sessions.
"""

from __future__ import annotations

import os
from functools import cache

import parakin as pk

NAMES = pk.machines()
REPRESENTATIVES = [
    "hbg80_2d",
    "hbg80_3d",
    "hexapod",
    "lambda6",
    "linear_delta",
    "orthoglide",
    "orthoglide5_head",
    "orthoglide5_table",
    "tricept",
    "eclipse",
    "rrr3",
    "sprint_z3",
    "exechon",
    "pentapod",
    "triglide_pairs",
    "four_struts",
]
MOTIONS = [
    "linear_delta",  # translates
    "tricept",  # a wrist
    "orthoglide5_table",  # a table
    "hexapod",  # struts turn the tool
    "sprint_z3",  # constraints
    "rrr3",  # in a plane
]
EVERYTHING = os.environ.get("PARAKIN_LINUXCNC") == "all"
CONFIGURED = REPRESENTATIVES if EVERYTHING else MOTIONS


@cache
def load_shipped(name: str) -> pk.Machine:
    """Load a shipped machine, once for all tests of a process."""
    assert name in NAMES, name
    return pk.load(name)


def list_features(machine):
    """What a machine has that a representative must have too: its axes with its structure, and its kinds of legs."""
    return {(machine.axes, type(machine.structure).__name__), *(leg.kind for leg in machine.legs)}
