"""Inverse and direct kinematics of a million poses, against the copy of the same bytes, plain NumPy and gcc -O2."""

from __future__ import annotations

import shutil

import numpy as np
from in_c import compiled, source
from measure import best, table

import parakin as pk
from parakin.algebra import Trace
from parakin.kernels.batch import count_cores

COUNT = 1_000_000
# What each has to keep to: inverse and direct, times the copy.
BOUNDS = {"tricept": (2.0, 12.0), "hexapod": (2.0, 25.0), "lambda6": (2.0, None), "linear_delta": (None, 6.0)}


def poses_around_home(machine: pk.Machine, rng: np.random.Generator) -> np.ndarray:
    """Allowed poses within 100 mm and 17° of home."""
    spread = np.where(np.array(machine.axis_units) == "mm", 100.0, 0.3)
    poses = machine.home + rng.uniform(-1.0, 1.0, (COUNT, len(machine.axes))) * spread
    if machine.axes == ("X", "Y", "Z", "B", "C"):
        poses[:, 3:] = np.abs(poses[:, 3:]) + [0.05, 0.0]
    lost = machine.check(poses) != 0
    poses[lost] = poses[~lost][: lost.sum()] if (~lost).sum() >= lost.sum() else machine.home
    return poses


def main() -> str:
    rng = np.random.default_rng(1)
    rows = []
    for name in BOUNDS:
        machine = pk.load(name)
        poses = poses_around_home(machine, rng)
        joints = np.empty((COUNT, len(machine.joints)))
        both = np.zeros((COUNT, poses.shape[1] + joints.shape[1]))
        other = np.ones_like(both)
        copy = best(lambda: np.copyto(other, both))  # noqa: B023
        off = np.where(np.array(machine.axis_units) == "mm", 1.0 / np.sqrt(3.0), np.deg2rad(0.5))
        near = poses + off * rng.choice([-1.0, 1.0], poses.shape)

        inverse = best(lambda: machine.inverse(poses, out=joints))  # noqa: B023
        columns = [np.ascontiguousarray(c) for c in poses.T]
        numpy = best(lambda: machine.model.invert(columns, machine.mode), 3)  # noqa: B023
        solution = machine.forward(joints, near)
        assert solution.converged.all() and np.nanmax(np.abs(machine.inverse(solution.poses) - joints)) < 1e-9
        direct = best(lambda: machine.forward(joints, near), 5)  # noqa: B023
        lines = [("inverse", "parakin", inverse, BOUNDS[name][0]), ("inverse", "NumPy", numpy, None)]
        if shutil.which("gcc"):
            trace = Trace()
            outputs = machine.model.invert(trace.inputs(poses.shape[1]), machine.mode)[0]
            batch = compiled(source(trace, outputs, poses.shape[1]))
            lines.append(("inverse", "gcc -O2", best(lambda: batch(poses, joints), 3), None))  # noqa: B023
        lines.append(("direct, near", "parakin", direct, BOUNDS[name][1]))
        rows.append([name, "copy", f"{1e9 * copy / COUNT:.1f}", "1.00", ""])
        for problem, tool, seconds, bound in lines:
            limit = "" if bound is None else f"≤ {bound:g}"
            rows.append([name, f"{problem}, {tool}", f"{1e9 * seconds / COUNT:.1f}", f"{seconds / copy:.2f}", limit])
    title = f"{COUNT:,} poses, {count_cores()} cores (NumPy and gcc: one), C-ordered float64"
    return table(title, ["machine", "what", "ns a pose", "times the copy", "bound"], rows)


if __name__ == "__main__":
    print(main())
