"""What a design has to keep in hand for the tolerances of its numbers, to the first order, by differences."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..machine import Machine
from .manufactured import Reserve
from .measures import Measures
from .problem import DesignProblem
from .wants import WANTS

_SPARE = 1.1  # what the second order and the poses between may add


def measure_reserve(problem: DesignProblem, machine: Machine, x: Array, points: Array) -> Reserve:
    """Measure the reserve of a design x (variables,) at the poses that matter, points (P, width).

    Each number is moved to either end of its tolerance; what they take at a pose adds up.
    """
    size_box = problem.make_size_box(machine)
    assert size_box is not None
    k = len(size_box.names)
    moves = np.concatenate([np.zeros((1, k)), np.diag(size_box.halves), -np.diag(size_box.halves)])
    poses = problem.place_poses(x, np.concatenate([points, problem.middle]))
    tapes = problem.make_tapes(machine, size_box.names)
    values = moves @ size_box.follow_rates.T
    sizes = tapes.family.nominal + values[:, _order(tapes.family.names, size_box.names)]
    m = Measures(tapes, np.broadcast_to(poses, (len(sizes), *poses.shape)), sizes[:, None])
    low, high = _add_up(m.joints), _add_up(-m.joints)
    losses = {
        name: float(_add_up(-WANTS[name].sign * WANTS[name].measure(m)).max())
        for name in problem.wants
        if not (WANTS[name].spread or WANTS[name].whole)
    }
    if "stroke" in problem.wants:
        losses["stroke"] = float((low + high).max())
    return Reserve(_add_up(m.margins), low, high, losses)


def _order(names: tuple[str, ...], given: tuple[str, ...]) -> list[int]:
    return [given.index(name) for name in names]


def _add_up(values: Array) -> Array:
    """Add up by how much values (1 + 2k, P, c) fall from the first by each number; the most of all poses, (c,)."""
    fall = np.maximum(values[:1] - values[1:], 0.0)
    up, down = np.split(fall, 2)
    return np.asarray(_SPARE * np.maximum(up, down).sum(0).max(0))
