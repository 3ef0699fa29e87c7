"""Intervals against arb at 200 bits: what is exact lies between the bounds, and they are no wider than roundings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from shipped import load_shipped
from test_kernels import MEANING, steps

from parakin import algebra as alg
from parakin.kernels.intervals import IntervalProgram, JumpFreeTrace

ctx.prec = 200
VANISHING = 1e-300  # below this numbers count as 0
ROUNDINGS = 40 * 2.0**-53  # what bounds may be too wide by, of the sizes that went in

# Operations, exactly. None: there is no value.


def quotient(x, y):
    return None if y == 0 else x / y


def root(x):
    return None if x < 0 else x.sqrt()


def angle(y, x):
    if y == 0:
        return arb.pi() if x < 0 else arb(0)
    return arb.atan2(y, x)


def least(x, y):
    return x if x <= y else y


def most(x, y):
    return x if x >= y else y


OPERATIONS = {
    alg.DIV: quotient,
    alg.SQRT: root,
    alg.SIN: lambda x: x.sin(),
    alg.COS: lambda x: x.cos(),
    alg.ATAN2: angle,
    alg.MIN: least,
    alg.MAX: most,
    alg.ABS: lambda x: x if x >= 0 else -x,
    alg.COPYSIGN: lambda x, y: -abs(x) if y < 0 else abs(x),
    alg.SELECT: lambda x, y, below, otherwise: below if x < y else otherwise,
    alg.STOP_GRADIENT: lambda x: x,
}


def exactly(node, given):
    """A node's value for the values of the inputs, its constants taken as they stand."""
    a, k = [exactly(arg, given) for arg in node.args], [arb(value) for value in node.k]
    if any(value is None for value in a):
        return None
    if node.op == alg.INPUT:
        return given[int(node.k[0])]
    if node.op == alg.LIN:
        return sum((x * y for x, y in zip(k[1:], a, strict=True)), k[0])
    if node.op == alg.QUAD:
        return sum((x * a[2 * i] * a[2 * i + 1] for i, x in enumerate(k)), arb(0))
    if node.op == alg.FMA:
        return k[0] * a[0] * a[1] + k[1] * a[2] + k[2]
    return OPERATIONS[node.op](*a)


# Every operation on every sort of interval.

CASES = {
    "constant": (alg.LIN, (), (-0.7,)),
    "lin1": (alg.LIN, (0,), (0.3, -1.7)),
    "lin1 bare": (alg.LIN, (0,), (0.0, 1.0)),
    "lin2": (alg.LIN, (0, 1), (-0.1, 1.0, -3.3)),
    "lin3": (alg.LIN, (0, 1, 2), (1e3, -1.0, 0.1, 7.7)),
    "product": (alg.QUAD, (0, 1), (-1.3,)),
    "square": (alg.QUAD, (0, 0), (1.0,)),
    "less a square": (alg.QUAD, (0, 0), (-0.7,)),
    "quad2": (alg.QUAD, (0, 1, 2, 2), (1.0, -2.3)),
    "quad3": (alg.QUAD, (0, 0, 1, 1, 2, 2), (1.0, 0.1, -1.0)),
    "fma": (alg.FMA, (0, 1, 2), (1.0, -0.3, 0.7)),
    "fma square": (alg.FMA, (0, 0, 1), (-1.0, 1.0, 1e4)),
    "quotient": (alg.DIV, (0, 1), ()),
    "root": (alg.SQRT, (0,), ()),
    "sine": (alg.SIN, (0,), ()),
    "cosine": (alg.COS, (0,), ()),
    "angle": (alg.ATAN2, (0, 1), ()),
    "least": (alg.MIN, (0, 1), ()),
    "most": (alg.MAX, (0, 1), ()),
    "size": (alg.ABS, (0,), ()),
    "signed": (alg.COPYSIGN, (0, 1), ()),
    "choice": (alg.SELECT, (0, 1, 2, 3), ()),
    "held": (alg.STOP_GRADIENT, (0,), ()),
}
COUNT = 4
every_case = pytest.mark.parametrize("case", CASES)


