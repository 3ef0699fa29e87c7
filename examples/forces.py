"""What a part asks of an Orthoglide's drives: forces and powers along it, from the masses of all that moves.

python examples/forces.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import parakin as pk

PART = """UNITS/MM
FEDRAT/6000,MMPM
RAPID
GOTO/-60,-40,30
GOTO/-60,-40,-20
GOTO/60,-40,-20
GOTO/60,40,-20
GOTO/-60,40,-20
GOTO/-60,-40,-20
RAPID
GOTO/-60,-40,30
FINI
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("out"))
    folder = parser.parse_args().output
    (part,) = pk.write_files(folder, {"part.apt": PART})
    job = pk.prepare(pk.load("orthoglide"), pk.read_path(part))
    assert job.trajectory is not None
    found = pk.compute_drive_forces(job.trajectory, {"Z": -300.0})
    print(found)
    for joint, peak, rms, power in zip(
        job.posted.machine.joints, found.peaks, found.rms, found.peak_powers, strict=True
    ):
        print(f"{joint}: {peak:.0f} N at most, {rms:.0f} N rms, {power:.0f} W at most")
    for path in pk.write_files(folder, {"forces.png": pk.render_drive_forces(found)}):
        print(path)


if __name__ == "__main__":
    main()
