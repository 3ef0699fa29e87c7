"""How far a planar 3-RPR may turn: det A over X and C, and the box that is proved free of singularities.

python examples/singularities.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import parakin as pk

RANGES = {"X": (-150.0, 150.0), "C": (-1.5, 1.5)}  # mm, rad


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    folder = parser.parse_args().output
    machine = pk.load("rpr3")
    grown = pk.find_nearest_singularity(pk.region(machine), RANGES)
    (left, right), (low, high) = grown.grown_ranges["X"], np.degrees(grown.grown_ranges["C"])
    print(f"X {left:.1f} to {right:.1f} mm, C {low:.2f} to {high:.2f} deg: proved, {grown.boxes} boxes")
    print(f"ended by what is {grown.ended} at C {np.degrees(grown.pose[2]):.2f} deg")

    x, c = np.linspace(*RANGES["X"], 121), np.linspace(*RANGES["C"], 121)
    poses = np.zeros((121, 121, 3))
    poses[..., 0], poses[..., 2] = np.meshgrid(x, c)
    sides = machine.sides(poses.reshape(-1, 3)).reshape(121, 121)
    figure = Figure(figsize=(7.0, 5.2), dpi=130, facecolor="white", layout="constrained")
    axes = figure.subplots()
    axes.set(title="det A of a planar 3-RPR at Y = 0", xlabel="X [mm]", ylabel="C [deg]")
    figure.colorbar(axes.contourf(x, np.degrees(c), sides, 20, cmap="cividis"))
    axes.contour(x, np.degrees(c), sides, [0.0], colors="black")
    axes.add_patch(Rectangle((left, low), right - left, high - low, fill=False, edgecolor="white", linewidth=2))
    data = BytesIO()
    figure.savefig(data, format="png")
    for path in pk.write_files(folder, {"singularities.png": data.getvalue()}):
        print(path)


if __name__ == "__main__":
    main()
