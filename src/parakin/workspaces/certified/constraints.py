"""What must be ≥ 0 for a pose to be allowed, as functions of the place x and of the turns θ that are swept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ... import algebra as alg
from ...algebra import Scalar, Term, Trace, absolute, derivative, find_dependencies, maximum, minimum, norm, sub
from ...kernels.intervals import IntervalProgram
from ...machine import Machine
from ...model.parts import ROTATIONS

_ROUNDING = 1e-12  # relative, of what limits are found to imply


@dataclass(frozen=True, eq=False)
class Constraint:
    """One margin, ≥ 0 where it holds, of ``places`` x and ``turns`` θ.

    Two programs bound it over boxes of x, then θ, by Taylor's formula about the middle: ``at`` gives the margin and, of
    a smooth one, its gradient by x; ``over`` gives the margin, the guard, the gradient by θ and the second derivatives
    by x (d(d + 1)/2 of them), or of one with corners the gradient by x instead.
    """

    name: str
    margin: Scalar
    places: Sequence[Term]
    turns: Sequence[Term] = ()
    implied: bool = False  # by others, and of use only to show that they can't hold

    @cached_property
    def _trace(self) -> Trace:
        return self.places[0].trace

    @cached_property
    def _nodes(self) -> list[Term]:
        margin = self.margin
        return [self._trace.nodes[i] for i in find_dependencies([margin])] if isinstance(margin, Term) else []

    @cached_property
    def smooth(self) -> bool:
        """No corners: Taylor's formula holds to the second order. What is held moves, so it has a first order only."""
        corners = (alg.MIN, alg.MAX, alg.ABS, alg.COPYSIGN, alg.SELECT, alg.STOP_GRADIENT)
        return not any(node.op in corners for node in self._nodes)

    @cached_property
    def guard(self) -> Scalar:
        """> 0 where no angle jumps by a turn, so that derivatives tell how the margin changes."""
        guard: Scalar = 1.0
        for node in self._nodes:
            if node.op == alg.ATAN2:
                y, x = node.args
                guard = minimum(guard, maximum(x, absolute(y)))
        return guard

    @cached_property
    def at(self) -> IntervalProgram:
        gradient = [derivative(self.margin, x) for x in self.places] if self.smooth else []
        return IntervalProgram(self._trace, [self.margin, *gradient])

    @cached_property
    def over(self) -> IntervalProgram:
        first = [derivative(self.margin, x) for x in self.places]
        if self.smooth:
            first = [derivative(g, y) for i, g in enumerate(first) for y in self.places[i:]]
        by_turns = [derivative(self.margin, x) for x in self.turns]
        return IntervalProgram(self._trace, [self.margin, self.guard, *by_turns, *first])


@dataclass(frozen=True, eq=False)
class Slice:
    """Poses of a machine in which some axes are places or turns that vary, and the others are held."""

    machine: Machine
    places: tuple[str, ...]
    turns: tuple[str, ...]
    held: Mapping[str, float]
    mode: str

    @cached_property
    def inputs(self) -> list[Term]:
        return Trace().inputs(len(self.places) + len(self.turns))

    @cached_property
    def pose(self) -> list[Scalar]:
        """The whole pose: terms for what varies, numbers for what is held, so that the trace folds them away."""
        free = dict(zip((*self.places, *self.turns), self.inputs, strict=True))
        return [free[axis] if axis in free else np.float64(self.held[axis]) for axis in self.machine.axes]

    def constraints(self, without: Sequence[str] = ()) -> list[Constraint]:
        """The machine's limits, but for those named in ``without``."""
        with np.errstate(all="ignore"):  # what a pose held out of reach makes of numbers is a margin that is broken
            margins = self.machine.model.own_margins(self.pose, self.mode)
        d = len(self.places)
        x, turns = self.inputs[:d], self.inputs[d:]
        kept = [(limit.name, g) for limit, g in margins if limit.name not in without]
        found = [Constraint(name, g, x, turns) for name, g in kept]
        implied = [*_across_the_jump(kept), *self._about_the_feet(without)]
        return found + [Constraint(name, g, x, turns, implied=True) for name, g in implied]

    def _about_the_feet(self, without: Sequence[str]) -> list[tuple[str, Scalar]]:
        """How near the legs hold the platform's origin, however it is turned.

        With a central leg the rotation follows from the place, and near the axis of its first turn nothing is known of
        it: there this still tells how far the machine can reach.
        """
        spec = self.machine.spec
        if spec.motion[0] not in ROTATIONS:
            return []
        with np.errstate(all="ignore"):
            _, placed, _ = self.machine.model.invert(self.pose, self.mode)
        found = []
        for leg in spec.legs:
            low = [-np.inf if f"{drive.name}.min" in without else drive.low for drive in leg.drives]
            high = [np.inf if f"{drive.name}.max" in without else drive.high for drive in leg.drives]
            trace = Trace()
            sphere = leg.sphere(list(trace.inputs(len(low))))
            if sphere is None:
                continue
            centre, radius = sphere
            down, up = (
                ends[0] for ends in IntervalProgram(trace, [*centre, radius])(np.array([low]), np.array([high]))
            )
            if np.isfinite(down[:3]).all() and np.isfinite(up).all():
                middle, half = 0.5 * (down + up)[:3], 0.5 * (up - down)[:3]
                most = (up[3] + np.linalg.norm(half) + np.linalg.norm(leg.platform)) * (1.0 + _ROUNDING)
                found.append((leg.drives[0].name, most - norm(sub(placed.origin, middle.tolist()))))
        return found


def _across_the_jump(margins: Sequence[tuple[str, Scalar]]) -> list[tuple[str, Scalar]]:
    """What limits on both sides of an angle say of its size, which does not jump at ±180° as the angle does."""
    found: dict[int, dict[bool, tuple[float, Term, str]]] = {}
    for name, g in margins:
        if isinstance(g, Term) and g.op == alg.LIN and len(g.args) == 1 and g.args[0].op == alg.ATAN2:
            angle = g.args[0]
            found.setdefault(angle.index, {})[g.k[1] < 0.0] = abs(g.k[0] / g.k[1]), angle, name
    sizes = []
    for sides in found.values():
        most = max(bound for bound, _, _ in sides.values())
        _, angle, name = next(iter(sides.values()))
        if len(sides) == 2 and most < np.pi:
            y, x = angle.args
            sizes.append((name, most - alg.atan2(absolute(y), x)))
    return sizes