def program(case):
    trace = alg.Trace()
    inputs = trace.inputs(COUNT)
    op, args, k = CASES[case]
    node = trace.node(op, tuple(inputs[i] for i in args), k)
    return IntervalProgram(trace, [node]), node


def ends(rng, sort, count):
    """Intervals of a sort, (count, COUNT) lower and upper ends."""
    shape = (count, COUNT)
    middle = rng.normal(size=shape) * 10.0 ** rng.uniform(-3.0, 3.0, shape)
    width = np.abs(rng.normal(size=shape)) * 10.0 ** rng.uniform(-9.0, 3.0, shape)
    if sort == "points":
        low = high = np.where(rng.random(shape) < 0.2, np.round(middle), middle)
    elif sort == "huge":
        middle, width = middle * 10.0 ** rng.uniform(0, 280, shape), width * 10.0 ** rng.uniform(0, 280, shape)
        low, high = middle - width, middle + width
    elif sort == "greatest":
        low, high = np.sort(1.7e308 * rng.uniform(-1.0, 1.0, (2, *shape)), 0)
    elif sort == "tiny":
        scale = 10.0 ** rng.uniform(-280.0, -100.0, shape)
        low, high = (middle - width) * scale, (middle + width) * scale
    else:
        low, high = middle - width, middle + width
    if sort == "touching":  # what they begin or end with is 0, or another's end, or a whole number
        low = np.where(rng.random(shape) < 0.3, 0.0, low)
        high = np.where((rng.random(shape) < 0.3) & (low <= 0.0), 0.0, np.maximum(low, high))
        low = np.where((rng.random(shape) < 0.3) & (high[:, ::-1] <= high), high[:, ::-1], low)
    if sort == "unbounded":
        low = np.where(rng.random(shape) < 0.4, -np.inf, low)
        high = np.where(rng.random(shape) < 0.4, np.inf, high)
    if sort == "turns":
        low = np.round(middle * 4.0) * (np.pi / 8) + np.where(rng.random(shape) < 0.5, 0.0, middle)
        high = low + np.where(rng.random(shape) < 0.3, 0.0, rng.exponential(3.0, shape))
    if sort == "many turns":
        low = rng.uniform(-1.2e5, 1.2e5, shape)
        high = low + np.where(rng.random(shape) < 0.3, 0.0, rng.exponential(3.0, shape))
    return low, high


SORTS = ["ordinary", "points", "touching", "turns", "many turns", "huge", "greatest", "tiny", "unbounded"]


def samples(rng, low, high, count=9):
    """Points of intervals: their ends, 0 if they hold it, quarter turns, and some between; (samples, N, COUNT)."""
    low, high = np.maximum(low, -1.7e308), np.minimum(high, 1.7e308)
    share = rng.random((count, *low.shape)) * (rng.random((count, 1, 1)) < 0.8)
    between = low * (1.0 - share) + high * share
    crest = np.ceil(low / (np.pi / 2)) * (np.pi / 2)
    points = np.stack([low, high, np.zeros_like(low), crest, *between, *np.where(share < 0.5, low, high)])
    return np.clip(points, low, high)


def values(node, points):
    """Exact values at sample points (samples, COUNT) where there are any."""
    found = (exactly(node, [arb(x) for x in point]) for point in points.tolist())
    return [value for value in found if value is not None]


@every_case
@pytest.mark.parametrize("sort", SORTS)
def test_the_exact_image_lies_within_the_bounds(case, sort):
    run, node = program(case)
    rng = np.random.default_rng(len(case) + 100 * SORTS.index(sort))
    low, high = ends(rng, sort, 60)
    assert (low <= high).all()
    down, up = run(low, high)
    assert not np.isnan(down).any()
    assert not np.isnan(up).any()
    points = samples(rng, low, high)
    for i in range(len(low)):
        for value in values(node, points[:, i]):
            assert not value < arb(down[i, 0]) - VANISHING, (low[i], high[i], value, down[i, 0])
            assert not value > arb(up[i, 0]) + VANISHING, (low[i], high[i], value, up[i, 0])


