"""All benchmarks, one after the other, as tables of ratios."""

from __future__ import annotations

import assemblies
import feed
import kinematics
import linuxcnc
import many_direct_problems
import page
import post
import startup
import trajectory
import workspace

if __name__ == "__main__":
    for benchmark in (
        kinematics, many_direct_problems, assemblies, post, startup, workspace, feed, trajectory, linuxcnc, page,
    ):  # fmt: skip
        print(benchmark.main(), flush=True)
