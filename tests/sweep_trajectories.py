"""Plan seeded wild paths, with jerk limits and without, and hold every row's joints against their limits.

``python sweep_trajectories.py FIRST LAST LOG`` runs seeds FIRST to LAST - 1 and adds a line to LOG for each, with what
is wrong; what the log has already is not run again. Of 1,000 paths some 6 have 1e5 to 1e6 rows, 40 have 1e4 to 1e5.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import process_time

import numpy as np
from seeded_rows import draw_wild, measure_pieces, plan_rows

from parakin.toolpath.timing import time_optimal
from parakin.toolpath.timing.joint_path import divide_joint_path

BEYOND = 1.001  # times a limit
SIZES = (  # share up to here, least and most rows
    (0.006, 1e5, 1_000_000),
    (0.046, 1e4, 100_000),
    (0.126, 1e3, 10_000),
    (1.0, 10.0**0.3, 1_000),
)
PLACES, FEWER, MANY = 41, 11, 50_000  # on each piece where joints are looked at; of more pieces fewer
BLOCK = 20_000  # pieces


def draw_sized(seed):
    """A wild path of a size that the seed draws."""
    drawn = np.random.default_rng([seed, 12]).random()
    least, most = next((least, most) for share, least, most in SIZES if drawn < share)
    return draw_wild(seed, most, least)


def measure_all(path, profile, limits):
    """The greatest fractions of speed, acceleration, jerk and feed over all pieces, a block at a time."""
    pieces, worst = len(profile.row), np.zeros(4)
    for first in range(0, pieces, BLOCK):
        block = slice(first, min(first + BLOCK, pieces))
        motion = (column[block] for column in profile[1:-1])
        part = type(profile)(profile.time[first : block.stop + 1], *motion, profile.row_times)
        worst = np.maximum(worst, measure_pieces(path, part, limits, PLACES if pieces <= MANY else FEWER))
    return worst


def check_profile(path, way, profile, limits):
    """Say what does not hold of a profile on a path of length ``way``."""
    if not np.isfinite(profile.time[-1]):
        return "no time"
    span, digit = np.diff(profile.time), 2.0 * np.spacing(profile.time[-1])
    if (span < 0.0).any() or ((span == 0.0) & (path.step[profile.row] > digit * profile.speed)).any():
        return "time stands still"
    if abs(path.step.sum() - way) > 1e-9 * way:
        return "another length"
    worst = measure_all(path, profile, limits)
    return "" if worst.max() < BEYOND else f"beyond {worst}"


def sweep(seed):
    """Plan one path; what is wrong, rows and seconds."""
    path, limits = draw_sized(seed)
    way, begin = path.step.sum(), process_time()
    refined, profile = plan_rows(path, limits)
    seconds = process_time() - begin
    soft = limits._replace(jerk=np.full_like(limits.jerk, np.inf))
    # There is no machine: no forces, and new rows lie on the splines.
    finer, x, u = time_optimal.find_quickest(path, soft, None, divide_joint_path)
    plain = time_optimal.build_accelerated_profile(finer, soft, x, u)[0]
    wrong = [check_profile(refined, way, profile, limits), check_profile(finer, way, plain, soft)]
    return wrong, len(path.step), seconds


def main():
    first, last, log = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    done = {line.split()[0] for line in log.read_text().splitlines()} if log.exists() else set()
    for seed in range(first, last):
        if str(seed) in done:
            continue
        print(seed, flush=True)
        (jerked, plain), rows, seconds = sweep(seed)
        words = f"{rows} rows, {seconds:.2f} s of processor {jerked} {plain and f'without jerk {plain}'}"
        with log.open("a") as file:
            file.write(f"{seed} {words}\n")


if __name__ == "__main__":
    main()
