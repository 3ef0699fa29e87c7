"""Proved worst cases at single poses against drawn machines: python tests/sweep_worst_case.py MM POSES [NAMES].

Every geometric number of a machine is off by up to MM mm (angles by as many tenths of a degree). Machines at ends of
all tolerances, evenly drawn ones, and ones that are bettered number by number, each by its own direct problem, must not
break the bound; told is the bound over what is attained, for each machine.
"""

import sys
import time

import numpy as np

import parakin as pk
from parakin.errors import NoMethodError

_DRAWN = 4000


def measure(machine, accuracy, pose, rng):
    """Measure the bound, what it attains itself, and the greatest error of drawn machines, mm."""
    within = accuracy.tolerances
    family, halves = within.family, within.halves
    ranges = {axis: (value, value) for axis, value in zip(machine.axes, pose.tolist(), strict=True)}
    proved = pk.bound_worst_case(pk.analyse_accuracy(machine, within_texts(within), pose[None]), ranges)
    joints, tip = machine.inverse(pose), [axis in "XYZ" for axis in machine.axes]

    def err(ends):
        moved = family.forward(joints, family.nominal + ends * halves, near=pose).poses
        return np.nan_to_num(np.linalg.norm((moved - pose)[:, tip], axis=1))

    ends = np.vstack([rng.choice([-1.0, 1.0], (_DRAWN, len(halves))), rng.uniform(-1.0, 1.0, (_DRAWN, len(halves)))])
    errors = err(ends)
    best = ends[errors.argmax()]
    for _ in range(4):  # every number to its other end, where that is worse
        turned = np.where(np.eye(len(halves), dtype=bool), np.where(best > 0.0, -1.0, 1.0), best)
        gains = err(turned) - err(best[None])
        best = np.where(gains > 0.0, np.diag(turned), best)
    return proved.bound, proved.attained, max(errors.max(), err(best[None])[0])


def within_texts(within):
    return [(t.name, f"{t.value!r} {t.unit}") for t in within.tolerances]


def main(size, poses, names):
    """Measure machines, all by default."""
    rng = np.random.default_rng(0)
    for name in names or pk.machines():
        machine = pk.load(name)
        units = dict.fromkeys((p.name, p.unit) for p in machine.parameters if p.group != "sizes")
        texts = [(n, f"{size} mm" if unit == "mm" else f"{0.1 * size} deg") for n, unit in units]
        began = time.process_time()
        accuracy = pk.analyse_accuracy(machine, texts, samples=poses)
        try:
            rows = np.array([measure(machine, accuracy, pose, rng) for pose in accuracy.poses])
        except NoMethodError as error:
            print(f"{name}: {error}", flush=True)
            continue
        broken = int((rows[:, 2] > rows[:, 0]).sum())
        known = rows[np.isfinite(rows[:, 0])]
        ratios = known[:, 0] / known[:, 1:].max(1) if len(known) else np.array([np.inf])
        print(
            f"{name}: {len(texts)} tolerances, attained up to {rows[:, 1:].max():.3f} mm, "
            f"{len(rows) - len(known)} unproved, {broken} broken, "
            f"bound over attained {np.median(ratios):.4f} to {ratios.max():.4f}, "
            f"{time.process_time() - began:.1f} s",
            flush=True,
        )


if __name__ == "__main__":
    main(float(sys.argv[1]), int(sys.argv[2]), sys.argv[3:])
