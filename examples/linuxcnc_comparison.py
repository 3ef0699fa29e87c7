"""One tool path under the real LinuxCNC: as programmed and as posted, with LinuxCNC's planner and with parakin's.

The path is the first passes of the turbine blade's finishing, at 10 m/min in the cut, on the Tricept. The programs run
headless from the machine's home, in the same configuration but for the planner. Every servo cycle's joints are written
down; the picture shows their speeds as fractions of what the joints are allowed, and the cycle times. The table has the
same of four machines, at 10 and at 2 m/min, with ideal drives and with drives that follow within 2 % of their own
limits, as programmed, as posted, and as posted with pauses and overrides amid it; and moves by MDI all over their
workspaces.

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
from parakin.controllers.linuxcnc.axis_ranges import estimate_axis_ranges
from parakin.controllers.linuxcnc.home_pose import find_home_pose

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests" / "linuxcnc"))
from planner import Planner, read_program  # noqa: E402
from simulation import CYCLE, as_programmed, first_line, simulated, why_not  # noqa: E402
from stub import FIELDS, outward, world  # noqa: E402

RECORDS, SHOWN = 2000, 130  # of the whole operation, and of it here
FEED, SLOW = 10_000.0, 2_000.0  # mm/min in the cut
MOVES, FASTEST = 24, 1e6  # by MDI, mm/min
RESERVE = 0.02  # of the drives, over the limits of the machine's description
CHANGES = [  # s after the first record's turn has come; what the operator does then
    [1.0, "feedrate", 0.3],
    [2.5, "feedrate", 1.0],
    [3.0, "auto", "AUTO_PAUSE"],
    [3.5, "auto", "AUTO_RESUME"],
    [4.0, "feedrate", 0.0],
    [4.4, "feedrate", 1.0],
    [4.8, "auto", "AUTO_PAUSE"],
    [5.2, "auto", "AUTO_RESUME"],
]
NAMES = {"d1": "strut d1", "d2": "strut d2", "d3": "strut d3", "theta1": "wrist θ1", "theta2": "wrist θ2"}
COLOURS = ("#9db4c9", "#6c8fb0", "#3f6d99", "#c8442f", "#d9a441")


class Place(NamedTuple):
    """Where the part lies on a machine: on top of the file's frame or without it, the tool tilted or upright."""

    name: str
    workpiece: np.ndarray | None = None
    frame: str = "file"
    upright: bool = False


PLACES = (
    Place("tricept"),
    Place("hexapod", pk.workpiece(X=-60, Y=20, Z=710)),
    Place("linear_delta", pk.workpiece(X=-60, Y=45, Z=1920), upright=True),
    Place("orthoglide5_table", pk.workpiece(X=-97, Y=13), frame="ignore"),
)


def part(folder, place, feed):
    """The first passes of the blade, as a CL file tells them."""
    path = turbine_blade.tool_path(RECORDS, place.upright)
    file = Path(folder) / "turbine_blade.cls"
    lines = turbine_blade.nx_lines(path, turbine_blade.FEEDS | {"cut": feed})
    file.write_text("\n".join(lines) + "\n", encoding="ascii")
    whole, shown = pk.read_path(file, frame=place.frame), slice(SHOWN)
    arrays = {name: getattr(whole, name)[shown] for name in ("tip", "axis", "line", "rapid", "feed", "spindle")}
    return replace(whole, events=tuple(e for e in whole.events if e.record < SHOWN), **arrays)


class Measured(NamedTuple):
    """What a run did: speeds and accelerations of the joints over their limits, (cycles, joints) each; what it told."""

    speeds: np.ndarray
    accelerations: np.ndarray
    told: str

    @property
    def seconds(self):
        return len(self.speeds) * CYCLE

    def describe(self):
        """Cells of a table."""
        if self.told:
            return f"{self.told} after {self.seconds:.3f} s | | |"
        over = (self.accelerations > 1.05).any(axis=1).mean()
        return f"{self.seconds:.3f} s | {self.speeds.max():.3f} | {self.accelerations.max():.2f} | {over:.1%}"


def measure(machine, simulation, job, text, changes=()):
    """Run a program from home, with changes amid it; what it does from its first record on."""
    program = read_program(text)
    before = float(program.seconds[~program.timed].sum())
    during = [[before + at, *words] for at, *words in changes]
    run = simulation.run({"program": "part.ngc", "during": during}, {"part.ngc": text})
    told = run.seen.get("told", "")
    shown = slice(None) if told else run.part(first_line(text), world(machine, job.posted.poses[:1])[0])
    return weigh(machine, run.joints[shown], told)


def measure_moves(machine, simulation, blocks):
    """Run blocks by MDI from home: what the joints do, without the cycles in which all stand, and what is refused."""
    run = simulation.run({"by hand": blocks}, seconds=400)
    moves = (np.diff(run.joints, axis=0) != 0.0).any(axis=1)
    near = moves | np.roll(moves, 1) | np.roll(moves, -1)
    measured = weigh(machine, run.joints, run.seen.get("told", ""))
    refused = [answer for answer in run.seen.get("by hand", ()) if isinstance(answer, str)]
    return measured._replace(speeds=measured.speeds[near]), refused


