"""Pictures of LinuxCNC's screen with a machine of parakin's beside it, as an operator sees them.

LinuxCNC runs with its screen AXIS on a display of its own (Xvfb). On the Tricept the first passes of the turbine blade
are cut, at 10 m/min; other machines run the first program of their configuration.

    python linuxcnc_screen.py [-o FOLDER]

It needs LinuxCNC 2.9 with its development files, Xvfb, xdotool, ImageMagick, and root for namespaces of its own.
"""

import argparse
import io
import shutil
import sys
import tempfile
from pathlib import Path

from linuxcnc_comparison import PLACES, part

import parakin as pk

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests" / "linuxcnc"))
from simulation import simulated, why_not  # noqa: E402

FEED = 10_000.0  # mm/min in the cut
OTHERS = ("hexapod", "lambda6", "orthoglide5_table")
ON = [["switch_on"], ["home"], ["wait", 1.0]]


def show_part(folder):
    """The whole screen while the Tricept cuts."""
    machine = pk.load("tricept")
    file = io.BytesIO()
    pk.make_linuxcnc_program(pk.prepare(machine, part(folder, PLACES[0], FEED)).trajectory)(file)
    with simulated(machine) as simulation:
        steps = [*ON, ["start", "part.ngc"], ["wait", 15.0], ["picture", "screen.png"], ["abort"]]
        simulation.show(steps, {"part.ngc": file.getvalue().decode("ascii")})
        shutil.copy(simulation.folder / "screen.png", folder / "linuxcnc_screen.png")


def show_gmoccapy(folder):
    """The whole screen with gmoccapy in AXIS' place, once the Tricept has run its first program."""
    with simulated(pk.load("tricept")) as simulation:
        steps = [["wait", 15.0], *ON, ["start", "tricept.ngc"], ["wait", 8.0], ["picture", "screen.png"]]
        simulation.show(steps, screen="gmoccapy")
        shutil.copy(simulation.folder / "screen.png", folder / "linuxcnc_gmoccapy.png")


def show_machine(name, folder):
    """A machine's window once its first program has run."""
    with simulated(pk.load(name)) as simulation:
        simulation.show([*ON, ["start", f"{name}.ngc"], ["wait", 4.0], ["window", "window.png"]])
        shutil.copy(simulation.folder / "window.png", folder / f"linuxcnc_{name}.png")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=HERE.parent / "docs" / "pictures", help="folder")
    output = parser.parse_args().output
    if why_not():
        sys.exit(why_not())
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        show_part(folder)
        show_gmoccapy(folder)
        for name in OTHERS:
            show_machine(name, folder)
        for picture in folder.glob("linuxcnc_*.png"):
            shutil.copy(picture, output)
            print(output / picture.name)


if __name__ == "__main__":
    main()
