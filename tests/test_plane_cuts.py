"""Straight cuts of boxes: shares against exact fractions, bounds of margins against their values, cuts together."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from math import factorial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear
from test_kernels import CORNERS, MEANING, SMOOTH, number

from parakin import algebra as alg
from parakin.kernels.batch import evaluate_tape
from parakin.kernels.tape import compile_tape
from parakin.model.limits import compute_segment_distance
from parakin.workspaces.certified.box_fractions import bound_fraction
from parakin.workspaces.certified.constraints import Constraint
from parakin.workspaces.certified.orientation_boxes import OrientationBoxes, add_cuts, bound_margin
from parakin.workspaces.certified.plane_cuts import (
    CLEARED,
    EXCLUDED,
    KEPT,
    LinearBounds,
    PlaneCuts,
    bound_unions,
    keep_tightest_planes,
)

ROOM = np.empty(3)


def exact_share(b, slopes):
    """Of the box above b + slopes·v: Barrow and Smith's sum over the box's corners, in fractions."""
    w = [abs(Fraction(slope)) for slope in slopes if slope != 0.0]
    if not w:
        return Fraction(int(b >= 0.0))
    total, scale = Fraction(0), factorial(len(w)) * 2 ** len(w)
    for signs in product((1, -1), repeat=len(w)):
        height = Fraction(b) + sum(s * x for s, x in zip(signs, w, strict=True))
        if height > 0:
            total += np.prod(signs) * height ** len(w)
    for x in w:
        scale *= x
    return total / scale


def planes(rng, count):
    """Heights and slopes over a box, many of them touching a corner, level, steep or all but level along an axis."""
    for i in range(count):
        d = 1 + i % 3
        slopes = rng.normal(size=d) * 10.0 ** rng.choice(
            [0, -2, -3.9, -4.1, -9, -300], d, p=[0.6, 0.1, 0.1, 0.1, 0.05, 0.05]
        )
        slopes[rng.random(d) < 0.1] = 0.0
        slopes[rng.random(d) < 0.2] = slopes[0]
        slopes *= 10.0 ** rng.choice([0, 200, -200], p=[0.8, 0.1, 0.1])
        corner = rng.choice([-1.0, 1.0], d) @ slopes
        near = rng.choice([0.0, 1e-16, 1e-9, 1e-5, 1e-2, 1.0]) * rng.normal() * np.abs(slopes).max()
        yield (corner if rng.random() < 0.6 else 0.0) + near, slopes


def test_a_share_of_a_box_is_the_exact_one():
    apart, some = [], 0
    for b, slopes in planes(np.random.default_rng(51), 6000):
        low, high = bound_fraction(b, slopes, ROOM)
        exact = exact_share(b, slopes)
        total = sum(abs(Fraction(slope)) for slope in slopes)
        # A height within roundings of a corner's may count as at it: margins are bounded with room for that.
        if low == 1.0 or high == 0.0:
            assert abs(b) >= total * (1 - Fraction(1, 2**51))
        assert low <= exact or low == 1.0
        assert exact <= high or high == 0.0
        steep = np.abs(slopes).max()
        flat = np.abs(slopes[np.abs(slopes) <= 1e-4 * steep]).sum() / steep if steep else 0.0
        apart.append(high - low - 1.01 * flat)
        some += 0 < exact < 1
    assert some > 3000
    assert max(apart) < 3e-7


def test_a_corner_too_small_for_roundings_is_no_whole_box():
    for size in (1e-6, 1e-9, 1e-12):
        low, high = bound_fraction(3.0 - size, np.ones(3), ROOM)
        assert 0.999 < low < 1.0 <= high
        low, high = bound_fraction(size - 3.0, np.ones(3), ROOM)
        assert low == 0.0 < high < 1e-3


def test_what_is_not_known_leaves_all_open():
    assert bound_fraction(np.nan, np.zeros(2), ROOM) == (0.0, 1.0)
    assert bound_fraction(-np.inf, np.zeros(2), ROOM) == (0.0, 0.0)
    assert bound_fraction(np.inf, np.zeros(2), ROOM) == (1.0, 1.0)


# Straight bounds of margins.

WILD = {  # what is not everywhere, jumps or has poles
    "root": lambda a, b, k: alg.sqrt(a + k),
    "jump": lambda a, b, k: alg.atan2(a, b),
    "over": lambda a, b, k: a / b if isinstance(b, alg.Term) else a,
    "angle": lambda a, b, k: alg.atan2(alg.absolute(a), b),
}
ALL = {**MEANING, **WILD}
STEPS = [name for name in (*SMOOTH, *CORNERS, *WILD) if name != "copysign"]
steps = st.lists(
    st.tuples(st.sampled_from(STEPS), st.integers(0, 99), st.integers(0, 99), number), min_size=2, max_size=12
)


def margin_of(program, count):
    """A margin of ``count`` inputs, and the values it has at points."""
    trace = alg.Trace()
    values = list(trace.inputs(count))
    for name, i, j, k in program:
        values.append(ALL[name](values[-1 - i % min(len(values), 4)], values[j % len(values)], k))
    tape = compile_tape(trace, [values[-1]], count)
    return trace, values[-1], lambda points: evaluate_tape(tape, points, np.empty((len(points), 1)), whole=False)[:, 0]


def assert_bounds_hold(constraint, value, low, size, bottom, top, every, rng, off=1e-9):
    """Compare the bounds with values in random places and turns of the boxes; how many boxes had straight ones."""
    n, d, s = *low.shape, bottom.shape[1]
    items = OrientationBoxes(np.arange(n), bottom, top, np.zeros((n, 0), bool))
    with np.errstate(all="ignore"):
        found = bound_margin(constraint, low, size, items, every)
    middle = 0.5 * (bottom + top)
    for draw in range(60):
        v = rng.uniform(-1, 1, (n, d)) if draw % 4 else rng.choice([-1.0, 0.0, 1.0], (n, d))
        u = rng.uniform(0, 1, (n, s)) if draw % 3 else rng.choice([0.0, 0.5, 1.0], (n, s))
        x, turns = low + 0.5 * size * (1.0 + v), bottom + (top - bottom) * u
        g, g_middle = value(np.hstack([x, turns])), value(np.hstack([x, middle]))
        straight = (found.slopes * v).sum(1)
        room = off * (1.0 + np.abs(straight))
        lower, upper = (g, g_middle) if every else (g_middle, g)
        assert not (lower < straight + found.low - room - off * np.abs(lower)).any()
        assert not (upper > straight + found.high + room + off * np.abs(upper)).any()
        assert not (g[found.state == CLEARED] < -off).any()
        assert not (upper[found.state == EXCLUDED] > off).any()
        for k in range(s):
            for end, side in ((bottom, -1), (top, 1)):
                there = turns.copy()
                there[:, k] = end[:, k]
                least = value(np.hstack([x, there]))
                assert not ((g < least - room - off * np.abs(g)) & (found.least_at[:, k] == side)).any()
    return int((found.slopes != 0.0).any(1).sum())


@pytest.mark.parametrize("every", [True, False])
@given(
    program=steps,
    d=st.integers(1, 3),
    s=st.integers(0, 2),
    seed=st.integers(0, 2**32 - 1),
    wide=st.sampled_from([1e-6, 1e-2, 0.3, 2.0]),
)
@settings(max_examples=120)
def test_straight_bounds_hold_throughout_a_box(every, program, d, s, seed, wide):
    trace, margin, value = margin_of(program, d + s)
    if not isinstance(margin, alg.Term):
        return
    inputs = trace.inputs(d + s)
    constraint = Constraint("drawn", margin, inputs[:d], inputs[d:])
    rng = np.random.default_rng(seed)
    n = 30
    low, bottom = rng.uniform(-2, 2, (n, d)), rng.uniform(-2, 2, (n, s))
    size, more = wide * rng.uniform(0.5, 1, (n, d)), wide * rng.uniform(0, 1, (n, s)) * (rng.random((n, s)) < 0.8)
    off = 1e-9 if wide > 1e-3 else 1e-7
    assert_bounds_hold(constraint, value, low, size, bottom, bottom + more, every, rng, off)


def test_straight_bounds_are_of_the_second_order():
    trace = alg.Trace()
    x, y, turn = trace.inputs(3)
    margin = alg.sqrt(x * x + y * y) * alg.sincos(turn)[1] + alg.atan2(y, x)
    constraint = Constraint("smooth", margin, [x, y], [turn])
    opens = []
    for size in (0.1, 0.01):
        items = OrientationBoxes(np.zeros(1, int), np.full((1, 1), 0.3), np.full((1, 1), 0.3), np.zeros((1, 0), bool))
        found = bound_margin(constraint, np.array([[1.0, 2.0]]), np.full((1, 2), size), items, True)
        opens.append(found.high[0] - found.low[0])
    assert opens[1] < 1.5e-2 * opens[0]


@pytest.mark.parametrize("every", [True, False])
@pytest.mark.parametrize("smooth", [True, False])
def test_the_jump_of_an_angle_is_not_missed(smooth, every, monkeypatch):
    trace = alg.Trace()
    x, y, turn = trace.inputs(3)
    margin = 2.9 - alg.atan2(y + turn, x)
    if not smooth:
        margin = alg.minimum(margin, 5.0 + x)
    tape = compile_tape(trace, [margin], 3)
    rng = np.random.default_rng(52)
    low = np.column_stack([rng.uniform(-3, -2, 300), rng.uniform(-0.3, 0.1, 300)])
    size = rng.uniform(0.05, 0.3, (300, 2))
    bottom, top = np.full((300, 1), -0.05), np.full((300, 1), 0.05)

    def straight(constraint):
        def value(rows):
            return evaluate_tape(tape, rows, np.empty((len(rows), 1)))[:, 0]

        return assert_bounds_hold(constraint, value, low, size, bottom, top, every, rng)

    crossing = (low[:, 1] - 0.05 < 0.0) & (low[:, 1] + size[:, 1] + 0.05 >= 0.0)
    assert 0 < crossing.sum() < 300
    assert straight(Constraint("jumps", margin, [x, y], [turn])) == (~crossing).sum()
    monkeypatch.setattr(Constraint, "guard", 1.0)
    with pytest.raises(AssertionError):
        straight(Constraint("unguarded", margin, [x, y], [turn]))


def test_straight_bounds_of_a_clearance_hold_for_the_least_distance():
    """Also of struts that are parallel somewhere in the box, that cross, and whose nearest points are ends."""
    trace = alg.Trace()
    inputs = trace.inputs(4)
    rng = np.random.default_rng(53)
    kept = 0
    for case in range(12):
        ends = rng.integers(-2, 3, (4, 3)).astype(float)
        if case % 3 == 0:
            ends[3] = ends[2] + (ends[1] - ends[0])  # parallel in the middle
        moves = rng.normal(size=(4, 3, 4)) * (rng.random((4, 1, 1)) < 0.7)
        if min(np.linalg.norm(ends[1] - ends[0]), np.linalg.norm(ends[3] - ends[2])) < 0.5:
            continue
        points = [
            tuple(
                e + sum((float(c) * x for c, x in zip(m, inputs, strict=True)), 0.0)
                for e, m in zip(end, move, strict=True)
            )
            for end, move in zip(ends, moves, strict=True)
        ]
        margin = compute_segment_distance((points[0], points[1]), (points[2], points[3])) - 0.5

        def value(rows, ends=ends, moves=moves):
            a, b, c, d = np.moveaxis(ends + np.einsum("pck,nk->npc", moves, rows), 1, 0)
            return np.array([least_distance(*four) for four in zip(a, b, c, d, strict=True)]) - 0.5

        constraint = Constraint("clearance", margin, inputs[:3], inputs[3:])
        for wide in (0.02, 0.2):
            middle = np.zeros((4, 4)) + rng.uniform(-0.4, 0.4, (4, 4)) * (np.arange(4) > 0)[:, None] * wide
            low, top = middle - 0.5 * wide, middle + 0.5 * wide
            every = case % 2 == 0
            kept += assert_bounds_hold(
                constraint, value, low[:, :3], np.full((4, 3), wide), low[:, 3:], top[:, 3:], every, rng, 1e-6
            )
    assert kept > 20


def least_distance(a, b, c, d):
    """Of two segments: the least of s, t in [0, 1], by bounded least squares."""
    matrix = np.column_stack([b - a, c - d])
    return np.linalg.norm(matrix @ lsq_linear(matrix, c - a, (0, 1), method="bvls", tol=1e-14).x - (c - a))


# Cuts of several limits together.


def linear_bounds(low, high, slopes):
    """Of undecided cells, without angles."""
    n = len(low)
    nothing = np.zeros((n, 0))
    return LinearBounds(np.full(n, KEPT, np.int8), nothing.astype(np.int8), low, high, slopes, nothing)


def test_cuts_together_leave_between_inner_and_outer():
    """Of each limit several items, which must all hold, with a margin somewhere between its straight bounds."""
    rng = np.random.default_rng(54)
    cells, draws = 60, 20_000
    for d in (1, 2, 3):
        cuts = PlaneCuts.start(cells)
        v = rng.uniform(-1, 1, (draws, d))
        good = np.ones((cells, draws), bool)
        for limit in range(3):
            cell = np.sort(np.concatenate([rng.integers(0, cells, 150), rng.integers(0, 20, 20)]))
            n = len(cell)
            base = rng.normal(size=(cells, d))
            slopes = base[cell] + 0.3 * rng.normal(size=(n, d)) * rng.integers(0, 2, (n, 1))
            true = rng.normal(size=n) + 1.5
            low, high = true - rng.exponential(0.1, n), true + rng.exponential(0.1, n)
            low[rng.random(n) < 0.03], high[rng.random(n) < 0.03] = -np.inf, np.inf
            slopes[~(np.isfinite(low) & np.isfinite(high))] = 0.0
            for i, c in enumerate(cell):
                good[c] &= v @ slopes[i] + true[i] >= 0.0
            add_cuts(cuts, limit, cell, np.ones((cells, d)), linear_bounds(low, high, slopes))
        part = good.mean(1)
        sigma = 5.0 * np.sqrt(part * (1.0 - part) / draws) + 1e-3
        shares = cuts.fractions
        assert (shares.inner <= part + sigma).all()
        assert (shares.outer >= part - sigma).all()
        assert (shares.outer - shares.inner).mean() < 0.6
        assert (shares.limit[part < 0.9] >= 0).all()


def test_the_work_is_the_same_however_it_is_divided(monkeypatch):
    """Items of one cell on both sides of where threads part."""
    rng = np.random.default_rng(55)
    n, cells = 9000, 40
    cell = np.sort(rng.integers(0, cells, n))
    height = 3.0 + rng.exponential(0.1, n)
    lines = linear_bounds(height, height + 0.1, rng.normal(size=(n, 2)))
    found = []
    for threads in (1, 2, 7):
        monkeypatch.setattr("parakin.kernels.batch.count_cores", lambda threads=threads: threads)
        monkeypatch.setattr("parakin.kernels.batch.SMALL", 100)
        cuts = PlaneCuts.start(cells)
        add_cuts(cuts, 0, cell, np.ones((cells, 2)), lines)
        found.append((cuts.cut_off, cuts.outer, cuts.cut_off_estimate, cuts.area))
    for other in found[1:]:
        for one, two in zip(found[0], other, strict=True):
            assert np.array_equal(one, two)


def test_leaves_together_leave_no_less_than_their_union():
    rng = np.random.default_rng(56)
    cells, draws = 40, 20_000
    for d in (1, 2, 3):
        v = rng.uniform(-1, 1, (draws, d))
        n = 160
        cell = rng.integers(0, cells, n)
        base = rng.normal(size=(cells, d))
        outer, line = np.ones(n), np.zeros((n, d + 1))
        good = np.ones((n, draws), bool)
        for _ in range(2):
            leaf = np.sort(rng.permutation(n)[:130])
            slopes = base[cell[leaf]] + 0.2 * rng.normal(size=(len(leaf), d))
            high = rng.normal(size=len(leaf))
            keep_tightest_planes(leaf, linear_bounds(high, high, slopes), outer, line)
            good[leaf] &= slopes @ v.T + high[:, None] >= 0.0
        union = np.array([good[cell == c].any(0).mean() if (cell == c).any() else 0.0 for c in range(cells)])
        length = np.linalg.norm(line[:, :-1], axis=1)
        line[length > 0.0] /= length[length > 0.0, None]
        line[length == 0.0, -1] = np.inf
        first = np.full(cells, -1)
        order = np.argsort(outer, kind="stable")
        first[cell[order]] = order
        result = np.empty(cells)
        bound_unions(cell, first, line, outer, result)
        assert (result >= union - 5.0 * np.sqrt(union * (1.0 - union) / draws) - 1e-4).all()
        assert (result[union == 0.0] < 1.0).any()
