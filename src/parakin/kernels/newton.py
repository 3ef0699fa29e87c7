"""Newton's method on the legs' closures, many poses side by side: the general direct problem.

Every lane takes the same steps, so a block ends when its slowest lane has converged. The matrix is factored only while
it still matters; the last steps keep it (a chord step costs a tenth). Row exchanges are chosen lane by lane, and passed
over where no lane needs one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array, Flags
from .blocks import _MASK, LANES, allocate_lanes, fetch_to_read, fetch_to_write, interpret, load_rows, store_rows
from .compiling import njit
from .elementary import FAST, use_widest_vectors

CLOSE = 1e-6  # mm: from a closure this good one more step ends below rounding
WORTH = 1e-4  # mm: where a step will end no worse than this, the matrix at hand serves on
SLOW = 0.05  # a kept matrix that gains less than this a step is made anew
FINE = 1e-12  # mm: where the next step is predicted to end, it is the last
PIVOT = 4.0  # how many times greater an entry must be to become the pivot


class NewtonBlock(NamedTuple):
    """The working arrays of one block, rows of LANES numbers, for m coordinates.

    registers : of the tapes
    point : (m + joints rows) the coordinates and the joints
    closures : (m rows) f there, then the step
    matrix, exchanges : (m·m rows) the factored ∂f/∂y, and which lanes exchanged rows
    exchanged : (m·m,) whether any lane did
    determinant, first_determinant : of the last and the first matrix
    worst : the greatest closure of each lane
    shrink : the part of its step that a lane takes
    """

    registers: Array
    point: Array
    closures: Array
    matrix: Array
    exchanges: Array
    exchanged: Flags
    determinant: Array
    first_determinant: Array
    worst: Array
    shrink: Array


@njit(nogil=True, cache=True)
def _allocate_block(tapes, m, joints):
    """Allocate the working arrays for m coordinates."""
    registers = max(
        max(tapes.begin.registers, tapes.closures_and_slopes.registers),
        max(tapes.closures.registers, tapes.end.registers),
    )
    r, point = allocate_lanes(registers), allocate_lanes(m + joints)
    matrix, exchanges, closures = allocate_lanes(m * m), allocate_lanes(m * m), allocate_lanes(m)
    exchanged = np.zeros(m * m, np.bool_)
    determinant, first, worst, shrink = allocate_lanes(1), allocate_lanes(1), allocate_lanes(1), allocate_lanes(1)
    return NewtonBlock(r, point, closures, matrix, exchanges, exchanged, determinant, first, worst, shrink)


@njit(nogil=True, cache=True)
def copy_lanes(a, i, b, j, rows):
    """Copy rows from the i-th of ``a`` to the j-th on of ``b``; a slice would take seconds to compile."""
    s, t = (i & _MASK) * LANES, (j & _MASK) * LANES
    for c in range(rows * LANES):
        b[t + c] = a[s + c]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def factor_matrix(a, m, exchanges, exchanged, determinant):
    """Factor ``a`` (m·m·LANES,), row by row, in place: multipliers below, reciprocal pivots on the diagonal.

    ``exchanges`` (m·m·LANES,) is 1 where a lane exchanged rows k and i at k·m + i, ``exchanged`` (m·m,) where any did;
    ``determinant`` (LANES,) becomes the matrix's.
    """
    use_widest_vectors()
    determinant[:] = 1.0
    for k in range(m):
        p = ((k * m + k) & _MASK) * LANES
        for i in range(k + 1, m):
            q = ((i * m + k) & _MASK) * LANES
            w = ((k * m + i) & _MASK) * LANES
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
                    s, t = ((k * m + c) & _MASK) * LANES, ((i * m + c) & _MASK) * LANES
                    for j in range(LANES):
                        x, y = a[s + j], a[t + j]
                        a[s + j] = y if exchanges[w + j] > 0.0 else x
                        a[t + j] = x if exchanges[w + j] > 0.0 else y
        for j in range(LANES):
            determinant[j] *= a[p + j]
            a[p + j] = 1.0 / a[p + j]
        for i in range(k + 1, m):
            q = ((i * m + k) & _MASK) * LANES
            for j in range(LANES):
                a[q + j] *= a[p + j]
            for c in range(k + 1, m):
                s, t = ((k * m + c) & _MASK) * LANES, ((i * m + c) & _MASK) * LANES
                for j in range(LANES):
                    a[t + j] -= a[q + j] * a[s + j]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def solve_factored(a, m, exchanges, exchanged, f):
    """Solve with what :func:`factor_matrix` left: ``f`` (m·LANES,) becomes the solution."""
    use_widest_vectors()
    for k in range(m):
        fk = (k & _MASK) * LANES
        for i in range(k + 1, m):
            if exchanged[k * m + i]:
                fi, w = (i & _MASK) * LANES, ((k * m + i) & _MASK) * LANES
                for j in range(LANES):
                    x, y = f[fk + j], f[fi + j]
                    f[fk + j] = y if exchanges[w + j] > 0.0 else x
                    f[fi + j] = x if exchanges[w + j] > 0.0 else y
        for i in range(k + 1, m):
            fi, q = (i & _MASK) * LANES, ((i * m + k) & _MASK) * LANES
            for j in range(LANES):
                f[fi + j] -= a[q + j] * f[fk + j]
    for k in range(m - 1, -1, -1):
        fk, p = (k & _MASK) * LANES, ((k * m + k) & _MASK) * LANES
        for c in range(k + 1, m):
            s, fc = ((k * m + c) & _MASK) * LANES, (c & _MASK) * LANES
            for j in range(LANES):
                f[fk + j] -= a[s + j] * f[fc + j]
        for j in range(LANES):
            f[fk + j] *= a[p + j]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def evaluate_closures(tape, m, block, n):
    """Evaluate a tape that gives m closures first; returns the greatest of the block's first n lanes."""
    r, f, worst = block.registers, block.closures, block.worst
    copy_lanes(block.point, 0, r, 0, tape.inputs)
    interpret(tape.code, tape.constants, r)
    worst[:] = 0.0
    for i in range(m):
        s, t = ((tape.inputs + i) & _MASK) * LANES, (i & _MASK) * LANES
        for j in range(LANES):
            v = r[s + j]
            f[t + j] = v
            worst[j] = abs(v) if (abs(v) > worst[j]) | (v != v) else worst[j]
    greatest = 0.0
    for j in range(n):
        greatest = worst[j] if worst[j] > greatest else greatest  # false for NaN: such a lane is done
    return greatest


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _take_step(m, caps, block):
    """Take the step that stands in ``closures`` from ``point``, shrunk where a coordinate would change by too much."""
    f, shrink, point, worst = block.closures, block.shrink, block.point, block.worst
    for j in range(LANES):  # a lane that is done stays: beside a slow one it would take steps of pure rounding
        shrink[j] = 0.0 if worst[j] < FINE else 1.0
    for i in range(m):
        s = (i & _MASK) * LANES
        for j in range(LANES):
            over = abs(f[s + j]) * shrink[j]
            shrink[j] = shrink[j] * (caps[i] / over) if over > caps[i] else shrink[j]
    for i in range(m):
        s = (i & _MASK) * LANES
        for j in range(LANES):
            point[s + j] -= shrink[j] * f[s + j] if shrink[j] > 0.0 else 0.0


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def solve_block(tapes, limits, m, block, n):
    """Run Newton's method on one block, from its point to the root; returns the number of steps."""
    full = tapes.closures_and_slopes
    refactor, last = True, False
    before = np.inf
    for step in range(limits.most + 1):
        if refactor:
            greatest = evaluate_closures(full, m, block, n)
            copy_lanes(block.registers, full.inputs + m, block.matrix, 0, m * m)
            factor_matrix(block.matrix, m, block.exchanges, block.exchanged, block.determinant)
            if step == 0:
                copy_lanes(block.determinant, 0, block.first_determinant, 0, 1)
            refactor = greatest * greatest > WORTH * limits.size
            enough = greatest < CLOSE
        else:
            greatest = evaluate_closures(tapes.closures, m, block, n)
            ratio = greatest / before
            refactor = ratio > SLOW
            enough = (ratio <= SLOW) & (greatest * ratio < FINE)
        if last or step == limits.most:
            return step
        last = enough
        before = greatest
        solve_factored(block.matrix, m, block.exchanges, block.exchanged, block.closures)
        _take_step(m, limits.caps, block)
    return limits.most


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _load_start(tapes, near, q, row, stop, block, bad):
    """Load the coordinates and joints of a block into its point; returns how many rows it has."""
    r, m, given, joints = block.registers, tapes.begin.outputs, near.shape[1], q.shape[1]
    n = min(LANES, stop - row)
    bad[:] = 0.0
    if near.shape[0] == 1:
        for i in range(given):
            r[i * LANES : (i + 1) * LANES] = near[0, i]
    else:
        load_rows(near, row, n, 0, r, bad)
    load_rows(q, row, n, m, block.point, bad)
    copy_lanes(block.point, m, r, given, joints)
    fetch_to_read(q, row + LANES, stop)
    if near.shape[0] != 1:
        fetch_to_read(near, row + LANES, stop)
    return n


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def solve_newton(tapes, limits, near, q, side, roots, start, stop):
    """Solve f(y, q) = 0 for rows start ≤ i < stop of ``q``; see :func:`~.batch.solve_by_newton`.

    tapes : :class:`~.tape.NewtonTapes`; limits : :class:`~.batch.NewtonSteps`
    near : (N or 1, k) starts; side : (N,), (1,) or (0,)
    roots : :class:`~.batch.Roots`, overwritten
    """
    m, joints = limits.caps.shape[0], q.shape[1]
    block, bad = _allocate_block(tapes, m, joints), allocate_lanes(1)
    r, determinant = block.registers, block.determinant
    for row in range(start, stop, LANES):
        n = _load_start(tapes, near, q, row, stop, block, bad)
        fetch_to_write(roots.rows, row, stop)
        interpret(tapes.begin.code, tapes.begin.constants, r)
        copy_lanes(r, tapes.begin.inputs, block.point, 0, m)
        step = solve_block(tapes, limits, m, block, n)
        for j in range(n):
            roots.steps[row + j] = step
            if side.shape[0] == 0:
                roots.turned[row + j] = determinant[j] * block.first_determinant[j]
            else:
                roots.turned[row + j] = determinant[j] * side[0 if side.shape[0] == 1 else row + j]
        copy_lanes(block.point, 0, r, 0, m + joints)
        interpret(tapes.end.code, tapes.end.constants, r)
        for i in range(tapes.end.outputs):
            s = ((m + joints + i) & _MASK) * LANES
            for j in range(LANES):
                bad[j] += 0.0 * r[s + j]
        store_rows(roots.rows, row, n, m + joints, r, bad)
        for j in range(n):
            roots.residual[row + j] = block.worst[j] + bad[j]
