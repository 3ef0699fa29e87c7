"""Which Lambda has the largest total orientation workspace, of sizes within ranges and with the drives as they are.

python examples/largest_workspace.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import parakin as pk
from parakin.export.designs import format_proved_yaml
from parakin.export.workspace.workspace_files import prepare_files

TURNS = {axis: tuple(np.radians(ends)) for axis, ends in {"A": (-20, 20), "B": (-20, 20), "C": (10, 50)}.items()}
FREE = {"c": (900.0, 1500.0), "u": (600.0, 1000.0), "r": (200.0, 500.0), "D": (150.0, 400.0)}  # mm


def make_problem() -> pk.DesignProblem:
    """Make the problem: every orientation of a box in the middle, as many positions as can be."""
    box = {"X": (-50.0, 50.0), "Y": (-50.0, 50.0), "Z": (1350.0, 1450.0)}
    return pk.DesignProblem(pk.load("lambda6"), FREE, {**box, **TURNS}, maximise=["workspace"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    parser.add_argument("--time", type=float, default=60.0, help="s for the search and its proof, and for the picture")
    options = parser.parse_args()
    designs = pk.find_designs(make_problem(), seconds=options.time)
    (best,) = designs.front
    print(", ".join(f"{name} {value:.1f} mm" for name, value in best.sizes.items()))
    print(f"{1e-9 * best.values['workspace']:.3f} m3 at least")
    workspace = pk.workspace(pk.region(best.machine, every=TURNS), 0.05, seconds=options.time)
    low, high = 1e-9 * workspace.volume.inner, 1e-9 * workspace.volume.outer
    print(f"{low:.3f} to {high:.3f} m3, {1e-9 * workspace.volume.estimate:.3f} by an estimate")
    picture = prepare_files(workspace, None, lambda _: None, options.time).make_file(".png")
    files = {"largest_workspace.png": picture, "largest_workspace.yaml": format_proved_yaml(designs, 0)}
    for path in pk.write_files(options.output, files):
        print(path)


if __name__ == "__main__":
    main()
