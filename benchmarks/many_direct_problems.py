"""Direct problems by the million: answers in another working mode or on another side, which there may be none of.

``python benchmarks/many_direct_problems.py 1000000`` takes so many a machine; by default it is less.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from measure import table

import parakin as pk

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from direct_problems import try_direct_problems

COUNT = 100_000


class Stopwatch:
    """A machine whose direct problems are timed."""

    def __init__(self, machine: pk.Machine):
        self.machine, self.seconds = machine, 0.0
        machine.forward(machine.inverse(np.tile(machine.home, (2, 1))), near=machine.home)  # compiled before it counts

    def __getattr__(self, name: str) -> object:
        return getattr(self.machine, name)

    def forward(self, *args: object, **options: object) -> object:
        start = time.perf_counter()
        solution = self.machine.forward(*args, **options)
        self.seconds += time.perf_counter() - start
        return solution


def main(count: int = COUNT) -> str:
    rows = []
    for name in pk.machines():
        machine = Stopwatch(pk.load(name))
        tally = try_direct_problems(machine, count, mode=machine.mode)
        wrong = [str(number) for number in (tally.other_mode, tally.other_side)]
        close = f"{tally.close_refused - tally.close_across} of {tally.close:,}"
        cells = [f"{tally.refused:,}", close, str(tally.close_across), f"{1e9 * machine.seconds / count:.0f}"]
        causes = ", ".join(f"{number} {cause}" for cause, number in tally.causes.items())
        rows.append([name, *wrong, f"{tally.open_by:.1e}", *cells, causes])
        print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    title = f"{count:,} direct problems a machine from starts up to 600 mm and 80° off, the farthest refused"
    columns = [
        "machine",
        "in another mode",
        "on another side",
        "open by, mm",
        "refused",
        "refused from 1 mm",
        "across",
        "ns a problem",
        "refused from 1 mm, why",
    ]
    return table(title, columns, rows)


if __name__ == "__main__":
    print(main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT))
