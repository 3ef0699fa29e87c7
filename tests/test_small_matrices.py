"""Quotients and singular values of many small matrices against LAPACK, near singularities too."""

import numpy as np
import pytest

from parakin.kernels.small_matrices import compute_singular_values, solve_quotients


@pytest.mark.parametrize(("n", "m"), [(1, 1), (2, 2), (3, 3), (3, 9), (6, 6), (6, 12)])
@pytest.mark.parametrize("count", [1, 63, 3000])
def test_they_are_those_of_lapack(n, m, count):
    rng = np.random.default_rng(n * m + count)
    a, b = rng.normal(size=(count, n, n)), rng.normal(size=(count, n, m))
    a[:, 0] *= 1e-6  # rows of different units need pivots
    x = solve_quotients(a, b)
    size = np.abs(np.linalg.inv(a)) @ np.abs(a) @ np.abs(x)  # to the condition of the rows, Skeel's
    assert (np.abs(x - np.linalg.solve(a, b)) <= 1e-13 * n * size).all()
    expected = np.linalg.svd(x, compute_uv=False)
    assert np.abs(compute_singular_values(x) - expected).max() <= 1e-14 * n * expected.max()


def test_small_singular_values_keep_their_digits():
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(200, 6, 6)))[0]
    sizes = np.sort(10.0 ** rng.uniform(-12, 3, (200, 6)))[:, ::-1]
    assert compute_singular_values(sizes[:, :, None] * turn) == pytest.approx(sizes, rel=1e-13)


def test_what_has_no_inverse_or_no_number():
    a = np.stack([np.eye(3), np.diag([1.0, 0.0, 2.0]), np.full((3, 3), np.nan)])
    x = solve_quotients(a, np.stack([2.0 * np.eye(3)] * 3))
    assert (x[0] == 2.0 * np.eye(3)).all()
    assert np.isinf(x[1]).all()
    assert np.isnan(x[2]).all()
    assert compute_singular_values(np.zeros((1, 3, 3))).tolist() == [[0.0, 0.0, 0.0]]
    assert np.isnan(compute_singular_values(x[1:])).all()
    assert compute_singular_values(np.zeros((0, 2, 3))).shape == (0, 2)
