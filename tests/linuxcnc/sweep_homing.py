"""Follow a machine's homing from many more starts, in finer steps, than the choice of its order looks at.

``python sweep_homing.py STARTS STEP MACHINE ...``: starts and mm. It prints from how many the homing did harm.
"""

from __future__ import annotations

import sys
from time import perf_counter

import parakin as pk
from parakin.controllers.linuxcnc.homing import homing_plan, starts, walk


def sweep(name: str, count: int, step: float) -> str:
    """Choose the order from the usual starts, and follow it from ``count`` others in steps of ``step`` mm."""
    machine = pk.load(name)
    plan = homing_plan.find_homing(machine)
    ends = {i: joint.switch for i, joint in enumerate(plan.joints[: machine.leg_count]) if joint.switch is not None}
    if not ends or len({plan.joints[i].sequence for i in ends}) > 1:
        return f"{name}: no legs that are homed together"
    starts.STARTS, starts._SAMPLES, walk._MOST_STEPS = count, 40 * count, 20_000
    walk._STEP = {"mm": step, "rad": 0.25 * step * walk._STEP["rad"]}
    starts.sample_starts.cache_clear()
    many = starts.sample_starts(machine)
    order = homing_plan._LegOrder((ends,))
    begin = perf_counter()
    end, _ = homing_plan._walk_order(machine, many, order, patient=True)
    harmed = int((~end.kept).sum())
    return (
        f"{name}: {len(many.poses)} starts, steps of {step:g} mm, {harmed} harmed, "
        f"least regularity {end.least.min():.4f} of home's, {perf_counter() - begin:.0f} s"
    )


def main() -> None:
    count, step = int(sys.argv[1]), float(sys.argv[2])
    for name in sys.argv[3:]:
        print(sweep(name, count, step), flush=True)


if __name__ == "__main__":
    main()