SIZES = {  # what roundings are relative to, beside the image: the sum of what was added, and of angles a turn
    **{
        case: lambda k, x: np.abs(k[0]) + np.abs(k[1:]) @ x[: len(k) - 1]
        for case in ("lin1", "lin1 bare", "lin2", "lin3")
    },
    "constant": lambda k, x: abs(k[0]),
    "quad2": lambda k, x: abs(k[0]) * x[0] * x[1] + abs(k[1]) * x[2] ** 2,
    "quad3": lambda k, x: np.abs(k) @ x[:3] ** 2,
    "fma": lambda k, x: abs(k[0]) * x[0] * x[1] + abs(k[1]) * x[2] + abs(k[2]),
    "fma square": lambda k, x: abs(k[0]) * x[0] ** 2 + abs(k[1]) * x[1] + abs(k[2]),
    "sine": lambda k, x: 1.0 + x[0],
    "cosine": lambda k, x: 1.0 + x[0],
    "angle": lambda k, x: 1.0,
}


def product_of(corners):
    return np.array(np.meshgrid(*corners)).reshape(len(corners), -1).T


def image(case, low, high):
    """The least and greatest exact value over an interval: these operations have them at corners, at 0 or at crests."""
    _, node = program(case)
    op, args, _ = CASES[case]
    used = sorted(set(args))
    corners = [[low[i], high[i]] for i in range(COUNT)]
    for i in range(COUNT):
        if i not in used:
            corners[i] = [low[i]]
        elif low[i] < 0.0 < high[i]:
            corners[i].append(0.0)
    found = values(node, product_of(corners))
    if op in (alg.SIN, alg.COS):
        shift = 0.25 if op == alg.SIN else 0.0
        for crest, value in ((shift, 1), (shift + 0.5, -1)):
            if math.floor(high[0] / (2 * np.pi) - crest) >= math.ceil(low[0] / (2 * np.pi) - crest):
                found.append(arb(value))
    if op == alg.ATAN2 and low[0] < 0.0 <= high[0] and low[1] <= 0.0:
        found = [-arb.pi(), arb.pi()]
    if op == alg.DIV and low[1] <= 0.0 <= high[1]:
        return None
    return min(map(float, found)), max(map(float, found))


@every_case
@pytest.mark.parametrize("sort", ["ordinary", "points", "touching", "turns"])
def test_the_bounds_are_no_wider_than_roundings(case, sort):
    run, _ = program(case)
    low, high = ends(np.random.default_rng(5), sort, 60)
    down, up = run(low, high)
    compared = 0
    for i in range(len(low)):
        if case == "root" and high[i, 0] < 0.0:
            continue  # no value
        if case == "choice" and not (high[i, 0] < low[i, 1] or low[i, 0] >= high[i, 1]):
            continue  # either
        exact = image(case, low[i], high[i])
        if exact is None:
            assert (down[i, 0], up[i, 0]) == (-np.inf, np.inf)
            continue
        size = max(abs(exact[0]), abs(exact[1]))
        if case in SIZES:
            size += SIZES[case](np.array(CASES[case][2]), np.maximum(np.abs(low[i]), np.abs(high[i])))
        compared += 1
        assert exact[0] - down[i, 0] <= ROUNDINGS * size + VANISHING
        assert up[i, 0] - exact[1] <= ROUNDINGS * size + VANISHING
    assert compared > 10


@every_case
def test_what_is_rounded_lies_strictly_within(case):
    """Of points the bounds hold the exact value between them, not at one of them, unless it is a number itself."""
    run, node = program(case)
    low, _ = ends(np.random.default_rng(6), "points", 200)
    down, up = run(low, low)
    strict = 0
    for i in range(len(low)):
        for value in values(node, low[i : i + 1]):
            exact = value.is_exact() and arb(float(value)) == value
            strict += not exact
            assert (exact and down[i, 0] <= float(value) <= up[i, 0]) or arb(down[i, 0]) < value < arb(up[i, 0])
    assert strict > 50 or case in ("constant", "lin1 bare", "least", "most", "size", "signed", "choice", "held")


# Whole expressions: the traces' nodes with their folded constants, and the expressions as they were written.


