"""``parakin compare``: machines side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..errors import InputError
from .accuracy import split_pairs
from .console import announce_compiling, format_table, measure_line, print_json, print_remark, print_text
from .options import Json, OutputPath, complete_machine, load_machine, require_ending
from .stiffness import split_words

if TYPE_CHECKING:
    from ..comparison.comparison import Comparison

_LINE = 100  # letters, where there is no terminal


def compare(
    names: Annotated[list[str], Parameter(completer=complete_machine)],
    /,
    *,
    tolerance: Annotated[list[str] | None, Parameter(negative="")] = None,
    drives: str | None = None,
    struts: str | None = None,
    part: Path | None = None,
    samples: int | None = None,
    output: OutputPath = None,
    json: Json = False,
) -> int:
    """Machines side by side: workspace, indices, accuracy, stiffness, and the time that a part takes.

    Parameters
    ----------
    names
        Two machines or more: shipped machines' names or YAML files.
    tolerance
        What numbers may be off, as for accuracy: feet=0.05mm,encoders=2um. A machine leaves out what it has not.
    drives
        The stiffness of the drives, along and about their joints: 100N/um,200kNm/rad.
    struts
        The section of the struts, or how stiff each rod is, as for stiffness.
    part
        A CL file or G-code, which is placed on each machine where its least margin is greatest.
    samples
        How many poses of each workspace are looked at; by default 400.
    output
        A page to write, .html: the machines' pictures and figures side by side.
    """
    require_ending(output, (".html",))
    if len(names) < 2:
        raise InputError("two machines at least expected", "compare")
    machines = [load_machine(name) for name in names]
    tolerances = None if tolerance is None else split_pairs(tolerance, "--tolerance", "feet=0.05mm")
    of_struts = split_words([struts], "--struts") if struts is not None and "=" in struts else struts
    path = None
    if part is not None:
        from ..toolpath.reading.detect import read_path

        path = read_path(part)
    announce_compiling()
    from ..comparison.comparison import compare as compare_machines
    from ..workspaces.sampled.allowed_poses import SAMPLES

    result = compare_machines(
        machines,
        tolerances=tolerances,
        drives=drives,
        struts=of_struts,
        path=path,
        samples=SAMPLES if samples is None else samples,
    )
    from ..export.json.comparison import encode_comparison

    files = {} if output is None else _write_page(result, output)
    if json:
        print_json(encode_comparison(result, files))
        return 0
    print_text("\n\n".join([_format_comparison(result), *(f"{kind}  {name}" for kind, name in files.items())]))
    for column in result.columns:
        for what, reason in column.reasons.items():
            print_remark(f"{column.machine.name}: {what}: {reason}")
    return 0


def _write_page(result: Comparison, output: Path) -> dict[str, str]:
    from ..export.comparison_page import render_comparison_page
    from ..export.files import write_files

    write_files(output.parent, {output.name: render_comparison_page(result)})
    return {"page": str(output)}


def _format_comparison(result: Comparison) -> str:
    """Format a column for each machine, as many beside each other as fit a line; where that is one, a line for each."""
    from ..export.comparison_table import list_rows

    names = [column.machine.name for column in result.columns]
    titles, *columns = zip(*[["", *names], *list_rows(result)], strict=True)
    room = measure_line(_LINE) - max(map(len, titles))
    blocks: list[list[tuple[str, ...]]] = [[]]
    for column in columns:
        if blocks[-1] and sum(2 + max(map(len, own)) for own in (*blocks[-1], column)) > room:
            blocks.append([])
        blocks[-1].append(column)
    if any(len(block) == 1 for block in blocks[:-1]):
        blocks = [list(columns)]
    tables = [list(zip(titles, *block, strict=True)) for block in blocks]
    return "\n\n".join(format_table(rows, header, " " + "r" * (len(header) - 1)) for header, *rows in tables)
