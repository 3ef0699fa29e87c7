"""Jerk-limited profiles: as quick as an optimal solver's, all limits kept at dense places, whatever the path."""

import numpy as np
import pytest
from s_curves import s_curve_time
from seeded_rows import build_rows, build_smooth, draw_smooth, draw_wild, measure_pieces, plan_rows
from sweep_trajectories import sweep

from parakin.kernels import batch
from parakin.toolpath.timing.drive_limits import DriveLimits
from parakin.toolpath.timing.jerk_limited import _PLACES
from parakin.toolpath.timing.kernels.utilisation import Places, Utilisation, measure_utilisation
from parakin.toolpath.timing.speed_profile import SpeedProfile

BEYOND = 1.001  # times a limit

# Cycle times by copp-py 0.2.3 (topp3_socp on 500 Chebyshev stations, linearized anew until it settled to 5e-4), s;
# made by benchmarks/trajectory.py.
OPTIMAL = (2.2287, 2.6041, 2.7845, 4.1935, 1.8279, 1.3011, 4.6296, 3.3318)


@pytest.mark.parametrize(("seed", "optimal"), enumerate(OPTIMAL))
def test_as_quick_as_an_optimal_solver(seed, optimal):
    path, limits = draw_smooth(seed)
    refined, profile = plan_rows(build_smooth(path, 2000), limits)
    assert 0.99 * optimal < profile.time[-1] < 1.005 * optimal
    assert measure_pieces(refined, profile, limits).max() < BEYOND
    # against the sines themselves, not their splines
    s = np.append(0.0, np.cumsum(refined.step))[profile.row] + profile.shift
    v, a, e = (column[:, None] for column in (profile.speed, profile.acceleration, profile.jerk))
    q = [path.derive(s, order) for order in range(4)]
    assert (np.abs(q[1] * v) < BEYOND * limits.speed).all()
    assert (np.abs(q[1] * a + q[2] * v**2) < BEYOND * limits.acceleration).all()
    inside = slice(2, -2)  # q''' of the splines' first and last steps is their neighbours'
    assert (np.abs(q[1] * e + 3.0 * q[2] * v * a + q[3] * v**3)[inside] < 1.01 * limits.jerk).all()


@pytest.mark.parametrize("way", [1e-3, 0.1, 2.0, 30.0, 400.0])
@pytest.mark.parametrize("rows", [1, 2, 7, 300])
def test_a_straight_motion_takes_the_time_of_its_s_curve(way, rows):
    v, a, j = 100.0, 2000.0, 50_000.0
    limits = DriveLimits(np.array([v]), np.array([a]), np.array([j]))
    s = np.linspace(0.0, way, rows + 1)
    profile = plan_rows(build_rows(np.diff(s), s[:, None], np.full(rows, 1e12)), limits)[1]
    least = s_curve_time(way, v, a, j)
    assert least * (1.0 - 1e-9) < profile.time[-1] < 1.005 * least


def test_every_path_keeps_its_limits():
    for seed, most in [*((seed, 300) for seed in range(300)), (501500, 1000)]:
        path, limits = draw_wild(seed, most)
        refined, profile = plan_rows(path, limits)
        assert np.isfinite(profile.time[-1]), seed
        assert (np.diff(profile.time) > 0.0).all(), seed
        assert measure_pieces(refined, profile, limits, places=41).max() < BEYOND, seed
        assert refined.step.sum() == pytest.approx(path.step.sum())


def test_the_sweep_of_many_more_paths_runs():
    assert sweep(701002)[0] == ["", ""]


def test_the_trajectory_does_not_hang_on_the_number_of_cores(monkeypatch):
    path, limits = draw_smooth(3)
    rows = build_smooth(path, 9000)
    many = plan_rows(rows, limits)[1]
    monkeypatch.setattr(batch, "count_cores", lambda: 1)
    one = plan_rows(rows, limits)[1]
    assert (many.time == one.time).all() and (many.jerk == one.jerk).all()


def test_peaks_between_the_places_are_measured():
    missed = 0
    for seed in range(10):
        path, limits = draw_smooth(seed)
        path, rng = build_smooth(path, 30), np.random.default_rng(seed)
        for row in range(30):
            speed = rng.uniform(10.0, 100.0)
            seconds = 0.5 * path.step[row] / speed
            rise, jerk = rng.uniform(-0.5, 0.5) * speed / seconds, rng.uniform(-1.0, 1.0) * speed / seconds**2
            motion = (np.array([value]) for value in (0.0, speed, rise, jerk))
            piece = SpeedProfile(np.array([0.0, seconds]), np.array([row]), *motion, np.zeros(len(path.step) + 1))
            dense = measure_pieces(path, piece, limits, places=201)
            expected = max(dense[0], np.sqrt(dense[1]), np.cbrt(dense[2]), dense[3])
            use = Utilisation(np.empty(1), np.zeros(len(path.step) + 1, np.int64), np.ones(len(path.step), bool))
            measured, sampled = (
                measure_utilisation(path.rows, limits, piece, use, places, 0, 1)
                for places in (_PLACES, Places(9, False))
            )
            assert measured == pytest.approx(expected, rel=1e-4), (seed, row)
            missed += sampled < 0.999 * expected
    assert missed
