"""Complex numbers in lanes: linear systems and sums.

Number k of an array (2·count, LANES) stands in the rows 2·k and 2·k + 1, its real and its imaginary part.
"""

from __future__ import annotations

from .compiling import njit
from .numba_lanes import choose, is_greater, load, repeat, store
from .numba_turns import FAST


@njit(inline="always")
def get_number(a, k):
    """Load a complex number."""
    return load(a, 2 * k), load(a, 2 * k + 1)


@njit(inline="always")
def put_number(a, k, re, im):
    """Store a complex number."""
    store(a, 2 * k, re)
    store(a, 2 * k + 1, im)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _swap_numbers(bits, a, one, other):
    """Swap two numbers in the lanes of bits."""
    x, y = get_number(a, one)
    u, v = get_number(a, other)
    put_number(a, one, choose(bits, u, x), choose(bits, v, y))
    put_number(a, other, choose(bits, x, u), choose(bits, y, v))


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def factor_in_lanes(a, swaps):
    """Factor by rows with partial pivoting, in place; reciprocal pivots on the diagonal, not finite where singular."""
    n = len(swaps)
    for k in range(n):
        pivot_re, pivot_im = get_number(a, k * n + k)
        best = pivot_re * pivot_re + pivot_im * pivot_im
        for i in range(k + 1, n):
            re, im = get_number(a, i * n + k)
            size = re * re + im * im
            bits = is_greater(size, best)
            swaps[k, i] = bits
            if bits != 0:
                best = choose(bits, size, best)
                for j in range(n):
                    _swap_numbers(bits, a, k * n + j, i * n + j)
        scale = repeat(1.0) / best
        pivot_re, pivot_im = get_number(a, k * n + k)
        pivot_re, pivot_im = pivot_re * scale, repeat(0.0) - pivot_im * scale
        put_number(a, k * n + k, pivot_re, pivot_im)
        for i in range(k + 1, n):
            re, im = get_number(a, i * n + k)
            factor_re, factor_im = re * pivot_re - im * pivot_im, re * pivot_im + im * pivot_re
            put_number(a, i * n + k, factor_re, factor_im)
            for j in range(k + 1, n):
                re, im = get_number(a, k * n + j)
                u, v = get_number(a, i * n + j)
                put_number(a, i * n + j, u - factor_re * re + factor_im * im, v - factor_re * im - factor_im * re)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def solve_in_lanes(a, swaps, b):
    """Solve by the factors, in place."""
    n = len(swaps)
    for k in range(n):
        for i in range(k + 1, n):
            bits = swaps[k, i]
            if bits != 0:
                _swap_numbers(bits, b, k, i)
    for i in range(1, n):
        re, im = get_number(b, i)
        for j in range(i):
            c, d = get_number(a, i * n + j)
            u, v = get_number(b, j)
            re = re - c * u + d * v
            im = im - c * v - d * u
        put_number(b, i, re, im)
    for i in range(n - 1, -1, -1):
        re, im = get_number(b, i)
        for j in range(i + 1, n):
            c, d = get_number(a, i * n + j)
            u, v = get_number(b, j)
            re = re - c * u + d * v
            im = im - c * v - d * u
        c, d = get_number(a, i * n + i)
        put_number(b, i, re * c - im * d, re * d + im * c)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def multiply_numbers(x, first, y, other, count):
    """Sum the products of ``count`` numbers of x from the ``first`` on and of y from the ``other`` on."""
    re, im = repeat(0.0), repeat(0.0)
    for j in range(count):
        a, b = get_number(x, first + j)
        u, v = get_number(y, other + j)
        re = re + a * u - b * v
        im = im + a * v + b * u
    return re, im


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def measure_numbers(x, first, count):
    """Sum the squares of numbers from the ``first`` on."""
    total = repeat(1e-300)
    for i in range(count):
        re, im = get_number(x, first + i)
        total = total + re * re + im * im
    return total
