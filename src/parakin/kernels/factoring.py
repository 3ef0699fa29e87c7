"""Linear systems in lanes: elimination of a square matrix, and orthogonalisation of one with more rows than columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from .elementary import Lane, Lanes

PIVOT = 4.0  # how many times greater an entry must be to become the pivot


class MatrixShape(NamedTuple):
    """Rows and columns of a matrix; a square one is factored by elimination, a tall one by orthogonalisation."""

    rows: int
    columns: int

    @property
    def is_square(self) -> bool:
        return self.rows == self.columns

    @property
    def factor_entries(self) -> int:
        """How many entries the factors have."""
        if self.is_square:
            return self.columns**2
        return self.rows * self.columns + self.columns * (self.columns + 1) // 2

    @property
    def exchanges(self) -> int:
        """How many pairs of rows may be exchanged."""
        return self.columns * (self.columns - 1) // 2 if self.is_square else 0


class Factors(NamedTuple):
    """What :func:`factor_matrix` makes of a matrix's entries.

    matrix : of a square matrix the multipliers below, and reciprocal pivots on the diagonal; of a tall one its
        orthonormal columns Q, one after the other, then R row by row, with the reciprocals of its diagonal
    exchanged : where rows k and i > k were, in the order of elimination
    determinant : of a tall matrix √det(AᵀA), its volume
    """

    matrix: list[Lane]
    exchanged: list[Lane]
    determinant: Lane


def factor_matrix(lanes: Lanes, entries: Sequence[Lane], shape: MatrixShape) -> Factors:
    """Factor a matrix, given row by row."""
    return (_factor_square if shape.is_square else _factor_tall)(lanes, entries, shape)


def _factor_square(lanes: Lanes, entries: Sequence[Lane], shape: MatrixShape) -> Factors:
    """Factor a square matrix by elimination, with exchanges of rows chosen lane by lane."""
    m = shape.columns
    a, exchanged, determinant = [list(entries[m * i : m * i + m]) for i in range(m)], [], lanes.constant(1.0)
    for k in range(m):
        for i in range(k + 1, m):
            swap = abs(a[i][k]) > PIVOT * abs(a[k][k])
            exchanged.append(swap)
            determinant = lanes.select(swap, -determinant, determinant)
            for c in range(k, m):
                upper, lower = a[k][c], a[i][c]
                a[k][c], a[i][c] = lanes.select(swap, lower, upper), lanes.select(swap, upper, lower)
        determinant = determinant * a[k][k]
        a[k][k] = 1.0 / a[k][k]
        for i in range(k + 1, m):
            a[i][k] = a[i][k] * a[k][k]
            for c in range(k + 1, m):
                a[i][c] = a[i][c] - a[i][k] * a[k][c]
    return Factors([entry for row in a for entry in row], exchanged, determinant)


def _dot(one: Sequence[Lane], other: Sequence[Lane]) -> Lane:
    total = one[0] * other[0]
    for x, y in zip(one[1:], other[1:], strict=True):
        total = total + x * y
    return total


def _factor_tall(lanes: Lanes, entries: Sequence[Lane], shape: MatrixShape) -> Factors:
    """Factor a tall matrix by the modified Gram-Schmidt method."""
    columns = [list(entries[k :: shape.columns]) for k in range(shape.columns)]
    triangle: list[Lane] = []
    determinant = lanes.constant(1.0)
    for k, column in enumerate(columns):
        size = lanes.sqrt(_dot(column, column))
        determinant, inverse = determinant * size, 1.0 / size
        triangle.append(inverse)
        column[:] = [entry * inverse for entry in column]
        for later in columns[k + 1 :]:
            share = _dot(column, later)
            triangle.append(share)
            later[:] = [entry - share * own for entry, own in zip(later, column, strict=True)]
    return Factors([*(entry for column in columns for entry in column), *triangle], [], determinant)


def solve_factored(
    lanes: Lanes, factors: Factors, right: Sequence[Lane], shape: MatrixShape
) -> tuple[list[Lane], list[Lane]]:
    """Solve the linear system whose matrix is factored, of a tall one in the least squares.

    Returns the solution, and the part of the right side that it meets: all of it where the matrix is square.
    """
    if shape.is_square:
        return _solve_square(lanes, factors, right), list(right)
    return _solve_tall(factors.matrix, right, shape)


def _solve_square(lanes: Lanes, factors: Factors, right: Sequence[Lane]) -> list[Lane]:
    """Solve the linear system whose square matrix is factored."""
    f, m, exchanges = list(right), len(right), iter(factors.exchanged)
    for k in range(m):
        for i in range(k + 1, m):
            swap, upper, lower = next(exchanges), f[k], f[i]
            f[k], f[i] = lanes.select(swap, lower, upper), lanes.select(swap, upper, lower)
        for i in range(k + 1, m):
            f[i] = f[i] - factors.matrix[m * i + k] * f[k]
    for k in reversed(range(m)):
        for c in range(k + 1, m):
            f[k] = f[k] - factors.matrix[m * k + c] * f[c]
        f[k] = f[k] * factors.matrix[m * k + k]
    return f


def _solve_tall(matrix: Sequence[Lane], right: Sequence[Lane], shape: MatrixShape) -> tuple[list[Lane], list[Lane]]:
    """Solve a tall system in the least squares; returns the solution, and the right side's part in the columns."""
    rest, shares = list(right), list[Lane]()
    for k in range(shape.columns):
        column = matrix[shape.rows * k : shape.rows * (k + 1)]
        shares.append(_dot(column, rest))
        rest = [entry - shares[k] * own for entry, own in zip(rest, column, strict=True)]
    solution, end = shares, len(matrix)
    for k in reversed(range(shape.columns)):
        count = shape.columns - k
        inverse, *row = matrix[end - count : end]
        for entry, known in zip(row, solution[k + 1 :], strict=True):
            solution[k] = solution[k] - entry * known
        solution[k] = solution[k] * inverse
        end -= count
    return solution, [entry - left for entry, left in zip(right, rest, strict=True)]
