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
from .blocks import _MASK, LANES, allocate_lanes, fetch_to_read, fetch_to_write, interpret, load_rows, store_rows
from .compiling import njit
from .elementary import FAST, use_widest_vectors

CLOSE = 1e-6  # mm: from a closure this good one more step ends below rounding
WORTH = 1e-4  # mm: where a step will end no worse than this, the matrix at hand serves on
SLOW = 0.05  # a kept matrix that gains less than this a step is made anew
FINE = 1e-12  # mm: where the next step is predicted to end, it is the last
DOUBLE = 0.2  # a new matrix that leaves more than this a step is beside a double root, where each leaves a quarter
PIVOT = 4.0  # how many times greater an entry must be to become the pivot


class NewtonBlock(NamedTuple):
    """The working arrays of one block, rows of LANES numbers, for m coordinates.

    registers : of the tapes
    point : (m + joints rows) the coordinates and the joints
    closures : (m rows) f there, then the step
    matrix, exchanges : (m·m rows) the factored ∂f/∂y, and which lanes exchanged rows
    exchanged : (m·m,) whether any lane did
    determinant, first_determinant : of the last and the first matrix
    worst, before : the greatest closure of each lane, now and a step before
    shrink : the part of its step that a lane takes
    renews, stops : which lanes want a new matrix, and which take no step any more (2) or one (1)
    steps : that each lane took
    kept : (2·m·m + 1 rows) matrix, exchanges and determinant of lanes that keep theirs
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
    before: Array
    shrink: Array
    renews: Array
    stops: Array
    steps: Array
    kept: Array


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
    determinant, first, worst, before = allocate_lanes(1), allocate_lanes(1), allocate_lanes(1), allocate_lanes(1)
    shrink, renews, stops, steps = allocate_lanes(1), allocate_lanes(1), allocate_lanes(1), allocate_lanes(1)
    kept = allocate_lanes(2 * m * m + 1)
    return NewtonBlock(
        r, point, closures, matrix, exchanges, exchanged, determinant, first, worst, before, shrink, renews, stops,
        steps, kept,
    )  # fmt: skip


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
    """Solve with the factors of :func:`factor_matrix`: ``f`` (m·LANES,) becomes the solution."""
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
def evaluate_closures(tape, m, block):
    """Evaluate a tape that gives m closures first, and the greatest of each lane."""
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


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _take_step(m, caps, block):
    """Take the step in ``closures`` from ``point``, shrunk where a coordinate would change by too much."""
    f, shrink, point, worst, stops = block.closures, block.shrink, block.point, block.worst, block.stops
    for j in range(LANES):
        shrink[j] = 0.0 if (worst[j] < FINE) | (stops[j] > 1.5) else 1.0
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
def _update_matrix(full, m, block, some):
    """Factor the slopes that the tape left, for the lanes that want it; with ``some`` the others keep their matrix."""
    matrix, exchanges, exchanged, kept = block.matrix, block.exchanges, block.exchanged, block.kept
    square = m * m
    if some:
        copy_lanes(matrix, 0, kept, 0, square)
        copy_lanes(exchanges, 0, kept, square, square)
        copy_lanes(block.determinant, 0, kept, 2 * square, 1)
        before = exchanged.copy()
    copy_lanes(block.registers, full.inputs + m, matrix, 0, square)
    factor_matrix(matrix, m, exchanges, exchanged, block.determinant)
    if some:
        renews = block.renews
        for i in range(square):
            exchanged[i] |= before[i]
            s, t = (i & _MASK) * LANES, ((square + i) & _MASK) * LANES
            for j in range(LANES):
                matrix[s + j] = matrix[s + j] if renews[j] > 0.0 else kept[s + j]
                exchanges[s + j] = exchanges[s + j] if renews[j] > 0.0 else kept[t + j]
        s = ((2 * square) & _MASK) * LANES
        for j in range(LANES):
            block.determinant[j] = block.determinant[j] if renews[j] > 0.0 else kept[s + j]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _choose_next_matrix(limits, block, n, step):
    """Decide for each lane whether its next matrix is a new one, and whether it stops; returns how many go on.

    A lane whose closures are NaN stops. One whose last step did not close the legs goes on.
    """
    size, closed = limits.size, limits.closed
    worst, before, renews, stops, steps = block.worst, block.before, block.renews, block.stops, block.steps
    for j in range(LANES):
        w, ratio = worst[j], worst[j] / before[j]
        new = renews[j] > 0.0
        double = (ratio > DOUBLE) & (w > closed)
        anew = (w * w > WORTH * size) | double if new else ratio > SLOW
        enough = (w < CLOSE) & (not double) if new else (ratio <= SLOW) & (w * ratio < FINE)
        going = ((stops[j] < 0.5) | (stops[j] < 1.5) & (w > closed)) & (w == w)
        steps[j] = step if stops[j] < 1.5 else steps[j]
        renews[j] = 1.0 if going & anew else 0.0
        stops[j] = (1.0 if enough else 0.0) if going else 2.0
        before[j] = w
    count = 0
    for j in range(n):
        count += 1 if stops[j] < 1.5 else 0
    return count


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def solve_block(tapes, limits, m, block, n):
    """Run Newton's method on one block, from its point to the root."""
    full, renews = tapes.closures_and_slopes, block.renews
    renews[:] = 1.0
    block.before[:] = np.inf
    for j in range(LANES):
        block.stops[j] = 0.0 if j < n else 2.0
    for step in range(limits.most + 1):
        wanted = 0
        for j in range(n):
            wanted += 1 if renews[j] > 0.0 else 0
        evaluate_closures(full if wanted > 0 else tapes.closures, m, block)
        if wanted > 0:
            _update_matrix(full, m, block, wanted < n)
            if step == 0:
                copy_lanes(block.determinant, 0, block.first_determinant, 0, 1)
        if _choose_next_matrix(limits, block, n, step) == 0:
            return
        solve_factored(block.matrix, m, block.exchanges, block.exchanged, block.closures)
        _take_step(m, limits.caps, block)


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
        solve_block(tapes, limits, m, block, n)
        for j in range(n):
            roots.steps[row + j] = int(block.steps[j])
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
