"""``parakin design FILE.yaml``: designs searched for and proved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, PoseError, quote
from ..export.figure_file import SCREEN
from ..units import name_display_unit, to_display
from .console import ProgressBar, announce_compiling, format_table, print_json, print_text
from .design_problem import read_design_problem
from .options import OFF_LIMITS
from .region_options import parse_time

if TYPE_CHECKING:
    from ..export.files import Content
    from ..synthesis.designs import Designs, ProvedDesign
    from ..synthesis.problem import DesignProblem

_NUMBERS = ".9g"


def design_by_search(path: Path, output: Path | None, count: int, time: float, json: bool) -> int:
    """Search for the designs of a problem's file, write and print them; 3 where none is proved."""
    if output is not None and output.suffix:
        raise InputError(f"{quote(output)}: expected a folder for the designs of a problem", "--output")
    problem = read_design_problem(path)
    seconds = parse_time(time)
    announce_compiling()
    from ..synthesis.designs import find_designs

    try:
        with ProgressBar() as bar:
            designs = find_designs(problem, count, seconds, bar.stage("designs", 0.0, 1.0))
    except PoseError as error:
        raise InputError(str(error), str(path)) from None
    files = _write_designs(designs, output) if output is not None and designs.front else []
    if json:
        from ..export.json.designs import encode_designs

        print_json(encode_designs(designs, files))
    else:
        print_text("\n".join([_format_designs(designs), *files]))
    return 0 if designs.front else OFF_LIMITS


def _write_designs(designs: Designs, output: Path) -> list[str]:
    from ..export.designs import format_proved_yaml, render_front
    from ..export.files import write_files

    files: dict[str, Content] = {
        f"design_{number}.yaml": format_proved_yaml(designs, number - 1) for number in range(1, len(designs.front) + 1)
    }
    if len(designs.problem.objectives) > 1:
        files |= {f"front{kind}": render_front(designs, kind) for kind in (SCREEN, ".pdf")}
    write_files(output, files)
    return [str(output / name) for name in files]


def _describe_objectives(problem: DesignProblem) -> str:
    ways = (("least", problem.minimise), ("greatest", problem.maximise))
    return ", ".join(f"{way} {' and '.join(names)}" for way, names in ways if names)


def _describe_tolerances(problem: DesignProblem) -> str:
    """Say of which machines a proof is."""
    own = ", ".join(f"{name} {value}" for name, value in (problem.within or {}).items())
    if not own:
        return ""
    return f" of all machines within {own}" + (", the part run on the nominal one" if problem.path is not None else "")


def _describe_proofs(number: int, design: ProvedDesign) -> str:
    """Say of which quantities less is proved than what was found where they were looked at."""
    said = []
    for name, worst in design.proved.items():
        value = design.values[name]
        if worst is None:
            said.append(f"{name} is sampled only")
        elif abs(worst - value) > 2e-6 * abs(value) and name in design.values:
            said.append(f"{name} proved to be {'above' if worst < value else 'below'} {worst:{_NUMBERS}}")
    return f"{number}: {', '.join(said)}" if said else ""


def _format_designs(designs: Designs) -> str:
    from ..synthesis.wants import WANTS

    problem = designs.problem
    lines = []
    if designs.shortfall:
        lines.append(designs.shortfall)
    units = {parameter.name: parameter.unit for parameter in problem.family.parameters}
    if designs.front:
        first = designs.front[0]
        quantities = [name for name in first.values if name not in first.sizes]
        header = ["", *first.sizes, *(f"{name} [{WANTS[name].unit}]".removesuffix(" []") for name in quantities)]
        rows = [
            [
                str(number),
                *(f"{to_display(value, units.get(name, 'mm')):{_NUMBERS}}" for name, value in found.sizes.items()),
                *(f"{found.values[name]:{_NUMBERS}}" for name in quantities),
            ]
            for number, found in enumerate(designs.front, 1)
        ]
        proved = f"{len(rows)} proved{_describe_tolerances(problem)}"
        lines += [f"{problem.machine.name}: {proved}, {_describe_objectives(problem)}\n"]
        lines += [format_table(rows, header, "r" * len(header))]
        lines += [_describe_proofs(number, found) for number, found in enumerate(designs.front, 1)]
        lines = [line for line in lines if line]
    for number, found in enumerate(designs.front, 1) if problem.fit_strokes else ():
        drives = dict(zip(found.machine.joints, found.machine.joint_units, strict=True))
        ends = ", ".join(
            f"{name} {to_display(low, drives[name]):.4f} to {to_display(high, drives[name]):.4f} "
            f"{name_display_unit(drives[name])}"
            for name, (low, high) in found.ranges.items()
        )
        lines.append(f"{number}: {ends}")
    for failed in designs.unproved:
        sizes = ", ".join(f"{name} {value:{_NUMBERS}}" for name, value in failed.sizes.items())
        lines.append(f"not proved: {sizes}: {failed.reason}")
    return "\n".join(lines)
