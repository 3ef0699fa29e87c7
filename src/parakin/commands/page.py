"""``parakin page``: a machine, or a part on it, as one HTML file on which it moves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..errors import InputError
from .console import ProgressBar, announce_compiling, print_json, print_text
from .options import (
    OFF_LIMITS,
    Json,
    Mode,
    OutputPath,
    Sizes,
    complete_machine_or_part,
    load_machine,
    require_ending,
)
from .part_job import JobOptions, prepare_part
from .part_options import PartOptions, ToolLengthText, fit_part, parse_tool_length, read_part
from .post import MachineOption, WorkpieceText
from .workpiece import parse_workpiece

if TYPE_CHECKING:
    from ..machine import Machine
    from ..toolpath.job import Job

_ARC_TOLERANCE = 0.01  # mm, as of ``parakin post``


def page(
    name: Annotated[str, Parameter(completer=complete_machine_or_part)],
    /,
    *,
    machine: MachineOption | None = None,
    output: OutputPath = None,
    workpiece: WorkpieceText = None,
    tool_length: ToolLengthText = None,
    mode: Mode = None,
    force: bool = False,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """A machine, or a part on it, as one HTML file on which it moves, to open from a disk without a network.

    Drag the tool, a strut or a slider: limits colour the struts and are named where they stop it; working and assembly
    modes can be switched; near a singularity the free motion is drawn; the workspace's surface follows the orientation.
    A part's tool path is played, coloured by margin, feed, or what sets the pace. The exit code is 3 if the machine
    can't run the part; the page shows where.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file; with --machine a part: a CL file or a G-code program.
    machine
        The machine that the part is for, a name or a YAML file.
    output
        The file, an .html; by default the machine's or the part's name, in this folder.
    force
        Overwrite a file that parakin did not write.
    """
    from ..toolpath.reading.detect import PART_SUFFIXES

    if machine is None and Path(name).suffix.lower() in PART_SUFFIXES:
        raise InputError("a part needs the machine that it is for; expected --machine", name)
    chosen = load_machine(name if machine is None else machine, sizes)
    if machine is None and (workpiece, tool_length, mode) != (None, None, None):
        raise InputError("only a part has a workpiece, a tool length and a mode; expected --machine", name)
    output = Path(f"{chosen.name if machine is None else Path(name).stem}.html") if output is None else output
    require_ending(output, (".html",))
    refuse_foreign_file(output, force)
    from ..export.files import write_files
    from ..export.page.page import render_machine_page, render_path_page

    if machine is None:
        content, runs = render_machine_page(chosen), True
    else:
        job = _prepare(chosen, Path(name), workpiece, tool_length, mode)
        content, runs = render_path_page(job.posted, job.trajectory), job.runs
    write_files(output.parent, {output.name: content})
    if json:
        answer = {"machine": chosen.name, "runs": runs, "files": {"page": str(output)}}
        print_json({"schema": "parakin.page/1", **answer})
    else:
        print_text(f"page  {output}{'' if runs else '  (off limits)'}")
    return 0 if runs else OFF_LIMITS


def refuse_foreign_file(output: Path, force: bool) -> None:
    """Raise :class:`InputError` where a file stands that parakin did not write as a page."""
    from ..export.page.page import is_page

    if not force and output.exists() and not is_page(output):
        raise InputError("no page that parakin wrote; nothing is written, --force overwrites it", str(output))


def _prepare(machine: Machine, part: Path, workpiece: str | None, tool_length: str | None, mode: str | None) -> Job:
    """Prepare a part as ``parakin post`` does by default."""
    placed = None if workpiece is None else parse_workpiece(workpiece)
    length = parse_tool_length(tool_length, None)
    announce_compiling()
    from ..toolpath.job import Tolerances
    from ..toolpath.posting.frames import compose_frames

    with ProgressBar() as progress:
        saying = progress.stage("reading", 0.0, 0.1)
        path = read_part(part, PartOptions(), _ARC_TOLERANCE, compose_frames(placed, None), saying)
        path = fit_part(machine, path, length, placed)
        options = JobOptions(mode, Tolerances(), None, "round", None, None)
        return prepare_part(machine, path, placed, None, options, progress).job
