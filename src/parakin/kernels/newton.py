"""Newton's method on the legs' closures, many poses side by side: the general direct problem.

A block ends when its slowest lane has converged, but every lane decides for itself which matrix it keeps and where it
stops, so an answer does not depend on the rows that share its block. A lane's matrix is made anew only while that still
matters; its last steps keep it. Where all lanes do, a step costs a tenth. Row exchanges are chosen lane by lane, and
passed over where no lane needs one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array, Flags
from .blocks import find_positive, interpret
from .compiling import njit
from .elementary import FAST, use_widest_vectors
from .lanes import LANES, MASK, allocate_lanes, fetch_to_read, fetch_to_write, load_rows, store_rows

CLOSE = 1e-6  # mm: from a closure this good one more step ends below rounding
WORTH = 1e-4  # mm: where a step will end no worse than this, the matrix at hand serves on
SLOW = 0.05  # a kept matrix that gains less than this a step is made anew
FINE = 1e-12  # mm: where the next step is predicted to end, it is the last
DOUBLE = 0.2  # a new matrix that leaves more than this a step is beside a double root, where each leaves a quarter
PIVOT = 4.0  # how many times greater an entry must be to become the pivot

# Rows of a block's state, where in it they begin. One array holds them: the compiler sees that they are apart, and so
# takes the lanes of a loop over several of them side by side.
WORST, BEFORE, SHRINK, RENEWS, STOPS, STEPS = (LANES * row for row in range(6))


class Factors(NamedTuple):
    """What :func:`factor_matrix` makes of m·m entries a lane.

    matrix, exchanges : (m·m rows) the factored ∂f/∂y, and which lanes exchanged rows
    exchanged : (m·m,) whether any lane did
    determinant : (1 row)
    """

    matrix: Array
    exchanges: Array
    exchanged: Flags
    determinant: Array


class NewtonBlock(NamedTuple):
    """The working arrays of one block, rows of LANES numbers, for m coordinates.

    registers : of the tapes
    point : (m + joints rows) the coordinates and the joints
    near : the rows to start from
    closures : (m rows) f there, then the step
    factors, fresh : of the matrix that each lane goes by, and of one that only some lanes take
    first_determinant : of the first matrix
    bad, holds : what turns NaN in the lanes where a number is not finite, and 1 where all margins are positive
    state : (6 rows) of each lane: its greatest closure, now (WORST) and a step before (BEFORE); the part of its step
        that it takes (SHRINK); whether it wants a new matrix (RENEWS); whether it takes no step any more (STOPS, 2) or
        one (1); how many it took (STEPS)
    """

    registers: Array
    point: Array
    near: Array
    closures: Array
    factors: Factors
    fresh: Factors
    first_determinant: Array
    bad: Array
    holds: Array
    state: Array


class NewtonProblems(NamedTuple):
    """What is given, as :func:`~.batch.solve_by_newton` has it."""

    near: Array
    joints: Array
    side: Array


@njit(inline="always")
def _allocate_factors(m):
    """Allocate the factors of m·m entries."""
    exchanged = np.zeros(m * m, np.bool_)
    return Factors(allocate_lanes(m * m), allocate_lanes(m * m), exchanged, allocate_lanes(1))


@njit(inline="always")
def _allocate_block(tapes, m, joints, given):
    """Allocate the working arrays for m coordinates, from starts of ``given`` numbers."""
    registers = max(
        max(tapes.begin.registers, tapes.closures_and_slopes.registers),
        max(tapes.closures.registers, tapes.end.registers),
    )
    r, point, near, closures = (
        allocate_lanes(registers), allocate_lanes(m + joints), allocate_lanes(given), allocate_lanes(m),
    )  # fmt: skip
    factors, fresh = _allocate_factors(m), _allocate_factors(m)
    first, bad, holds, state = allocate_lanes(1), allocate_lanes(1), allocate_lanes(1), allocate_lanes(6)
    return NewtonBlock(r, point, near, closures, factors, fresh, first, bad, holds, state)


@njit(inline="always")
def copy_lanes(a, i, b, j, rows):
    """Copy rows from the i-th of ``a`` to the j-th on of ``b``; a slice would take seconds to compile."""
    s, t = (i & MASK) * LANES, (j & MASK) * LANES
    for c in range(rows * LANES):
        b[t + c] = a[s + c]


@njit(allocates=False, nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def factor_matrix(factors, m):
    """Factor the matrix of :class:`Factors` by rows, in place: multipliers below, reciprocal pivots on the diagonal.

    ``exchanges`` becomes 1 where a lane exchanged rows k and i at k·m + i.
    """
    use_widest_vectors()
    a, exchanges, exchanged, determinant = factors.matrix, factors.exchanges, factors.exchanged, factors.determinant
    determinant[:] = 1.0
    for k in range(m):
        p = ((k * m + k) & MASK) * LANES
        for i in range(k + 1, m):
            q = ((i * m + k) & MASK) * LANES
            w = ((k * m + i) & MASK) * LANES
            count = 0.0
            for j in range(LANES):
                swap = 1.0 if abs(a[q + j]) > PIVOT * abs(a[p + j]) else 0.0
                exchanges[w + j] = swap
                count = max(count, swap)
            exchanged[k * m + i] = count > 0.0
            if count > 0.0:
                for j in range(LANES):
                    determinant[j] = -determinant[j] if exchanges[w + j] > 0.0 else determinant[j]
                for c in range(k, m):
                    s, t = ((k * m + c) & MASK) * LANES, ((i * m + c) & MASK) * LANES
                    for j in range(LANES):
                        x, y = a[s + j], a[t + j]
                        a[s + j] = y if exchanges[w + j] > 0.0 else x
                        a[t + j] = x if exchanges[w + j] > 0.0 else y
        for j in range(LANES):
            determinant[j] *= a[p + j]
            a[p + j] = 1.0 / a[p + j]
        for i in range(k + 1, m):
            q = ((i * m + k) & MASK) * LANES
            for j in range(LANES):
                a[q + j] *= a[p + j]
            for c in range(k + 1, m):
                s, t = ((k * m + c) & MASK) * LANES, ((i * m + c) & MASK) * LANES
                for j in range(LANES):
                    a[t + j] -= a[q + j] * a[s + j]


@njit(allocates=False, nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def solve_factored(factors, m, f):
    """Solve with the factors of :func:`factor_matrix`: ``f`` (m·LANES,) becomes the solution."""
    use_widest_vectors()
    a, exchanges, exchanged = factors.matrix, factors.exchanges, factors.exchanged
    for k in range(m):
        fk = (k & MASK) * LANES
        for i in range(k + 1, m):
            if exchanged[k * m + i]:
                fi, w = (i & MASK) * LANES, ((k * m + i) & MASK) * LANES
                for j in range(LANES):
                    x, y = f[fk + j], f[fi + j]
                    f[fk + j] = y if exchanges[w + j] > 0.0 else x
                    f[fi + j] = x if exchanges[w + j] > 0.0 else y
        for i in range(k + 1, m):
            fi, q = (i & MASK) * LANES, ((i * m + k) & MASK) * LANES
            for j in range(LANES):
                f[fi + j] -= a[q + j] * f[fk + j]
    for k in range(m - 1, -1, -1):
        fk, p = (k & MASK) * LANES, ((k * m + k) & MASK) * LANES
        for c in range(k + 1, m):
            s, fc = ((k * m + c) & MASK) * LANES, (c & MASK) * LANES
            for j in range(LANES):
                f[fk + j] -= a[s + j] * f[fc + j]
        for j in range(LANES):
            f[fk + j] *= a[p + j]


@njit(inline="always")
def evaluate_closures(tape, m, block):
    """Evaluate a tape that gives m closures first, and the greatest of each lane."""
    r, f, state = block.registers, block.closures, block.state
    copy_lanes(block.point, 0, r, 0, tape.inputs)
    interpret(tape.code, tape.constants, r)
    for j in range(LANES):
        state[WORST + j] = 0.0
    for i in range(m):
        s, t = ((tape.inputs + i) & MASK) * LANES, (i & MASK) * LANES
        for j in range(LANES):
            v = r[s + j]
            f[t + j] = v
            state[WORST + j] = abs(v) if (abs(v) > state[WORST + j]) | (v != v) else state[WORST + j]


@njit(inline="always")
def _take_step(m, caps, block):
    """Take the step in ``closures`` from ``point``, shrunk where a coordinate would change by too much."""
    f, point, state = block.closures, block.point, block.state
    for j in range(LANES):
        state[SHRINK + j] = 0.0 if (state[WORST + j] < FINE) | (state[STOPS + j] > 1.5) else 1.0
    for i in range(m):
        s = (i & MASK) * LANES
        for j in range(LANES):
            over = abs(f[s + j]) * state[SHRINK + j]
            state[SHRINK + j] = state[SHRINK + j] * (caps[i] / over) if over > caps[i] else state[SHRINK + j]
    for i in range(m):
        s = (i & MASK) * LANES
        for j in range(LANES):
            point[s + j] -= state[SHRINK + j] * f[s + j] if state[SHRINK + j] > 0.0 else 0.0


@njit(inline="always")
def _blend_lanes(state, a, b, s):
    """Copy a row of ``a`` to ``b`` in the lanes that want a new matrix."""
    for j in range(LANES):
        x, y = a[s + j], b[s + j]
        b[s + j] = x if state[RENEWS + j] > 0.0 else y


@njit(inline="always")
def _update_matrix(full, m, block, apart):
    """Factor the slopes that the tape left, for the lanes that want it; with ``apart`` the others keep their matrix."""
    own, fresh, state = block.factors, block.fresh, block.state
    target = fresh if apart else own
    copy_lanes(block.registers, full.inputs + m, target.matrix, 0, m * m)
    factor_matrix(target, m)
    if apart:
        for i in range(m * m):
            own.exchanged[i] |= fresh.exchanged[i]
            s = (i & MASK) * LANES
            _blend_lanes(state, fresh.matrix, own.matrix, s)
            _blend_lanes(state, fresh.exchanges, own.exchanges, s)
        _blend_lanes(state, fresh.determinant, own.determinant, 0)


@njit(inline="always")
def _choose_next_matrix(limits, block, n, step):
    """Decide for each lane whether its next matrix is a new one, and whether it stops; returns how many go on.

    A lane whose closures are NaN stops. One whose last step did not close the legs goes on.
    """
    state, worth, closed = block.state, WORTH * limits.size, limits.closed
    for j in range(LANES):
        w, before, stops = state[WORST + j], state[BEFORE + j], state[STOPS + j]
        new = state[RENEWS + j] > 0.0
        slow, double = w > SLOW * before, (w > DOUBLE * before) & (w > closed)
        anew = (w * w > worth) | double if new else slow
        enough = (w < CLOSE) & (not double) if new else (w * w < FINE * before) & (not slow)
        going = ((stops < 0.5) | ((stops < 1.5) & (w > closed))) & (w == w)
        state[STEPS + j] = step if stops < 1.5 else state[STEPS + j]
        state[RENEWS + j] = 1.0 if going & anew else 0.0
        state[STOPS + j] = (1.0 if enough else 0.0) if going else 2.0
        state[BEFORE + j] = w
    count = 0
    for j in range(n):
        count += 1 if state[STOPS + j] < 1.5 else 0
    return count


@njit(inline="always")
def solve_block(tapes, limits, m, block, n):
    """Run Newton's method on one block, from its point to the root."""
    full, state = tapes.closures_and_slopes, block.state
    for j in range(LANES):
        state[RENEWS + j] = 1.0
        state[BEFORE + j] = np.inf
        state[STOPS + j] = 0.0 if j < n else 2.0
    for step in range(limits.most + 1):
        wanted = 0
        for j in range(n):
            wanted += 1 if state[RENEWS + j] > 0.0 else 0
        evaluate_closures(full if wanted > 0 else tapes.closures, m, block)
        if wanted > 0:
            _update_matrix(full, m, block, wanted < n)
            if step == 0:
                copy_lanes(block.factors.determinant, 0, block.first_determinant, 0, 1)
        if _choose_next_matrix(limits, block, n, step) == 0:
            return
        solve_factored(block.factors, m, block.closures)
        _take_step(m, limits.caps, block)


