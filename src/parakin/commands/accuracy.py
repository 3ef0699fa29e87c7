"""``parakin accuracy``: the tool's error where a machine's numbers are within tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..errors import InputError, quote
from ..export.figure_file import PICTURES
from ..export.number_format import format_fixed
from ..units import LENGTH, QuantityError, name_display_unit, parse_quantity, to_display
from .console import announce_compiling, format_pose, format_table, print_json, print_text
from .options import Json, Name, OutputPath, Sizes, load_machine, require_ending, tell_options
from .region_options import parse_axis_ranges, parse_time

if TYPE_CHECKING:
    from ..accuracy.accuracy import Accuracy
    from ..accuracy.tolerances import Tolerance
    from ..accuracy.worst_case import WorstCase

_LONGEST = 60.0  # s of a proof, if nothing else is said


def accuracy(
    name: Name,
    /,
    *,
    tolerance: Annotated[list[str], Parameter(negative="")],
    error: str | None = None,
    cost: list[str] | None = None,
    over: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    time: float | None = None,
    samples: int | None = None,
    output: OutputPath = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """The tool's error over the workspace, where a machine's numbers are within tolerances, and what matters most.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    tolerance
        What numbers may be off, either way: feet=0.05mm,rods=0.02mm,encoders=2um; by their names, patterns such as
        legs.*.foot.z, or groups (feet, platform, rods, rails, encoders, mounting, head, table). May be given again.
    error
        The tip's error, root mean square, that is wanted all over the workspace: the tolerances that allow it are
        told, those of the least cost.
    cost
        What a number costs at a tolerance of 1 mm, feet=1,rods=3; it goes with the tolerance's inverse. By default 1.
    over
        Prove the worst case over a box of poses, of every machine within the tolerances: X=-100:100,Y=-100:100; the
        other axes are at home.
    time
        The longest that the proof may take, s; by default 60.
    samples
        How many poses of the workspace are looked at; by default 400.
    output
        A map of the error to write: .png, or .pdf or .svg for a printed page.
    """
    machine = load_machine(name, sizes)
    require_ending(output, PICTURES)
    if cost is not None and error is None:
        raise InputError("goes with --error", "--cost")
    stated = split_pairs(tolerance, "--tolerance", "feet=0.05mm")
    wanted, costs = _parse_error(error), _parse_costs(cost)
    ranges, seconds = parse_axis_ranges(machine, over, "--over"), parse_time(time)
    announce_compiling()
    from ..accuracy.accuracy import allocate_tolerances, analyse_accuracy
    from ..accuracy.worst_case import bound_worst_case
    from ..workspaces.sampled.allowed_poses import SAMPLES

    result = analyse_accuracy(machine, stated, samples=SAMPLES if samples is None else samples)
    with tell_options(costs="--cost"):
        allowed = None if wanted is None else allocate_tolerances(result, wanted, costs)
    proved = None if over is None else bound_worst_case(result, ranges, _LONGEST if seconds is None else seconds)
    files = _write_map(result, output)
    if json:
        from ..export.json.accuracy import encode_accuracy

        print_json(encode_accuracy(result, proved, allowed, files))
    else:
        told = [f"{kind}  {path}" for kind, path in files.items()]
        print_text("\n".join([_format_accuracy(result, proved, allowed), *told]))
    return 0


def _write_map(result: Accuracy, output: Path | None) -> dict[str, str]:
    if output is None:
        return {}
    from ..export.accuracy_map import render_accuracy_map
    from ..export.files import write_files

    write_files(output.parent, {output.name: render_accuracy_map(result, output.suffix.lower())})
    return {"map": str(output)}


def split_pairs(texts: Sequence[str], source: str, example: str) -> list[tuple[str, str]]:
    """Split ``NAME=TEXT,NAME=TEXT`` into names and texts."""
    pairs = []
    for one in (word for text in texts for word in text.split(",")):
        name, equals, value = (word.strip() for word in one.partition("="))
        if not (name and equals and value):
            raise InputError(f"{quote(one.strip())}: expected NAME=VALUE, such as {example}", source)
        pairs.append((name, value))
    return pairs


def _parse_error(text: str | None) -> float | None:
    try:
        return None if text is None else parse_quantity(text, LENGTH)
    except QuantityError as error:
        raise InputError(str(error), "--error") from None


def _parse_costs(texts: Sequence[str] | None) -> dict[str, float]:
    costs: dict[str, float] = {}
    for name, text in split_pairs(texts or (), "--cost", "feet=1"):
        try:
            costs[name] = float(text)
        except ValueError:
            raise InputError(f"{name}: {quote(text)}, expected a number", "--cost") from None
    return costs


def _format_accuracy(result: Accuracy, proved: WorstCase | None, allowed: Sequence[Tolerance] | None) -> str:
    machine = result.machine
    median, most, worst = (1e3 * result.percentile(percent) for percent in (50, 95, 100))
    where = format_pose(machine, result.poses[result.worst])
    lines = [
        f"{machine.name}: the tip's error, root mean square, at {len(result.poses)} poses of the workspace\n",
        f"half of them   {format_fixed(median, 1)} um",
        f"95 % of them   {format_fixed(most, 1)} um",
        f"the worst      {format_fixed(worst, 1)} um at {where}",
        f"all numbers at their worst, to the first order: {format_fixed(1e3 * float(result.greatest.max()), 1)} um",
    ]
    if result.turns.any():
        turn = format_fixed(to_display(float(result.turns.max()), "rad"), 5)
        lines.append(f"the tool's turn, root mean square: at most {turn} deg")
    rows, wanted = [], {(one.name, one.unit): one.value for one in allowed or ()}
    for tolerance, mean, at_worst in result.budget:
        value, unit = to_display(tolerance.value, tolerance.unit), name_display_unit(tolerance.unit)
        row = [tolerance.name, f"{value:.6g} {unit}", f"{100.0 * mean:.1f} %", f"{100.0 * at_worst:.1f} %"]
        if allowed is not None:
            row.append(f"{to_display(wanted[tolerance.name, tolerance.unit], tolerance.unit):.3g} {unit}")
        rows.append(row)
    header = ["tolerance", "either way", "of the variance", "at the worst pose"]
    header += ["allowed"] if allowed is not None else []
    lines += ["", format_table(rows, header, " " + "r" * (len(header) - 1))]
    if proved is not None:
        bound = f"no machine within them is off by more than  {format_fixed(1e3 * proved.bound, 1)} um"
        if proved.unproved is not None:
            about = format_pose(machine, proved.unproved)
            bound = f"no bound of their error was found at these tolerances about {about};\n"
            bound += "smaller tolerances, a smaller box or more time may give one"
        lines += ["", bound]
        lines.append(f"one of them is off by                       {format_fixed(1e3 * proved.attained, 1)} um")
    return "\n".join(lines)
