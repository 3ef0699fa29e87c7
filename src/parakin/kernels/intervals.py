"""A trace over intervals: bounds that hold for every point of a box, many boxes at once, rounded outward."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import algebra as alg
from ..algebra import Scalar, Term, Trace

Bounds = tuple[NDArray[np.float64], NDArray[np.float64]]


def _out(low: NDArray[np.float64], high: NDArray[np.float64]) -> Bounds:
    return np.nextafter(low, -np.inf), np.nextafter(high, np.inf)


def plus(a: Bounds, b: Bounds) -> Bounds:
    return _out(a[0] + b[0], a[1] + b[1])


def scaled(a: Bounds, k: float) -> Bounds:
    return _out(k * a[0], k * a[1]) if k >= 0.0 else _out(k * a[1], k * a[0])


def times(a: Bounds, b: Bounds) -> Bounds:
    with np.errstate(invalid="ignore", over="ignore"):
        products = (a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1])
    corners = [np.where(np.isnan(corner), 0.0, corner) for corner in products]  # 0·∞: an end is never reached
    return _out(np.minimum.reduce(corners), np.maximum.reduce(corners))


def square(a: Bounds) -> Bounds:
    low, high = np.abs(a[0]), np.abs(a[1])
    least = np.where((a[0] <= 0.0) & (a[1] >= 0.0), 0.0, np.minimum(low, high))
    down, up = _out(least * least, np.maximum(low, high) ** 2)
    return np.maximum(down, 0.0), up


def quotient(a: Bounds, b: Bounds) -> Bounds:
    """a/b; the whole line where b holds 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = _out(1.0 / b[1], 1.0 / b[0])
    through = (b[0] <= 0.0) & (b[1] >= 0.0)
    low, high = times(a, (np.where(through, 0.0, inverse[0]), np.where(through, 0.0, inverse[1])))
    return np.where(through, -np.inf, low), np.where(through, np.inf, high)


def root(a: Bounds) -> Bounds:
    """√ of the part of a that is not negative."""
    low, high = _out(np.sqrt(np.maximum(a[0], 0.0)), np.sqrt(np.maximum(a[1], 0.0)))
    return np.maximum(low, 0.0), high


def sine(a: Bounds) -> Bounds:
    """Sine: the ends, and ±1 where a crest or a trough lies between them."""
    ends = np.sin(a[0]), np.sin(a[1])
    # libm's sine is good to an ulp or so; widen by a few, and look for crests in a slightly wider interval.
    low, high = np.minimum(*ends) - 4e-16, np.maximum(*ends) + 4e-16
    turn = 2.0 * np.pi
    wide = a[0] - 1e-15 * (1.0 + np.abs(a[0])), a[1] + 1e-15 * (1.0 + np.abs(a[1]))
    crest = np.floor((wide[1] - 0.5 * np.pi) / turn) >= np.ceil((wide[0] - 0.5 * np.pi) / turn)
    trough = np.floor((wide[1] + 0.5 * np.pi) / turn) >= np.ceil((wide[0] + 0.5 * np.pi) / turn)
    return np.where(trough, -1.0, np.maximum(low, -1.0)), np.where(crest, 1.0, np.minimum(high, 1.0))


def cosine(a: Bounds) -> Bounds:
    return sine(_out(a[0] + 0.5 * np.pi - 1e-16, a[1] + 0.5 * np.pi + 1e-16))


@dataclass(frozen=True, eq=False)
class IntervalProgram:
    """The outputs of a trace, to be evaluated over boxes."""

    trace: Trace
    outputs: Sequence[Scalar]

    def __call__(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> Bounds:
        """Bounds (boxes, outputs) of every output over boxes (boxes, inputs)."""
        known: dict[int, Bounds] = {}
        count = len(low)
        for index in alg.needed([y for y in self.outputs if isinstance(y, Term)]):
            known[index] = _operation(self.trace.nodes[index], known, low, high)
        results = [
            known[y.index] if isinstance(y, Term) else (np.full(count, float(y)), np.full(count, float(y)))
            for y in self.outputs
        ]
        return np.stack([r[0] for r in results], -1), np.stack([r[1] for r in results], -1)


def _operation(y: Term, known: dict[int, Bounds], low: NDArray[np.float64], high: NDArray[np.float64]) -> Bounds:
    a = [known[arg.index] for arg in y.args]
    if y.op == alg.INPUT:
        column = int(y.k[0])
        return low[:, column], high[:, column]
    if y.op == alg.LIN:
        total = (np.full(len(low), y.k[0]), np.full(len(low), y.k[0]))
        for k, part in zip(y.k[1:], a, strict=True):
            total = plus(total, scaled(part, k))
        return total
    if y.op in (alg.QUAD, alg.FMA):
        pairs = 1 if y.op == alg.FMA else len(y.k)
        total = (np.full(len(low), 0.0), np.full(len(low), 0.0))
        if y.op == alg.FMA:
            total = plus(scaled(a[2], y.k[1]), (np.full(len(low), y.k[2]), np.full(len(low), y.k[2])))
        for i in range(pairs):
            same = y.args[2 * i] is y.args[2 * i + 1]
            total = plus(total, scaled(square(a[2 * i]) if same else times(a[2 * i], a[2 * i + 1]), y.k[i]))
        return total
    if y.op == alg.DIV:
        return quotient(a[0], a[1])
    if y.op == alg.SQRT:
        return root(a[0])
    if y.op == alg.SIN:
        return sine(a[0])
    if y.op == alg.COS:
        return cosine(a[0])
    if y.op == alg.MIN:
        return np.minimum(a[0][0], a[1][0]), np.minimum(a[0][1], a[1][1])
    if y.op == alg.MAX:
        return np.maximum(a[0][0], a[1][0]), np.maximum(a[0][1], a[1][1])
    raise TypeError(f"no interval form of operation {y.op}")
