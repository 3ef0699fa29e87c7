"""How stiff an Orthoglide is whose drives and rods give way, and how far a cutting force moves its tip.

python examples/stiffness.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import parakin as pk


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    folder = parser.parse_args().output
    machine = pk.load("orthoglide")
    rods = {"diameter": "20 mm", "rods": "2"}  # two of steel in each parallelogram
    stiffness = pk.analyse_stiffness(machine, "100 N/um", rods)
    print(stiffness)
    print(
        f"{1e-3 * stiffness.least.min():.1f} N/um at the worst, {1e-3 * np.median(stiffness.least):.1f} at half of them"
    )
    print(f"the drives make {100.0 * stiffness.drive_share.mean():.0f} % of it")

    moved = 1e3 * np.linalg.norm(stiffness.deflect({"X": -200.0, "Z": -100.0}), axis=1)
    print(
        f"200 N against X and 100 N against Z move the tip by {np.median(moved):.1f} um, at most by {moved.max():.1f}"
    )
    for path in pk.write_files(folder, {"stiffness.png": pk.render_stiffness_map(stiffness)}):
        print(path)


if __name__ == "__main__":
    main()
