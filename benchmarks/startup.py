"""How long a user waits: help, the first result after a fresh install, a later start."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

from measure import best, table

INVERSE = "import parakin as pk; m = pk.load('tricept'); print(m.inverse(m.home))"


def run(arguments: list[str], cache: str | None = None) -> None:
    environment = dict(os.environ) if cache is None else {**os.environ, "NUMBA_CACHE_DIR": cache}
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True, env=environment)


def once(arguments: list[str]) -> float:
    """Seconds with an empty kernel cache."""
    with tempfile.TemporaryDirectory() as cache:
        start = time.perf_counter()
        run(arguments, cache)
        return time.perf_counter() - start


def main() -> str:
    command = ["-m", "parakin.cli"]
    rows = [
        ["bare interpreter", f"{best(lambda: run(['-c', 'pass']), 5):.2f}", ""],
        ["parakin --help", f"{best(lambda: run([*command, '--help']), 5):.2f}", "≤ 0.3"],
        [
            "parakin inverse, kernels compiled",
            f"{best(lambda: run([*command, 'inverse', 'tricept', 'Z=-1600']), 3):.2f}",
            "≤ 1.0",
        ],
        ["import parakin; one inverse", f"{best(lambda: run(['-c', INVERSE]), 3):.2f}", "≤ 1.0"],
        ["parakin inverse, first after an install", f"{once([*command, 'inverse', 'tricept', 'Z=-1600']):.2f}", "≤ 3"],
        [
            "parakin forward, first after an install",
            f"{once([*command, 'forward', 'hexapod', *['990'] * 6]):.2f}",
            "≤ 3",
        ],
    ]
    return table("Starting up", ["what", "s", "bound"], rows)


if __name__ == "__main__":
    print(main())
