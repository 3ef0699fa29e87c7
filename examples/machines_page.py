"""The page of the shipped machines, docs/machines.md, with a picture, axes, drives and workspace of each.

python examples/machines_page.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Iterator
from pathlib import Path

from PIL import Image

import parakin as pk

WIDTH, COLOURS = 360, 160  # of a picture, px
HEAD = """\
# Machines

What is shipped, written by `python examples/machines_page.py`. A workspace is where the tool's tip may be with the tool
as at home, proved to lie between the two numbers. Each source says which sizes are published and which were chosen, and
ends with who built the machine or where, or that it is not known.
"""


def make_page(machines: list[pk.Machine]) -> str:
    """Make the page: a section for each family, those of few axes first."""
    return "\n".join([HEAD, *(line for family in list_families(machines) for line in family)])


def list_families(machines: list[pk.Machine]) -> Iterator[list[str]]:
    for family in sorted({m.spec.family for m in machines}):
        members = sorted((m for m in machines if m.spec.family == family), key=lambda m: (len(m.axes), m.name))
        lines = [
            f"## {family[0].upper()}{family[1:]}",
            "",
            "| | machine | axes | drives | workspace |",
            "|---|---|---|---|---|",
        ]
        yield [*lines, *(describe_machine(m) for m in members), ""]


def describe_machine(machine: pk.Machine) -> str:
    """Describe a machine in a row of the table."""
    words = f"`{machine.name}`: {machine.spec.title}. {' '.join(machine.spec.source.split())}"
    picture = f"![{machine.name}](pictures/machines/{machine.name}.png)"
    cells = (picture, words, " ".join(machine.axes), " ".join(machine.joints), measure_workspace(machine))
    return f"| {' | '.join(cells)} |"


def measure_workspace(machine: pk.Machine) -> str:
    """Measure the workspace at home's orientation, with proved bounds."""
    turns = {
        axis: value
        for axis, value, unit in zip(machine.axes, machine.home.tolist(), machine.axis_units, strict=True)
        if unit == "rad"
    }
    volume = pk.workspace(pk.region(machine, at=turns), gap=0.02, seconds=20.0).volume
    flat = len(machine.axes) - len(turns) == 2
    factor, unit = (1e-6, "m²") if flat else (1e-9, "m³")
    return f"{volume.inner * factor:.4f} to {volume.outer * factor:.4f} {unit}"


def draw_picture(machine: pk.Machine) -> bytes:
    """Draw a small picture of the machine at home."""
    picture = Image.open(io.BytesIO(pk.render_machine_picture(machine))).convert("RGB")
    picture = picture.resize((WIDTH, round(WIDTH * picture.height / picture.width)), Image.Resampling.LANCZOS)
    file = io.BytesIO()
    picture.quantize(COLOURS).save(file, "PNG", optimize=True)
    return file.getvalue()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    folder = parser.parse_args().output
    machines = [pk.load(name) for name in pk.machines()]
    pk.write_files(folder / "pictures" / "machines", {f"{m.name}.png": draw_picture(m) for m in machines})
    for path in pk.write_files(folder, {"machines.md": make_page(machines)}):
        print(path)


if __name__ == "__main__":
    main()
