"""Scalars and vectors in which the model is written once, for several interpreters.

A scalar is a number, a NumPy array (all poses at once) or a :class:`Term` (a trace, compiled by
:mod:`parakin.kernels.tape` or differentiated by :func:`derivative`). Vectors are triples of scalars, matrices triples
of rows.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from itertools import combinations
from typing import Any, TypeAlias

import numpy as np

# The operations of a trace. LIN: k0 + Σ k·a; QUAD: Σ k·a·b, up to three summands each; FMA: k·a·b + k·c + k0;
# SELECT: c where a < b, else d (the derivatives of MIN and MAX); STOP_GRADIENT: a, whose derivative is 0.
LIN, QUAD, FMA, DIV, SQRT, SIN, COS, ATAN2, MIN, MAX, ABS, COPYSIGN, SELECT, STOP_GRADIENT, INPUT = range(15)


class Term:
    """A node of a trace. Equal nodes are one object; sums and products are combined as they are written."""

    __slots__ = ("args", "index", "k", "op", "trace")
    __array_ufunc__ = None  # so that NumPy's scalars leave arithmetic with a term to the term

    def __init__(self, trace: Trace, op: int, args: tuple[Term, ...], k: tuple[float, ...], index: int):
        self.trace, self.op, self.args, self.k, self.index = trace, op, args, k, index

    def __add__(self, other: Scalar) -> Scalar:
        return _add_multiple(self, other, 1.0)

    __radd__ = __add__

    def __sub__(self, other: Scalar) -> Scalar:
        return _add_multiple(self, other, -1.0)

    def __rsub__(self, other: float) -> Scalar:
        return -self + other

    def __neg__(self) -> Scalar:
        return _multiply_constant(self, -1.0)

    def __mul__(self, other: Scalar) -> Scalar:
        if not isinstance(other, Term):
            return _multiply_constant(self, float(other))
        (ka, a), (kb, b) = _split_factor(self), _split_factor(other)
        pair = (a, b) if a.index <= b.index else (b, a)
        return self.trace.node(QUAD, pair, (ka * kb,))

    __rmul__ = __mul__

    def __pow__(self, exponent: int) -> Scalar:
        return self * self if exponent == 2 else NotImplemented

    def __truediv__(self, other: Scalar) -> Scalar:
        if not isinstance(other, Term):
            return _multiply_constant(self, 1.0 / float(other))
        return self.trace.node(DIV, (self, other), ())

    def __rtruediv__(self, other: float) -> Scalar:
        if other == 0.0:
            return 0.0
        return self.trace.node(DIV, (self.trace.constant(other), self), ())


Scalar: TypeAlias = Any  # float | np.ndarray | Term: mypy can't follow arithmetic over the union
Vec: TypeAlias = Sequence[Scalar]
Mat: TypeAlias = Sequence[Sequence[Scalar]]


class Trace:
    """All nodes of one computation in the order of their making: operands before results."""

    def __init__(self) -> None:
        self.nodes: list[Term] = []
        self._known: dict[tuple[Any, ...], Term] = {}
        self._derivatives: dict[int, dict[int, Scalar]] = {}
        self.known_slopes: dict[int, list[tuple[Scalar, Scalar]]] = {}  # factors of others' derivatives

    def input(self, number: int) -> Term:
        """Return the ``number``-th input."""
        return self.node(INPUT, (), (float(number),))

    def inputs(self, count: int, start: int = 0) -> list[Term]:
        return [self.input(start + i) for i in range(count)]

    def constant(self, value: float) -> Term:
        return self.node(LIN, (), (float(value),))

    def node(self, op: int, args: tuple[Term, ...], k: tuple[float, ...]) -> Term:
        key = (op, k, *[a.index for a in args])
        term = self._known.get(key)
        if term is None:
            term = self._known[key] = Term(self, op, args, k, len(self.nodes))
            self.nodes.append(term)
        return term


def _split_factor(term: Term) -> tuple[float, Term]:
    """Split a term into (k, a) with term = k·a."""
    if term.op == LIN and len(term.args) == 1 and term.k[0] == 0.0:
        return term.k[1], term.args[0]
    return 1.0, term


def _multiply_constant(term: Term, k: float) -> Scalar:
    """Multiply a term by k, without a node for k of 0 or 1 and without a chain of multiples."""
    if k == 0.0:
        return 0.0
    if k == 1.0:
        return term
    if term.op == LIN:
        return term.trace.node(LIN, term.args, tuple(k * x for x in term.k))
    return term.trace.node(LIN, (term,), (0.0, k))


def _split_linear(term: Scalar) -> tuple[float, list[tuple[float, Term]]]:
    """Split a scalar into a constant and multiples (k, a) of terms, whose sum it is."""
    if not isinstance(term, Term):
        return float(term), []
    if term.op == LIN:
        return term.k[0], list(zip(term.k[1:], term.args, strict=True))
    return 0.0, [(1.0, term)]


def _add_multiple(x: Term, y: Scalar, sign: float) -> Scalar:
    """Add sign·y to x in as few operations as possible; equal terms are joined."""
    if not isinstance(y, Term | float | int | np.floating):
        return NotImplemented
    kx, summands = _split_linear(x)
    ky, more = _split_linear(y)
    const, total = kx + sign * ky, {a.index: (k, a) for k, a in summands}
    for k, a in more:
        total[a.index] = (total.get(a.index, (0.0, a))[0] + sign * k, a)
    terms = [(k, a) for k, a in total.values() if k != 0.0]
    if not terms:
        return const
    trace = x.trace
    if len(terms) > 3 and isinstance(y, Term):  # too wide for one operation: keep both sides as they are
        return trace.node(LIN, (x, y), (0.0, 1.0, sign))
    if const == 0.0 and len(terms) == 1:  # a bare multiple, so that it cancels against others and products absorb it
        return _multiply_constant(terms[0][1], terms[0][0])
    products = [a.op == QUAD for _, a in terms]
    if const == 0.0 and all(products) and sum(len(a.k) for _, a in terms) <= 3:
        args = tuple(arg for _, a in terms for arg in a.args)
        return trace.node(QUAD, args, tuple(k * q for k, a in terms for q in a.k))
    if len(terms) == 2 and any(p and len(a.k) == 1 for p, (_, a) in zip(products, terms, strict=True)):
        (kp, p), (kc, c) = terms if products[0] and len(terms[0][1].k) == 1 else terms[::-1]
        return trace.node(FMA, (*p.args, c), (kp * p.k[0], kc, const))
    return trace.node(LIN, tuple(a for _, a in terms), (const, *[k for k, _ in terms]))


# Functions of a scalar of any kind.


def sqrt(x: Scalar) -> Scalar:
    """Square root; NaN below zero."""
    if isinstance(x, Term):
        return x.trace.node(SQRT, (x,), ())
    with np.errstate(invalid="ignore"):
        return np.sqrt(x)


def sincos(x: Scalar) -> tuple[Scalar, Scalar]:
    """Compute sine and cosine."""
    if isinstance(x, Term):
        return x.trace.node(SIN, (x,), ()), x.trace.node(COS, (x,), ())
    return np.sin(x), np.cos(x)


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Compute the angle of (x, y) in (-π, π]; 0 for (0, 0), whatever the signs of the zeros."""
    if isinstance(y, Term) or isinstance(x, Term):
        trace = y.trace if isinstance(y, Term) else x.trace
        args = tuple(a if isinstance(a, Term) else trace.constant(a) for a in (y, x))
        return trace.node(ATAN2, args, ())
    return np.arctan2(y + 0.0, x + 0.0)


