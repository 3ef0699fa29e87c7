"""``parakin stiffness``: how far the tool gives way where drives and struts are elastic."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..errors import InputError, quote
from ..export.figure_file import PICTURES
from ..export.number_format import format_fixed
from .accuracy import split_pairs
from .console import announce_compiling, format_pose, format_table, print_json, print_remark, print_text
from .force_option import parse_force
from .options import OFF_LIMITS, Json, Name, OutputPath, Sizes, load_machine, require_ending

if TYPE_CHECKING:
    from ..arrays import Array, Indices
    from ..machine import Machine
    from ..stiffness.stiffness import Stiffness


def stiffness(
    name: Name,
    /,
    *,
    drives: Annotated[list[str] | None, Parameter(negative="")] = None,
    struts: str | None = None,
    force: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    weight: bool = False,
    along: str | None = None,
    csv: Path | None = None,
    samples: int | None = None,
    output: OutputPath = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """The tool's stiffness over the workspace or along a path, where drives and struts are elastic.

    The exit code is 3 if a pose of the file is out of reach or singular.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    drives
        The stiffness of the drives along or about their joints, with slides and motors: 100N/um,200kNm/rad, or by their
        names and patterns, d*=100N/um,theta*=200kNm/rad; rigid is one. May be given again. By default as the
        machine's file says.
    struts
        The section of the struts: diameter=40mm,wall=5mm,modulus=210GPa,rods=2; or how stiff each rod is along
        itself: 300N/um. By default as the machine's file says, else they are rigid.
    force
        A force on the tip, whose deflection is told: X=-200N,Z=-1kN.
    weight
        Tell how far the machine's own weight moves the tip.
    along
        A translation: the map shows the stiffness along it, where it shows the least one by default.
    csv
        Rows of poses to look at instead of the workspace, such as the joint table that post writes.
    samples
        How many poses of the workspace are looked at; by default 400.
    output
        A map to write, of stiffness, or with --force of the deflection: .png, or .pdf or .svg for a printed page; or
        with --csv, .csv: both at each row.
    """
    machine = load_machine(name, sizes)
    if csv is not None and samples is not None:
        raise InputError("there is a file of poses, expected one of them", "--samples")
    if along is not None and (force is not None or output is None or csv is not None):
        raise InputError("goes with a map, --output, and without --force", "--along")
    require_ending(output, PICTURES if csv is None else (".csv",))
    of_drives = _read_drives(drives)
    of_struts = split_words([struts], "--struts") if struts is not None and "=" in struts else struts
    wanted = parse_force(machine, force)
    direction = None if along is None else _name_direction(machine, along)
    rows, lines = (None, None) if csv is None else _read_poses(machine, csv)
    announce_compiling()
    from ..stiffness.stiffness import analyse_stiffness
    from ..workspaces.sampled.allowed_poses import SAMPLES

    result = analyse_stiffness(machine, of_drives, of_struts, rows, SAMPLES if samples is None else samples)
    unreachable = _find_unreachable(result, csv, lines)
    if unreachable is not None:
        print_remark(unreachable)
        return OFF_LIMITS
    files = {} if output is None else _write(result, output, direction, wanted, lines)
    _tell(result, wanted, weight, files, json)
    return 0


def _tell(result: Stiffness, force: Array | None, weight: bool, files: dict[str, str], json: bool) -> None:
    if json:
        from ..export.json.stiffness import encode_stiffness

        print_json(encode_stiffness(result, force, files, weight))
        return
    sag = [_format_sag(result)] if weight else []
    print_text(
        "\n".join([_format_stiffness(result, force), *sag, *(f"{kind}  {path}" for kind, path in files.items())])
    )


def _read_drives(texts: list[str] | None) -> dict[str, str] | str | None:
    if texts is None:
        return None
    return split_words(texts, "--drives") if any("=" in text for text in texts) else ",".join(texts)


def _find_unreachable(result: Stiffness, csv: Path | None, lines: Indices | None) -> str | None:
    """Say which rows of a file have no stiffness."""
    import numpy as np

    lost = np.flatnonzero(~np.isfinite(result.compliances).all((1, 2)))
    if csv is None or lines is None or not lost.size:
        return None
    more = f", and {lost.size - 1:,} more" if lost.size > 1 else ""
    return f"{csv}:{lines[lost[0]]}: out of reach or singular{more}"


def split_words(texts: Sequence[str], source: str) -> dict[str, str]:
    """Split ``NAME=VALUE,NAME=VALUE`` into values by their names."""
    words: dict[str, str] = {}
    for name, value in split_pairs(texts, source, "d*=100N/um" if source == "--drives" else "diameter=40mm"):
        if name in words:
            raise InputError(f"{name} is given twice", source)
        words[name] = value
    return words


def _name_direction(machine: Machine, axis: str) -> dict[str, float]:
    axes = [name for name in machine.axes if name in "XYZ"]
    if axis.upper() not in axes:
        raise InputError(f"{quote(axis)}, expected one of {' '.join(axes)}", "--along")
    return {axis.upper(): 1.0}


def _read_poses(machine: Machine, csv: Path) -> tuple[Array, Indices]:
    from .rows import read_rows

    return read_rows(csv, machine.axes, machine.axis_units)


def _write(
    result: Stiffness, output: Path, along: dict[str, float] | None, force: Array | None, lines: Indices | None
) -> dict[str, str]:
    from ..export.files import write_files

    if lines is None:
        from ..export.stiffness_map import render_stiffness_map

        content = render_stiffness_map(result, along=along, force=force, suffix=output.suffix.lower())
        write_files(output.parent, {output.name: content})
        return {"map": str(output)}
    from ..export.tables.stiffness import format_stiffness_csv

    write_files(output.parent, {output.name: format_stiffness_csv(result, force, lines)})
    return {"table": str(output)}


def _format_stiffness(result: Stiffness, force: Array | None) -> str:
    import numpy as np

    machine = result.machine
    rows = [["least", *_format_percentiles(result.least)]]
    for axis, unit in zip(result.translations, np.eye(len(result.translations)), strict=True):
        rows.append([f"along {axis}", *_format_percentiles(result.along(unit))])
    lines = [
        f"{machine.name}: the tip's stiffness, N/um, at {len(result.poses)} poses\n",
        format_table(rows, ["", "at the worst", "5 % are below", "half are below"], " rrr"),
        "",
        "frame, platform, arms of cranks, and what guides without a drive count as rigid: a real machine is softer",
        f"least at {format_pose(machine, result.poses[int(result.least.argmin())])}",
        f"of the compliance the drives make {100.0 * float(np.mean(result.drive_share)):.0f} %",
    ]
    if result.springs.struts is None:
        lines.append("the struts count as rigid, for neither --struts nor the machine's file says more")
    if force is not None:
        sizes = np.linalg.norm(result.deflect(force)[:, : len(force)], axis=1)
        worst = int(sizes.argmax())
        median, most = (format_fixed(1e3 * float(value), 2) for value in (np.median(sizes), sizes[worst]))
        lines += ["", f"the force moves the tip by {median} um at half of them,"]
        lines.append(f"and by {most} um at {format_pose(machine, result.poses[worst])}")
    return "\n".join(lines)


def _format_sag(result: Stiffness) -> str:
    import numpy as np

    sizes = np.linalg.norm(result.sag()[:, : len(result.translations)], axis=1)
    worst = int(sizes.argmax())
    median, most = (format_fixed(1e3 * float(value), 2) for value in (np.median(sizes), sizes[worst]))
    return (
        f"\nits own weight moves the tip by {median} um at half of them,\n"
        f"and by {most} um at {format_pose(result.machine, result.poses[worst])}"
    )


def _format_percentiles(values: Array) -> list[str]:
    import numpy as np

    return [format_fixed(1e-3 * float(np.percentile(values, percent)), 2) for percent in (0, 5, 50)]
