"""Bound what rounding does to a computation in doubles, over a box of its inputs: running error analysis.

Every operation's range and error follow from its operands' (N. J. Higham, Accuracy and stability of numerical
algorithms, 2002, section 3.3). A sum's summands may be added in any order, and products fused with sums. The box is cut
into cells, over which ranges are closer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import NamedTuple

import numpy as np

from ... import algebra as alg
from ...algebra import Scalar, Term, Trace
from ...arrays import Array, Flags

_UNIT = 2.0**-53  # of a result, by which an operation rounds at most
_CUTS = 8  # of an input's range


class Rounded(NamedTuple):
    """A value's range over every cell, and how far what is computed may be from what it would be without rounding."""

    low: Array
    high: Array
    error: Array

    @property
    def size(self) -> Array:
        return np.maximum(np.abs(self.low), np.abs(self.high))


def bound_rounding(
    trace: Trace, outputs: Sequence[Scalar], box: Sequence[tuple[float, float]], least: Mapping[Term, float]
) -> list[float]:
    """Bound the error of each output over a box of inputs, which are exact; infinite where it has no bound.

    least : what some terms are known to be at least, as they are computed: elsewhere there is no bound to hold. A
        product's factor is at least as much over the other's range.
    """
    nodes = [trace.nodes[i] for i in alg.find_dependencies([y for y in [*outputs, *least] if isinstance(y, Term)])]
    used = [int(node.k[0]) for node in nodes if node.op == alg.INPUT]
    inputs = dict(zip(used, _cut_box([box[i] for i in used]), strict=True))
    floors: dict[int, Array | float] = {term.index: floor for term, floor in least.items()}
    known: dict[int, Rounded] = {}
    with np.errstate(all="ignore"):
        for _ in range(2):  # floors of factors are known after the first
            for node in nodes:
                args = [known[a.index] for a in node.args]
                value = inputs[int(node.k[0])] if node.op == alg.INPUT else _OPERATIONS[node.op](node.k, args)
                known[node.index] = value._replace(low=np.maximum(value.low, floors.get(node.index, -np.inf)))
            for term, floor in least.items():
                if term.op == alg.QUAD and len(term.args) == 2 and term.k[0] > 0.0:
                    for one, other in (term.args, term.args[::-1]):
                        factor = known[other.index]
                        floors[one.index] = np.where(factor.low > 0.0, floor / (term.k[0] * factor.high), -np.inf)
        empty = reduce(np.logical_or, (value.low > value.high for value in known.values()))
        errors = [np.where(empty, 0.0, known[y.index].error).max() if isinstance(y, Term) else 0.0 for y in outputs]
    return [np.inf if np.isnan(error) else float(error) for error in errors]


def _cut_box(box: Sequence[tuple[float, float]]) -> list[Rounded]:
    """Cut a box into cells, and list each side's ranges."""
    ends = [np.linspace(low, high, _CUTS + 1) for low, high in box]
    low = np.meshgrid(*(end[:-1] for end in ends), indexing="ij")
    high = np.meshgrid(*(end[1:] for end in ends), indexing="ij")
    return [Rounded(a.ravel(), b.ravel(), np.zeros(a.size)) for a, b in zip(low, high, strict=True)]


def _add(constant: float, summands: Sequence[Rounded]) -> Rounded:
    """Add summands, whose own operations and constants round too."""
    size = abs(constant) + sum(x.size + x.error for x in summands)
    rounding = (len(summands) + 3) * _UNIT * size
    low, high = (np.asarray(constant + sum(x[i] for x in summands)) for i in (0, 1))
    return Rounded(low, high, np.asarray(sum(x.error for x in summands) + rounding))


def _multiply(factor: float, a: Rounded, b: Rounded) -> Rounded:
    ends = [factor * x * y for x in (a.low, a.high) for y in (b.low, b.high)]
    if a is b:  # a square, which is never negative
        nearest = np.maximum(np.maximum(a.low, -a.high), 0.0)
        ends = [factor * nearest**2, factor * a.size**2]
    error = abs(factor) * (a.size * b.error + b.size * a.error + a.error * b.error)
    return Rounded(reduce(np.minimum, ends), reduce(np.maximum, ends), error)


_ONE = Rounded(np.ones(1), np.ones(1), np.zeros(1))


def _bound_line(k: Sequence[float], args: Sequence[Rounded]) -> Rounded:
    return _add(k[0], [_multiply(factor, a, _ONE) for factor, a in zip(k[1:], args, strict=True)])


def _bound_products(k: Sequence[float], args: Sequence[Rounded]) -> Rounded:
    return _add(0.0, [_multiply(factor, *args[2 * i : 2 * i + 2]) for i, factor in enumerate(k)])


def _bound_product_and_line(k: Sequence[float], args: Sequence[Rounded]) -> Rounded:
    return _add(k[2], [_multiply(k[0], *args[:2]), _multiply(k[1], args[2], _ONE)])


def _bound_quotient(k: Sequence[float], args: Sequence[Rounded]) -> Rounded:
    a, b = args
    least = np.maximum(b.low, -b.high) - b.error
    ends = [x / y for x in (a.low, a.high) for y in (b.low, b.high)]
    low, high = reduce(np.minimum, ends), reduce(np.maximum, ends)
    size = np.maximum(np.abs(low), np.abs(high))
    error = (a.error + size * b.error) / least + 2.0 * _UNIT * size
    return _keep_where(least > 0.0, Rounded(low, high, error))


def _bound_root(k: Sequence[float], args: Sequence[Rounded]) -> Rounded:
    (a,) = args
    least = a.low - a.error
    low, high = np.sqrt(a.low), np.sqrt(a.high)
    return _keep_where(least > 0.0, Rounded(low, high, a.error / np.sqrt(least) + 2.0 * _UNIT * high))


def _bound_nothing(k: Sequence[float], args: Sequence[Rounded]) -> Rounded:
    return _keep_where(np.zeros(1, np.bool_), _ONE)


def _keep_where(known: Flags, value: Rounded) -> Rounded:
    """Keep a value in the cells where it is known."""
    low, high, error = (np.where(known, x, end) for x, end in zip(value, (-np.inf, np.inf, np.inf), strict=True))
    return Rounded(low, high, error)


_OPERATIONS: dict[int, Callable[[Sequence[float], Sequence[Rounded]], Rounded]] = {
    **dict.fromkeys(range(alg.INPUT), _bound_nothing),
    alg.LIN: _bound_line,
    alg.QUAD: _bound_products,
    alg.FMA: _bound_product_and_line,
    alg.DIV: _bound_quotient,
    alg.SQRT: _bound_root,
}
