"""Where to put a part whose turn about the tool's axis is free: placed and turned in alternation."""

from __future__ import annotations

from ...arguments import check_arguments
from ...arrays import Progress
from ...machine import Machine
from ..path import ToolPath
from ..placing.placement import AxisRanges, Placement, find_placements
from .choice import choose_tool_turn

_ROUNDS = 3
_GAIN = 1.02  # of the margin: what a further round has to gain


@check_arguments
def find_turned_placements(
    machine: Machine,
    path: ToolPath,
    bounds: AxisRanges,
    *,
    mode: str | None = None,
    progress: Progress | None = None,
) -> list[Placement]:
    """Find placements for a path whose turn about the tool's axis is chosen there, by coordinate ascent.

    The path is placed with C as at home, then turned, then placed with these turns, as long as the least margin
    grows. The result, whose margin is the one with its turns, is followed by the placements with C as at home.

    Parameters and errors as of :func:`~..placing.placement.find_placements` and :func:`~.choice.choose_tool_turn`.
    """
    report = progress or (lambda fraction: None)
    placements = find_placements(machine, path, bounds, mode=mode, progress=lambda fraction: report(0.4 * fraction))
    best, turned_placements = placements[0], list[Placement]()
    for number in range(_ROUNDS):
        turn = choose_tool_turn(machine, path, workpiece=best.workpiece, mode=best.mode)
        if turn is None:
            break
        placed = find_placements(machine, turn.path, bounds, mode=best.mode)[0]
        report(0.4 + 0.6 * (number + 1) / _ROUNDS)
        if not placed.margin > _GAIN * best.margin:
            break
        best = placed
        turned_placements = [best]
    report(1.0)
    return [*turned_placements, *placements]
