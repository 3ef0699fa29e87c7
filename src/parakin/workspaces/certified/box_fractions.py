"""Fractions of boxes above planes: closed forms, with bounds of their rounding."""

from __future__ import annotations

from ...kernels.compiling import njit

_FLAT = 1e-4  # slopes below this fraction of the steepest count as unknown: the closed form cancels there
_ROUNDING = 1e-7  # the error of the closed form, with slopes no flatter than that


@njit(nogil=True, cache=True)
def _compute_fraction(b, w, n):
    """Compute the fraction of the v in [-1, 1]^n with b + w·v ≥ 0, for n ≤ 3 positive w, by cutting off corners."""
    total = 0.0
    for k in range(n):
        total += w[k]
    if b >= total:
        return 1.0
    if b <= -total:
        return 0.0
    t = 0.5 * (total - abs(b))  # the smaller of both parts, at a corner
    if n == 1:
        fraction = t / w[0]
    elif n == 2:
        p, q = max(t - w[0], 0.0), max(t - w[1], 0.0)
        fraction = (t * t - p * p - q * q) / (2.0 * w[0] * w[1])  # t ≤ (w0 + w1)/2: the far corner is not reached
    else:
        fraction = t * t * t
        for k in range(3):
            p = max(t - w[k], 0.0)
            q = max(t - w[k] - w[(k + 1) % 3], 0.0)
            fraction += q * q * q - p * p * p
        fraction /= 6.0 * w[0] * w[1] * w[2]
    return 1.0 - fraction if b > 0.0 else fraction


@njit(nogil=True, cache=True)
def scale_slopes(slopes, scaled):
    """Scale slopes by the steepest: fill in those that are not flat.

    Returns how many they are, the sum of the flat ones, the steepest slope and the sum of all, both as given.
    """
    steepest, total = 0.0, 0.0
    for slope in slopes:
        steepest = max(steepest, abs(slope))
        total += abs(slope)
    n, flat = 0, 0.0
    for slope in slopes:
        if abs(slope) > _FLAT * steepest:
            scaled[n] = abs(slope) / steepest
            n += 1
        elif steepest > 0.0:
            flat += abs(slope) / steepest
    return n, flat, steepest, total


@njit(nogil=True, cache=True)
def bound_scaled_fraction(b, scaled, scale):
    """Bound the fraction of a box above b + slopes·v ≥ 0 by the slopes as :func:`scale_slopes` scaled them."""
    n, flat, steepest, total = scale
    if b >= total:
        return 1.0, 1.0
    if b < -total:
        return 0.0, 0.0
    if b != b:
        return 0.0, 1.0
    # A part that rounds to all or to nothing is neither: what is cut off at a corner can be smaller than a rounding.
    least = _compute_fraction(b / steepest - flat, scaled, n)
    most = _compute_fraction(b / steepest + flat, scaled, n) if flat > 0.0 else least
    return max(0.0, least - _ROUNDING), min(1.0, most + _ROUNDING)


@njit(nogil=True, cache=True)
def bound_fraction(b, slopes, scratch):
    """Bound the fraction of a box above b + slopes·v ≥ 0, v in [-1, 1]^d, rounding included: (least, greatest).

    ``scratch`` (3,) is overwritten.
    """
    return bound_scaled_fraction(b, scratch, scale_slopes(slopes, scratch))


@njit(nogil=True, cache=True)
def estimate_growth(b, scaled, scale):
    """Estimate how fast the fraction of a box above b + slopes·v = 0 grows with b."""
    step = 1e-3 * scale[3]
    if not step > 0.0:
        return 0.0
    more, less = bound_scaled_fraction(b + step, scaled, scale)[0], bound_scaled_fraction(b - step, scaled, scale)[0]
    return (more - less) / (2.0 * step)
