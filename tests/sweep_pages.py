"""Seeded interactions on machines' pages, by hand: ``python tests/sweep_pages.py SEED COUNT MACHINE ...``.

Of each machine: how long the slowest of them took, by kind, how the page's memory grew, and where margins are not the
library's. A page that hangs is waited for: its machine is missing from what is printed.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from browser import open_browser, open_tab
from playwright.sync_api import Error
from shipped import load_shipped
from test_page_interactions import find_difference, interact, write_page

LONGEST = 20_000  # ms


def sweep(browser, name, seed, count, folder):
    machine, rng, slowest, messages = load_shipped(name), np.random.default_rng([seed, *name.encode()]), {}, []
    with open_tab(browser) as tab:
        tab.set_default_timeout(LONGEST)
        tab.on("console", lambda message: messages.append(message.text) if message.type == "error" else None)
        tab.goto(write_page(name, folder))
        session = tab.context.new_cdp_session(tab)
        heap = [measure_heap(session)]
        for number in range(count):
            begin = time.perf_counter()
            try:
                kind = interact(tab, rng)
                tab.evaluate("0")  # answers once the page is idle
            except Error as error:
                print(f"{name}: interaction {number} did not end: {error}", flush=True)
                return
            took = time.perf_counter() - begin
            slowest[kind] = max(slowest.get(kind, (0.0, 0)), (took, number))
            difference = find_difference(tab, machine)
            if difference is not None:
                print(f"{name}: interaction {number}, {kind}: {difference}", flush=True)
            if number % 50 == 49:
                heap.append(measure_heap(session))
        times = ", ".join(f"{kind} {took:.2f} s ({number})" for kind, (took, number) in sorted(slowest.items()))
        print(f"{name}: {count} done, heap MB {heap}; slowest {times}; {messages}", flush=True)


def measure_heap(session):
    """Measure what a page's scripts hold, MB, once what they dropped is gone."""
    session.send("HeapProfiler.collectGarbage")
    return round(session.send("Runtime.getHeapUsage")["usedSize"] / 1e6, 1)


if __name__ == "__main__":
    with open_browser() as opened, tempfile.TemporaryDirectory() as place:
        for own in sys.argv[3:]:
            try:
                sweep(opened, own, int(sys.argv[1]), int(sys.argv[2]), Path(place))
            except (AssertionError, Error) as error:
                print(f"{own}: {error}", flush=True)
