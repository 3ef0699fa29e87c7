"""Tell whether limits are kept by scalars with the margins' signs that cost less than the margins."""

from __future__ import annotations

from math import cos, pi, sin

from ...algebra import ATAN2, LIN, SQRT, Scalar, Term


def find_cheap_sign(margin: Scalar) -> Scalar:
    """Find a scalar that is ≥ 0 where a traced margin is, without the last angle or root.

    For an angle in [0, π], bound - atan2(√w, c) has the sign of sin(bound) c - cos(bound) √w; √w - bound has that of
    w - bound².
    """
    if not isinstance(margin, Term) or margin.op != LIN or len(margin.args) != 1:
        return margin
    (bound, factor), (measured,) = margin.k, margin.args
    if factor == -1.0 and measured.op == ATAN2 and measured.args[0].op == SQRT and 0.0 <= bound <= pi:
        length, along = measured.args
        return sin(bound) * along - cos(bound) * length
    if factor == 1.0 and measured.op == SQRT and bound <= 0.0:
        return measured.args[0] - bound * bound
    return margin
