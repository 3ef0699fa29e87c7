"""Three machines side by side: their workspaces, indices, accuracy and stiffness, on one page.

python examples/comparison.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import parakin as pk

MACHINES = ("orthoglide", "linear_delta", "hexapod")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    parser.add_argument("--samples", type=int, default=400)
    given = parser.parse_args()
    compared = pk.compare(
        [pk.load(name) for name in MACHINES],
        tolerances=[("feet", "0.05 mm")],
        drives="100 N/um",
        samples=given.samples,
    )
    for column in compared.columns:
        print(f"{column.machine.name}: {column.accuracy.percentile(50) * 1e3:.0f} um at half of the poses")
    for path in pk.write_files(given.output, {"comparison.html": pk.render_comparison_page(compared)}):
        print(path)


if __name__ == "__main__":
    main()
