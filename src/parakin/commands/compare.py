"""``parakin compare``: machines side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..errors import InputError
from .accuracy import split_pairs
from .console import announce_compiling, format_table, print_json, print_remark, print_text
from .options import Json, complete_machine, load_machine
from .stiffness import split_words

if TYPE_CHECKING:
    from ..comparison.comparison import Comparison


def compare(
    names: Annotated[list[str], Parameter(completer=complete_machine)],
    /,
    *,
    tolerance: Annotated[list[str] | None, Parameter(negative="")] = None,
    drives: str | None = None,
    struts: str | None = None,
    part: Path | None = None,
    samples: int | None = None,
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
    """
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

    encoded = encode_comparison(result)
    if json:
        print_json(encoded)
        return 0
    print_text(_format_comparison(result))
    for column in encoded["machines"]:
        for what, reason in column["reasons"].items():
            print_remark(f"{column['name']}: {what}: {reason}")
    return 0


def _format_comparison(result: Comparison) -> str:
    from ..export.comparison_table import list_rows

    header = ["", *(column.machine.name for column in result.columns)]
    return format_table(list_rows(result), header, " " + "r" * len(result.columns))