def minimum(x: Scalar, y: Scalar) -> Scalar:
    """Return the lesser of two; NaN if either is."""
    return _apply_binary(MIN, np.minimum, x, y)


def maximum(x: Scalar, y: Scalar) -> Scalar:
    """Return the greater of two; NaN if either is."""
    return _apply_binary(MAX, np.maximum, x, y)


def copysign(x: Scalar, y: Scalar) -> Scalar:
    """Return |x| with the sign of y; NaN if either is."""
    return _apply_binary(COPYSIGN, np.copysign, x, y)


def _apply_binary(op: int, function: Any, x: Scalar, y: Scalar) -> Scalar:
    if isinstance(x, Term) or isinstance(y, Term):
        trace = x.trace if isinstance(x, Term) else y.trace
        return trace.node(op, tuple(a if isinstance(a, Term) else trace.constant(a) for a in (x, y)), ())
    return function(x, y)


def select(x: Scalar, y: Scalar, below: Scalar, otherwise: Scalar) -> Scalar:
    """Return ``below`` where x < y, else ``otherwise``."""
    args = (x, y, below, otherwise)
    traces = [a.trace for a in args if isinstance(a, Term)]
    if traces:
        if below is otherwise or (
            not isinstance(below, Term) and not isinstance(otherwise, Term) and below == otherwise
        ):
            return below
        return traces[0].node(SELECT, tuple(a if isinstance(a, Term) else traces[0].constant(a) for a in args), ())
    return np.where(x < y, below, otherwise)


