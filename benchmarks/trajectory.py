"""Cycle times of jerk-limited trajectories on smooth paths, against an optimal solver (copp-py) where it converges."""

from __future__ import annotations

from importlib.util import find_spec
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from measure import table

from parakin.toolpath.timing.drive_limits import DriveLimits
from parakin.toolpath.timing.jerk_limited import limit_jerk
from parakin.toolpath.timing.joint_path import JointPath
from parakin.toolpath.timing.kernels.acceleration_limits import AccelerationLimits
from parakin.toolpath.timing.kernels.reachability import compute_controllable, compute_reachable
from parakin.toolpath.timing.kernels.splines import JointRows, fit_splines
from parakin.toolpath.timing.time_optimal import compute_ceilings

ROWS, STATIONS, ROUNDS, SETTLED = 2000, 500, 10, 5e-4
UNBOUND = 1e12


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


def draw(seed: int) -> tuple[str, Sines, DriveLimits]:
    """A path and its limits: ramps of 0.02 to 0.1 s."""
    rng = np.random.default_rng(seed)
    joints = int(rng.integers(2, 7))
    length = 10.0 ** rng.uniform(1.3, 3.0)
    waves = rng.uniform(0.2, 4.0, joints)
    path = Sines(rng.uniform(5.0, 60.0, joints), 2.0 * np.pi * waves / length, rng.uniform(0.0, 6.0, joints), length)
    acceleration = 10.0 ** rng.uniform(3.0, 4.0, joints)
    limits = DriveLimits(rng.uniform(100.0, 600.0, joints), acceleration, acceleration / rng.uniform(0.02, 0.1))
    return f"{joints} joints, {length:.0f} mm, seed {seed}", path, limits


def plan(path: Sines, limits: DriveLimits) -> float:
    """Our cycle time."""
    s = np.linspace(0.0, path.length, ROWS + 1)
    q = path.derive(s, 0)
    curvature = np.empty_like(q)
    step = np.diff(s)
    fit_splines(step, q, curvature, np.empty(len(s)))
    rows = JointRows(step, q, curvature, np.full(ROWS, UNBOUND))
    nothing: Any = None  # the planner asks the rows alone
    joint_path = JointPath(nothing, nothing, np.zeros(len(s), np.int64), s, rows)
    ceilings = compute_ceilings(joint_path, limits)
    ceiling = np.minimum(np.append(ceilings.start, 0.0), np.append(0.0, ceilings.end))
    bounds = AccelerationLimits(limits.acceleration, np.full(ROWS, np.inf))
    controllable, x, u = np.empty(ROWS + 1), np.empty(ROWS + 1), np.empty(ROWS)
    compute_controllable(rows, bounds, ceiling, controllable, 0, ROWS)
    compute_reachable(rows, bounds, controllable, x, u, 0, ROWS)
    return float(limit_jerk(joint_path, limits, x)[1].time[-1])


def solve(path: Sines, limits: DriveLimits) -> tuple[float, str]:
    """The cycle time of copp-py's third-order cone programs, linearized anew until it settles; NaN where it does not.

    Joints, length and time are scaled to about 1, for its solver's sake.
    """
    import copp_py as copp

    grid = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, STATIONS))
    joints, seconds, a, bend, times = len(limits.speed), path.length / 100.0, None, None, list[float]()
    for order in (2, 2, *[3] * ROUNDS):
        size = limits.jerk * seconds**3
        robot = copp.Robot(joints, capacity=STATIONS)
        robot.append_s(grid)
        q = [path.derive(path.length * grid, k) * path.length**k / size for k in range(4)]
        robot.set_q(q[0], q[1], q[2], 0, dddq=q[3])
        speed, acceleration = limits.speed * seconds / size, limits.acceleration * seconds**2 / size
        robot.add_velocity_limits(speed, -speed, start_idx_s=0, length=STATIONS)
        robot.add_acceleration_limits(acceleration, -acceleration, start_idx_s=0, length=STATIONS)
        if order == 2:
            ends = {"idx_s_interval": (0, STATIONS - 1), "a_boundary": (0.0, 0.0)}
            solver = copp.solver.topp2_ra
            a = solver.solve(solver.Problem(robot.constraints, **ends), solver.Options())
            seconds *= copp.interpolation.s_to_t_topp2(grid, a, 0.0)[0]
            continue
        one = np.ones(joints)
        robot.add_jerk_limits(one, -one, start_idx_s=0, length=STATIONS)
        rest = {"a_boundary": (0.0, 0.0), "b_boundary": (0.0, 0.0), "num_stationary_max": 1, "b_linearization": bend}
        try:
            start = np.maximum(0.5 * a if bend is None else a, 1e-9)
            profile = copp.solver.topp3_socp.solve(
                copp.solver.topp3_socp.Problem(robot.constraints, start, idx_s_start=0, **rest)
            )
        except copp.CoppError:
            return np.nan, "fails"
        a, bend = profile.a, profile.b
        times.append(seconds * copp.interpolation.s_to_t_topp3(grid, profile, 0.0)[0])
        if len(times) > 2 and max(times[-3:]) < (1.0 + SETTLED) * min(times[-3:]):
            return times[-1], ""
    return times[-1], "does not settle"


def main() -> str:
    rows, yardstick = [], bool(find_spec("copp_py"))
    plan(*draw(0)[1:])
    for seed in range(8):
        name, path, limits = draw(seed)
        begin = perf_counter()
        ours = plan(path, limits)
        seconds = perf_counter() - begin
        theirs, remark = solve(path, limits) if yardstick else (np.nan, "copp-py is not installed")
        ratio = remark or f"{ours / theirs:.4f}"
        rows.append([name, f"{ours:.4f}", f"{theirs:.4f}", ratio, "≤ 1.005", f"{seconds:.2f}"])
    columns = ["path", "cycle time, s", "copp-py", "ratio", "bound", "planned in, s"]
    return table(f"Jerk-limited trajectories, {ROWS:,} rows", columns, rows)


if __name__ == "__main__":
    print(main())
