"""A CL file of a million records, from file to CSV, against numpy.loadtxt of the same numbers as CSV."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from measure import best, table

import parakin as pk
from parakin.export.files import write_files
from parakin.export.tables.joints import make_joint_csv
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.reading.cl.reader import read_cl

COUNT = 1_000_000


def numbers() -> np.ndarray:
    """A zigzag over a wavy surface with axes that sway, rounded as CAM writes them."""
    t = np.linspace(0.0, 400.0 * np.pi, COUNT)
    tip = np.stack([100.0 * np.sin(t), 0.4 * t - 250.0, -1650.0 + 20.0 * np.sin(0.3 * t)], 1).round(4)
    lean, way = 0.2 + 0.1 * np.sin(0.1 * t), np.sin(0.37 * t)
    axis = np.stack([np.sin(lean) * np.cos(way), np.sin(lean) * np.sin(way), np.cos(lean)], 1).round(6)
    return np.hstack([tip, axis])


def main() -> str:
    machine = pk.load("tricept")
    values = numbers()
    with tempfile.TemporaryDirectory() as folder:
        csv, cl = (Path(folder) / name for name in ("numbers.csv", "part.apt"))
        np.savetxt(csv, values, fmt=["%.4f"] * 3 + ["%.6f"] * 3, delimiter=",")
        lines = csv.read_text().split()
        cl.write_text("UNITS/MM\nMULTAX\nFEDRAT/2000.,MMPM\n" + "".join(f"GOTO/{line}\n" for line in lines) + "FINI\n")

        def whole() -> None:
            write_files(folder, {"joints.csv": make_joint_csv(post_path(machine, read_cl(cl)))})

        loadtxt = best(lambda: np.loadtxt(csv, delimiter=","), 3)
        read = best(lambda: read_cl(cl), 3)
        everything = best(whole, 3)
    rows = [
        ["numpy.loadtxt of the six numbers", f"{loadtxt:.2f}", "1.00", ""],
        ["read_cl", f"{read:.2f}", f"{read / loadtxt:.2f}", ""],
        ["CL file to joint table (CSV)", f"{everything:.2f}", f"{everything / loadtxt:.2f}", "≤ 3"],
    ]
    return table(f"{COUNT:,} records through the Tricept", ["what", "s", "times loadtxt", "bound"], rows)


if __name__ == "__main__":
    print(main())