@njit(inline="always")
def _load_start(m, near, q, row, stop, block):
    """Load the starts and joints ``q`` of a block; returns how many rows it has. A single start counts for all."""
    r, bad, given, joints = block.registers, block.bad, near.shape[1], q.shape[1]
    n = min(LANES, stop - row)
    bad[:] = 0.0
    if near.shape[0] == 1:
        for i in range(given):
            for j in range(LANES):
                r[i * LANES + j] = near[0, i]
    else:
        load_rows(near, row, n, given, r, bad)
        fetch_to_read(near, row + LANES, stop)
    load_rows(q, row, n, given + joints, r, bad)
    fetch_to_read(q, row + LANES, stop)
    copy_lanes(r, given, block.point, m, joints)
    copy_lanes(r, 0, block.near, 0, given)
    return n


@njit(inline="always")
def _evaluate_end(end, m, width, block):
    """Evaluate the last tape: ``width`` outputs of the answer, then margins."""
    r, bad, point, joints = block.registers, block.bad, block.point, block.point.shape[0] // LANES - m
    copy_lanes(point, 0, r, 0, m + joints)
    copy_lanes(block.near, 0, r, m + joints, end.inputs - m - joints)
    interpret(end.code, end.constants, r)
    for i in range(end.inputs, end.inputs + width):
        s = (i & MASK) * LANES
        for j in range(LANES):
            bad[j] += 0.0 * r[s + j]
    find_positive(r, end.inputs + width, end.inputs + end.outputs, block.holds)