def stop_gradient(x: Scalar) -> Scalar:
    """Make x a constant for :func:`derivative`.

    The position of a minimum has no first-order effect on it (Danskin).
    """
    return x.trace.node(STOP_GRADIENT, (x,), ()) if isinstance(x, Term) else x


def absolute(x: Scalar) -> Scalar:
    """Compute the absolute value |x|."""
    if isinstance(x, Term):
        return x.trace.node(ABS, (x,), ())
    return np.abs(x)


# Vectors.


def dot(u: Vec, v: Vec) -> Scalar:
    total: Scalar = 0.0
    for a, b in zip(u, v, strict=True):
        total = a * b + total
    return total


def norm(u: Vec) -> Scalar:
    return sqrt(dot(u, u))


def add(u: Vec, v: Vec) -> Vec:
    return tuple(a + b for a, b in zip(u, v, strict=True))


def sub(u: Vec, v: Vec) -> Vec:
    return tuple(a - b for a, b in zip(u, v, strict=True))


def scale(u: Vec, k: Scalar) -> Vec:
    return tuple(a * k for a in u)


def move_along(start: Vec, direction: Vec, distance: Scalar) -> Vec:
    """Compute start + distance·direction."""
    return tuple(a + d * distance for a, d in zip(start, direction, strict=True))


def cross(u: Vec, v: Vec) -> Vec:
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def transpose(m: Mat) -> Mat:
    return tuple(zip(*m, strict=True))


def apply(m: Mat, v: Vec) -> Vec:
    return tuple(dot(row, v) for row in m)


def product(m: Mat, n: Mat) -> Mat:
    columns = transpose(n)
    return tuple(tuple(dot(row, column) for column in columns) for row in m)


def expand_determinant(rows: Sequence[Vec]) -> Scalar:
    """Expand the determinant of n rows of n, row after row, by the minors of the rows before it: n 2ⁿ⁻¹ products."""
    minors: dict[tuple[int, ...], Scalar] = {(): 1.0}
    for size, row in enumerate(rows, 1):
        minors = {
            columns: dot(
                [row[column] if (size - 1 - i) % 2 == 0 else -row[column] for i, column in enumerate(columns)],
                [minors[columns[:i] + columns[i + 1 :]] for i in range(size)],
            )
            for columns in combinations(range(len(rows)), size)
        }
    return minors[tuple(range(len(rows)))]


def make_axis_rotation(axis: str, s: Scalar, c: Scalar) -> Mat:
    """Make the rotation about a coordinate axis (``rx``, ``ry`` or ``rz``) by the angle of sine s and cosine c."""
    if axis == "rx":
        return ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))
    if axis == "ry":
        return ((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c))
    return ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))


IDENTITY: Mat = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN: Vec = (0.0, 0.0, 0.0)


def find_dependencies(outputs: Sequence[Term], known: Container[int] = ()) -> list[int]:
    """Find the indices of all nodes that outputs depend on, operands first; none ``known``, nor their operands."""
    indices: set[int] = set()
    stack = list(outputs)
    while stack:
        term = stack.pop()
        if term.index not in indices and term.index not in known:
            indices.add(term.index)
            stack.extend(term.args)
    return sorted(indices)


