"""``parakin inverse`` and ``parakin forward``: joints for poses and poses for joints, one or a CSV of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from ..errors import InputError
from ..export.json.poses import encode_poses
from ..export.number_format import format_fixed
from ..export.tables.poses import ColumnGroup, PoseTable, format_pose_csv
from ..units import LENGTH, QuantityError, name_display_unit, parse_quantity, to_display
from .console import announce_compiling, format_table, print_json, print_remark, print_text
from .offences import format_offence
from .options import OFF_LIMITS, Json, Mode, Name, Sizes, load_machine
from .values import parse_row

if TYPE_CHECKING:
    from ..arrays import Array, Indices
    from ..kinematics.solution import Solution
    from ..machine import Machine
    from ..toolpath.posting.offences import Judgement
    from ..toolpath.posting.posted import Offence

Csv = Annotated[Path | None, Parameter(help="Rows of values instead, mm and degrees; with a header in any order.")]
Output = Annotated[Path | None, Parameter(name=["--output", "-o"], help="Write the result there, as CSV.")]

_LOST = 10  # rows without a pose that are named


def inverse(
    name: Name,
    /,
    *values: str,
    csv: Csv = None,
    mode: Mode = None,
    output: Output = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """Joints for poses.

    The exit code is 3 if a pose is out of reach or off limits.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    values
        A pose in mm and degrees, in the order of the axes or by name: X=10 Z=-1400; the rest comes from home.
    """
    machine = load_machine(name, sizes)
    poses, lines = _read_values(machine, "pose", values, csv, machine.home)
    announce_compiling()
    from ..toolpath.posting.offences import judge_path

    joints = machine.inverse(poses, mode)
    judgement = judge_path(machine, poses, joints, lines, mode)
    table = PoseTable(machine, poses, joints, [_name_broken(judgement, i) for i in range(len(poses))])
    _show_table(table, _Request("inverse", "joints", csv, output, json), judgement.offences)
    return OFF_LIMITS if judgement.offences else 0


def forward(
    name: Name,
    /,
    *values: str,
    csv: Csv = None,
    near: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    agreement: str = "1 um",
    output: Output = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """Poses for joints.

    The exit code is 3 if no pose is found, or one that is off limits.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    values
        Joints in mm and degrees, in their order or by name: d1=1200 d2=1250; the rest is home's.
    near
        A pose to start from and to stay near, with commas: 0,0,-1400,0,0 or X=10,Z=-1400; home by default.
    agreement
        By how much legs may fail to close where there are more drives than freedoms, whose joints never quite agree as
        they are measured or written.
    """
    import numpy as np

    machine = load_machine(name, sizes)
    agreed = _parse_agreement(agreement)
    announce_compiling()
    joints, lines = _read_values(machine, "joints", values, csv, machine.inverse(machine.home))
    start = None
    if near is not None:
        words = [word.strip() for word in near.split(",")]
        start = parse_row(words, machine.axes, machine.axis_units, machine.home, "--near")
    from ..toolpath.posting.offences import judge_path

    solution = machine.forward(joints, start, agreement=agreed)
    solved = np.flatnonzero(solution.converged)
    judgement = judge_path(machine, solution.poses[solved], joints[solved], lines[solved])
    offences = tuple(replace(offence, record=int(solved[offence.record])) for offence in judgement.offences)
    broken = ["not converged"] * len(joints)
    for i, row in enumerate(solved.tolist()):
        broken[row] = _name_broken(judgement, i)
    table = PoseTable(machine, solution.poses, joints, broken, solution)
    _show_table(table, _Request("forward", "pose", csv, output, json), offences)
    _report_lost(machine, solution, csv, lines)
    _report_other_modes(machine, solution)
    return OFF_LIMITS if len(solved) < len(joints) or offences else 0


def _parse_agreement(text: str) -> float:
    """Parse a length, mm."""
    try:
        return parse_quantity(text, LENGTH)
    except QuantityError as error:
        raise InputError(str(error), "--agreement") from None


def _report_other_modes(machine: Machine, solution: Solution) -> None:
    """Say where the legs stand in another working mode than the machine's."""
    import numpy as np

    count = int(np.count_nonzero(solution.in_other_mode))
    if count:
        rows = "the pose has" if len(solution.in_other_mode) == 1 else f"{count:,} rows have"
        print_remark(f"{rows} the joints in another working mode than the machine's {machine.mode}, as --near has them")


def _report_lost(machine: Machine, solution: Solution, csv: Path | None, lines: Indices) -> None:
    """Print the rows without a pose, some of them by their line."""
    import numpy as np

    lost, reasons = np.flatnonzero(~solution.converged).tolist(), solution.reasons
    for row in lost[:_LOST]:
        place = f"{csv}:{lines[row]}" if csv else "joints"
        residual = solution.residual[row]
        closes = np.isnan(residual) or residual <= machine.closure_tolerance
        gap = "" if closes else f" (they fail to close by {residual:.3g} mm)"
        print_remark(f"{place}: no pose found, {reasons[row]}{gap}")
    if len(lost) > _LOST:
        print_remark(f"{csv}: no pose found for {len(lost) - _LOST:,} more rows")


def _name_broken(judgement: Judgement, row: int) -> str:
    broken = int(judgement.broken[row])
    return judgement.limits[broken - 1] if broken else ""


def _read_values(
    machine: Machine, side: ColumnGroup, values: tuple[str, ...], csv: Path | None, default: Array
) -> tuple[Array, Indices]:
    """Read the rows that a command is given, mm and rad, and their lines in the CSV."""
    import numpy as np

    poses = machine.axes, machine.axis_units
    names, units = poses if side == "pose" else (machine.joints, machine.joint_units)
    if csv is not None:
        if values:
            raise InputError("values on the line and --csv, expected one of them", side)
        from .rows import read_rows

        return read_rows(csv, names, units)
    if not values:
        raise InputError(f"no values, expected {' '.join(names)} (or --csv FILE)", side)
    return parse_row(values, names, units, default, side)[None, :], np.zeros(1, np.int64)


@dataclass(frozen=True)
class _Request:
    """What a command shows: the problem, the side of its table that is the answer, and the options on output."""

    problem: Literal["inverse", "forward"]
    answer: ColumnGroup
    csv: Path | None
    output: Path | None
    json: bool


def _show_table(table: PoseTable, request: _Request, offences: Sequence[Offence]) -> None:
    """Print or write a table, and print its offences."""
    csv, output = request.csv, request.output
    for offence in offences:
        print_remark(format_offence(f"{csv}:{offence.line}", offence, "row") if csv else f"pose: {offence.text}")
    if output is not None:
        from ..export.files import write_files

        write_files(output.parent, {output.name: format_pose_csv(table)})
    if request.json:
        files = {} if output is None else {"table": str(output)}
        print_json(encode_poses(request.problem, table, offences, files))
    elif output is not None:
        print_text(f"table {output}")
    elif csv is not None:
        print_text(format_pose_csv(table).removesuffix("\n"))
    else:
        print_text(_format_answer(table, request.answer))


def _format_answer(table: PoseTable, answer: ColumnGroup) -> str:
    """Format the answer for a single row."""
    names, units, values = table.columns(answer)
    cells = [
        (name, "-" if value != value else format_fixed(to_display(value, unit), 6), name_display_unit(unit))
        for name, unit, value in zip(names, units, values[0].tolist(), strict=True)
    ]
    text = format_table(cells, (answer, "", ""), " r")
    solution = table.solution
    if solution is not None and solution.converged[0]:
        text += f"\n\nconverged in {solution.steps[0]} steps, residual {solution.residual[0]:.1e} mm"
    return text
