"""``parakin machines`` and ``parakin show``: which machines there are, and what one of them is."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..export.figure_file import PICTURES
from ..export.json.machine import (
    LOADS,
    MOTOR,
    RATES,
    encode_details,
    encode_machine,
    encode_machines,
    encode_parameters,
)
from ..export.number_format import format_fixed
from ..units import name_display_unit
from .console import format_table, print_json, print_text
from .options import Json, Name, OutputPath, Sizes, load_machine, require_ending, split_sizes
from .page import refuse_foreign_file

if TYPE_CHECKING:
    from ..machine import Machine

_LONGEST_TITLE = 48  # characters: a line of the list then has 80 at most

_HEADERS = dict(zip(RATES, ("speed /s", "acceleration /s2", "jerk /s3"), strict=True))
_HEADERS |= dict(zip(MOTOR, ("counts a turn", "lead", "homing"), strict=True))
_HEADERS |= dict(zip(LOADS, ("force N, Nm", "rated N, Nm", "power W", "adds kg, kg m2", "N/um, kNm/rad"), strict=True))


def machines(*, json: Json = False) -> int:
    """The machines that come with parakin, by families."""
    from .. import load
    from .. import machines as shipped

    known = [load(name) for name in shipped()]
    if json:
        print_json(encode_machines(known))
        return 0
    print_text("\n\n".join(_list_families(known)))
    return 0


def _list_families(machines: list[Machine]) -> Iterator[str]:
    """List the machines of each family, those of few axes first."""
    for family in sorted({m.spec.family for m in machines}):
        members = sorted((m for m in machines if m.spec.family == family), key=lambda m: (len(m.axes), m.name))
        rows = [(m.name, " ".join(m.axes), _shorten_text(m.spec.title, _LONGEST_TITLE)) for m in members]
        yield f"{family}\n{format_table(rows, ('name', 'axes', 'title'))}"


def _shorten_text(text: str, most: int) -> str:
    line = " ".join(text.split())
    return line if len(line) <= most else line[: most - 3].rstrip() + "..."


def show(
    name: Name,
    /,
    *,
    output: OutputPath = None,
    yaml: bool = False,
    file: bool = False,
    parameters: bool = False,
    force: bool = False,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """A machine's sizes, drives, limits and home, and the page on which it moves.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    output
        Where to put the picture of the machine at home: an .html on which it moves (see parakin page), a .png, or
        a .pdf or .svg for a printed page. Without it a terminal is asked whether to write NAME.html.
    yaml
        Print a machine file with every number explicit, a group for each leg: to write the numbers of a calibrated
        machine into, or to keep those of --set. Reading it gives the same machine, bit for bit.
    file
        Print the machine's file as it was written, with the values of --set in their places.
    parameters
        Print the numbers that can be inputs: free in families, designs and calibrations, and within tolerances.
    force
        Overwrite an .html that parakin did not write.
    """
    if yaml + file + parameters + json > 1:
        raise InputError("only one of --yaml, --file, --parameters and --json, expected what to print", "show")
    machine = load_machine(name, sizes)
    if output is not None:
        _write_picture(machine, output, force)
    if json:
        files = {} if output is None else {"picture": str(output)}
        print_json(encode_machine(machine, files))
        return 0
    if yaml:
        print_text(machine.format_yaml().rstrip())
        return 0
    if file:
        from ..description import find_machine_file, write_sizes

        print_text(write_sizes(find_machine_file(name), split_sizes(sizes)).rstrip("\n"))
        return 0
    if parameters:
        print_text(_list_parameters(machine))
        return 0
    print_text(_summarise_machine(machine))
    print()
    if output is None:
        output = _ask_for_page(machine, force)
    if output is not None:
        print_text(f"{'page' if output.suffix == '.html' else 'picture'} {output}")
    return 0


def _ask_for_page(machine: Machine, force: bool) -> Path | None:
    """Ask at a terminal whether to write the page on which a machine moves; elsewhere tell how to."""
    output = Path(f"{machine.name}.html")
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        print_text(f"-o {output} writes the page on which it moves")
        return None
    try:
        answer = input(f"write {output}, on which it moves? [y/N] ")
    except EOFError:
        answer = ""
    if answer.strip().lower() not in ("y", "yes"):
        return None
    _write_picture(machine, output, force)
    return output


def _write_picture(machine: Machine, output: Path, force: bool) -> None:
    kind = output.suffix.lower()
    require_ending(output, (".html", *PICTURES))
    from ..export.files import write_files
    from ..export.machine.picture import render_machine_picture
    from ..export.page.page import render_machine_page

    if kind == ".html":
        refuse_foreign_file(output, force)
    content = render_machine_page(machine) if kind == ".html" else render_machine_picture(machine, None, kind)
    write_files(output.parent, {output.name: content})


def _format_number(value: float | str | None) -> str:
    if isinstance(value, str):
        return value
    if value is None or not abs(value) < float("inf"):
        return "-"
    return format_fixed(value, 4).rstrip("0").rstrip(".")


def _format_bound(value: float | None, unit: str) -> tuple[str, str]:
    return ("", "") if value is None else (_format_number(value), unit)


def _list_parameters(machine: Machine) -> str:
    rows = [
        (own["name"], _format_number(own["value"]), own["unit"], own["group"]) for own in encode_parameters(machine)
    ]
    return format_table(rows, ("number", "", "", "group"), " r")


def _summarise_machine(machine: Machine) -> str:
    details = encode_details(machine)
    columns = [key for key in RATES if any(d[key] < float("inf") for d in details["drives"])]
    columns += [key for key in (*MOTOR, *LOADS) if any(d[key] is not None for d in details["drives"])]
    headers = [_HEADERS[key] for key in columns]
    drives = [
        (d["joint"], *(_format_number(d[key]) for key in ("low", "high")), d["unit"],
         *(_format_number(d[key]) for key in columns))
        for d in details["drives"]
    ]  # fmt: skip
    signs = {"min": "at least", "max": "at most", "reach": "must close"}
    limits = [
        (limit["name"], limit["of"], signs[limit["side"]], *_format_bound(limit["bound"], limit["unit"]))
        for limit in details["limits"]
    ]
    sizes = [(name, _format_number(value)) for name, value in details["sizes"].items()]
    paragraphs = [
        f"{machine.name}: {machine.spec.title}\n{' '.join(machine.spec.source.split())}",
        f"axes    {' '.join(machine.axes)}\njoints  {' '.join(machine.joints)}"
        + (f"\nmode    {machine.mode}, of {len(machine.modes)}" if machine.mode else ""),
        format_table(sizes, ("size", "mm, rad"), " r") if sizes else "",
        format_table(drives, ("drive", "from", "to", "", *headers), " rr " + "r" * len(headers)),
        format_table(limits, ("limit", "of", "", "bound", ""), "   r"),
        format_table(
            [
                (axis, _format_number(value), name_display_unit(unit))
                for (axis, value), unit in zip(details["home"].items(), machine.axis_units, strict=True)
            ],
            ("home", "", ""), " r",
        ),
    ]  # fmt: skip
    return "\n\n".join(paragraph for paragraph in paragraphs if paragraph)
