"""A linear delta as a family: one trace for every radius of its towers, and for 100,000 machines built to tolerances.

python examples/family.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import parakin as pk

TOLERANCES = {"feet": "0.05 mm", "rods": "0.02 mm"}
DRAWN = 100_000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    folder = parser.parse_args().output
    machine = pk.load("linear_delta")

    family = pk.family(machine, free=["tower"])
    towers, ways = np.linspace(250.0, 450.0, 161), np.linspace(-200.0, 200.0, 161)
    poses = machine.home + np.outer(np.tile(ways, len(towers)), [1.0, 0.0, 0.0])
    a, b, _ = family.jacobians(poses, np.repeat(towers, len(ways))[:, None])
    greatest = np.linalg.norm(np.linalg.solve(a, b), 2, axis=(1, 2)).reshape(len(towers), -1)
    print(f"amplification at home: {greatest[0, 80]:.3f} with towers at 250 mm, {greatest[-1, 80]:.3f} at 450 mm")

    family = pk.family(machine, free=list(TOLERANCES))
    halves = np.array([0.05 if parameter.group == "feet" else 0.02 for parameter in family.parameters])
    sizes = family.nominal + np.random.default_rng(0).uniform(-1.0, 1.0, (DRAWN, len(halves))) * halves
    built = family.forward(machine.inverse(machine.home), sizes, near=machine.home)
    errors = 1e3 * np.linalg.norm(built.poses - machine.home, axis=1)
    told = 1e3 * pk.analyse_accuracy(machine, TOLERANCES, poses=[machine.home]).deviations[0]
    print(
        f"{DRAWN:,} machines drawn: {np.sqrt((errors**2).mean()):.2f} um rms at home, the first order tells {told:.2f}"
    )

    figure = Figure(figsize=(11.0, 4.4), dpi=130, facecolor="white", layout="constrained")
    left, right = figure.subplots(1, 2)
    left.set(title="greatest amplification", xlabel="X [mm]", ylabel="tower [mm]")
    figure.colorbar(left.contourf(ways, towers, greatest, 12))
    right.set(title=f"{DRAWN:,} machines at home", xlabel="the tip's error [um]", ylabel="machines")
    right.hist(errors, 100)
    right.axvline(told, color="black")
    data = BytesIO()
    figure.savefig(data, format="png")
    for path in pk.write_files(folder, {"family.png": data.getvalue()}):
        print(path)


if __name__ == "__main__":
    main()
