"""Angles of turning joints, told on the turn on which the joint's range is."""

from __future__ import annotations

from math import cos, isfinite, pi, sin

from ..algebra import Scalar, Term, atan2
from .elements import Drive
from .nominal_values import find_nominal_value


def find_turn_middle(drive: Drive) -> float:
    """Find the angle about which a turning joint is told: its range's middle, rad, if it goes beyond ±180°, else 0."""
    low, high = (find_nominal_value(end + drive.offset) for end in (drive.low, drive.high))
    middle = 0.5 * (low + high)
    return 0.0 if not isfinite(middle) or (low >= -pi and high <= pi) else middle


def measure_turn(drive: Drive, y: Scalar, x: Scalar, v: Scalar = 0.0, u: Scalar = 1.0) -> Scalar:
    """Measure the angle of (x, y) less that of (u, v), rad, on the turn on which the drive's range is.

    Where the range goes beyond ±180° the angle is within half a turn of its middle, and so jumps nowhere in it.
    """
    return measure_angle_near(find_turn_middle(drive), y, x, v, u)


def measure_angle_near(middle: float, y: Scalar, x: Scalar, v: Scalar = 0.0, u: Scalar = 1.0) -> Scalar:
    """Measure the angle of (x, y) less that of (u, v), rad, within half a turn of ``middle``."""
    if middle == 0.0:
        return subtract_angles(y, x, v, u)
    s, c = sin(middle), cos(middle)
    return middle + subtract_angles(c * y - s * x, c * x + s * y, v, u)


def subtract_angles(y: Scalar, x: Scalar, v: Scalar, u: Scalar) -> Scalar:
    """Compute the angle of (x, y) less that of (u, v), in (-π, π].

    Its derivative is that of the one less that of the other, in which equal terms have cancelled, so over boxes it is
    some times narrower.
    """
    angle = atan2(y * u - x * v, x * u + y * v)
    if isinstance(angle, Term) and (isinstance(v, Term) or isinstance(u, Term)):
        one, other = x * x + y * y, u * u + v * v
        angle.trace.known_slopes[angle.index] = [(x / one, y), (-y / one, x), (-u / other, v), (v / other, u)]
    return angle
