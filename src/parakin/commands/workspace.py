"""``parakin workspace``: where a machine is allowed, with its volume proved, and the shape's files."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError, PoseError
from ..export.json.text import format_json
from .console import ProgressBar, announce_compiling, print_json, print_remark, print_text
from .options import INTERRUPTED, OFF_LIMITS, Json, Mode, Name, Sizes, load_machine, require_ending
from .region_options import AllParts, At, Every, Some, Time, Without, parse_length, parse_time, read_region
from .workspace_inside import InsideOptions, check_inside, encode_inside, explore_inside, format_inside
from .workspace_methods import Effort, Method, find_workspace
from .workspace_summary import format_workspace

if TYPE_CHECKING:
    from ..export.files import Content
    from ..export.workspace.workspace_files import WorkspaceFiles

_ELSEWHERE = 10.0  # s, at most, for what home can't reach

MachineArgument = Annotated[
    Name,
    Parameter(help="A shipped machine's name or a YAML file."),
]
Dexterous = Annotated[
    bool,
    Parameter(help="Every value of every turning axis must be allowed."),
]
MethodName = Annotated[
    Method,
    Parameter(
        help=(
            "certified proves; grid looks at a lattice of places, polar along rays from an axis, drives maps the "
            "drives."
        )
    ),
]
VolumeGap = Annotated[
    float | None,
    Parameter(help="How far apart the two numbers may be, relative to the volume; 0.01 by default."),
]
CellSize = Annotated[
    str | None,
    Parameter(help="Refine the whole boundary to cells of this size instead, mm."),
]
StepLength = Annotated[
    str | None,
    Parameter(help="Of the sampling methods, and of the grids for meshes and cross-sections, mm."),
]
LargestBox = Annotated[
    bool,
    Parameter(help="Look for the largest box inside, proved too, its edges along the axes."),
]
Proportions = Annotated[
    str | None,
    Parameter(help="Proportions of that box: 3:3:1."),
]
Centre = Annotated[
    str | None,
    Parameter(
        allow_leading_hyphen=True,
        help="The place that box is centred at: X=0,Y=0,Z=-1400.",
    ),
]
CountParts = Annotated[
    bool,
    Parameter(
        help="Count the parts that a path can't leave without crossing a singularity or changing the working mode."
    ),
]
StartPose = Annotated[
    str | None,
    Parameter(
        allow_leading_hyphen=True,
        help=(
            "A pose, X=0,Y=0,Z=-1400, to tell in which of these parts it lies; axes that are not named stand as "
            "at home."
        ),
    ),
]
Files = Annotated[
    list[Path] | None,
    Parameter(
        name=["--output", "-o"],
        help=(
            "A file, by its ending: .stl .ply .glb (mesh, mm), .vtu .csv (cells), .png, .pdf .svg (for a page), .json. "
            "May be given again."
        ),
    ),
]


def workspace(
    name: MachineArgument,
    /,
    *,
    at: At = None,
    every: Every = None,
    some: Some = None,
    dexterous: Dexterous = False,
    without: Without = None,
    method: MethodName = "certified",
    gap: VolumeGap = None,
    cell: CellSize = None,
    time: Time = None,
    step: StepLength = None,
    all_parts: AllParts = False,
    box: LargestBox = False,
    shape: Proportions = None,
    around: Centre = None,
    parts: CountParts = False,
    start: StartPose = None,
    mode: Mode = None,
    output: Files = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """Where a machine is allowed: the volume, proved to lie between two numbers, what bounds it, and its shape.

    The exit code is 3 if a file has nothing to be filled with, for the workspace is empty, or if no box is proved.
    """
    machine = load_machine(name, sizes)
    region = read_region(machine, at, every, some, dexterous, without, mode, all_parts)
    effort = Effort(gap, parse_length(cell, "--cell"), parse_time(time), parse_length(step, "--step"))
    options = InsideOptions(box, shape, around, parts, start, effort.seconds)
    check_inside(region, options)
    files = _sort_files(output or (), method, len(region.free_axes))
    announce_compiling()
    from ..export.json.workspace import encode_workspace
    from ..export.workspace.workspace_files import WorkspaceFiles, prepare_files
    from ..workspaces.certified.workspace import Workspace, measure_elsewhere

    began = clock.monotonic()
    with ProgressBar() as progress:
        is_drawn = json or bool(set(files) - {".vtu", ".csv"})
        result = find_workspace(method, region, effort, progress.stage("looking for it", 0.0, 0.6 if is_drawn else 1.0))
        seconds = clock.monotonic() - began
        contents = WorkspaceFiles(result, None, ())
        if is_drawn:
            contents = prepare_files(result, effort.step, progress.stage("drawing", 0.6, 1.0), effort.seconds)
        elsewhere = None
        if isinstance(result, Workspace):
            elsewhere = measure_elsewhere(result, seconds=min(_ELSEWHERE, effort.seconds))
        encoded = encode_workspace(result, contents.cross_sections, elsewhere)
        inside = explore_inside(region, options, progress)
        encoded.update(encode_inside(inside))
        encoded["parameters"] = {"step": effort.step, **encoded["parameters"], "set": list(sizes or ())}
        written, refused = _write_files(files, contents, encoded)
    if json:
        print_json({**encoded, "files": written})
    else:
        print_text(format_workspace(result, seconds, elsewhere) + format_inside(inside))
        if written:
            print_text("\n" + "\n".join(f"{kind:<5} {path}" for kind, path in written.items()))
    if contents.undrawn and json:
        print_remark(f"no cross-sections, {contents.undrawn}")
    for path, reason in refused.items():
        print_remark(f"{path}: not written, {reason}")
    if isinstance(result, Workspace) and result.stopped == "interrupted":
        return INTERRUPTED
    return OFF_LIMITS if refused or inside.no_box else 0


def _sort_files(paths: Sequence[Path], method: str, dimension: int) -> dict[str, Path]:
    """Sort the files by their endings; unknown, repeated and unfit ones are refused."""
    from ..export.workspace.workspace_files import SUFFIXES, explain_unfit

    files: dict[str, Path] = {}
    for path in paths:
        suffix = path.suffix.lower()
        require_ending(path, SUFFIXES)
        if suffix in files:
            raise InputError(f'"{path}": a second {suffix}', "--output")
        reason = explain_unfit(suffix, method, dimension)
        if reason:
            raise InputError(f'"{path}": {reason}', "--output")
        files[suffix] = path
    return files


def _write_files(
    files: Mapping[str, Path], source: WorkspaceFiles, encoded: Mapping[str, Any]
) -> tuple[dict[str, str], dict[Path, str]]:
    """Write files; return those written, by their endings without the dot, and those refused, with the reason."""
    from ..export.files import write_files

    contents: dict[str, Content] = {}
    refused: dict[Path, str] = {}
    for suffix, path in files.items():
        try:
            contents[suffix] = b"" if suffix == ".json" else source.make_file(suffix)
        except PoseError as error:
            refused[path] = str(error)
    written = {suffix.removeprefix("."): str(files[suffix]) for suffix in contents}
    if ".json" in contents:
        contents[".json"] = format_json({**encoded, "files": written})
    folders: dict[Path, dict[str, Content]] = {}
    for suffix, data in contents.items():
        folders.setdefault(files[suffix].parent, {})[files[suffix].name] = data
    for folder, group in folders.items():
        write_files(folder, group)
    return written, refused