class Exact:
    """A number of arb that the functions of the algebra take for an array."""

    __array_ufunc__ = None

    def __init__(self, value):
        self.value = value

    def __add__(self, other):
        return Exact(self.value + exact(other))

    def __sub__(self, other):
        return Exact(self.value - exact(other))

    def __mul__(self, other):
        return Exact(self.value * exact(other))

    def __truediv__(self, other):
        return Exact(self.value / exact(other))

    def __rsub__(self, other):
        return Exact(exact(other) - self.value)

    def __neg__(self):
        return Exact(-self.value)

    __radd__, __rmul__ = __add__, __mul__


def exact(x):
    return x.value if isinstance(x, Exact) else arb(float(x))


WRITTEN = {
    **{name: MEANING[name] for name in ("add", "sub", "mul", "scale", "shift", "neg", "from", "square", "div")},
    "sqrt": lambda a, b, k: Exact(exact(a * a + 0.25).sqrt()),
    "sin": lambda a, b, k: Exact(exact(a).sin()),
    "cos": lambda a, b, k: Exact(exact(a).cos()),
    "atan2": lambda a, b, k: Exact(arb.atan2(exact(a), exact(b * b + 0.5))),
    "min": lambda a, b, k: Exact(least(exact(a), exact(b))),
    "max": lambda a, b, k: Exact(most(exact(a), exact(b))),
    "abs": lambda a, b, k: Exact(abs(exact(a))),
}


@given(
    program=steps(list(WRITTEN)),
    seed=st.integers(0, 2**32 - 1),
    wide=st.sampled_from([0.0, 1e-9, 1e-3, 0.3, 3.0, 40.0]),
)
@settings(max_examples=150)
def test_bounds_of_expressions_hold_the_exact_values(program, seed, wide):
    trace = alg.Trace()
    written = list(trace.inputs(3))
    for name, i, j, k in program:
        written.append(MEANING[name](written[i % len(written)], written[j % len(written)], k))
    outputs = written[3:]
    rng = np.random.default_rng(seed)
    low = rng.uniform(-2.0, 2.0, (6, 3))
    high = low + wide * rng.random((6, 3))
    down, up = IntervalProgram(trace, outputs)(low, high)
    points = np.clip(low + (high - low) * np.stack([low * 0, low * 0 + 1, *rng.random((4, 6, 3))]), low, high)
    for i in range(len(low)):
        for point in points[:, i].tolist():
            plain = [Exact(arb(x)) for x in point]
            for name, a, b, k in program:
                plain.append(WRITTEN[name](plain[a % len(plain)], plain[b % len(plain)], k))
            for n, (node, value) in enumerate(zip(outputs, plain[3:], strict=True)):
                folded = exactly(node, [arb(x) for x in point]) if isinstance(node, alg.Term) else arb(node)
                for truth in (folded, value.value):
                    assert not truth < arb(down[i, n]) - VANISHING
                    assert not truth > arb(up[i, n]) + VANISHING


@pytest.mark.parametrize("name", ["rotary_delta", "five_bar", "rus6"])
def test_rates_of_turning_arms_are_bounded_closely(name):
    """Over 10 mm cells about allowed poses: no less than what samples turn, and at most a quarter more (a half was)."""
    machine = load_shipped(name)
    size = np.where(np.array(machine.axis_units) == "mm", 5.0, 0.01)
    poses = machine.home + np.random.default_rng(3).uniform(-10.0, 10.0, (200, len(size))) * size
    poses = poses[machine.check(poses) == 0][:60]
    trace = JumpFreeTrace()
    pose = trace.inputs(len(size))
    joints = machine.trace_inverse(pose, machine.mode)[0]
    down, up = IntervalProgram(trace, [alg.derivative(q, x) for q in joints for x in pose])(poses - size, poses + size)
    samples = poses[:, None] + np.random.default_rng(4).integers(-1, 2, (1, 100, len(size))) * size
    a, b = machine.jacobians(samples)
    seen = np.linalg.solve(b, a).reshape(len(poses), 100, -1)
    assert (seen >= down[:, None] - 1e-12).all() and (seen <= up[:, None] + 1e-12).all()
    assert np.median(np.maximum(np.abs(down), np.abs(up)) / np.abs(seen).max(1)) < 1.25
