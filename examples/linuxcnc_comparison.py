"""One tool path under the real LinuxCNC: as programmed and as posted, with LinuxCNC's planner and with parakin's.

The path is the first passes of the turbine blade's finishing, at 10 m/min in the cut, on the Tricept. The programs run
headless from the machine's home, in the same configuration but for the planner. Every servo cycle's joints are written
down; the picture shows their speeds as fractions of what the joints are allowed, and the cycle times. On other machines
the posted program runs too, at 10 and at 2 m/min, with drives that follow within 2 % of their own limits.

    python linuxcnc_comparison.py [-o PICTURE]

It needs LinuxCNC 2.9 with its development files, and root for installing the modules for the time of the run.
"""

import argparse
import io
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import turbine_blade

import parakin as pk

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests" / "linuxcnc"))
from simulation import CYCLE, as_programmed, first_line, simulated, trial, why_not  # noqa: E402
from stub import outward, world  # noqa: E402

RECORDS, SHOWN = 2000, 130  # of the whole operation, and of it here
FEED, SLOW = 10_000.0, 2_000.0  # mm/min in the cut
RESERVE = 0.02  # of the drives, over the limits of the machine's description
MACHINES = (  # where the part lies there, and whether its tool is upright
    ("tricept", None, False),
    ("hexapod", pk.workpiece(X=-60, Y=20, Z=710), False),
    ("linear_delta", pk.workpiece(X=-60, Y=45, Z=1920), True),
)
NAMES = {"d1": "strut d1", "d2": "strut d2", "d3": "strut d3", "theta1": "wrist θ1", "theta2": "wrist θ2"}
COLOURS = ("#9db4c9", "#6c8fb0", "#3f6d99", "#c8442f", "#d9a441")


def part(folder, upright, feed):
    """The first passes of the blade, as a CL file tells them."""
    path = turbine_blade.tool_path(RECORDS, upright)
    file = Path(folder) / "turbine_blade.cls"
    lines = turbine_blade.nx_lines(path, turbine_blade.FEEDS | {"cut": feed})
    file.write_text("\n".join(lines) + "\n", encoding="ascii")
    whole, shown = pk.read_path(file), slice(SHOWN)
    arrays = {name: getattr(whole, name)[shown] for name in ("tip", "axis", "line", "rapid", "feed", "spindle")}
    return replace(whole, events=tuple(e for e in whole.events if e.record < SHOWN), **arrays)


class Measured(NamedTuple):
    """What a run did: speeds and accelerations of the joints over their limits, (cycles, joints) each."""

    speeds: np.ndarray
    accelerations: np.ndarray

    @property
    def seconds(self):
        return len(self.speeds) * CYCLE

    def describe(self):
        """A row of a table."""
        over = (self.accelerations > 1.05).any(axis=1).mean()
        return f"{self.seconds:.3f} s | {self.speeds.max():.3f} | {self.accelerations.max():.2f} | {over:.1%}"


def measure(machine, simulation, text, start):
    """Run a program from home; what it does from its first record on."""
    run = simulation.run({"program": "part.ngc"}, {"part.ngc": text})
    if "told" in run.seen:
        sys.exit(f"LinuxCNC says: {run.seen['told']}")
    joints = run.joints[run.part(first_line(text), start)]
    rows = (np.array([[getattr(d, rate) for d in machine.drives]]) for rate in ("speed", "acceleration"))
    speed, acceleration = (outward(machine, row) for row in rows)
    return Measured(
        np.abs(np.diff(joints, axis=0)) / CYCLE / speed, np.abs(np.diff(joints, 2, axis=0)) / CYCLE**2 / acceleration
    )


