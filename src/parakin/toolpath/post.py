"""A tool path on a machine: poses, joints, and the limits they break."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..errors import PoseError
from ..machine import Machine
from .frames import ROUNDED, composed, parse_workpiece, tool_poses
from .offences import judge
from .program import Floats, ToolPath
from .result import Posted

Progress = Callable[[float], None]
_TURN = 2.0 * math.pi


def post(
    machine: Machine,
    path: ToolPath,
    *,
    workpiece: str | Floats | None = None,
    mode: str | None = None,
    progress: Progress | None = None,
) -> Posted:
    """Joints for every record of a tool path, and what keeps the machine from following it.

    Parameters
    ----------
    machine, path : as from :func:`parakin.load` and a reader of tool paths
    workpiece : transform (3, 4), mm, or text as of the option ``--workpiece``; it is applied after the frame that the
        path itself brings: M ← workpiece ← path.frame ← W
    mode : working mode, one of ``machine.modes``
    progress : called now and then with the fraction done, 0 to 1

    Raises :class:`InputError` for a workpiece that can't be read, :class:`PoseError` for an unknown mode. A record that
    can't be reached raises nothing: it is an offence of the result.
    """
    say = progress or (lambda fraction: None)
    outer = parse_workpiece(workpiece) if isinstance(workpiece, str) else workpiece
    if outer is not None and (np.shape(outer) != (3, 4) or not np.isfinite(outer).all()):
        raise PoseError("workpiece: a transform of shape (3, 4) expected")
    frame = composed(outer, path.frame)
    poses, own = tool_poses(machine, path.tip, path.axis, frame)
    say(0.3)
    joints = machine.follow(poses, mode, ROUNDED)
    _count_turns(machine, joints)
    say(0.7)
    chosen = machine.mode if mode is None else mode
    found = judge(machine, poses, joints, path.line, chosen, own)
    say(1.0)
    return Posted(
        machine, path, chosen, frame, poses, joints,
        found.broken, found.limits, found.offences, found.first, found.worst,
    )  # fmt: skip


def _count_turns(machine: Machine, joints: Floats) -> None:
    """Shift turning joints, each as a whole, by the turns that bring them into their ranges, or nearest to."""
    for column, drive in enumerate(machine.model.drives if len(joints) else ()):
        values = joints[:, column]
        low, high = float(np.fmin.reduce(values)), float(np.fmax.reduce(values))
        if drive.unit == "rad" and (low < drive.low or high > drive.high):
            values += _turns(low, high, drive.low, drive.high) * _TURN


def _turns(low: float, high: float, least: float, most: float) -> int:
    """How many turns move low..high into least..most; the fewest that do, else those that leave least outside."""
    up = math.ceil((least - low) / _TURN) if math.isfinite(least) else None
    down = math.floor((most - high) / _TURN) if math.isfinite(most) else None

    def outside(turns: int) -> tuple[float, int]:
        return max(least - low - turns * _TURN, high + turns * _TURN - most, 0.0), abs(turns)

    tried = [0, *[turns for turns in (up, down) if turns is not None]]
    if up is not None and down is not None:
        tried.append(round((least + most - low - high) / (2.0 * _TURN)))
    return min(tried, key=outside)
