"""The quickest trajectory by reachability, against toppra's."""

import logging

import numpy as np
import pytest

from parakin.toolpath.timing.kernels.acceleration_limits import AccelerationLimits
from parakin.toolpath.timing.kernels.reachability import compute_controllable, compute_reachable
from parakin.toolpath.timing.kernels.speed_ceilings import StepCeilings, compute_speed_ceilings
from parakin.toolpath.timing.kernels.splines import JointRows, fit_splines, make_unforced_rows


def quickest(s, q, speed, acceleration):
    step = np.diff(s)
    n, curvature = len(step), np.empty_like(q)
    fit_splines(step, q, curvature, np.empty(n + 1))
    rows = JointRows(step, q, curvature, np.full(n, np.inf), make_unforced_rows(n + 1))
    ceilings = StepCeilings(np.empty(n), np.empty(n))
    compute_speed_ceilings(rows, speed, np.inf, ceilings, 0, n)
    ceiling = np.minimum(np.append(ceilings.start, 0.0), np.append(0.0, ceilings.end))
    limits = AccelerationLimits(acceleration, np.full(n, np.inf))
    controllable, x, u = np.empty(n + 1), np.empty(n + 1), np.empty(n)
    compute_controllable(rows, limits, ceiling, controllable, 0, n)
    compute_reachable(rows, limits, controllable, x, u, 0, n)
    v = np.sqrt(x)
    return (2.0 * step / (v[1:] + v[:-1])).sum()


def test_as_quick_as_toppra():
    toppra = pytest.importorskip("toppra", reason="toppra is not installed")
    from scipy.interpolate import CubicSpline

    logging.getLogger("toppra").setLevel(logging.ERROR)
    rng = np.random.default_rng(5)
    for _ in range(12):
        points = rng.uniform(-1.0, 1.0, (8, 6))
        ends, s = np.linspace(0.0, 1.0, 8), np.linspace(0.0, 1.0, 701)
        v, a = rng.uniform(0.5, 3.0, 6), rng.uniform(2.0, 20.0, 6)
        path = toppra.SplineInterpolator(ends, points)
        acceleration = toppra.constraint.JointAccelerationConstraint(np.stack([-a, a], 1))
        acceleration.set_discretization_type(toppra.constraint.DiscretizationType.Interpolation)
        limits = [toppra.constraint.JointVelocityConstraint(np.stack([-v, v], 1)), acceleration]
        planner = toppra.algorithm.TOPPRA(limits, path, gridpoints=s, solver_wrapper="seidel")
        speed = planner.compute_parameterization(0.0, 0.0)[1]
        theirs = (2.0 * np.diff(s) / (speed[1:] + speed[:-1])).sum()
        ours = quickest(s, CubicSpline(ends, points)(s), v, a)
        assert theirs * 0.995 < ours < theirs * 1.02
