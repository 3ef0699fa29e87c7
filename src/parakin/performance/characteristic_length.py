"""The characteristic length: by it angles become millimetres, so that numbers of mixed units can be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from ..algebra import Trace, derivative, evaluate_trace, norm
from ..arrays import Array
from ..errors import PoseError
from ..machine import Machine

_ZERO = 1e-9  # mm; a length no greater counts as zero


@dataclass(frozen=True)
class CharacteristicLength:
    """The characteristic length, and where it comes from.

    value : mm; None for a machine without angles
    rule : which one gave it, in words
    """

    value: float | None
    rule: str

    @property
    def factor(self) -> float:
        """What radians are multiplied by, mm; 1 for a machine without angles."""
        return 1.0 if self.value is None else self.value


def choose_characteristic_length(machine: Machine, length: float | None = None) -> CharacteristicLength:
    """Take ``length``, mm, if it is given, else by the first of these rules that gives one for a ``machine``.

    - axes X Y Z B C: the tool's reach, from the head's last turn (without one from the platform) to the tip;
    - a platform that turns: the radius of its joints about their middle, root mean square;
    - drives that turn and a platform that does not: the arms' length, root mean square;
    - else the rods' length at home, root mean square.

    Raises :class:`PoseError` for an invalid length.
    """
    if length is not None:
        if not (isfinite(length) and length > 0.0):
            raise PoseError(f"length: a length above 0 mm expected, not {length:g}")
        return CharacteristicLength(float(length), "given")
    turns = machine.structure.turns
    if not turns and "rad" not in machine.joint_units:
        return CharacteristicLength(None, "no angles")
    five = machine.has_direction
    rules = {
        "the tool's reach": _measure_tool_reach(machine) if five else 0.0,
        "the radius of the platform's joints": _measure_platform_radius(machine) if turns else 0.0,
        "the length of the arms": 0.0 if turns else _measure_arms(machine),
        "the length of the rods at home": _compute_rms(_measure_rods_at_home(machine)),
    }
    rule = next(name for name, value in rules.items() if value > _ZERO)
    return CharacteristicLength(rules[rule], rule)


def _compute_rms(lengths: Sequence[float] | Array) -> float:
    return float(np.sqrt(np.mean(np.square(lengths)))) if len(lengths) else 0.0


def _measure_tool_reach(machine: Machine) -> float:
    return machine.structure.measure_tool_reach()


def _measure_platform_radius(machine: Machine) -> float:
    turns = machine.structure.turns
    joints = np.array([leg.platform for leg in machine.legs])
    if len(turns) == 1:  # along the axis of its only turn nothing moves
        joints[:, "xyz".index(turns[0][1])] = 0.0
    return _compute_rms(np.linalg.norm(joints - joints.mean(0), axis=1))


def _measure_arms(machine: Machine) -> float:
    """Measure the arms of turning drives at home: how fast their feet move, mm/rad; of those that turn a foot."""
    at_home = machine.group_joints(machine.inverse(machine.home).tolist())
    lengths = []
    for leg, given in zip(machine.legs, at_home, strict=True):
        trace = Trace()
        q = trace.inputs(len(given))
        foot, _ = leg.struts(leg.platform, list(q))[0]
        for i, drive in enumerate(leg.drives):
            if drive.unit == "rad":
                lengths.append(float(norm(evaluate_trace(trace, [derivative(c, q[i]) for c in foot], given))))
    return _compute_rms([length for length in lengths if length > 0.0])


def _measure_rods_at_home(machine: Machine) -> Array:
    home = machine.home[None]
    _, _, wrench_norms = machine.twist_rates(home, machine.inverse(home), whole=False)
    return wrench_norms.reshape(-1)
