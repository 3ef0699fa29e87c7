"""One tool path twice under the real LinuxCNC: with the feed as it is programmed, and as parakin posts it.

The path is the first passes of the turbine blade's finishing, at 10 m/min in the cut, on the Tricept. Both programs run
headless from the machine's home, in the same configuration. Every servo cycle's joints are written down; the picture
shows their speeds over what the joints are allowed, and the cycle times. On the hexapod, and with the tool
upright on the linear delta, the posted program runs too.

    python linuxcnc_comparison.py [-o PICTURE]

It needs LinuxCNC 2.9 with its development files, and root for installing the kinematics for the time of the run.
"""

import argparse
import io
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import turbine_blade

import parakin as pk

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests" / "linuxcnc"))
from simulation import CYCLE, as_programmed, first_line, simulated, trial, why_not  # noqa: E402
from stub import outward, world  # noqa: E402

RECORDS, SHOWN, FEED = 2000, 130, 10_000.0  # of the whole operation, of it here, and mm/min in the cut
OTHERS = (  # where the part lies there
    ("hexapod", pk.workpiece(X=-60, Y=20, Z=710), False),
    ("linear_delta", pk.workpiece(X=-60, Y=45, Z=1920), True),
)
NAMES = {"d1": "strut d1", "d2": "strut d2", "d3": "strut d3", "theta1": "wrist θ1", "theta2": "wrist θ2"}
COLOURS = ("#9db4c9", "#6c8fb0", "#3f6d99", "#c8442f", "#d9a441")


def part(folder, upright=False):
    """The first passes of the blade, as a CL file tells them."""
    path = turbine_blade.tool_path(RECORDS, upright)
    file = Path(folder) / "turbine_blade.cls"
    lines = turbine_blade.nx_lines(path, turbine_blade.FEEDS | {"cut": FEED})
    file.write_text("\n".join(lines) + "\n", encoding="ascii")
    whole, shown = pk.read_path(file), slice(SHOWN)
    arrays = {name: getattr(whole, name)[shown] for name in ("tip", "axis", "line", "rapid", "feed", "spindle")}
    return replace(whole, events=tuple(e for e in whole.events if e.record < SHOWN), **arrays)


def measured(machine, simulation, text, start):
    """Speeds of the joints over their limits, (cycles, joints), and the program's line, (cycles,)."""
    run = simulation.run({"program": "part.ngc"}, {"part.ngc": text})
    if "told" in run.seen:
        sys.exit(f"LinuxCNC says: {run.seen['told']}")
    shown = run.part(first_line(text), start)
    limits = outward(machine, np.array([[drive.speed for drive in machine.drives]]))
    return np.abs(np.diff(run.joints[shown], axis=0)) / CYCLE / limits, run.line[shown][1:]


def accelerations(machine, utilisation):
    """The greatest acceleration over its limit, and for how much of the time one is beyond it."""
    drives = machine.drives
    rates = np.array([drive.speed / drive.acceleration for drive in drives])
    found = (np.abs(np.diff(utilisation, axis=0)) / CYCLE * rates).max(1)
    return found.max(), (found > 1.05).mean()


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


def programs(machine, folder, place, upright):
    """The job, and its programs: as programmed and as posted."""
    job = pk.prepare(machine, part(folder, upright), workpiece=place)
    file = io.BytesIO()
    pk.make_linuxcnc_program(job.trajectory)(file)
    text = file.getvalue().decode("ascii")
    return job, as_programmed(job.posted, text), text


def told(job, text, ours):
    """A line about a posted program that has run."""
    took, planned = len(ours) * CYCLE, job.trajectory.seconds
    worst = job.posted.machine.joints[int(ours.max(0).argmax())]
    return (
        f"posted: {len(job.posted.path)} records ({job.inserted} inserted), {text.count('G53 G1')} motions; "
        f"{took:.3f} s, trajectory {planned:.3f} s ({took / planned - 1.0:+.1%}), "
        f"program {pk.predict_linuxcnc_seconds(job.trajectory):.3f} s; "
        f"{worst} at {ours.max():.3f} of its speed"
    )


def compare(folder, target):
    """The Tricept, both ways."""
    machine = trial("tricept", folder)
    job, *texts = programs(machine, folder, None, False)
    start = world(machine, job.posted.poses[:1])[0]
    with simulated(machine) as simulation:
        (plain, lines), (ours, _) = (measured(machine, simulation, text, start) for text in texts)
    cutting = ~job.posted.path.rapid[np.clip(lines - first_line(texts[0]) + 1, 0, len(job.posted.path) - 1)]
    worst, over = machine.joints[int(plain.max(0).argmax())], (plain.max(1) > 1.0).sum() * CYCLE
    print(f"tricept, as programmed: {len(plain) * CYCLE:.3f} s; {worst} at {plain[~cutting].max():.2f} of its speed in")
    print(f"  rapid and {plain[cutting].max():.2f} in the cut, beyond it for {over:.2f} s")
    print(f"tricept, {told(job, texts[1], ours)}")
    for way, utilisation in ("as programmed", plain), ("posted", ours):
        most, often = accelerations(machine, utilisation)
        print(f"  accelerations {way}: up to {most:.1f} times the limit, beyond it in {often:.0%} of the cycles")
    titles = (
        f"Feed as programmed: {NAMES[worst]} at {plain.max():.0%} of its limit",
        f"Posted by parakin: no joint beyond {ours.max():.1%}; predicted {job.trajectory.seconds:.2f} s",
    )
    picture(target, machine, list(zip(titles, (plain, ours), strict=True)))


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
        for name, workpiece, upright in OTHERS:
            machine = trial(name, folder)
            job, _, text = programs(machine, folder, workpiece, upright)
            with simulated(machine) as simulation:
                ours, _ = measured(machine, simulation, text, world(machine, job.posted.poses[:1])[0])
            print(f"{name}, {told(job, text, ours)}")
    print(options.output)


if __name__ == "__main__":
    main()
