"""The proof of a design: its limits and bounds hold at every wanted pose, by intervals."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..algebra import Scalar
from ..arrays import Array
from ..budget import Budget
from ..machine import Machine
from ..performance.certified.interval_matrices import PoseBox
from ..performance.certified.proofs import prove_no_singularity
from ..performance.certified.quotient_norms import NormSearch
from ..performance.characteristic_length import choose_characteristic_length
from ..workspaces.certified.assembly_mode import make_side_constraints
from ..workspaces.certified.constraints import Constraint
from ..workspaces.certified.containment import prove_constraints
from .design_tapes import DesignTapes
from .pose_sets import PoseSet
from .problem import DesignProblem
from .wants import WANTS, MarginProof, NormProof

TOLERANCE = 1e-6  # relative, within which bounds are kept
_CLOSE = 0.25 * TOLERANCE  # between what is attained and what is proved, relative
_BOXES = 200_000  # of a proof


class DesignProof:
    """Proves what is wanted of a design all over its wanted poses.

    sets : the poses, where the design has them
    sizes : its free numbers
    boxes : how many parts of the sets the proofs examined
    """

    def __init__(
        self,
        problem: DesignProblem,
        machine: Machine,
        sets: tuple[PoseSet, ...],
        sizes: Mapping[str, float],
        budget: Budget,
    ):
        self.problem, self.machine, self.sets, self.sizes, self.budget = problem, machine, sets, sizes, budget
        self.length = choose_characteristic_length(machine, problem.tapes.length.value)
        self.size_box = problem.make_size_box(machine)
        self.boxes = 0

    def prove_margins(self, bounds: Mapping[str, float]) -> str:
        """Prove the limits, the side of the singularities, and bounds that are margins; returns what fails, or ""."""
        for number, poses in enumerate(self.sets):
            traced = poses.trace(self.machine) if self.size_box is None else self.size_box.trace_set(poses)
            constraints = traced.build_limits()
            if not self.machine.is_redundant:
                constraints.append(make_side_constraints(traced)[0])
            d = len(traced.free_axes)
            position, orientation = traced.inputs[:d], traced.inputs[d:]
            equations = traced.trace_equations(traced.inputs)
            for name, bound in bounds.items():
                proof = WANTS[name].proof
                assert isinstance(proof, MarginProof)
                margins = proof.trace(equations, traced.pose, traced.mode, bound)
                constraints += [Constraint(name, margin, position, orientation) for margin in margins]
            budget = self.budget.take_fraction(0.5 / (len(self.sets) - number))
            containment = prove_constraints(constraints, *self._list_ends(poses), _BOXES, budget)
            self.boxes += int(containment.boxes[0])
            limit = int(containment.limit[0])
            if limit >= 0:
                return f"{containment.names[limit]} is broken at a wanted pose"
            if not containment.proved[0]:
                why = "the time was up" if budget.is_spent() else f"after {int(containment.boxes[0]):,} boxes"
                return f"limits and bounds are left undecided: {why}"
            if self.machine.is_redundant:
                box = self._make_box(poses)[1]
                regular = prove_no_singularity(box, "parallel", _BOXES, max(budget.seconds_left, 1e-3))
                self.boxes += regular.boxes
                if regular.verdict != "proved":
                    return f"{regular.claim}: {regular.verdict}, {regular.reason}"
        return ""

    def _list_ends(self, poses: PoseSet) -> tuple[Array, Array]:
        """List low and high of a set's coordinates, then of the numbers within tolerance."""
        if self.size_box is None:
            return poses.bounds
        low, high = (np.concatenate(ends) for ends in zip(poses.bounds, self.size_box.bounds, strict=True))
        return low, high

    def _make_box(self, poses: PoseSet) -> tuple[DesignTapes, PoseBox, Mapping[str, Scalar]]:
        """Make what quotients are traced from: tapes, a box of poses, and other values of the tapes' numbers."""
        if self.size_box is None:
            return self.problem.tapes, poses.make_box(self.machine, self.length), self.sizes
        box = self.size_box.make_box(poses, self.length)
        return self.problem.make_tapes(self.machine, self.size_box.names), box, box.sizes

    def bound_norm(self, name: str, bound: float, seconds: float) -> float | None:
        """Bound the worst value of a quantity, closely or so far that a bound is kept; None where it can't be."""
        proof = WANTS[name].proof
        assert isinstance(proof, NormProof)
        most, worst, budget = bound**proof.power, 0.0, Budget(max(seconds, 1e-3), _BOXES)
        for poses in self.sets:
            tapes, box, sizes = self._make_box(poses)
            for quotients in proof.trace(tapes, box, sizes):
                search = NormSearch(box, quotients)
                bracket = search.bracket(_CLOSE, budget, most, enough=most)
                worst = max(worst, bracket.high)
        self.boxes += budget.used
        return worst ** (1.0 / proof.power) if np.isfinite(worst) else None
