"""Kernels for utilisation: the fraction of each limit that a trajectory takes, and the limit that it takes most of.

Utilisation is measured by time: the factor by which the trajectory would have to be stretched to keep a limit just so.
Stretching divides speeds by the factor, accelerations by its square and jerks by its cube.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array, Flags, Indices
from ....kernels.compiling import njit

_MORE = 1.1  # power to which corrections are raised: a little more than each alone would need


class Utilisation(NamedTuple):
    """What is measured of a trajectory's pieces.

    kept : (pieces, 4) the fractions of a piece's ṡ, s̈ and s⃛ with which it would keep all limits, 1 where it does, and
        the factor by which it would have to be stretched
    binding : (rows,) the limit that is taken most of where each row is passed: 0 the feed, 1 + j the speed of joint j,
        1 + m + j its acceleration, 1 + 2m + j its jerk, 1 + 3m + j its drive's force, of m joints
    changed : (steps,) where pieces have to be measured; for the others ``kept`` and ``binding`` hold
    """

    kept: Array
    binding: Indices
    changed: Flags


class _PlaceUtilisation(NamedTuple):
    """Utilisation at k places.

    motion : (k, 4) mm after the row, ṡ, s̈ and s⃛
    greatest, joint : (k, 4) of a speed, an acceleration, a jerk and a force, and the joint whose it is
    causes : (k, 5) the greatest ones of an acceleration or a force whose greater part is from s̈, and from ṡ; and of a
        jerk whose greatest part is from s⃛, from ṡ with s̈, and from ṡ alone
    """

    motion: Array
    greatest: Array
    joint: Indices
    causes: Array


@njit(nogil=True, cache=True, error_model="numpy")
def _measure_places(step, rows, limits, places):
    """Measure the utilisation of the joints' limits at each place on a step."""
    h, q, bend = rows.step[step], rows.joints, rows.curvature
    greatest, joint, causes = places.greatest, places.joint, places.causes
    greatest[:], joint[:], causes[:] = 0.0, 0, 0.0
    for j in range(q.shape[1]):
        bend0, third = bend[step, j], (bend[step + 1, j] - bend[step, j]) / h
        slope0 = (q[step + 1, j] - q[step, j]) / h - h * (2.0 * bend0 + bend[step + 1, j]) / 6.0
        per_speed, per_acceleration = 1.0 / limits.speed[j], 1.0 / limits.acceleration[j]
        per_jerk = 1.0 / limits.jerk[j]
        for k in range(len(places.motion)):
            o, v, a, e = places.motion[k, 0], places.motion[k, 1], places.motion[k, 2], places.motion[k, 3]
            second, slope = bend0 + third * o, slope0 + o * (bend0 + 0.5 * third * o)
            used = abs(slope * v) * per_speed
            if used > greatest[k, 0]:
                greatest[k, 0], joint[k, 0] = used, j
            along, across = slope * a, second * v * v
            used = abs(along + across) * per_acceleration
            if used > greatest[k, 1]:
                greatest[k, 1], joint[k, 1] = used, j
            cause = 0 if abs(along) > abs(across) else 1
            causes[k, cause] = max(causes[k, cause], used)
            along, both, across = slope * e, 3.0 * second * v * a, third * v**3
            used = abs(along + both + across) * per_jerk
            if used > greatest[k, 2]:
                greatest[k, 2], joint[k, 2] = used, j
            cause = 2 if abs(along) > abs(both + across) else 3 if abs(both) > abs(across) else 4
            causes[k, cause] = max(causes[k, cause], used)
    _measure_forces(step, rows, places)


@njit(nogil=True, cache=True, error_model="numpy")
def _measure_forces(step, rows, places):
    """Measure the utilisation of the drives' forces at each place on a step."""
    forces, h = rows.forces, rows.step[step]
    for c in range(len(forces.drive)):
        along0, across0 = forces.along[step, c], forces.across[step, c]
        for k in range(len(places.motion)):
            share, v, a = places.motion[k, 0] / h, places.motion[k, 1], places.motion[k, 2]
            along = (along0 + share * (forces.along[step + 1, c] - along0)) * a
            across = (across0 + share * (forces.across[step + 1, c] - across0)) * v * v
            used = along + across
            if used > places.greatest[k, 3]:
                places.greatest[k, 3], places.joint[k, 3] = used, forces.drive[c]
            cause = 0 if abs(along) > abs(across) else 1
            places.causes[k, cause] = max(places.causes[k, cause], used)


