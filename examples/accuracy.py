"""How accurate an Orthoglide is that is built to tolerances, what matters most, and which tolerances would do.

python examples/accuracy.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import parakin as pk


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    folder = parser.parse_args().output
    machine = pk.load("orthoglide")
    tolerances = {"feet": "0.05 mm", "rods": "0.02 mm", "encoders": "2 um"}
    accuracy = pk.analyse_accuracy(machine, tolerances)
    print(accuracy)
    for tolerance, mean, _ in accuracy.budget:
        print(f"{tolerance.name}: {100.0 * mean:.1f} % of the variance")

    cube = pk.bound_worst_case(accuracy, dict.fromkeys("XYZ", (-50.0, 50.0)))
    print(f"in the cube of 100 mm no machine within them is off by more than {1e3 * cube.bound:.0f} um,")
    print(f"and one is off by {1e3 * cube.attained:.0f} um, at {cube.pose.round(1)}")

    allowed = pk.allocate_tolerances(accuracy, 0.05, costs={"feet": 1.0, "rods": 2.0, "encoders": 0.1})
    print("50 um all over the workspace:", ", ".join(f"{each.name} {1e3 * each.value:.1f} um" for each in allowed))
    for path in pk.write_files(folder, {"accuracy.png": pk.render_accuracy_map(accuracy)}):
        print(path)


if __name__ == "__main__":
    main()
