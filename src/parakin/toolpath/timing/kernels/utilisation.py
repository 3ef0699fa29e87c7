"""Kernels for utilisation: the fraction of each limit that a trajectory takes, and the limit that it takes most of.

Utilisation is measured by time: the factor by which the trajectory would have to be stretched to keep a limit just so.
Stretching divides speeds by the factor, accelerations by its square and jerks by its cube.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array, Flags, Indices
from ....kernels.compiling import njit


class Places(NamedTuple):
    """Where the utilisation of a piece is measured: at ``count`` places, even in time, both ends among them.

    between : measure the peaks between the places, too, by the parabolas through every three of them
    """

    count: int
    between: bool


class Utilisation(NamedTuple):
    """What is measured of a trajectory's pieces.

    excess : (pieces,) the factor by which a piece would have to be stretched in time to keep all limits just so
    binding : (rows,) the limit that is taken most of where each row is passed: 0 the feed, 1 + j the speed of joint j,
        1 + m + j its acceleration, 1 + 2m + j its jerk, 1 + 3m + j its drive's force, of m joints
    changed : (steps,) where pieces have to be measured; for the others ``excess`` and ``binding`` hold
    """

    excess: Array
    binding: Indices
    changed: Flags


class _Motion(NamedTuple):
    """The motion at the places of a piece, (places,) each: mm after the row, ṡ and s̈."""

    shift: Array
    speed: Array
    acceleration: Array


class _Scratch(NamedTuple):
    """What :func:`_measure_piece` overwrites; per_speed, per_acceleration, per_jerk : (joints,) of the limits.

    values : (3, places) a joint's speed, acceleration and jerk as fractions of its limits
    greatest : (3, places) the greatest of all joints at and beside each place
    """

    per_speed: Array
    per_acceleration: Array
    per_jerk: Array
    values: Array
    greatest: Array


@njit(nogil=True, cache=True)
def _allocate_scratch(limits, count):
    """Allocate the motion and the scratch of a piece."""
    motion = _Motion(np.empty(count), np.empty(count), np.empty(count))
    rates = 1.0 / limits.speed, 1.0 / limits.acceleration, 1.0 / limits.jerk
    return motion, _Scratch(*rates, np.empty((3, count)), np.empty((3, count)))


@njit(nogil=True, cache=True, error_model="numpy")
def _write_motion(piece, profile, length, motion):
    """Write the motion at the places of a piece; no place is more than ``length`` mm after the row."""
    count = len(motion.shift)
    dt = (profile.time[piece + 1] - profile.time[piece]) / max(count - 1, 1)
    begin, v, a, e = profile.shift[piece], profile.speed[piece], profile.acceleration[piece], profile.jerk[piece]
    for k in range(count):
        t = k * dt
        motion.shift[k] = min(begin + t * (v + t * (0.5 * a + t * e / 6.0)), length)
        motion.speed[k], motion.acceleration[k] = max(0.0, v + t * (a + 0.5 * t * e)), a + t * e


@njit(nogil=True, cache=True, error_model="numpy")
def _find_peak(before, here, after):
    """Find the size of the peak of the parabola through three values, even in time; without one, of the middle one."""
    change, bend = after - before, after - 2.0 * here + before
    return abs(here - (0.125 * change * change / bend if abs(change) < 2.0 * abs(bend) else 0.0))


@njit(nogil=True, cache=True, error_model="numpy", fastmath={"nnan", "nsz"})
def _measure_joints(step, jerk, rows, motion, scratch, between):
    """Measure the greatest fractions of speed, acceleration and jerk that joints take over a piece, from its s⃛."""
    q, bend, per_step = rows.joints, rows.curvature, 1.0 / rows.step[step]
    values, greatest, count = scratch.values, scratch.greatest, scratch.values.shape[1]
    greatest[:] = 0.0
    for j in range(q.shape[1]):
        bend0, third = bend[step, j], (bend[step + 1, j] - bend[step, j]) * per_step
        slope0 = (q[step + 1, j] - q[step, j]) * per_step - rows.step[step] * (2.0 * bend0 + bend[step + 1, j]) / 6.0
        per_speed, per_acceleration = scratch.per_speed[j], scratch.per_acceleration[j]
        per_jerk = scratch.per_jerk[j]
        for k in range(count):
            o, v, a = motion.shift[k], motion.speed[k], motion.acceleration[k]
            slope, second, square = slope0 + o * (bend0 + 0.5 * third * o), bend0 + third * o, v * v
            values[0, k] = slope * v * per_speed
            values[1, k] = (slope * a + second * square) * per_acceleration
            values[2, k] = (slope * jerk + v * (3.0 * second * a + third * square)) * per_jerk
            greatest[0, k] = max(greatest[0, k], abs(values[0, k]))
            greatest[1, k] = max(greatest[1, k], abs(values[1, k]))
            greatest[2, k] = max(greatest[2, k], abs(values[2, k]))
        for k in range(1, count - 1 if between else 0):
            greatest[0, k] = max(greatest[0, k], _find_peak(values[0, k - 1], values[0, k], values[0, k + 1]))
            greatest[1, k] = max(greatest[1, k], _find_peak(values[1, k - 1], values[1, k], values[1, k + 1]))
            greatest[2, k] = max(greatest[2, k], _find_peak(values[2, k - 1], values[2, k], values[2, k + 1]))
    of_speed, of_acceleration, of_jerk = 0.0, 0.0, 0.0
    for k in range(count):
        of_speed, of_acceleration = max(of_speed, greatest[0, k]), max(of_acceleration, greatest[1, k])
        of_jerk = max(of_jerk, greatest[2, k])
    return of_speed, of_acceleration, of_jerk


@njit(nogil=True, cache=True, error_model="numpy", fastmath={"nnan", "nsz"})
def _measure_forces(step, rows, motion, scratch, between):
    """Measure the greatest fraction of the drives' forces that a piece takes."""
    forces, per_step, greatest = rows.forces, 1.0 / rows.step[step], 0.0
    values, count = scratch.values, scratch.values.shape[1]
    for c in range(len(forces.drive)):
        along, across = forces.along[step, c], forces.across[step, c]
        more_along, more_across = forces.along[step + 1, c] - along, forces.across[step + 1, c] - across
        for k in range(count):
            share, v = motion.shift[k] * per_step, motion.speed[k]
            used = (along + share * more_along) * motion.acceleration[k] + (across + share * more_across) * v * v
            values[0, k] = max(used, 0.0)  # the other way the drive's other bound counts
            greatest = max(greatest, values[0, k])
        for k in range(1, count - 1 if between else 0):
            greatest = max(greatest, _find_peak(values[0, k - 1], values[0, k], values[0, k + 1]))
    return greatest


