"""Elementary functions, traces, their derivatives, tapes and intervals, each against plain arithmetic."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numba import njit

from parakin import algebra as alg
from parakin.kernels import numba_turns
from parakin.kernels.batch import evaluate_tape, find_first_negative
from parakin.kernels.intervals import IntervalProgram
from parakin.kernels.kernel import find_kernel
from parakin.kernels.tape import compile_tape
from parakin.kernels.tape_rows import write_rows


@njit
def scalar_angles(y, x):
    out = np.empty_like(x)
    for i in range(len(x)):
        out[i] = numba_turns.atan2(y[i], x[i])
    return out


@njit
def scalar_turns(x):
    s, c = np.empty_like(x), np.empty_like(x)
    for i in range(len(x)):
        s[i], c[i] = numba_turns.sincos(x[i])
    return s, c


def evaluated(function, *columns):
    """A function of terms, by compiled code; NumPy gives the same bits."""
    trace = alg.Trace()
    outputs = function(*trace.inputs(len(columns)))
    tape = compile_tape(trace, outputs, len(columns))
    rows = np.column_stack(columns)
    by_numpy = evaluate_tape(tape, rows[:999], np.empty((len(rows[:999]), len(outputs))), whole=False)
    find_kernel(write_rows, tape, (len(columns),), False).expect(1 << 60)
    out = evaluate_tape(tape, rows, np.empty((len(rows), len(outputs))), whole=False)
    assert np.array_equal(by_numpy, out[:999], equal_nan=True)
    return out.T


def angles(y, x):
    by_scalars, (found,) = scalar_angles(y, x), evaluated(lambda y, x: [alg.atan2(y, x)], y, x)
    assert np.allclose(by_scalars, found, rtol=4e-16, atol=4e-16, equal_nan=True)
    return found


def turns(x):
    by_scalars, found = scalar_turns(x), evaluated(alg.sincos, x)
    assert np.allclose(by_scalars, found, rtol=4e-16, atol=4e-16, equal_nan=True)
    return found


def test_sine_and_cosine_are_libms():
    rng = np.random.default_rng(31)
    quarter = np.arange(-6000, 6000) * (np.pi / 2)
    small = rng.normal(size=999) * 1e-9
    x = np.concatenate([rng.uniform(-10, 10, 600_000), rng.uniform(-1e4, 1e4, 400_000), quarter, small])
    s, c = turns(x)
    assert np.abs(s - np.sin(x)).max() <= 4e-16
    assert np.abs(c - np.cos(x)).max() <= 4e-16
    small = np.array([1e-300, 1e-20, 1e-8, 3e-5])
    assert np.allclose(turns(small)[0], np.sin(small), rtol=1e-15, atol=0)
    far = rng.uniform(1e4, 1e5, 10_000)
    assert np.abs(np.array(turns(far)) - [np.sin(far), np.cos(far)]).max() < 1e-13


@pytest.mark.parametrize("x", [1.0001e5, -2e5, 1e18, 1e300, math.inf, -math.inf, math.nan])
def test_angles_too_great_to_reduce_are_not_numbers(x):
    assert np.isnan(turns(np.array([x]))).all()


def test_the_angle_of_a_vector_is_libms():
    rng = np.random.default_rng(32)
    y, x = rng.normal(size=(2, 1_000_000)) * 10.0 ** rng.uniform(-8, 8, (2, 1_000_000))
    y[:1000], x[1000:2000] = 0.0, 0.0
    y[2000:3000] = x[2000:3000]
    expected = np.arctan2(y, x)
    assert (np.abs(angles(y, x) - expected) / np.maximum(1.0, np.abs(expected))).max() <= 4e-16
    tiny = np.abs(y) < 1e-3 * x
    assert (np.abs(angles(y, x) - expected)[tiny] <= 5e-16 * np.abs(expected[tiny])).all()


def test_special_angles():
    zero, one = np.array([0.0, -0.0]), np.ones(2)
    for y in (zero, -zero):
        for x in (zero, -zero):
            assert (angles(y, x) == 0.0).all()
    assert (angles(zero, one) == 0.0).all()
    assert (angles(zero, -one) == np.pi).all()  # whatever the zero's sign: (-π, π]
    assert (angles(one, zero) == np.pi / 2).all()
    assert (angles(-one, zero) == -np.pi / 2).all()
    for bad in (math.nan, math.inf, -math.inf):
        for pair in ((bad, 1.0), (1.0, bad), (bad, bad), (bad, 0.0), (0.0, bad)):
            assert np.isnan(angles(*np.array(pair)[:, None])).all()
    assert angles(np.array([1e-300]), np.array([1e-300]))[0] == pytest.approx(np.pi / 4)
    assert angles(np.array([1e300]), np.array([1e300]))[0] == pytest.approx(np.pi / 4)


# Random expressions: a list of steps, each on inputs and on what stands before it; read by numbers and by traces alike.

SMOOTH = ["add", "sub", "mul", "scale", "shift", "div", "sqrt", "sin", "cos", "atan2", "square", "neg", "from"]
CORNERS = ["min", "max", "abs", "copysign"]
number = st.floats(-3.0, 3.0).map(lambda v: round(v, 3))


def steps(names):
    step = st.tuples(st.sampled_from(names), st.integers(0, 99), st.integers(0, 99), number)
    return st.lists(step, min_size=1, max_size=14)


MEANING = {
    "add": lambda a, b, k: a + b,
    "sub": lambda a, b, k: a - b,
    "mul": lambda a, b, k: a * b,
    "scale": lambda a, b, k: a * k,
    "shift": lambda a, b, k: a + k,
    "neg": lambda a, b, k: -a,
    "from": lambda a, b, k: k - a,
    "square": lambda a, b, k: a * a,
    "div": lambda a, b, k: a / (b * b + 0.5),
    "sqrt": lambda a, b, k: alg.sqrt(a * a + 0.25),
    "sin": lambda a, b, k: alg.sincos(a)[0],
    "cos": lambda a, b, k: alg.sincos(a)[1],
    "atan2": lambda a, b, k: alg.atan2(a, b * b + 0.5),
    "min": lambda a, b, k: alg.minimum(a, b),
    "max": lambda a, b, k: alg.maximum(a, b),
    "abs": lambda a, b, k: alg.absolute(a),
    "copysign": lambda a, b, k: alg.copysign(a, b),
}


def expression(inputs, program):
    """The values that a program makes of its inputs, numbers, arrays or terms."""
    values = list(inputs)
    for name, i, j, k in program:
        values.append(MEANING[name](values[i % len(values)], values[j % len(values)], k))
    return values[len(inputs) :]


points = st.integers(0, 2**32 - 1).map(lambda seed: np.random.default_rng(seed).uniform(-2.0, 2.0, (40, 3)))


def traced(program):
    trace = alg.Trace()
    inputs = trace.inputs(3)
    return trace, inputs, expression(inputs, program)


@given(program=steps(SMOOTH + CORNERS), rows=points)
@settings(max_examples=150)
def test_arrays_numbers_and_tapes_agree(program, rows):
    trace, _, outputs = traced(program)
    arrays = [np.broadcast_to(v, len(rows)) for v in expression(rows.T, program)]
    expected = np.stack(arrays, -1)
    one = [float(v) for v in expression(rows[0].tolist(), program)]
    assume(np.abs(expected).max() < 1e4)
    assert np.allclose(one, expected[0], rtol=1e-12, atol=1e-12)
    flips = np.zeros_like(expected, bool)
    if any(name == "copysign" for name, *_ in program):  # a sign may hang on a rounding's
        flips = np.broadcast_to((np.abs(expected) < 1e-9).any(1, keepdims=True), expected.shape)
    found = evaluate_tape(compile_tape(trace, outputs, 3), rows, np.empty(expected.shape))
    assert np.allclose(found[~flips], expected[~flips], rtol=1e-10, atol=1e-10)


@given(program=steps(SMOOTH), rows=points)
@settings(max_examples=150)
def test_derivatives_are_those_of_central_differences(program, rows):
    trace, inputs, outputs = traced(program)
    exact = compile_tape(trace, [alg.derivative(outputs[-1], x) for x in inputs], 3)
    found = evaluate_tape(exact, rows, np.empty((len(rows), 3)))

    def value(at):
        return np.broadcast_to(expression(at.T, program)[-1], len(at))

    h = 1e-3
    for i, step in enumerate(np.eye(3)):
        slopes = []
        for w in (h * step, 0.5 * h * step):
            one, two = value(rows + w) - value(rows - w), value(rows + 2.0 * w) - value(rows - 2.0 * w)
            slopes.append((8.0 * one - two) / (12.0 * w.max()))
        size = 1.0 + np.abs(slopes[0])
        good = np.abs(slopes[0] - slopes[1]) < 1e-8 * size
        assert (np.abs(found[:, i] - slopes[1])[good] < 1e-6 * size[good]).all()


@given(
    program=steps([*SMOOTH, "min", "max"]),
    seed=st.integers(0, 2**32 - 1),
    wide=st.sampled_from([0.0, 1e-3, 0.3, 3.0, 40.0]),
)
@settings(max_examples=200)
def test_bounds_hold_for_every_point_of_a_box(program, seed, wide):
    trace, _, outputs = traced(program)
    rng = np.random.default_rng(seed)
    low = rng.uniform(-2.0, 2.0, (20, 3))
    high = low + wide * rng.random((20, 3))
    bounds = IntervalProgram(trace, outputs)(low, high)
    inside = low + (high - low) * np.concatenate([np.zeros((1, 20, 3)), np.ones((1, 20, 3)), rng.random((40, 20, 3))])
    inside = np.minimum(inside, high)
    values = expression(np.moveaxis(inside, -1, 0), program)
    for i, value in enumerate(values):
        size = 1e-13 * (1.0 + np.abs(value))  # the plain evaluation's own rounding
        assert (bounds[0][:, i] <= value + size).all()
        assert (bounds[1][:, i] >= value - size).all()


@pytest.mark.parametrize(
    ("low", "high", "bottom", "top"),
    [
        (0.0, 1.0, 0.0, math.sin(1.0)),
        (-1.0, 4.0, math.sin(-1.0), 1.0),
        (0.0, 7.0, -1.0, 1.0),
        (1.5, 1.6, math.sin(1.5), 1.0),
        (-1e3, 1e3, -1.0, 1.0),
        (4.0, 5.0, -1.0, math.sin(4.0)),
        (2.0, 3.0, math.sin(3.0), math.sin(2.0)),
    ],
)
@pytest.mark.parametrize("function", [0, 1])
def test_sine_over_an_interval_is_tight(low, high, bottom, top, function):
    trace = alg.Trace()
    shift = 0.5 * np.pi * function
    program = IntervalProgram(trace, [alg.sincos(trace.input(0))[function]])
    down, up = program(np.array([[low - shift]]), np.array([[high - shift]]))
    assert down[0, 0] == pytest.approx(bottom, abs=1e-14)
    assert up[0, 0] == pytest.approx(top, abs=1e-14)
    assert -1.0 <= down[0, 0] <= up[0, 0] <= 1.0


@pytest.mark.parametrize("what", ["quotient", "product", "root", "square"])
@pytest.mark.parametrize("low", [[-1.0, -1.0], [0.0, -1.0], [0.0, 0.0]])
def test_bounds_at_the_edges_of_definition(what, low):
    trace = alg.Trace()
    x, y = trace.inputs(2)
    output = {"quotient": x / y, "product": (x / y) * x, "root": alg.sqrt(x), "square": x * x}[what]
    high = [2.0, 1.0]
    with np.errstate(all="ignore"):
        down, up = IntervalProgram(trace, [output])(np.array([low]), np.array([high]))
        a, b = np.random.default_rng(33).uniform(low, high, (10_000, 2)).T
        a[:9] = low[0]
        value = {"quotient": a / b, "product": a / b * a, "root": np.sqrt(a), "square": a * a}[what]
    value = value[np.isfinite(value)]
    assert (down[0, 0] <= value).all()
    assert (up[0, 0] >= value).all()


@pytest.mark.parametrize("widths", [(1, 0), (2, 9), (3, 1), (4, 10), (5, 2), (6, 7), (7, 8), (8, 3), (9, 4), (10, 5)])
def test_rows_of_any_width_go_to_their_registers_and_back(widths):
    first, second = widths
    trace = alg.Trace()
    tape = compile_tape(trace, [2.0 * x for x in trace.inputs(first + second)], first + second)
    rows = np.random.default_rng(35).uniform(-1.0, 1.0, (300, first + second))
    out = np.empty_like(rows)
    evaluate_tape(tape, rows[:, :first].copy(), out, rows[:, first:].copy())
    assert np.array_equal(out, 2.0 * rows)
    for column in range(first + second):  # in whole blocks and in the last one
        rows[17 + column, column] = rows[270 + column, column] = np.nan
    evaluate_tape(tape, rows[:, :first].copy(), out, rows[:, first:].copy())
    assert np.array_equal(np.isnan(out), np.repeat(np.isnan(rows).any(1)[:, None], first + second, axis=1))


def test_blocks_of_any_length_and_rows_that_are_not_numbers():
    trace = alg.Trace()
    x, y = trace.inputs(2)
    tape = compile_tape(trace, [alg.sqrt(x), x * y], 2)
    for count in (0, 1, 127, 128, 129, 1000, 9000):
        rows = np.random.default_rng(34).uniform(0.1, 2, (count, 2))
        clean = evaluate_tape(tape, rows, np.empty((count, 2)))
        assert np.allclose(clean, np.column_stack([np.sqrt(rows[:, 0]), rows[:, 0] * rows[:, 1]]), rtol=1e-15)
        if count > 100:
            rows[50, 1], rows[60, 0], rows[70, 0] = np.nan, np.inf, -1.0
            dirty = evaluate_tape(tape, rows, np.empty((count, 2)))
            assert np.isnan(dirty[[50, 60, 70]]).all()
            rest = np.setdiff1d(np.arange(count), [50, 60, 70])
            assert np.array_equal(dirty[rest], clean[rest])
            first = find_first_negative(tape, rows, np.empty((count, 0)))
            assert (first[[50, 60, 70]] > 0).all()
            assert first[70] == 1
            assert not first[rest].any()
