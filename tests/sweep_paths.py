"""Random paths over every machine that tilts the tool, in the planner that LinuxCNC loads; for running by hand.

``python sweep_paths.py FIRST LAST LOG [MACHINE ...]`` makes the paths of seeds FIRST to LAST - 1 on each machine and
adds a line to LOG for each, with what is wrong, or the offence for which it is refused; what the log has already is not
run again. The files of paths that failed are left beside the log.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from time import process_time

from random_paths import REACH_OF_ALL, PathMaker
from test_random_paths import build_controller, find_fault

import parakin as pk


def run_path(controller, seed, folder):
    """Post one path and run it: a word for what came of it and the reason, the recipes, and the path's text."""
    maker = PathMaker(controller.machine, seed)
    text = maker.make()
    (folder / "part.cls").write_text(text, encoding="ascii")
    try:
        job = pk.prepare(controller.machine, pk.read_path(folder / "part.cls"))
        if job.runs:
            fault = find_fault(controller, job)
            told = f"FAULT {fault}" if fault else f"ok {job.seconds:.2f} s"
        else:
            first = job.posted.first
            told = f"refused {first.line}: {first.text}" if first else f"refused {job.unplanned}"
    except Exception as error:  # whatever it is, it is a fault of the path's, and the sweep goes on
        told = f"FAULT {type(error).__name__}: {error}"
    return told, maker.recipes, text


def main(first, last, log, names):
    log = Path(log)
    done = {tuple(line.split()[:2]) for line in log.read_text("utf-8").splitlines()} if log.exists() else set()
    with tempfile.TemporaryDirectory() as folder:
        controllers = {}
        for seed in range(int(first), int(last)):
            for name in names or REACH_OF_ALL:
                if (name, str(seed)) in done:
                    continue
                if name not in controllers:
                    (Path(folder) / name).mkdir()
                    controllers[name] = build_controller(name, Path(folder) / name)
                start = process_time()
                told, recipes, text = run_path(controllers[name], seed, Path(folder))
                if told.startswith("FAULT"):
                    (log.parent / f"{name}_{seed}.cls").write_text(text, encoding="ascii")
                with log.open("a", encoding="utf-8") as lines:
                    lines.write(f"{name} {seed} {told} [{' '.join(recipes)}] {process_time() - start:.1f} s CPU\n")


if __name__ == "__main__":
    main(*sys.argv[1:4], sys.argv[4:])
