"""The feed planner: a million records on the Tricept, and 100,000 rows of smooth paths against toppra."""

from __future__ import annotations

import logging
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
from measure import best, table
from post import numbers

import parakin as pk
from parakin.machine import Machine
from parakin.model.elements import Drive
from parakin.toolpath.path import ToolPath
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.posting.posted import Posted
from parakin.toolpath.timing import plan_trajectory
from parakin.toolpath.timing.kernels.acceleration_limits import AccelerationLimits
from parakin.toolpath.timing.kernels.reachability import compute_controllable, compute_reachable
from parakin.toolpath.timing.kernels.speed_ceilings import StepCeilings, compute_speed_ceilings
from parakin.toolpath.timing.kernels.splines import JointRows, fit_splines, make_unforced_rows

ROWS, JOINTS = 100_000, 6


def million(ramp: float) -> Posted:
    """The path of the benchmark of ``post``, on a Tricept whose accelerations rise in ``ramp`` s; at once for 0."""

    def limit(drive: Drive, speed: float, acceleration: float) -> Drive:
        jerk = acceleration / ramp if ramp else np.inf
        return replace(drive, speed=speed, acceleration=acceleration, jerk=jerk)

    spec = pk.load("tricept").spec
    legs = tuple(replace(leg, drives=tuple(limit(d, 1000.0, 5000.0) for d in leg.drives)) for leg in spec.legs)
    head = tuple(s if s.drive is None else replace(s, drive=limit(s.drive, 3.0, 30.0)) for s in spec.head)
    values = numbers()
    n = len(values)
    lines, rapid = np.arange(n), np.zeros(n, bool)
    path = ToolPath("", values[:, :3], values[:, 3:], lines, rapid, np.full(n, 2000.0), np.full(n, np.nan))
    return post_path(Machine(replace(spec, legs=legs, head=head)), path)


def quickest(s: np.ndarray, q: np.ndarray, speed: np.ndarray, acceleration: np.ndarray) -> float:
    """The cycle time of the quickest trajectory through rows of joints."""
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
    speeds = np.sqrt(x)
    return float((2.0 * step / (speeds[1:] + speeds[:-1])).sum())


def against_toppra() -> list[list[str]]:
    """Rows of the table: planning only, the path being evaluated for both beforehand."""
    import toppra
    from scipy.interpolate import CubicSpline

    logging.getLogger("toppra").setLevel(logging.ERROR)
    rng, rows = np.random.default_rng(1), []
    for waypoints in (10, 1000):
        points = rng.uniform(-1.0, 1.0, (waypoints, JOINTS))
        ends, s = np.linspace(0.0, 1.0, waypoints), np.linspace(0.0, 1.0, ROWS + 1)
        speed, acceleration = rng.uniform(1.0, 3.0, JOINTS), rng.uniform(2.0, 20.0, JOINTS)
        limits = [
            toppra.constraint.JointVelocityConstraint(np.stack([-speed, speed], 1)),
            toppra.constraint.JointAccelerationConstraint(np.stack([-acceleration, acceleration], 1)),
        ]
        limits[1].set_discretization_type(toppra.constraint.DiscretizationType.Interpolation)
        path = toppra.SplineInterpolator(ends, points)
        planner = toppra.algorithm.TOPPRA(limits, path, gridpoints=s, solver_wrapper="seidel")
        theirs = best(lambda: planner.compute_parameterization(0.0, 0.0), 3)  # noqa: B023
        v = planner.compute_parameterization(0.0, 0.0)[1]
        their_time = float((2.0 * np.diff(s) / (v[1:] + v[:-1])).sum())
        q = CubicSpline(ends, points)(s)
        ours = best(lambda: quickest(s, q, speed, acceleration), 5)  # noqa: B023
        longer = quickest(s, q, speed, acceleration) / their_time
        what = f"{ROWS:,} rows, {waypoints} waypoints: "
        rows.append([what + "toppra", f"{theirs:.3f}", "1.0", "", "1.0000", ""])
        rows.append([what + "parakin", f"{ours:.4f}", f"{theirs / ours:.1f}", "≥ 20", f"{longer:.4f}", "≤ 1.02"])
    return rows


def main() -> str:
    rows = []
    for what, ramp, bound in (("without jerk", 0.0, "≤ 5 s"), ("with jerk", 0.02, "≤ 10 s")):
        posted = million(ramp)
        seconds = best(lambda: plan_trajectory(posted), 1)  # noqa: B023
        pace = f"{1e-3 * len(posted.path) / seconds:,.0f} records/ms"
        rows.append([f"{len(posted.path):,} records on the Tricept, {what}", f"{seconds:.2f}", pace, bound, "", ""])
    rows += against_toppra() if find_spec("toppra") else [["toppra is not installed", "", "", "", "", ""]]
    return table("Feed planning", ["what", "s", "times as fast", "bound", "cycle time", "bound"], rows)


if __name__ == "__main__":
    print(main())
