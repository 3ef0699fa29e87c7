"""Which sizes of a linear delta reach a box, all over the ranges of two numbers: a sweep of 40,000 designs, drawn.

python examples/sweep.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import pyarrow.parquet as pq
from matplotlib.figure import Figure

import parakin as pk

DESIGNS, POSES = 40_000, 60


def make_problem() -> pk.DesignProblem:
    """Make the problem: a delta's rods and the radius of its towers, for a box 200 mm wide."""
    box = {"X": (-100.0, 100.0), "Y": (-100.0, 100.0), "Z": (100.0, 250.0)}
    free = {"rod": (450.0, 900.0), "tower": (200.0, 500.0)}
    return pk.DesignProblem(pk.load("linear_delta"), free, box, ["condition"], bounds={"condition": 4.0})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    parser.add_argument("--designs", type=int, default=DESIGNS)
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        result = pk.run_sweep(pk.SweepPlan(make_problem(), options.designs, POSES), folder)
        table = pq.read_table(folder)
    print(result)
    columns = {
        name: table.column(name).to_numpy() for name in ("rod [mm]", "tower [mm]", "allowed", "condition", "keeps")
    }
    figure = Figure(figsize=(11.0, 4.6), dpi=130, facecolor="white", layout="constrained")
    reached, allowed = columns["allowed"] == 1.0, columns["allowed"]
    shown = (
        ("share of the poses within all limits", allowed, allowed >= 0.0, 0.0, 1.0),
        ("greatest condition number, where all poses are", columns["condition"], reached, 1.0, 6.0),
    )
    for number, (title, values, rows, low, high) in enumerate(shown, 1):
        axes = figure.add_subplot(1, 2, number)
        axes.set(title=title, xlabel="rod [mm]", ylabel="tower [mm]")
        dots = axes.scatter(
            columns["rod [mm]"][rows],
            columns["tower [mm]"][rows],
            c=values[rows],
            s=5,
            marker="s",
            linewidths=0,
            vmin=low,
            vmax=high,
        )
        figure.colorbar(dots)
    data = BytesIO()
    figure.savefig(data, format="png")
    for path in pk.write_files(options.output, {"sweep.png": data.getvalue()}):
        print(path)


if __name__ == "__main__":
    main()
