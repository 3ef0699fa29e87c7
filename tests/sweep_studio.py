"""Seeded presses in a studio, by hand: ``python tests/sweep_studio.py SEED COUNT [MACHINE]``.

All that can be pressed, chosen or typed into is, in the panel and on the machines' pages; now and then
what runs is cancelled. It prints errors of the pages' scripts and of their consoles, and whether the studio still runs
a command in the end.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from browser import open_browser, open_tab, wait_until
from playwright.sync_api import Error
from studio_client import run_studio
from test_page_interactions import NUMBERS

PART = "UNITS/MM\nFEDRAT/900,MMPM\nRAPID\nGOTO/0,0,0\nGOTO/40,10,0\nGOTO/40,-30,0\nFINI\n"
KEYS = [
    "Tab",
    "Shift+Tab",
    "Enter",
    "Space",
    "ArrowDown",
    "ArrowUp",
    "Home",
    "End",
    "PageDown",
    "Escape",
    "h",
    "v",
    "p",
]
CONTROLS = "button:visible, select:visible, input:visible, textarea:visible, summary:visible"
KIND = """control => [
  control.matches("select") ? "choice" : control.matches("textarea, [type=text], input:not([type])") ? "text" : "press",
  control.id || control.textContent.slice(0, 30),
]"""
TEXTS = [*NUMBERS, "X=10", "../a", "R=1mm", "-", "mine", "a b", "\u00e4.yaml"]


def press(tab, rng):
    """Press, choose or type into one control of the panel or a page; returns what it was."""
    frame = tab.frames[int(rng.integers(len(tab.frames)))] if rng.random() < 0.4 else tab.main_frame
    if rng.random() < 0.25:
        key = str(rng.choice(KEYS))
        tab.keyboard.press(key)
        return key
    controls = frame.locator(CONTROLS)
    count = controls.count()
    if not count:
        return "nothing"
    control = controls.nth(int(rng.integers(count)))
    kind, what = control.evaluate(KIND)
    if kind == "choice":
        control.select_option(index=int(rng.integers(control.locator("option").count())))
    elif kind == "text":
        control.fill(str(rng.choice(TEXTS)))
    else:
        control.click()
    return what


def sweep(seed, count, machine, folder):
    rng, said = np.random.default_rng(seed), []
    (folder / "part.apt").write_text(PART, encoding="utf-8")
    with run_studio(folder, machine, "part.apt") as client, open_browser() as browser, open_tab(browser) as tab:
        tab.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
        tab.on("filechooser", lambda chooser: None)
        tab.set_default_timeout(5_000)
        tab.goto(client.address)
        wait_until(tab, "document.body.dataset.ready === 'yes'", 120.0)
        missed = 0
        for number in range(count):
            try:
                what = press(tab, rng)
                tab.evaluate("0")
            except Error as error:  # what was to be pressed went, or lies under another
                missed += 1
                what = str(error).split("\n")[0]
            if number % 25 == 24:
                print(f"{number + 1}: {what}; {missed} missed; console {said}", flush=True)
            if number % 40 == 39:
                cancel_all(tab)
        cancel_all(tab)
        tab.evaluate("studio.run('machines', {})")
        wait_until(tab, "document.querySelector('#runs').textContent.includes('orthoglide')", 60.0)
        print(f"alive after {count} presses, {missed} missed; console {said}", flush=True)


def cancel_all(tab):
    tab.evaluate("[...document.querySelectorAll('.run button')].forEach(b => b.textContent === 'Cancel' && b.click())")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        sweep(int(sys.argv[1]), int(sys.argv[2]), (sys.argv[3:] or ["tricept"])[0], Path(place))
