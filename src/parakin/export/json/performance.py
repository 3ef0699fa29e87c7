"""Performance, atlases and proofs as objects for JSON, parts of ``parakin.atlas/1``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ...units import to_display

if TYPE_CHECKING:
    from ...arrays import Array
    from ...machine import Machine
    from ...performance.atlas import Atlas
    from ...performance.certified.amplification import Bracket
    from ...performance.certified.nearest_singularity import SingularityDistance
    from ...performance.certified.proofs import Proof
    from ...performance.characteristic_length import CharacteristicLength
    from ...performance.indices import Performance


def encode_pose(machine: Machine, pose: Array) -> dict[str, float]:
    """Encode a pose by its axes, mm and degrees."""
    values = zip(machine.axes, pose.tolist(), machine.axis_units, strict=True)
    return {axis: to_display(value, unit) for axis, value, unit in values}


def _encode_length(length: CharacteristicLength) -> dict[str, Any]:
    return {"value": length.value, "rule": length.rule}


def encode_performance(performance: Performance, broken_limit: str) -> dict[str, Any]:
    """Encode the performance at one pose, and the limit that is broken there or ""."""
    psi, force = performance.psi.tolist(), performance.force.tolist()
    return {
        "pose": encode_pose(performance.machine, performance.poses),
        "broken": broken_limit or None,
        "length": _encode_length(performance.length),
        "condition": float(performance.condition),
        "greatest": float(performance.greatest),
        "least": float(performance.least),
        "manipulability": float(performance.manipulability),
        "margins": dict(zip(performance.margin_names, performance.margins.tolist(), strict=True)),
        "ellipsoid": [
            {"psi": p, "force": f, "direction": dict(zip(performance.twist, direction, strict=True))}
            for p, f, direction in zip(psi, force, performance.directions.tolist(), strict=True)
        ],
    }


def encode_atlas(atlas: Atlas) -> dict[str, Any]:
    """Encode the extremes and isotropic poses of an atlas."""
    inside = atlas.map.inside
    return {
        "places": list(atlas.map.axes),
        "step": atlas.map.step,
        "allowed": len(inside.poses),
        "length": _encode_length(inside.length),
        "extremes": [
            {
                "quantity": extreme.quantity,
                "side": extreme.side,
                "value": extreme.value,
                "pose": encode_pose(atlas.machine, extreme.pose),
            }
            for extreme in atlas.extremes
        ],
        "singular": list(atlas.singular),
        "singularities": {
            singularity.margin: {
                "verdict": singularity.verdict,
                "pose": None if singularity.pose is None else encode_pose(atlas.machine, singularity.pose),
                "reason": singularity.reason,
            }
            for singularity in atlas.singularities
        },
        "isotropic": [
            {"pose": encode_pose(atlas.machine, pose), "parallel": margin}
            for pose, margin in zip(atlas.isotropic, atlas.isotropic_margins.tolist(), strict=True)
        ],
        "isolated": atlas.isolated,
    }


def encode_proofs(
    machine: Machine,
    ranges: Mapping[str, tuple[float, float]],
    proofs: Sequence[Proof],
    brackets: Sequence[Bracket],
) -> dict[str, Any]:
    """Encode proofs over the box of ``ranges``, and brackets of the amplification there."""
    units = dict(zip(machine.axes, machine.axis_units, strict=True))
    return {
        "spans": {axis: [to_display(end, units[axis]) for end in ends] for axis, ends in ranges.items()},
        "claims": [
            {
                "claim": proof.claim,
                "verdict": proof.verdict,
                "counterexample": None if proof.counterexample is None else encode_pose(machine, proof.counterexample),
                "reason": proof.reason or None,
                "boxes": proof.boxes,
                "undecided": proof.undecided,
                "tolerance": proof.tolerance,
            }
            for proof in proofs
        ],
        "psi": {bracket.side: _encode_bracket(machine, bracket) for bracket in brackets} or None,
    }


def encode_distance(grown: SingularityDistance) -> dict[str, Any]:
    """Encode the largest box (a fraction of the given one) or sphere (mm) without a parallel singularity."""
    machine = grown.machine
    units = dict(zip(machine.axes, machine.axis_units, strict=True))
    return {
        "shape": grown.shape,
        "middle": encode_pose(machine, grown.middle),
        "inner": grown.inner,
        "outer": grown.outer,
        "spans": {axis: [to_display(end, units[axis]) for end in ends] for axis, ends in grown.grown_ranges.items()},
        "pose": None if grown.pose is None else encode_pose(machine, grown.pose),
        "reason": grown.reason or None,
        "ended": grown.ended,
        "boxes": grown.boxes,
    }


def _encode_bracket(machine: Machine, bracket: Bracket) -> dict[str, Any]:
    return {
        "low": bracket.low,
        "high": bracket.high,
        "pose": encode_pose(machine, bracket.pose),
        "closed": bracket.closed,
    }
