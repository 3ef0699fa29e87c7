"""``parakin assemblies``: every pose of one joint vector."""

from __future__ import annotations

from math import ceil, isnan, log10
from typing import TYPE_CHECKING

from ..errors import InputError
from ..export.number_format import format_fixed
from ..units import name_display_unit, to_display
from .console import announce_compiling, format_table, print_json, print_remark, print_text
from .options import OFF_LIMITS, Json, Name, Sizes, load_machine
from .values import parse_row

if TYPE_CHECKING:
    from ..kinematics.assemblies import Assemblies
    from ..machine import Machine

_SIDES = {1: "det A > 0", -1: "det A < 0", 0: "singular"}


def assemblies(name: Name, /, *values: str, json: Json = False, sizes: Sizes = None) -> int:
    """Every pose of one joint vector, with the side of the singularities on which it lies.

    The exit code is 3 if there is none, or if it is not known whether there are more.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    values
        Joints in mm and degrees, in their order or by name: d1=1200 d2=1250; the rest is home's.
    """
    machine = load_machine(name, sizes)
    if not values:
        raise InputError(f"no values, expected {' '.join(machine.joints)}", "joints")
    announce_compiling()
    home = machine.inverse(machine.home)
    joints = parse_row(values, machine.joints, machine.joint_units, home, "joints")
    answer = machine.assemblies(joints)
    if json:
        from ..export.json.assemblies import encode_assemblies

        print_json(encode_assemblies(machine, joints, answer))
    else:
        if len(answer):
            print_text(_format_poses(machine, answer))
        print_text(_format_summary(answer))
    if answer.lost_count:
        print_remark(f"{answer.lost_count} paths could not be followed: there may be more poses")
    return OFF_LIMITS if not len(answer) or answer.lost_count else 0


def _format_poses(machine: Machine, answer: Assemblies) -> str:
    """Format a line for each pose."""
    header = [*(f"{axis} {name_display_unit(u)}" for axis, u in zip(machine.axes, machine.axis_units, strict=True))]
    rows = [
        [
            *(format_fixed(to_display(v, u), 6) for v, u in zip(pose.tolist(), machine.axis_units, strict=True)),
            _SIDES[int(side)],
            "yes" if within else "no",
            _format_bound(radius),
        ]
        for pose, side, within, radius in zip(
            answer.poses,
            answer.sides,
            answer.within_limits,
            answer.radii[:, 0].tolist(),
            strict=True,
        )
    ]
    return format_table(rows, [*header, "side", "within limits", "proved within mm"], "r" * len(header) + "llr")


def _format_bound(radius: float) -> str:
    """Format how far off a pose may be, mm, rounded up to a power of ten; NaN where that is not proved."""
    if isnan(radius):
        return "not proved"
    return f"1e{ceil(log10(radius))}" if radius > 0.0 else "0"


def _format_summary(answer: Assemblies) -> str:
    """Say how many there are, and how that is known."""
    text = f"{len(answer)} pose{'s' * (len(answer) != 1)}: {answer.complete}"
    if answer.complex_count is not None:
        text += f"; {answer.complex_count} more solutions are complex, {answer.infinite_count} at infinity"
    if answer.untold_count:
        text += f"; {answer.untold_count} more are real, but no pose tells them"
    return text
