"""Traces that serve every working mode: the signs of the mode are inputs beside the pose."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from itertools import product

from ...algebra import Scalar, select
from ...machine import Machine
from ...model.equations import Equations
from ...model.limits import Limit


def select_by_signs(mode: str, signs: Sequence[Scalar], trace: Callable[[str], Sequence[Scalar]]) -> list[Scalar]:
    """Trace outputs in every working mode at once.

    Parameters
    ----------
    mode : any working mode
    signs : a scalar for each of its signs, -1 or 1
    trace : makes the outputs in a mode, on one trace

    Each output is made only for those signs that it depends on: a leg's joints for the leg's own.
    """
    traced = cache(lambda text: list(trace(text)))
    base, flipped = traced(mode), [traced(_replace_signs(mode, {i: "+-"[sign == "+"]})) for i, sign in enumerate(mode)]
    outputs = []
    for number, output in enumerate(base):
        own = [i for i in range(len(mode)) if not _is_same(flipped[i][number], output)]
        choices = {
            chosen: traced(_replace_signs(mode, dict(zip(own, chosen, strict=True))))[number]
            for chosen in product("-+", repeat=len(own))
        }
        outputs.append(_choose(choices, [signs[i] for i in own]))
    return outputs


def _is_same(one: Scalar, other: Scalar) -> bool:
    """Tell whether two scalars of one trace are the same; equal terms are one object."""
    return one is other or (isinstance(one, float) and isinstance(other, float) and one == other)


def _replace_signs(mode: str, signs: dict[int, str]) -> str:
    return "".join(signs.get(i, sign) for i, sign in enumerate(mode))


def _choose(choices: dict[tuple[str, ...], Scalar], signs: Sequence[Scalar]) -> Scalar:
    if not signs:
        return choices[()]
    halves = [{key[1:]: value for key, value in choices.items() if key[0] == sign} for sign in "-+"]
    return select(signs[0], 0.0, *(_choose(half, signs[1:]) for half in halves))


def trace_inverse(
    equations: Equations, pose: Sequence[Scalar], signs: Sequence[Scalar], first: Scalar | None = None
) -> list[Scalar]:
    """Trace the joints of a pose in the mode of the signs; ``first`` is the wrist's first joint where it is free."""
    return select_by_signs(equations.mode, signs, lambda mode: equations.invert(pose, mode, first)[0])


def trace_margins(
    equations: Equations, pose: Sequence[Scalar], joints: Sequence[Scalar], signs: Sequence[Scalar]
) -> list[Scalar]:
    """Trace every limit's margin at a pose and the joints that a path takes there, in the mode of the signs."""

    def trace(mode: str) -> list[Scalar]:
        return [margin for _, margin in equations.margins(pose, joints, mode)]

    return select_by_signs(equations.mode, signs, trace)


def list_joints_of_limit(machine: Machine, limit: Limit) -> list[str]:
    """List the drives that a limit is about, by the names in its subject."""
    words = set(limit.subject.replace("-", " ").split())
    return [name for name in machine.joints if name in words]
