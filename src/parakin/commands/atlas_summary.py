"""The text that ``parakin atlas`` prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import floor
from typing import TYPE_CHECKING

from ..export.json.performance import encode_pose
from ..export.number_format import format_fixed
from ..units import name_display_unit, to_display
from .console import format_table

if TYPE_CHECKING:
    from ..arrays import Array
    from ..machine import Machine
    from ..performance.atlas import Atlas
    from ..performance.certified.amplification import Bracket
    from ..performance.certified.nearest_singularity import SingularityDistance
    from ..performance.certified.proofs import Proof
    from ..performance.characteristic_length import CharacteristicLength
    from ..performance.indices import Performance

_TITLES = {"condition": "condition number", "greatest": "greatest psi", "least": "least psi"}


def _format_number(value: float) -> str:
    return "-" if value != value else f"{value + 0.0:.6g}"


def _format_pose(machine: Machine, pose: Array, axes: Sequence[str] | None = None) -> str:
    """Format a pose, ``X 10.000, Y 0.000``: all axes or some, mm and degrees."""
    values = encode_pose(machine, pose)
    return ", ".join(
        f"{axis} {format_fixed(value, 3)}" for axis, value in values.items() if axes is None or axis in axes
    )


def _format_axis_value(value: float, unit: str) -> str:
    return format_fixed(to_display(value, unit), 3)


def _format_length(length: CharacteristicLength) -> str:
    return f"characteristic length {length.value:.6g} mm, {length.rule}" if length.value is not None else ""


def format_performance(performance: Performance, broken_limit: str) -> str:
    """Format the performance at one pose, and the limit that is broken there or ""."""
    pose = _format_pose(performance.machine, performance.poses)
    lines = [f"{performance.machine.name} at {pose}" + f" (off limits: {broken_limit})" * bool(broken_limit)]
    margins = zip(performance.margin_names, performance.margins.tolist(), strict=True)
    rows = [
        ("condition number", _format_number(float(performance.condition))),
        ("manipulability", _format_number(float(performance.manipulability))),
        *((f"margin {name}", _format_number(margin)) for name, margin in margins),
    ]
    lines += [_format_length(performance.length)] * (performance.length.value is not None)
    lines += ["", format_table(rows, ("singularities at 0", ""), " r"), ""]
    columns = (performance.psi.tolist(), performance.force.tolist(), performance.directions.tolist())
    axes = [
        (_format_number(p), _format_number(f), *(_format_number(round(x, 6)) for x in direction))
        for p, f, direction in zip(*columns, strict=True)
    ]
    head = ("velocity psi", "force 1/psi", *performance.twist)
    lines.append(format_table(axes, head, "r" * len(head)))
    return "\n".join(lines)


def format_atlas(atlas: Atlas) -> str:
    """Format the extremes and isotropic poses of an atlas."""
    inside, machine, axes = atlas.map.inside, atlas.machine, atlas.map.axes
    units = dict(zip(machine.axes, machine.axis_units, strict=True))
    head = f"{machine.name} over the workspace"
    if atlas.map.region.fixed_axes:
        head += " at " + ", ".join(
            f"{axis} {_format_axis_value(value, units[axis])}" for axis, value in atlas.map.region.fixed_axes.items()
        )
    grid = f"{len(inside.poses):,} places on a grid of {atlas.map.step:g} mm"
    lines = [head, f"{grid}, extremes found by search between them, not proved"]
    lines += [_format_length(inside.length)] * (inside.length.value is not None)
    rows = []
    for extreme in atlas.extremes:
        name = _TITLES.get(extreme.quantity, extreme.quantity)
        name = f"margin {name}" if extreme.quantity in inside.margin_names else name
        pose = _format_pose(machine, extreme.pose, axes)
        rows.append((name, extreme.side, _format_number(extreme.value), pose))
    lines += ["", format_table(rows, ("", "", "", "at [mm]"), "  r"), ""]
    lines += _format_singularities(atlas)
    several = "" if atlas.isolated else " (samples of a curve of them)"
    for pose_values, margin in zip(atlas.isotropic, atlas.isotropic_margins.tolist(), strict=True):
        beyond = ", beyond a parallel singularity" if margin < 0.0 else ""
        lines.append(f"isotropic: {_format_pose(machine, pose_values, axes)}{beyond}{several}")
    if not len(atlas.isotropic):
        lines.append("isotropic: nowhere")
    return "\n".join(lines)


def _format_singularities(atlas: Atlas) -> list[str]:
    """Format what is proved of the singularities."""
    lines = []
    for singularity in atlas.singularities:
        if singularity.verdict == "met" and singularity.pose is not None:
            pose = _format_pose(atlas.machine, singularity.pose, atlas.map.axes)
            lines.append(f"singular: {singularity.margin}, proved: at {pose}; {singularity.reason}")
    names = [singularity.margin for singularity in atlas.singularities if singularity.verdict == "none"]
    lines += [f"not singular: {', '.join(names)}, proved"] if names else []
    for singularity in atlas.singularities:
        if singularity.verdict == "unproved":
            least = atlas.extreme(singularity.margin, "least")
            where = f"{_format_number(least.value)} at {_format_pose(atlas.machine, least.pose, atlas.map.axes)}"
            lines.append(f"unproved: {singularity.margin}; {singularity.reason}, the least found is {where}")
    return lines


def format_distance(grown: SingularityDistance) -> str:
    """Format the largest box or sphere without a parallel singularity, rounded down, and what ends it."""
    machine, about = grown.machine, f"about {_format_pose(grown.machine, grown.middle)}"
    scale, unit = (1.0, "mm") if grown.shape == "sphere" else (100.0, "%")
    inner = format_fixed(floor(1e3 * scale * grown.inner) / 1e3, 3)
    what = f"a sphere of {inner} mm" if grown.shape == "sphere" else f"{inner} % of the box"
    lines = [
        f"{machine.name}: {what} {about}\n",
        f"within {', '.join(_list_sides(machine, grown.grown_ranges))}",
        f"the legs close and no parallel singularity is met: proved, {grown.boxes:,} boxes",
    ]
    met = ""
    if grown.pose is not None:
        met = f"at {_format_number(scale * grown.outer)} {unit}, {_format_pose(machine, grown.pose)}"
    return "\n".join([*lines, _format_end(grown, met)])


def _format_end(grown: SingularityDistance, met: str) -> str:
    """Format what ended the growth; ``met`` is where a singular pose, or one out of reach, was met."""
    if grown.ended == "singular":
        return f"ended by a singularity {met}"
    if grown.ended == "out of reach":
        return f"ended by the legs' reach {met}"
    if grown.ended == "box":
        return "ended by the given box, " + ("all of it" if grown.inner >= grown.outer else "within the tolerance")
    what = "the time" if grown.ended == "time" else f"the number of boxes, {grown.boxes:,}"
    rest = f"the nearest that was met is {met}: {grown.reason}" if met else "nothing was met within the given box"
    return f"ended by {what}, not by the machine: {rest}"


def _list_sides(machine: Machine, ranges: Mapping[str, tuple[float, float]]) -> list[str]:
    units = dict(zip(machine.axes, machine.axis_units, strict=True))
    sides = []
    for axis, (low, high) in ranges.items():
        unit = units[axis]
        ends = f"{_format_axis_value(low, unit)} to {_format_axis_value(high, unit)}"
        sides.append(f"{axis} {ends} {name_display_unit(unit)}")
    return sides


def format_proofs(
    machine: Machine,
    ranges: Mapping[str, tuple[float, float]],
    proofs: Sequence[Proof],
    brackets: Sequence[Bracket],
) -> str:
    """Format proofs over the box of ``ranges``, and brackets of the amplification there."""
    lines = [f"{machine.name} all over {', '.join(_list_sides(machine, ranges))}", ""]
    width = max(len(proof.claim) for proof in proofs)
    for proof in proofs:
        within = f" to {proof.tolerance:g}" if proof.tolerance and proof.verdict == "proved" else ""
        lines.append(f"{proof.claim:<{width}}  {proof.verdict}{within}, {proof.boxes:,} boxes")
        if proof.counterexample is not None:
            lines.append(f"{'':<{width}}  at {_format_pose(machine, proof.counterexample)}: {proof.reason}")
    for bracket in brackets:
        ends = f"{_format_number(bracket.low)} to {_format_number(bracket.high)}"
        ends += "" if bracket.closed else " (left open)"
        lines.append(f"{bracket.side} psi: {ends}, met at {_format_pose(machine, bracket.pose)}")
    return "\n".join(lines)