def weigh(machine, joints, told):
    """Joints (cycles, joints) as shares of what they can do."""
    rows = (np.array([[getattr(d, rate) for d in machine.drives]]) for rate in ("speed", "acceleration"))
    speed, acceleration = (outward(machine, row) for row in rows)
    return Measured(
        np.abs(np.diff(joints, axis=0)) / CYCLE / speed,
        np.abs(np.diff(joints, 2, axis=0)) / CYCLE**2 / acceleration,
        told,
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


def prepare(machine, folder, place, feed):
    """The job, its program as posted, and the same path as a plain post writes it."""
    path = pk.fit_tool_lengths(machine, part(folder, place, feed), "machine")
    job = pk.prepare(machine, path, workpiece=place.workpiece)
    file = io.BytesIO()
    pk.make_linuxcnc_program(job.trajectory)(file)
    text = file.getvalue().decode("ascii")
    return job, text, as_programmed(job.posted, text)


def compare(folder, place, feed):
    """A machine, as programmed and as posted, with both planners: rows of the table, and what ran by their titles."""
    machine = pk.load(place.name)
    job, posted, plain = prepare(machine, folder, place, feed)
    texts = {"as programmed": plain, "posted": posted}
    runs = {}
    for drives, reserve in (("ideal", None), ("limited", RESERVE)):
        for planner in ("LinuxCNC's", "parakin's"):
            with simulated(machine, reserve=reserve, stock=planner == "LinuxCNC's") as simulation:
                for what, text in texts.items():
                    runs[drives, what, planner] = measure(machine, simulation, job, text)
                if planner == "parakin's":
                    what = "posted, overrides and pauses"
                    runs[drives, what, planner] = measure(machine, simulation, job, posted, CHANGES)
    for (drives, what, planner), run in runs.items():
        told = f"{job.trajectory.seconds:.3f} s" if what == "posted" else ""
        name = f"{place.name}, {feed / 1000:g} m/min"
        print(f"| {name} | {drives} | {what} | {planner} | {told} | {run.describe()} |", flush=True)
    return machine, runs


def draw_moves(machine, folder):
    """Draw rapids all over the workspace that the planner takes and follows to their ends: blocks for MDI."""
    rng, planner, home = np.random.default_rng(1), Planner(machine, folder), find_home_pose(machine)
    low, high = (np.array(end) for end in estimate_axis_ranges(machine))
    if machine.direction is not None:  # C is one of a pair with B: half a turn is all directions
        low[machine.direction.c], high[machine.direction.c] = -np.pi / 2.0, np.pi / 2.0
    ends = []
    while len(ends) < MOVES:
        here = ends[-1] if ends else home
        poses = rng.uniform(low, high, (4096, len(low)))
        ways = here + np.linspace(0.0, 1.0, 100)[:, None, None] * (poses[machine.check(poses) == 0] - here)
        allowed = (machine.check(ways.reshape(-1, len(low))).reshape(ways.shape[:2]) == 0).all(axis=0)
        for end in ways[-1, allowed][:1]:
            planner.start(home)
            moves = [lambda at=at: planner.line_to(at, FASTEST) for at in [*ends, end]]
            if all(planner.run([move]).left == 0 and not planner.told for move in moves):
                ends.append(end)
    rows = world(machine, np.array(ends))
    return [" ".join(["G53 G0", *(f"{a}{row[FIELDS.index(a)]:.4f}" for a in machine.axes)]) for row in rows]


def compare_moves(folder, place):
    """A machine's moves by MDI with both planners: rows of the table."""
    machine = pk.load(place.name)
    blocks = draw_moves(machine, folder)
    for drives, planner in (("ideal", "LinuxCNC's"), ("ideal", "parakin's"), ("limited", "parakin's")):
        reserve = RESERVE if drives == "limited" else None
        with simulated(machine, reserve=reserve, stock=planner == "LinuxCNC's") as simulation:
            run, refused = measure_moves(machine, simulation, blocks)
        name = f"{place.name}, {MOVES - len(refused)} of {MOVES} rapids by MDI"
        print(f"| {name} | {drives} | as programmed | {planner} | | {run.describe()} |", flush=True)


def show(target, machine, runs):
    """The picture: as programmed with LinuxCNC's planner, and as posted with parakin's."""
    chosen = [("ideal", "as programmed", "LinuxCNC's"), ("limited", "posted", "parakin's")]
    titles = [f"{what}, {planner} planner" for _, what, planner in chosen]
    speeds = [runs[key].speeds for key in chosen]
    picture(
        target,
        machine,
        [(f"{t}: {s.max():.0%} of a joint's speed", s) for t, s in zip(titles, speeds, strict=True)],
    )


def main():
    parser = argparse.ArgumentParser(description="Run a tool path under LinuxCNC as programmed and as posted.")
    target = HERE.parent / "docs" / "pictures" / "linuxcnc.png"
    parser.add_argument("-o", "--output", type=Path, default=target, metavar="PICTURE", help=f"default: {target.name}")
    options = parser.parse_args()
    missing = why_not()
    if missing:
        sys.exit(missing)
    print("| machine | drives | program | planner | told | cycle time | speed | acceleration | beyond 1.05 |")
    with tempfile.TemporaryDirectory() as folder:
        for place in PLACES:
            for feed in (FEED, SLOW):
                machine, runs = compare(folder, place, feed)
                if (place.name, feed) == ("tricept", FEED):
                    show(options.output, machine, runs)
            compare_moves(folder, place)
    print(options.output)


if __name__ == "__main__":
    main()