def picture(target, machine, runs):
    """Joint speeds over time, one panel a run; ``runs`` are (title, utilisation, ...)."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    longest = max(len(utilisation) for _, utilisation in runs) * CYCLE
    highest = max(utilisation.max() for _, utilisation in runs)
    figure, panels = plt.subplots(2, 1, figsize=(10.0, 6.6), sharex=True, sharey=True, layout="constrained")
    for panel, (title, utilisation) in zip(panels, runs, strict=True):
        times = np.arange(len(utilisation)) * CYCLE
        for name, colour, values in zip(machine.joints, COLOURS, utilisation.T, strict=True):
            strong = name == machine.joints[int(runs[0][1].max(0).argmax())]
            panel.plot(times, 100.0 * values, color=colour, lw=1.7 if strong else 1.1, label=NAMES[name])
            panel.fill_between(times, 100.0, 100.0 * values, where=values > 1.0, color=colour, alpha=0.35, lw=0.0)
        panel.axhline(100.0, color="#222222", lw=1.2, ls=(0, (5, 3)))
        panel.axvline(times[-1], color="#888888", lw=0.8)
        panel.set_title(title, loc="left", fontsize=11.5)
        panel.set_ylabel("joint speed, % of its limit")
        panel.spines[["top", "right"]].set_visible(False)
        panel.grid(axis="y", color="#e6e6e6", lw=0.7)
        panel.set_axisbelow(True)
        panel.annotate(
            f"{len(utilisation) * CYCLE:.2f} s", (times[-1], 100.0 * highest), xytext=(-5, -2), ha="right", va="top",
            textcoords="offset points", fontsize=11, color="#333333",
        )  # fmt: skip
    panels[1].set_xlabel("time, s")
    panels[0].set_xlim(0.0, 1.01 * longest)
    panels[0].set_ylim(0.0, 106.0 * highest)
    panels[0].text(0.01 * longest, 103.0, "limit", fontsize=9.5, va="bottom")
    panels[1].legend(ncols=5, loc="upper left", bbox_to_anchor=(0.0, 0.93), frameon=False, fontsize=10)
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target, dpi=110)


def prepare(machine, folder, place, upright, feed):
    """The job, its program as posted, and the same path as a plain post writes it."""
    job = pk.prepare(machine, part(folder, upright, feed), workpiece=place)
    file = io.BytesIO()
    pk.make_linuxcnc_program(job.trajectory)(file)
    text = file.getvalue().decode("ascii")
    return job, text, as_programmed(job.posted, text)


def compare(folder, target):
    """The Tricept: as programmed and as posted, with both planners."""
    machine = trial("tricept", folder)
    job, posted, plain = prepare(machine, folder, None, False, FEED)
    start = world(machine, job.posted.poses[:1])[0]
    with simulated(machine, stock=True) as simulation:
        runs = [measure(machine, simulation, text, start) for text in (plain, posted)]
    with simulated(machine, reserve=RESERVE) as simulation:
        runs += [measure(machine, simulation, text, start) for text in (plain, posted)]
    names = [
        f"{what}, {whose} planner" for whose in ("LinuxCNC's", "parakin's") for what in ("as programmed", "posted")
    ]
    for name, run in zip(names, runs, strict=True):
        print(f"| tricept, {name} | {run.describe()} |")
    print(f"the trajectory takes {job.trajectory.seconds:.3f} s")
    shown = [(f"{names[i]}: {runs[i].speeds.max():.0%} of a joint's speed", runs[i].speeds) for i in (0, 3)]
    picture(target, machine, shown)


def run_posted(folder, name, place, upright, feed):
    """A posted program on another machine."""
    machine = trial(name, folder)
    job, text, _ = prepare(machine, folder, place, upright, feed)
    with simulated(machine, reserve=RESERVE) as simulation:
        run = measure(machine, simulation, text, world(machine, job.posted.poses[:1])[0])
    print(f"| {name}, posted, {feed / 1000:g} m/min | {run.describe()} | told {job.trajectory.seconds:.3f} s |")


def main():
    parser = argparse.ArgumentParser(description="Run a tool path under LinuxCNC as programmed and as posted.")
    place = HERE.parent / "docs" / "pictures" / "linuxcnc.png"
    parser.add_argument("-o", "--output", type=Path, default=place, metavar="PICTURE", help=f"default: {place.name}")
    options = parser.parse_args()
    missing = why_not()
    if missing:
        sys.exit(missing)
    with tempfile.TemporaryDirectory() as folder:
        compare(folder, options.output)
        for feed in (FEED, SLOW):
            for name, place, upright in MACHINES:
                run_posted(folder, name, place, upright, feed)
    print(options.output)


if __name__ == "__main__":
    main()
