"""One motion, or two, beside a pole, in a record each and cut into hundreds: one verdict, and nearly one time.

For running by hand. ``python sweep_densities.py FIRST LAST LOG [MACHINE ...]`` draws a pair of paths for each of seeds
FIRST to LAST - 1 on each machine, and adds a line to LOG with both times and their ratio, or with both verdicts; what
the log has already is not run again. Records have nine decimals, for the last one that a file prints is noise.
"""

from __future__ import annotations

import sys
import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np
from random_paths import PathMaker

import parakin as pk

MACHINES = ("tricept", "orthoglide5_table", "george_v", "sprint_z3", "exechon", "pentapod", "tricept_805")
MOST_RATIO = 1.5  # of both times
SHORT = 0.05  # s: what both may differ by besides


def draw_rows(machine, seed):
    """The few records, (n, 6) tips and axes, and the feed: off a pole, over it, or beside it, and on to anywhere."""
    maker = PathMaker(machine, seed)
    maker.digits, maker.lines = 9, []
    rng, azimuth = maker.rng, maker.choose_azimuth()
    kind = rng.choice(["off", "over", "beside"])
    tilts = {"off": (maker.choose_miss(), azimuth), "over": (maker.choose_tilt(), azimuth + np.pi)}
    maker.go(maker.tip, *tilts.get(kind, (maker.choose_tilt(), azimuth + rng.uniform(-2.5, 2.5))))
    maker.go(maker.tip + maker.choose_step(), maker.choose_tilt(), azimuth)
    if rng.random() < 0.3:
        maker.go(maker.tip + maker.choose_step(), maker.choose_tilt(), maker.choose_azimuth())
    rows = np.array([line.removeprefix("GOTO/").split(",") for line in maker.lines], float)
    return rows, float(np.exp(rng.uniform(*np.log([500.0, 20_000.0])))), int(rng.integers(20, 300)), str(kind)


def cut_rows(rows, count):
    """Each motion in ``count`` pieces: tips on the straight line, axes evenly on the great circle."""
    cut = [rows[:1]]
    for begin, end in pairwise(rows):
        s = np.arange(1.0, count + 1.0)[:, None] / count
        angle = np.arctan2(np.linalg.norm(np.cross(begin[3:], end[3:])), begin[3:] @ end[3:])
        weights = (np.sin((1.0 - s) * angle), np.sin(s * angle)) if angle > 1e-9 else (1.0 - s, s)
        axis = weights[0] * begin[3:] + weights[1] * end[3:]
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        cut.append(np.hstack([begin[:3] + s * (end - begin)[:3], axis]))
    return np.concatenate(cut)


def prepare_rows(machine, rows, feed, file):
    """The cycle time, or what is in the way: limit or reason without its place and its values."""
    points = ("GOTO/" + ",".join(f"{value:.9f}" for value in row) for row in rows)
    file.write_text("\n".join(["TOOL PATH/PAIR", f"FEDRAT/{feed:.1f},MMPM", *points, "FINI", ""]), encoding="ascii")
    job = pk.prepare(machine, pk.read_path(file))
    if job.runs:
        return job.seconds
    return job.posted.first.text.split(" would be")[0] if job.posted.first else job.unplanned.split(": ")[-1]


def compare_pair(machine, seed, file):
    """A word for what came of one pair, with both times or verdicts."""
    rows, feed, count, kind = draw_rows(machine, seed)
    few, many = (prepare_rows(machine, each, feed, file) for each in (rows, cut_rows(rows, count)))
    if isinstance(few, str) or isinstance(many, str):
        word = "same" if isinstance(few, str) and isinstance(many, str) else "FAULT"
        return f"{word} [{kind} {count}] few: {few} many: {many}"
    ratio = max(few, many) / min(few, many)
    word = "FAULT" if ratio > MOST_RATIO and abs(few - many) > SHORT else "ok"
    return f"{word} [{kind} {count}] few {few:.3f} s many {many:.3f} s ratio {ratio:.3f}"


def main(first, last, log, names):
    log = Path(log)
    done = {tuple(line.split()[:2]) for line in log.read_text("utf-8").splitlines()} if log.exists() else set()
    machines = {name: pk.load(name) for name in names or MACHINES}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(int(first), int(last)):
            for name, machine in machines.items():
                if (name, str(seed)) not in done:
                    told = compare_pair(machine, seed, Path(folder) / "part.cls")
                    with log.open("a", encoding="utf-8") as lines:
                        lines.write(f"{name} {seed} {told}\n")


if __name__ == "__main__":
    main(*sys.argv[1:4], sys.argv[4:])
