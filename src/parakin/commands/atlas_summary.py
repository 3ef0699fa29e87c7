"""What ``parakin atlas`` says, to people and to programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from .console import fixed, rim, rim_unit, table

if TYPE_CHECKING:
    from ..arrays import Array
    from ..machine import Machine
    from ..performance.atlas import Atlas
    from ..performance.certified.amplification import Bracket
    from ..performance.certified.proofs import AmplificationBrackets, Proof
    from ..performance.characteristic_length import CharacteristicLength
    from ..performance.indices import Performance

_TITLES = {"condition": "condition number", "greatest": "greatest psi", "least": "least psi"}


def _number(value: float) -> str:
    return "-" if value != value else f"{value + 0.0:.6g}"


def _pose_json(machine: Machine, pose: Array) -> dict[str, float]:
    values = zip(machine.axes, pose.tolist(), machine.axis_units, strict=True)
    return {axis: rim(value, unit) for axis, value, unit in values}


def _pose_text(machine: Machine, pose: Array, axes: Sequence[str] | None = None) -> str:
    """``X 10.000, Y 0.000``: of all axes or of some, mm and degrees."""
    given = _pose_json(machine, pose)
    return ", ".join(f"{axis} {fixed(value, 3)}" for axis, value in given.items() if axes is None or axis in axes)


def _length_json(length: CharacteristicLength) -> dict[str, Any]:
    return {"value": length.value, "rule": length.rule}


def _length_text(length: CharacteristicLength) -> str:
    return f"characteristic length {length.value:.6g} mm, {length.rule}" if length.value is not None else ""


# A pose.


def performance_json(found: Performance, broken: str) -> dict[str, Any]:
    psi, force = found.psi.tolist(), found.force.tolist()
    return {
        "pose": _pose_json(found.machine, found.poses),
        "broken": broken or None,
        "length": _length_json(found.length),
        "condition": float(found.condition),
        "greatest": float(found.greatest),
        "least": float(found.least),
        "manipulability": float(found.manipulability),
        "margins": dict(zip(found.margin_names, found.margins.tolist(), strict=True)),
        "ellipsoid": [
            {"psi": p, "force": f, "direction": dict(zip(found.twist, way, strict=True))}
            for p, f, way in zip(psi, force, found.directions.tolist(), strict=True)
        ],
    }


def performance_text(found: Performance, broken: str) -> str:
    lines = [
        f"{found.machine.name} at {_pose_text(found.machine, found.poses)}" + f" (off limits: {broken})" * bool(broken)
    ]
    rows = [
        ("condition number", _number(float(found.condition))),
        ("manipulability", _number(float(found.manipulability))),
        *((f"margin {name}", _number(m)) for name, m in zip(found.margin_names, found.margins.tolist(), strict=True)),
    ]
    lines += [_length_text(found.length)] * (found.length.value is not None)
    lines += ["", table(rows, ("singularities at 0", ""), " r"), ""]
    axes = [
        (_number(p), _number(f), *(_number(round(x, 6)) for x in way))
        for p, f, way in zip(found.psi.tolist(), found.force.tolist(), found.directions.tolist(), strict=True)
    ]
    lines.append(table(axes, ("velocity psi", "force 1/psi", *found.twist), "r" * (2 + len(found.twist))))
    return "\n".join(lines)


# A region.


def atlas_json(found: Atlas) -> dict[str, Any]:
    told = found.map.inside
    parallel = _parallel(found)
    return {
        "places": list(found.map.axes),
        "step": found.map.step,
        "allowed": len(told.poses),
        "length": _length_json(told.length),
        "extremes": [
            {
                "quantity": extreme.quantity,
                "side": extreme.side,
                "value": extreme.value,
                "pose": _pose_json(found.machine, extreme.pose),
            }
            for extreme in found.extremes
        ],
        "singular": list(found.singular),
        "isotropic": [
            {"pose": _pose_json(found.machine, pose), "parallel": margin}
            for pose, margin in zip(found.isotropic, parallel, strict=True)
        ],
        "isolated": found.isolated,
    }


def _parallel(found: Atlas) -> list[float]:
    """The parallel margin at the isotropic poses: below 0 they lie beyond a singularity, seen from home."""
    from ..performance.singularities import compute_singularity_margins

    told = found.map.performance
    margins = compute_singularity_margins(found.machine, found.isotropic, told.length.value, found.map.region.mode)
    return [float(row[0]) for row in margins]


def atlas_text(found: Atlas) -> str:
    told, machine, axes = found.map.inside, found.machine, found.map.axes
    turning = [axis for axis, unit in zip(machine.axes, machine.axis_units, strict=True) if unit == "rad"]
    held = found.map.region.fixed_axes
    head = f"{machine.name} over the workspace"
    if held:
        head += " at " + ", ".join(
            f"{axis} {fixed(rim(value, 'rad' if axis in turning else 'mm'), 3)}" for axis, value in held.items()
        )
    lines = [head, f"{len(told.poses):,} places on a grid of {found.map.step:g} mm, extremes found between them"]
    lines += [_length_text(told.length)] * (told.length.value is not None)
    rows = []
    for extreme in found.extremes:
        name = _TITLES.get(extreme.quantity, extreme.quantity)
        name = f"margin {name}" if extreme.quantity in told.margin_names else name
        rows.append((name, extreme.side, _number(extreme.value), _pose_text(machine, extreme.pose, axes)))
    lines += ["", table(rows, ("", "", "", "at [mm]"), "  r"), ""]
    if found.singular:
        lines.append(f"singular: the workspace meets {', '.join(found.singular)}")
    several = "" if found.isolated else " (samples of a curve of them)"
    for pose, margin in zip(found.isotropic, _parallel(found), strict=True):
        beyond = ", beyond a parallel singularity" if margin < 0.0 else ""
        lines.append(f"isotropic: {_pose_text(machine, pose, axes)}{beyond}{several}")
    if not len(found.isotropic):
        lines.append("isotropic: nowhere")
    return "\n".join(lines)


# A box.


def _bracket_json(machine: Machine, found: Bracket) -> dict[str, Any]:
    return {"low": found.low, "high": found.high, "pose": _pose_json(machine, found.pose), "closed": found.closed}


def proofs_json(
    machine: Machine,
    spans: Mapping[str, tuple[float, float]],
    proofs: Sequence[Proof],
    more: AmplificationBrackets | None,
) -> dict[str, Any]:
    brackets = _brackets(proofs, more)
    units = dict(zip(machine.axes, machine.axis_units, strict=True))
    return {
        "spans": {axis: [rim(end, units[axis]) for end in span] for axis, span in spans.items()},
        "claims": [
            {
                "claim": proof.claim,
                "verdict": proof.verdict,
                "counterexample": None if proof.counterexample is None else _pose_json(machine, proof.counterexample),
                "reason": proof.reason or None,
                "boxes": proof.boxes,
                "tolerance": proof.tolerance,
            }
            for proof in proofs
        ],
        "psi": {bracket.side: _bracket_json(machine, bracket) for bracket in brackets} or None,
    }


def _brackets(proofs: Sequence[Proof], more: AmplificationBrackets | None) -> Sequence[Bracket]:
    found: list[Bracket] = [bracket for proof in proofs for bracket in proof.brackets]
    return found if more is None else more.brackets


def proofs_text(
    machine: Machine,
    spans: Mapping[str, tuple[float, float]],
    proofs: Sequence[Proof],
    more: AmplificationBrackets | None,
) -> str:
    units = dict(zip(machine.axes, machine.axis_units, strict=True))
    sides = [
        f"{axis} {fixed(rim(low, units[axis]), 3)} to {fixed(rim(high, units[axis]), 3)} {rim_unit(units[axis])}"
        for axis, (low, high) in spans.items()
    ]
    lines = [f"{machine.name} all over {', '.join(sides)}", ""]
    width = max(len(proof.claim) for proof in proofs)
    for proof in proofs:
        within = f" to {proof.tolerance:g}" if proof.tolerance and proof.verdict == "proved" else ""
        lines.append(f"{proof.claim:<{width}}  {proof.verdict}{within}, {proof.boxes:,} boxes")
        if proof.counterexample is not None:
            lines.append(f"{'':<{width}}  at {_pose_text(machine, proof.counterexample)}: {proof.reason}")
    for bracket in _brackets(proofs, more):
        ends = f"{_number(bracket.low)} to {_number(bracket.high)}" + ("" if bracket.closed else " (left open)")
        lines.append(f"{bracket.side} psi: {ends}, met at {_pose_text(machine, bracket.pose)}")
    return "\n".join(lines)
