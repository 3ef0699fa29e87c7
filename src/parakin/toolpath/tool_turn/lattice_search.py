"""Ways through a lattice by dynamic programming: the widest, whose least margin is greatest, and the quickest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kernels.compiling import njit


class StepCosts(NamedTuple):
    """What a step from station to station costs.

    seconds : (m - 1,) that the feed takes, 0 where the drives are the only limit
    joint_seconds : (m, t, joints) where the joints are, each in seconds of its greatest speed
    whole_turns : (joints,) seconds that a whole turn takes, by which a turning joint counts on; 0 for another
    turn_weight : s for the square of a step by one turn, so that the turn changes evenly
    """

    seconds: Array
    joint_seconds: Array
    whole_turns: Array
    turn_weight: float


@njit(cache=True)
def find_widest_margin(margins: Array, steepest: int) -> float:
    """Find the greatest least margin of all ways through (m, t) margins that change by ``steepest`` turns a step."""
    stations, turns = margins.shape
    width = margins[0].copy()
    for j in range(1, stations):
        before = width.copy()
        for k in range(turns):
            best = -np.inf
            for i in range(max(0, k - steepest), min(turns, k + steepest + 1)):
                best = max(best, before[i])
            width[k] = min(best, margins[j, k])
    return width.max()


@njit(cache=True)
def find_quickest_way(usable: Flags, steps: StepCosts, steepest: int) -> Indices:
    """Find the way (m,) of least cost through the usable nodes (m, t), of which there is one.

    Of ways that cost the same, the one of the lowest turns is taken.
    """
    stations, turns = usable.shape
    seconds, joint_seconds = steps.seconds, steps.joint_seconds
    whole_turns, turn_weight = steps.whole_turns, steps.turn_weight
    joints = joint_seconds.shape[2]
    back = np.zeros((stations, turns), np.int16)
    cost = np.where(usable[0], 0.0, np.inf)
    for j in range(1, stations):
        before = cost.copy()
        for k in range(turns):
            cost[k] = np.inf
            if not usable[j, k]:
                continue
            for i in range(max(0, k - steepest), min(turns, k + steepest + 1)):
                if before[i] == np.inf:
                    continue
                time = seconds[j - 1]
                for joint in range(joints):
                    move = joint_seconds[j, k, joint] - joint_seconds[j - 1, i, joint]
                    if whole_turns[joint] > 0.0:
                        move -= whole_turns[joint] * round(move / whole_turns[joint])
                    time = max(time, abs(move))
                step = time + turn_weight * (k - i) ** 2
                if before[i] + step < cost[k]:
                    cost[k], back[j, k] = before[i] + step, i
    way = np.empty(stations, np.int64)
    way[-1] = np.argmin(cost)
    for j in range(stations - 1, 0, -1):
        way[j - 1] = back[j, way[j]]
    return way