@njit(nogil=True, cache=True, error_model="numpy")
def _find_top_speed(motion, jerk):
    """Find the greatest ṡ of a piece, at its ends or where s̈ is 0 between them."""
    v, a = motion.speed, motion.acceleration
    top = max(v[0], v[-1])
    return max(top, v[0] - 0.5 * a[0] * a[0] / jerk) if a[0] > 0.0 > a[-1] else top


@njit(nogil=True, cache=True, error_model="numpy")
def _find_binding(step, shift, motion, rows, scratch):
    """Find by how much the trajectory would have to be stretched at a place with ``motion`` ṡ, s̈, s⃛, and what binds."""
    per_step, q, bend, m = 1.0 / rows.step[step], rows.joints, rows.curvature, rows.joints.shape[1]
    v, a, e = motion
    speed, acceleration, jerk, force, of = 0.0, 0.0, 0.0, 0.0, (0, 0, 0, 0)
    for j in range(m):
        bend0, third = bend[step, j], (bend[step + 1, j] - bend[step, j]) * per_step
        slope = (q[step + 1, j] - q[step, j]) * per_step - rows.step[step] * (2.0 * bend0 + bend[step + 1, j]) / 6.0
        second, slope = bend0 + third * shift, slope + shift * (bend0 + 0.5 * third * shift)
        used = abs(slope * v) * scratch.per_speed[j]
        if used > speed:
            speed, of = used, (j, of[1], of[2], of[3])
        used = abs(slope * a + second * v * v) * scratch.per_acceleration[j]
        if used > acceleration:
            acceleration, of = used, (of[0], j, of[2], of[3])
        used = abs(slope * e + v * (3.0 * second * a + third * v * v)) * scratch.per_jerk[j]
        if used > jerk:
            jerk, of = used, (of[0], of[1], j, of[3])
    forces, share = rows.forces, shift * per_step
    for c in range(len(forces.drive)):
        along = forces.along[step, c] + share * (forces.along[step + 1, c] - forces.along[step, c])
        across = forces.across[step, c] + share * (forces.across[step + 1, c] - forces.across[step, c])
        used = along * a + across * v * v
        if used > force:
            force, of = used, (of[0], of[1], of[2], forces.drive[c])
    excess, binding = v / np.sqrt(rows.feed_ceiling[step]), 0
    stretches = speed, np.sqrt(acceleration), np.cbrt(jerk), np.sqrt(force)
    for n in range(4):
        if stretches[n] > excess:
            excess, binding = stretches[n], 1 + n * m + of[n]
    return excess, binding


