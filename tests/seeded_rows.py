"""Joint paths for the tests of the trajectory: smooth ones, which an optimal solver solves too, and wild ones."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from parakin.toolpath.timing.drive_limits import DriveLimits
from parakin.toolpath.timing.jerk_limited import limit_jerk
from parakin.toolpath.timing.joint_path import JointPath
from parakin.toolpath.timing.kernels.splines import JointRows, fit_splines, make_unforced_rows
from parakin.toolpath.timing.time_optimal import UNBOUND, compute_ceilings, find_reachable


class Sines(NamedTuple):
    """A smooth path of joints: amplitude·sin(frequency·s + phase), each (joints,), over a length s, mm."""

    amplitude: np.ndarray
    frequency: np.ndarray
    phase: np.ndarray
    length: float

    def derive(self, s: np.ndarray, order: int) -> np.ndarray:
        """The derivatives of the joints by s, (n, joints)."""
        angle = s[:, None] * self.frequency + self.phase + 0.5 * np.pi * order
        return self.amplitude * self.frequency**order * np.sin(angle)


def draw_smooth(seed: int) -> tuple[Sines, DriveLimits]:
    """A smooth path and its limits: ramps of 0.02 to 0.1 s."""
    rng = np.random.default_rng(seed)
    joints = int(rng.integers(2, 7))
    length = 10.0 ** rng.uniform(1.3, 3.0)
    waves = rng.uniform(0.2, 4.0, joints)
    path = Sines(rng.uniform(5.0, 60.0, joints), 2.0 * np.pi * waves / length, rng.uniform(0.0, 6.0, joints), length)
    acceleration = 10.0 ** rng.uniform(3.0, 4.0, joints)
    return path, DriveLimits(rng.uniform(100.0, 600.0, joints), acceleration, acceleration / rng.uniform(0.02, 0.1))


def build_rows(step: np.ndarray, joints: np.ndarray, feed_ceiling: np.ndarray) -> JointPath:
    """A joint path through rows; only its rows are asked."""
    curvature, nothing = np.empty_like(joints), np.zeros(len(joints), np.int64)
    fit_splines(step, joints, curvature, np.empty(len(joints)))
    rows = JointRows(step, joints, curvature, feed_ceiling, make_unforced_rows(len(joints)))
    unasked: Any = None
    return JointPath(unasked, unasked, nothing, np.append(0.0, np.cumsum(step)), rows)


def build_smooth(path: Sines, rows: int) -> JointPath:
    s = np.linspace(0.0, path.length, rows + 1)
    return build_rows(np.diff(s), path.derive(s, 0), np.full(rows, UNBOUND))


def draw_wild(seed: int, most: int, least: float = 10.0**0.3) -> tuple[JointPath, DriveLimits]:
    """A path with noise, steps from 1e-6 to 10 mm, stops, standing joints, changing feeds, and hard or soft limits.

    It has ``least`` to ``most`` rows, their number's logarithm evenly drawn.
    """
    rng = np.random.default_rng([seed, 11])
    count, joints = int(10.0 ** rng.uniform(np.log10(least), np.log10(most))), int(rng.integers(1, 7))
    step = 10.0 ** rng.uniform(*sorted(rng.uniform((-4.0, -3.0), (0.0, 1.0))), count)
    tiny = rng.random(count) < rng.choice([0.0, 0.02])
    step[tiny] = 10.0 ** rng.uniform(-6.0, -4.0, int(tiny.sum()))
    s = np.append(0.0, np.cumsum(step))
    waves = rng.uniform(0.0, 6.0, (3, joints)) / s[-1]
    q = sum(rng.uniform(0.1, 1.0, joints) * 0.2 * s[-1] * np.sin(2.0 * np.pi * w * s[:, None]) for w in waves)
    q = q + rng.normal(0.0, 10.0 ** rng.uniform(-9.0, -3.0), q.shape) * (rng.random() < 0.7)
    q[:, rng.random(joints) < 0.2] = 0.0
    step[1:-1][rng.random(max(count - 2, 0)) < rng.choice([0.0, 0.05])] = 0.0
    step[1:][(step[1:] == 0.0) & (step[:-1] == 0.0)] = 0.1
    for row in np.flatnonzero(step == 0.0):
        q[row + 1] = q[row]
    q[:, 0] += 0.3 * np.append(0.0, np.cumsum(step))
    feed = np.where(rng.random(count) < 0.5, 10.0 ** rng.uniform(-1.0, 2.5), 10.0 ** rng.uniform(0.0, 3.0))
    acceleration = 10.0 ** rng.uniform(1.0, 4.0, joints)
    jerk = acceleration / 10.0 ** rng.uniform(-2.5, -0.5, joints)
    jerk[1:][rng.random(joints - 1) < 0.2] = np.inf
    return build_rows(step, q, feed**2), DriveLimits(10.0 ** rng.uniform(0.0, 3.0, joints), acceleration, jerk)


def plan_rows(path: JointPath, limits: DriveLimits):
    """The jerk-limited joint path and its profile."""
    return limit_jerk(path, limits, find_reachable(path, limits, compute_ceilings(path, limits))[0])[:2]


def measure_pieces(path: JointPath, profile, limits: DriveLimits, places: int = 9):
    """The greatest fractions of speed, acceleration and jerk, and of the feed, at even times of all pieces.

    The joints are the rows' cubics; with s(t) of the profile the chain rule gives their derivatives by time. A piece
    ends on its row but for its times' digits, which in a path of years are as long as the shortest pieces.
    """
    dt = np.diff(profile.time)[:, None] * np.linspace(0.0, 1.0, places)
    v, a, e = profile.speed[:, None], profile.acceleration[:, None], profile.jerk[:, None]
    s = profile.shift[:, None] + dt * (v + dt * (a / 2.0 + dt * e / 6.0))
    v, a = v + dt * (a + dt * e / 2.0), a + dt * e
    i, h, worst = profile.row, path.step[profile.row], np.zeros(4)
    assert (s <= h[:, None] * (1.0 + 1e-9) + 2.0 * np.spacing(profile.time[-1]) * v.max(1, keepdims=True)).all()
    s = np.minimum(s, h[:, None])
    for j in range(path.joints.shape[1]):
        q, bend = path.joints[:, j], path.rows.curvature[:, j]
        third = ((bend[i + 1] - bend[i]) / h)[:, None]
        slope = ((q[i + 1] - q[i]) / h - h * (2.0 * bend[i] + bend[i + 1]) / 6.0)[:, None]
        q1, q2 = slope + s * (bend[i][:, None] + s * third / 2.0), bend[i][:, None] + s * third
        derivatives = q1 * v, q1 * a + q2 * v**2, q1 * e + 3.0 * q2 * v * a + third * v**3
        for k, derivative in enumerate(derivatives):
            worst[k] = max(worst[k], np.abs(derivative).max() / limits[k][j])
    worst[3] = (v / np.sqrt(path.rows.feed_ceiling[i])[:, None]).max()
    return worst