@njit(nogil=True, cache=True, error_model="numpy")
def _find_binding(k, feed_use, places, joints):
    """Find the factor by which the trajectory would have to be stretched at place k, and the limit that binds."""
    greatest, joint = places.greatest, places.joint
    stretch, limit = feed_use, 0
    if greatest[k, 0] > stretch:
        stretch, limit = greatest[k, 0], 1 + joint[k, 0]
    if greatest[k, 1] > stretch**2:
        stretch, limit = np.sqrt(greatest[k, 1]), 1 + joints + joint[k, 1]
    if greatest[k, 2] > stretch**3:
        stretch, limit = np.cbrt(greatest[k, 2]), 1 + 2 * joints + joint[k, 2]
    if greatest[k, 3] > stretch**2:
        stretch, limit = np.sqrt(greatest[k, 3]), 1 + 3 * joints + joint[k, 3]
    return stretch, limit


@njit(nogil=True, cache=True, error_model="numpy")
def _write_motion(piece, profile, length, motion):
    """Write the motion at places of a piece: mm after the row, ``length`` at most, ṡ, s̈, s⃛.

    The second place is where ṡ is least or greatest; the others are even in time, both ends among them.
    """
    dt = profile.time[piece + 1] - profile.time[piece]
    v, a, e = profile.speed[piece], profile.acceleration[piece], profile.jerk[piece]
    for k in range(len(motion)):
        t = max(k - 1, 0) * dt / (len(motion) - 2)
        if k == 1 and 0.0 < -a / e < dt:
            t = -a / e
        motion[k, 0] = min(profile.shift[piece] + t * (v + t * (0.5 * a + t * e / 6.0)), length)
        motion[k, 1], motion[k, 2], motion[k, 3] = max(0.0, v + t * (a + 0.5 * t * e)), a + t * e, e


@njit(nogil=True, cache=True, error_model="numpy")
def _lower_kept(speed_use, causes, kept):
    """Lower the kept fractions of ṡ, s̈ and s⃛ by the excess over a limit at a place."""
    speed = max(speed_use, np.sqrt(causes[1]), np.cbrt(causes[4]), np.cbrt(causes[3]))
    acceleration = max(causes[0], causes[3] ** (2.0 / 3.0))
    kept[0] = min(kept[0], speed**-_MORE)
    kept[1] = min(kept[1], acceleration**-_MORE)
    kept[2] = min(kept[2], causes[2] ** -_MORE)


@njit(nogil=True, cache=True, error_model="numpy")
def measure_utilisation(rows, limits, profile, use, count, first, last):
    """Measure pieces ``first`` to ``last``; returns the factor by which they would have to be stretched.

    rows : :class:`~.splines.JointRows`
    limits : :class:`~parakin.toolpath.timing.drive_limits.DriveLimits`
    profile : :class:`~parakin.toolpath.timing.speed_profile.SpeedProfile`
    use : :class:`Utilisation`, overwritten
    count : places of each piece at which it is measured
    """
    row, kept, binding = profile.row, use.kept, use.binding
    places = _PlaceUtilisation(
        np.empty((count, 4)), np.empty((count, 4)), np.empty((count, 4), np.int64), np.empty((count, 5))
    )
    joints, worst, before = rows.joints.shape[1], 0.0, 0.0
    for p in range(first, last):
        step = row[p]
        if not use.changed[step]:
            worst = max(worst, kept[p, 3])
            continue
        per_feed = 1.0 / np.sqrt(rows.feed_ceiling[step])
        _write_motion(p, profile, rows.step[step], places.motion)
        _measure_places(step, rows, limits, places)
        kept[p, :3], kept[p, 3] = 1.0, 0.0
        for k in range(count):
            feed_use = places.motion[k, 1] * per_feed
            stretch, limit = _find_binding(k, feed_use, places, joints)
            kept[p, 3] = max(kept[p, 3], stretch)
            if k == 0 and (p == first or row[p - 1] < step - 1 or (row[p - 1] == step - 1 and stretch > before)):
                binding[step] = limit
            if stretch > 1.0:
                _lower_kept(max(feed_use, places.greatest[k, 0]), places.causes[k], kept[p])
            before = stretch
        if p == last - 1 or row[p + 1] != step:
            binding[step + 1] = limit
        worst = max(worst, kept[p, 3])
    return worst
