"""Sine, cosine, arc tangent and square root without branches, so that loops over lanes vectorise.

They are within 4e-16 of libm's. PyPI's Numba calls libm one number at a time, eight times slower than these.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from .compiling import njit

# Contraction is welcome. NaN and infinity carry meaning and must survive: no reassociation, which cancels x - x.
FAST = {"contract", "arcp", "nsz", "afn"}

# π/2 in three parts of 33 bits (Cody and Waite).
_PI_2 = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
GREATEST_ANGLE = 1e5  # rad; beyond it the reduction loses digits, and the answer is NaN


@intrinsic
def use_widest_vectors(typing):
    """Make the calling function use the machine's widest vectors; LLVM's default halves them on many x86."""

    def generate(context, builder, signature, args):
        # llvmlite's own check knows enumerated attributes only.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return types.void(), generate


@intrinsic
def _read_bits(typing, x):
    """Return the bits of a float64 as an integer."""

    def generate(context, builder, signature, args):
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), generate


@intrinsic
def _make_float(typing, bits):
    """Return the float64 that has these bits."""

    def generate(context, builder, signature, args):
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), generate


@njit(inline="always", fastmath=FAST)
def sqrt(x):
    """Compute the square root by Newton steps; NaN below zero and at infinity.

    The processor's own takes as long as twenty products.
    """
    y = _make_float(0x5FE6EB50C7B537A9 - (_read_bits(x) >> 1))  # 1/√x within 4 %
    e = 1.0 - x * y * y
    y = y + y * e * (0.5 + e * (0.375 + e * 0.3125))
    e = 1.0 - x * y * y
    y = y + y * e * (0.5 + e * 0.375)
    root = x * y
    root = root + 0.5 * y * (x - root * root)
    return root if x >= 0.0 else np.nan


@njit(inline="always", fastmath=FAST)
def sincos(x):
    """Compute (sin x, cos x) by polynomials; NaN beyond GREATEST_ANGLE."""
    shifted = x * 0.63661977236758134308 + 6755399441055744.0  # 1.5·2^52: the quadrant is in the lowest bits
    quadrant = _read_bits(shifted)
    q = shifted - 6755399441055744.0
    r = ((x - q * _PI_2[0]) - q * _PI_2[1]) - q * _PI_2[2]
    r = r if abs(x) <= 1e5 else np.nan
    z = r * r
    s = r + r * z * (
        -1.66666666666666307295e-1
        + z
        * (
            8.33333333332211858878e-3
            + z
            * (
                -1.98412698295895385996e-4
                + z * (2.75573136213857245213e-6 + z * (-2.50507477628578072866e-8 + z * 1.58962301576546568060e-10))
            )
        )
    )
    c = (
        1.0
        - 0.5 * z
        + z
        * z
        * (
            4.16666666666665929218e-2
            + z
            * (
                -1.38888888888730564116e-3
                + z
                * (
                    2.48015872888517045348e-5
                    + z
                    * (-2.75573141792967388112e-7 + z * (2.08757008419747316778e-9 + z * -1.13585365213876817300e-11))
                )
            )
        )
    )
    odd = (quadrant & 1) == 1
    sine = _read_bits(c if odd else s) ^ ((quadrant & 2) << 62)
    cosine = _read_bits(s if odd else c) ^ (((quadrant + 1) & 2) << 62)
    return _make_float(sine), _make_float(cosine)


@njit(inline="always", fastmath=FAST)
def atan2(y, x):
    """Compute the angle of (x, y) in (-π, π] by a polynomial; 0 for (0, 0)."""
    ax, ay = abs(x), abs(y)
    big = ax if ax > ay else ay
    small = ay if ax > ay else ax
    # Reduce to |t| ≤ tan(π/8) before the one division.
    upper = small > 0.41421356237309503 * big
    top = small - big if upper else small
    bottom = small + big if upper else big
    t = top / (bottom if bottom > 0.0 else 1.0)
    z = t * t
    a = t + t * z * (
        -0.33333333333333330155
        + z
        * (
            0.19999999999995514143
            + z
            * (
                -0.14285714284665179609
                + z
                * (
                    0.11111111015146714628
                    + z
                    * (
                        -0.090909045736690599627
                        + z
                        * (
                            0.076921830873420259463
                            + z
                            * (
                                -0.066645099898180444678
                                + z
                                * (
                                    0.05858136251906146279
                                    + z
                                    * (
                                        -0.050853834888428314054
                                        + z * (0.039229744536612230905 + z * -0.01917454357202133235)
                                    )
                                )
                            )
                        )
                    )
                )
            )
        )
    )
    a = a + (0.78539816339744830962 if upper else 0.0)
    a = 1.57079632679489661923 - a if ay > ax else a
    a = 3.14159265358979323846 - a if x < 0.0 else a
    a = -a if y < 0.0 else a
    return a + 0.0 * (x + y)  # NaN where either is NaN or infinite