@njit(nogil=True, cache=True, error_model="numpy")
def _find_binding_at_end(piece, profile, rows, scratch):
    """Find what :func:`_find_binding` does at the end of a piece."""
    t, step = profile.time[piece + 1] - profile.time[piece], profile.row[piece]
    v, a, e = profile.speed[piece], profile.acceleration[piece], profile.jerk[piece]
    motion = max(0.0, v + t * (a + 0.5 * t * e)), a + t * e, e
    return _find_binding(step, rows.step[step], motion, rows, scratch)


@njit(nogil=True, cache=True, error_model="numpy")
def _write_binding(piece, rows, profile, scratch, binding):
    """Write what binds at the rows where a piece begins and ends, if it begins or ends a step."""
    row, step, pieces = profile.row, profile.row[piece], len(profile.row)
    if piece == 0 or row[piece - 1] != step:
        motion = profile.speed[piece], profile.acceleration[piece], profile.jerk[piece]
        excess, binding[step] = _find_binding(step, 0.0, motion, rows, scratch)
        if piece > 0 and row[piece - 1] == step - 1:
            before, bound = _find_binding_at_end(piece - 1, profile, rows, scratch)
            if before >= excess:
                binding[step] = bound
    if piece == pieces - 1 or row[piece + 1] > step + 1:
        binding[step + 1] = _find_binding_at_end(piece, profile, rows, scratch)[1]


@njit(nogil=True, cache=True, error_model="numpy")
def measure_utilisation(rows, limits, profile, use, places, first, last):
    """Measure pieces ``first`` to ``last``; returns the factor by which they would have to be stretched.

    rows : :class:`~.splines.JointRows`
    limits : :class:`~parakin.toolpath.timing.drive_limits.DriveLimits`
    profile : :class:`~parakin.toolpath.timing.speed_profile.SpeedProfile`
    use : :class:`Utilisation`, overwritten
    places : :class:`Places`
    """
    row, excess, changed, between, worst = profile.row, use.excess, use.changed, places.between, 0.0
    motion, scratch = _allocate_scratch(limits, places.count)
    for p in range(first, last):
        step, jerk = row[p], profile.jerk[p]
        if changed[step] or (step > 0 and changed[step - 1]):
            _write_binding(p, rows, profile, scratch, use.binding)
        if changed[step]:
            _write_motion(p, profile, rows.step[step], motion)
            of_feed = _find_top_speed(motion, jerk) / np.sqrt(rows.feed_ceiling[step])
            of_speed, of_acceleration, of_jerk = _measure_joints(step, jerk, rows, motion, scratch, between)
            if len(rows.forces.drive):
                of_acceleration = max(of_acceleration, _measure_forces(step, rows, motion, scratch, between))
            excess[p] = max(of_feed, of_speed, np.sqrt(of_acceleration), np.cbrt(of_jerk))
        worst = max(worst, excess[p])
    return worst