def derivative(y: Scalar, x: Term) -> Scalar:
    """Differentiate a trace: ∂y/∂x as a trace; at a corner of MIN, MAX or ABS the derivative of one side."""
    if not isinstance(y, Term):
        return 0.0
    known = y.trace._derivatives.setdefault(x.index, {})
    for index in find_dependencies([y], known):
        known[index] = _differentiate_node(y.trace.nodes[index], x, known)
    return known[y.index]


def _differentiate_node(y: Term, x: Term, known: dict[int, Scalar]) -> Scalar:
    if y is x:
        return 1.0
    if y.index in y.trace.known_slopes:
        return sum((factor * derivative(other, x) for factor, other in y.trace.known_slopes[y.index]), 0.0)
    a, d = y.args, [known[arg.index] for arg in y.args]
    if y.op == STOP_GRADIENT or not any(isinstance(slope, Term) or slope != 0.0 for slope in d):
        return 0.0
    if y.op == LIN:
        return sum((k * slope for k, slope in zip(y.k[1:], d, strict=True)), 0.0)
    if y.op in (QUAD, FMA):
        pairs = 1 if y.op == FMA else len(y.k)
        total: Scalar = y.k[1] * d[2] if y.op == FMA else 0.0
        for i in range(pairs):
            total = total + y.k[i] * (a[2 * i] * d[2 * i + 1] + a[2 * i + 1] * d[2 * i])
        return total
    if y.op == DIV:
        return (d[0] - y * d[1]) / a[1]
    if y.op == SQRT:
        return 0.5 * d[0] / y
    if y.op == SIN:
        return sincos(a[0])[1] * d[0]
    if y.op == COS:
        return -sincos(a[0])[0] * d[0]
    if y.op == ATAN2:
        return (a[1] * d[0] - a[0] * d[1]) / (a[0] * a[0] + a[1] * a[1])
    if y.op == MIN:
        return select(a[0], a[1], d[0], d[1])
    if y.op == MAX:
        return select(a[1], a[0], d[0], d[1])
    if y.op == ABS:
        return select(a[0], 0.0, -d[0], d[0])
    if y.op == SELECT:
        return select(a[0], a[1], d[2], d[3])
    raise TypeError(f"no derivative of operation {y.op}")


def evaluate_trace(trace: Trace, outputs: Sequence[Scalar], inputs: Sequence[Scalar]) -> list[Scalar]:
    """Evaluate outputs of a trace for given inputs, numbers or arrays: the plain interpreter.

    Inputs may also be terms of another trace; what depends on numbers alone is folded there.
    """
    known: dict[int, Scalar] = {}
    for index in find_dependencies([y for y in outputs if isinstance(y, Term)]):
        term = trace.nodes[index]
        a = [known[arg.index] for arg in term.args]
        k = term.k
        if term.op == INPUT:
            known[term.index] = inputs[int(k[0])] if int(k[0]) < len(inputs) else np.nan
        elif term.op == LIN:
            known[term.index] = k[0] + sum(x * y for x, y in zip(k[1:], a, strict=True))
        elif term.op == QUAD:
            known[term.index] = sum(x * a[2 * i] * a[2 * i + 1] for i, x in enumerate(k))
        elif term.op == FMA:
            known[term.index] = k[0] * a[0] * a[1] + k[1] * a[2] + k[2]
        else:
            known[term.index] = _FUNCTIONS[term.op](*a)
    return [known[y.index] if isinstance(y, Term) else y for y in outputs]


_FUNCTIONS: dict[int, Any] = {
    DIV: lambda x, y: x / y,
    SQRT: sqrt,
    SIN: lambda x: sincos(x)[0],
    COS: lambda x: sincos(x)[1],
    ATAN2: atan2,
    MIN: minimum,
    MAX: maximum,
    ABS: absolute,
    COPYSIGN: copysign,
    SELECT: select,
    STOP_GRADIENT: stop_gradient,
}
