"""``parakin design FILE.yaml``: designs searched for and proved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, PoseError, quote
from ..export.figure_file import SCREEN
from .console import ProgressBar, announce_compiling, format_table, print_json, print_text
from .design_problem import read_design_problem
from .options import OFF_LIMITS
from .region_options import parse_time

if TYPE_CHECKING:
    from ..export.files import Content
    from ..synthesis.designs import Designs

_NUMBERS = ".9g"


def design_by_search(path: Path, output: Path | None, count: int, time: float, json: bool) -> int:
    """Search for the designs of a problem's file, write and print them; 3 where none is proved."""
    if output is not None and output.suffix.lower() not in ("", ".html"):
        raise InputError(
            f"{quote(output)}: expected a folder, or a page .html, for the designs of a problem", "--output"
        )
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
    from ..export.front_page import render_front_page

    if output.suffix:
        write_files(output.parent, {output.name: render_front_page(designs)})
        return [str(output)]
    files: dict[str, Content] = {
        f"design_{number}.yaml": format_proved_yaml(designs, number - 1) for number in range(1, len(designs.front) + 1)
    }
    if len(designs.problem.objectives) > 1:
        files |= {f"front{kind}": render_front(designs, kind) for kind in (SCREEN, ".pdf")}
    files["front.html"] = render_front_page(designs)
    write_files(output, files)
    return [str(output / name) for name in files]


def _format_designs(designs: Designs) -> str:
    from ..export.designs import (
        describe_designs,
        describe_proofs,
        describe_ranges,
        list_shown_values,
        list_units,
        name_with_unit,
    )

    problem = designs.problem
    lines = [designs.shortfall] if designs.shortfall else []
    units = list_units(problem)
    if designs.front:
        shown = [list_shown_values(designs, index) for index in range(len(designs.front))]
        header = ["", *(name if name in problem.variables else name_with_unit(name, units) for name in shown[0])]
        rows = [
            [str(number), *(f"{value:{_NUMBERS}}" for value in values.values())]
            for number, values in enumerate(shown, 1)
        ]
        lines += [f"{describe_designs(designs)}\n", format_table(rows, header, "r" * len(header))]
        proofs = [describe_proofs(found, _NUMBERS) for found in designs.front]
        lines += [f"{number}: {said}" for number, said in enumerate(proofs, 1) if said]
    for number, found in enumerate(designs.front, 1) if problem.fit_strokes else ():
        lines.append(f"{number}: {describe_ranges(found)}")
    for failed in designs.unproved:
        lines.append(f"not proved: {problem.format_variables(failed.sizes, _NUMBERS)}: {failed.reason}")
    return "\n".join(lines)
