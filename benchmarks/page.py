"""The page: how long until a machine is seen, what a drag and a coarse workspace cost, and how large it is.

Costs are CPU time of the page's thread as Chromium counts it, all but what the graphics card does: a drag goes far
beyond what is allowed and back, frame by frame, of the tool, of a drive and of a size; the dearest of the three counts.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from measure import table

import parakin as pk
from parakin.export.page.page import render_machine_page, write_core, write_surface_worker

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from browser import open_browser, wait_until
from studio_client import run_studio

STARTS = 3
MOVES = 12
SEEN = "globalThis.parakin?.pictures > 0"
DRAG = """async ([kind, moves]) => {
  const frame = () => new Promise(resolve => requestAnimationFrame(resolve));
  const {machine, model} = parakin, sway = k => Math.sin(2 * Math.PI * (k + 1) / moves);
  parakin.goHome();
  await frame();
  const {pose, joints} = parakin.state, sizes = [...model.sizes];
  for (let k = 0; k < moves; k++) {
    if (kind === "tool") {
      parakin.moveToPose(pose.map((value, i) => value + sway(k) * (machine.axes[i].high - machine.axes[i].low)));
    }
    if (kind === "drive") parakin.moveToJoints(joints.map((q, i) => q + (i ? 0 : 0.5 * sway(k) * machine.size)));
    if (kind === "size") parakin.moveToSizes(sizes.map((value, i) => i ? value : value * (1 + 0.4 * sway(k))));
    await frame();
  }
  if (kind === "size") parakin.moveToSizes(sizes);
}"""
COARSE = """() => {
  const request = {pose: machine.axes.map(axis => axis.home), signs: machine.mode};
  const lattice = makeLattice(places, ...findRanges(places), LEVELS[0]);
  for (let layer = 0; layer < lattice.count; layer++) fillLayer(lattice, layer, request);
  return marchLattice(lattice, request).positions.length;
}"""


class Tab:
    """A tab with a clock of its thread's CPU time."""

    def __init__(self, browser):
        self.page = browser.new_page(viewport={"width": 1280, "height": 800})
        self.session = self.page.context.new_cdp_session(self.page)
        self.session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def measure_cpu(self) -> float:
        metrics = self.session.send("Performance.getMetrics")["metrics"]
        return float(next(metric["value"] for metric in metrics if metric["name"] == "TaskDuration"))

    def run(self, script: str, given: object = None) -> float:
        """Seconds of CPU that a script takes."""
        begin = self.measure_cpu()
        self.page.evaluate(script, given)
        return self.measure_cpu() - begin


def open_page(browser, folder: Path) -> float:
    """Seconds from the command that writes a page to its first picture."""
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-m", "parakin", "page", "tricept"], check=True, capture_output=True, cwd=folder)
    tab = browser.new_page()
    tab.goto((folder / "tricept.html").as_uri())
    wait_until(tab, SEEN)
    seconds = time.perf_counter() - begin
    tab.close()
    return seconds


def open_studio(browser, folder: Path) -> float:
    """Seconds from the studio's command to the first picture of its machine."""
    begin = time.perf_counter()
    with run_studio(folder) as studio:
        tab = browser.new_page()
        tab.goto(studio.address)
        wait_until(tab, SEEN.replace("globalThis", "document.querySelector('iframe')?.contentWindow"))
        seconds = time.perf_counter() - begin
        tab.close()
    return seconds


def measure_drag(tab: Tab, file: Path) -> float:
    """Seconds of CPU of a move and its picture."""
    tab.page.goto(file.as_uri())
    wait_until(tab.page, SEEN)
    return max(tab.run(DRAG, [kind, MOVES]) for kind in ("tool", "drive", "size")) / MOVES


def measure_coarse(browser, machine: pk.Machine) -> float:
    """Seconds of CPU of the first surface, or area in a plane, that a page's worker answers with."""
    tab = Tab(browser)
    tab.page.add_script_tag(content=write_core(machine) + write_surface_worker())
    tab.run(COARSE)
    seconds = tab.run(COARSE)
    tab.page.close()
    return seconds


def main() -> str:
    machines = [pk.load(name) for name in pk.machines()]
    drags: dict[str, float] = {}
    coarse: dict[str, float] = {}
    sizes: dict[str, float] = {}
    with open_browser() as browser, tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shown = min(open_page(browser, folder) for _ in range(STARTS))
        served = min(open_studio(browser, folder) for _ in range(STARTS))
        tab = Tab(browser)
        for machine in machines:
            file = folder / f"{machine.name}.html"
            file.write_text(render_machine_page(machine), encoding="utf-8")
            sizes[machine.name] = file.stat().st_size
            drags[machine.name] = measure_drag(tab, file)
            if machine.axis_units.count("mm") >= 2:
                coarse[machine.name] = measure_coarse(browser, machine)
    rows = [
        ["parakin page tricept, opened, to its first picture, s", f"{shown:.2f}", "", "≤ 4"],
        ["parakin studio, to its first picture, s", f"{served:.2f}", "", "≤ 4"],
        summarise("a drag's move, ms of CPU", drags, 1e3, "≤ 16"),
        summarise("a coarse workspace, ms of CPU", coarse, 1e3, "≤ 150"),
        summarise("size of a page, MB", sizes, 1e-6, "≤ 1"),
    ]
    return table(f"Pages of {len(machines)} machines", ["what", "median", "worst", "bound"], rows)


def summarise(what: str, measured: dict[str, float], factor: float, bound: str) -> list[str]:
    worst = max(measured, key=lambda name: measured[name])
    return [what, f"{factor * median(measured.values()):.3g}", f"{factor * measured[worst]:.3g} ({worst})", bound]


if __name__ == "__main__":
    print(main())
