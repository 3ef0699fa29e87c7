"""Sine, cosine and arc tangent without branches, for lanes of any kind: arrays, vectors under compilation, Numba's.

They are within 4e-16 of libm's, and have the same bits wherever arithmetic is that of IEEE 754 without contraction.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

Lane: TypeAlias = Any  # numbers side by side, on which the operators of Python work
Lanes: TypeAlias = Any  # the functions of one kind of lanes, as ArrayLanes has them

# π/2 in three parts of 33 bits (Cody and Waite).
_PI_2 = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
GREATEST_ANGLE = 1e5  # rad; beyond it the reduction loses digits, and the answer is NaN


def define_turns(
    select: Callable[[Lane, Lane, Lane], Lane],
    read_bits: Callable[[Lane], Lane],
    make_number: Callable[[Lane], Lane],
) -> tuple[Callable[[Lane], tuple[Lane, Lane]], Callable[[Lane, Lane], Lane]]:
    """Define sincos(x) and atan2(y, x) for one kind of lanes.

    select : (condition, x, y) -> x where the condition holds, else y
    read_bits, make_number : float64 -> the integer of the same bits, and back
    """
    nan = float("nan")

    def sincos(x: Lane) -> tuple[Lane, Lane]:
        """Compute (sin x, cos x) by polynomials; NaN beyond GREATEST_ANGLE."""
        shifted = x * 0.63661977236758134308 + 6755399441055744.0  # 1.5·2^52: the quadrant is in the lowest bits
        quadrant = read_bits(shifted)
        q = shifted - 6755399441055744.0
        r = ((x - q * _PI_2[0]) - q * _PI_2[1]) - q * _PI_2[2]
        r = select(abs(x) <= GREATEST_ANGLE, r, nan)
        z = r * r
        p = 2.75573136213857245213e-6 + z * (-2.50507477628578072866e-8 + z * 1.58962301576546568060e-10)
        p = -1.66666666666666307295e-1 + z * (8.33333333332211858878e-3 + z * (-1.98412698295895385996e-4 + z * p))
        s = r + r * z * p
        p = -2.75573141792967388112e-7 + z * (2.08757008419747316778e-9 + z * -1.13585365213876817300e-11)
        p = -1.38888888888730564116e-3 + z * (2.48015872888517045348e-5 + z * p)
        c = 1.0 - 0.5 * z + z * z * (4.16666666666665929218e-2 + z * p)
        odd = (quadrant & 1) == 1
        sine = read_bits(select(odd, c, s)) ^ ((quadrant & 2) << 62)
        cosine = read_bits(select(odd, s, c)) ^ (((quadrant + 1) & 2) << 62)
        return make_number(sine), make_number(cosine)

    def atan2(y: Lane, x: Lane) -> Lane:
        """Compute the angle of (x, y) in (-π, π] by a polynomial; 0 for (0, 0)."""
        ax, ay = abs(x), abs(y)
        big, small = select(ax > ay, ax, ay), select(ax > ay, ay, ax)
        # Reduce to |t| ≤ tan(π/8) before the one division.
        upper = small > 0.41421356237309503 * big
        top = select(upper, small - big, small)
        bottom = select(upper, small + big, big)
        t = top / select(bottom > 0.0, bottom, 1.0)
        z = t * t
        p = -0.050853834888428314054 + z * (0.039229744536612230905 + z * -0.01917454357202133235)
        p = 0.076921830873420259463 + z * (-0.066645099898180444678 + z * (0.05858136251906146279 + z * p))
        p = -0.14285714284665179609 + z * (0.11111111015146714628 + z * (-0.090909045736690599627 + z * p))
        p = -0.33333333333333330155 + z * (0.19999999999995514143 + z * p)
        a = t + t * z * p
        a = a + select(upper, 0.78539816339744830962, 0.0)
        a = select(ay > ax, 1.57079632679489661923 - a, a)
        a = select(x < 0.0, 3.14159265358979323846 - a, a)
        a = select(y < 0.0, -a, a)
        return a + 0.0 * (x + y)  # NaN where either is NaN or infinite

    return sincos, atan2
