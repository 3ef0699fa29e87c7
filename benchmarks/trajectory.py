"""Cycle times of jerk-limited trajectories on smooth paths, against an optimal solver (copp-py) where it converges."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter

import numpy as np
from measure import table

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from seeded_rows import Sines, build_smooth, draw_smooth, plan_rows

from parakin.toolpath.timing.drive_limits import DriveLimits

ROWS, STATIONS, ROUNDS, SETTLED = 2000, 500, 10, 5e-4


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
    plan_rows(build_smooth(draw_smooth(0)[0], ROWS), draw_smooth(0)[1])
    for seed in range(8):
        path, limits = draw_smooth(seed)
        begin = perf_counter()
        ours = float(plan_rows(build_smooth(path, ROWS), limits)[1].time[-1])
        seconds = perf_counter() - begin
        theirs, remark = solve(path, limits) if yardstick else (np.nan, "copp-py is not installed")
        ratio = remark or f"{ours / theirs:.4f}"
        name = f"{len(limits.speed)} joints, {path.length:.0f} mm, seed {seed}"
        rows.append([name, f"{ours:.4f}", f"{theirs:.4f}", ratio, "≤ 1.005", f"{seconds:.2f}"])
    columns = ["path", "cycle time, s", "copp-py", "ratio", "bound", "planned in, s"]
    return table(f"Jerk-limited trajectories, {ROWS:,} rows", columns, rows)


if __name__ == "__main__":
    print(main())