@njit(inline="always")
def _store_roots(settling, closed, side, block, roots, row, n):
    """Store what is known of a block's roots besides their rows."""
    residual, steps, turned, settled = roots.residual, roots.steps, roots.turned, roots.settled
    bad, holds, state = block.bad, block.holds, block.state
    first, determinant = block.first_determinant, block.factors.determinant
    for j in range(n):
        start = first[j] if side.shape[0] == 0 else side[0 if side.shape[0] == 1 else row + j]
        worst, change, product = state[WORST + j] + bad[j], abs(determinant[j] - first[j]), determinant[j] * start
        steps[row + j], turned[row + j], residual[row + j] = int(state[STEPS + j]), product, worst
        settled[row + j] = (
            (holds[j] > 0.0)
            & (worst <= closed)
            & (product > settling.turned)
            & (change <= settling.steady * abs(first[j]))
            & (state[STEPS + j] <= settling.steps)
        )


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def solve_newton(tapes, limits, near, q, side, roots, start, stop):
    """Solve f(y, q) = 0 for rows start ≤ i < stop of ``q``; see :func:`~.batch.solve_by_newton`.

    tapes : :class:`~.tape.NewtonTapes`; limits : :class:`~.batch.NewtonSteps`
    near : (N or 1, k) starts; side : (N,), (1,) or (0,)
    roots : :class:`~.batch.Roots`, overwritten
    """
    block = _allocate_block(tapes, limits.caps.shape[0], q.shape[1], near.shape[1])
    problems = NewtonProblems(near, q, side)
    for row in range(start, stop, LANES):
        _solve_rows(tapes, limits, problems, roots, block, row, stop)


@njit(allocates=False, nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _solve_rows(tapes, limits, problems, roots, block, row, stop):
    """Solve one block of rows, from ``row`` on."""
    use_widest_vectors()
    m, begin, end = limits.caps.shape[0], tapes.begin, tapes.end
    n = _load_start(m, problems.near, problems.joints, row, stop, block)
    fetch_to_write(roots.rows, row, stop)
    interpret(begin.code, begin.constants, block.registers)
    copy_lanes(block.registers, begin.inputs, block.point, 0, m)
    solve_block(tapes, limits, m, block, n)
    _evaluate_end(end, m, roots.rows.shape[1], block)
    store_rows(roots.rows, row, n, end.inputs, block.registers, block.bad)
    _store_roots(limits.settling, limits.closed, problems.side, block, roots, row, n)
