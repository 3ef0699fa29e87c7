"""``parakin machines`` and ``parakin show``: which machines there are, and what one of them is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError
from .console import fixed, print_json, rim, rim_unit, table
from .options import Json, Name, Sizes, machine_of

if TYPE_CHECKING:
    from ..machine import Machine

_RATES = {"speed": "speed /s", "acceleration": "acceleration /s2", "jerk": "jerk /s3"}


def machines(*, json: Json = False) -> int:
    """The machines that come with parakin."""
    from .. import load
    from .. import machines as shipped

    known = [load(name) for name in shipped()]
    if json:
        print_json({"schema": "parakin.machines/1", "machines": [_about(machine) for machine in known]})
        return 0
    rows = [(m.name, " ".join(m.axes), " ".join(m.joints), m.spec.title, _cut(m.spec.source, 60)) for m in known]
    print(table(rows, ("name", "axes", "joints", "title", "source")))
    return 0


def _cut(text: str, most: int) -> str:
    line = " ".join(text.split())
    return line if len(line) <= most else line[: most - 3].rstrip() + "..."


def _about(machine: Machine) -> dict[str, Any]:
    spec = machine.spec
    return {
        "name": spec.name,
        "title": spec.title,
        "axes": list(machine.axes),
        "joints": list(machine.joints),
        "source": " ".join(spec.source.split()),
    }


def show(
    name: Name,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """A machine's sizes, drives, limits and home, and its picture in 3D.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    output
        Where to put the picture of the machine at home: an .html to turn and look at, or a .png. By default NAME.html
        in this folder; with --json none.
    """
    machine = machine_of(name, sizes)
    if output is None and not json:
        output = Path(f"{machine.name}.html")
    if output is not None:
        _picture(machine, output)
    if json:
        files = {} if output is None else {"picture": str(output)}
        print_json({"schema": "parakin.show/1", **_about(machine), **_details(machine), "files": files})
        return 0
    print(_described(machine))
    print()
    print(f"picture {output}")
    return 0


def _picture(machine: Machine, output: Path) -> None:
    kind = output.suffix.lower()
    if kind not in (".html", ".png"):
        raise InputError(f'"{output}": expected a file name that ends in .html or .png', "--output")
    from ..export.files import write_all
    from ..export.machine.picture import machine_html, machine_png

    write_all(output.parent, {output.name: machine_html(machine) if kind == ".html" else machine_png(machine)})


def _details(machine: Machine) -> dict[str, Any]:
    drives = [
        {
            "joint": drive.name,
            "unit": rim_unit(drive.unit),
            **{key: rim(getattr(drive, key), drive.unit) for key in ("low", "high", *_RATES)},
        }
        for drive in machine.model.drives
    ]
    limits = [
        {
            "name": limit.name,
            "of": limit.subject,
            "side": limit.side,
            "bound": None if limit.side == "reach" else rim(limit.bound, limit.unit),
            "unit": rim_unit(limit.unit),
        }
        for limit in machine.limit_parts
    ]
    home = zip(machine.axes, machine.home.tolist(), machine.axis_units, strict=True)
    return {
        "mode": machine.mode,
        "modes": list(machine.modes),
        "sizes": dict(machine.spec.sizes),
        "drives": drives,
        "limits": limits,
        "home": {axis: rim(value, unit) for axis, value, unit in home},
    }


def _number(value: float | None) -> str:
    if value is None or not abs(value) < float("inf"):
        return "-"
    return fixed(value, 4).rstrip("0").rstrip(".")


def _bound(value: float | None, unit: str) -> tuple[str, str]:
    return ("", "") if value is None else (_number(value), unit)


def _described(machine: Machine) -> str:
    details = _details(machine)
    rates = [key for key in _RATES if any(d[key] < float("inf") for d in details["drives"])]
    drives = [
        (d["joint"], *(_number(d[key]) for key in ("low", "high")), d["unit"],
         *(_number(d[key]) for key in rates))
        for d in details["drives"]
    ]  # fmt: skip
    signs = {"min": "at least", "max": "at most", "reach": "must close"}
    limits = [
        (limit["name"], limit["of"], signs[limit["side"]], *_bound(limit["bound"], limit["unit"]))
        for limit in details["limits"]
    ]
    sections = [
        f"{machine.name}: {machine.spec.title}\n{' '.join(machine.spec.source.split())}",
        f"axes    {' '.join(machine.axes)}\njoints  {' '.join(machine.joints)}"
        + (f"\nmode    {machine.mode}, of {len(machine.modes)}" if machine.mode else ""),
        table([(name, _number(value)) for name, value in details["sizes"].items()], ("size", "mm, rad"), " r")
        if details["sizes"]
        else "",
        table(drives, ("drive", "from", "to", "", *(_RATES[key] for key in rates)), " rr " + "r" * len(rates)),
        table(limits, ("limit", "of", "", "bound", ""), "   r"),
        table(
            [
                (axis, _number(value), rim_unit(unit))
                for (axis, value), unit in zip(details["home"].items(), machine.axis_units, strict=True)
            ],
            ("home", "", ""), " r",
        ),
    ]  # fmt: skip
    return "\n\n".join(section for section in sections if section)
