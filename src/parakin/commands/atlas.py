"""``parakin atlas``: how well a machine moves and holds its tool, at a pose, over a region, and proved over a box."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from ..budget import SECONDS, Budget
from ..errors import InputError, PoseError, quote
from ..export.json.performance import encode_atlas, encode_distance, encode_performance, encode_proofs
from ..units import NUMBER, QuantityError, parse_quantity, to_display
from .atlas_files import AtlasFiles
from .atlas_summary import format_atlas, format_distance, format_performance, format_proofs
from .console import ProgressBar, announce_compiling, print_json, print_text
from .options import OFF_LIMITS, Json, Mode, Name, OutputPath, Sizes, load_machine
from .region_options import (
    AllParts,
    At,
    Time,
    Without,
    parse_axis_ranges,
    parse_length,
    parse_time,
    read_region,
    split_axes,
)
from .values import parse_row, parse_value

if TYPE_CHECKING:
    from ..arrays import Array, AxisRange
    from ..performance.atlas import Atlas, PerformanceMap
    from ..performance.certified.amplification import Bracket
    from ..performance.certified.counterexamples import SingularityKind
    from ..performance.certified.nearest_singularity import SingularityDistance
    from ..performance.certified.proofs import Proof
    from ..performance.indices import Performance
    from ..workspaces.certified.region import Region


Growth = Annotated[
    Literal["box", "sphere"] | None,
    Parameter(
        help=(
            "The largest box of the proportions of --box, or sphere of tips at all of its orientations, about its "
            "middle and within it, without a parallel singularity, proved; and the singular pose that ends it."
        )
    ),
]


def atlas(
    name: Name,
    /,
    *,
    at: At = None,
    pose: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    box: str | None = None,
    amplification: str | None = None,
    grow: Growth = None,
    slices: Annotated[list[str] | None, Parameter(name="--slice")] = None,
    without: Without = None,
    all_parts: AllParts = False,
    step: str | None = None,
    size: Annotated[str | None, Parameter(name="--length")] = None,
    time: Time = None,
    mode: Mode = None,
    output: OutputPath = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """Conditioning, amplification and singularities: at a pose, all over the workspace, proved over a box.

    Without --pose and --box, or with --output, the workspace is looked at. The exit code is 3 if the pose is
    off limits or a claim on the box is refuted.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    pose
        A pose to look at: X=10,Z=-1400 or all values in order, mm and degrees; the rest is home's.
    box
        Poses all over which the claims must hold: X=-50:50,Y=-50:50,Z=-1600:-1500,B=0:30; --time closes brackets.
    amplification
        A claim on the box, LOW:HIGH: every velocity amplification is within, 1/3:3.
    slices
        A place to hold for a map: Z=-100. May be given again; by default as at home.
    step
        Between the places of the grid, mm.
    size
        The length by which angles become mm; by default it follows from the machine, and is told.
    output
        A folder for the maps, PNG and CSV, or one file by its ending.
    """
    machine = load_machine(name, sizes)
    region = read_region(machine, at, without=without, mode=mode, all_parts=all_parts)
    scale, apart = parse_length(size, "--length"), parse_length(step, "--step")
    given = parse_time(time)
    seconds = SECONDS if given is None else given
    ranges = parse_axis_ranges(machine, box, "--box")
    bounds = _parse_claim(amplification, bool(ranges))
    _check_growth(grow, bool(ranges), bounds is not None)
    cuts = _cut_region(region, slices or ())
    if slices and output is None:
        raise InputError("a map is a file, name it or its folder with -o", "--slice")
    files = AtlasFiles(machine.name, output, len(cuts)) if output is not None else None
    one_pose = None if pose is None else _parse_pose(region, pose)
    announce_compiling()
    results = _AtlasResults(region, scale, seconds, _QUICK if given is None else _MOST)
    with ProgressBar() as progress:
        if one_pose is not None:
            results.examine_pose(one_pose)
        if ranges:
            results.prove_box(ranges, bounds, progress) if grow is None else results.grow(ranges, grow)
        if files is not None or not (ranges or pose):
            results.compute_atlas(apart, progress)
        if files is not None:
            results.write_maps(files, cuts, apart)
    results.print(json)
    return OFF_LIMITS if results.refused else 0


def _parse_claim(text: str | None, has_box: bool) -> tuple[float, float] | None:
    """Parse the ends of a claim on the amplification."""
    if text is None:
        return None
    if not has_box:
        raise InputError("a claim needs poses to hold for: --box X=-50:50,Y=-50:50,Z=-50:50", "--amplification")
    low, colon, high = text.partition(":")
    try:
        ends = (parse_quantity(low, NUMBER), parse_quantity(high, NUMBER)) if colon else (1.0, 0.0)
    except QuantityError as error:
        raise InputError(str(error), "--amplification") from None
    if not 0.0 <= ends[0] <= ends[1]:
        raise InputError(f"{quote(text)}: expected LOW:HIGH, such as 1/3:3", "--amplification")
    return ends


def _check_growth(grow: str | None, has_box: bool, has_claim: bool) -> None:
    if grow is not None and not has_box:
        raise InputError("it grows within --box, name that", "--grow")
    if grow is not None and has_claim:
        raise InputError("it and --amplification are asked one at a time", "--grow")


def _parse_pose(region: Region, text: str) -> Array:
    """Parse a pose; axes that are not named are as in the region, else as at home."""
    machine = region.machine
    home = machine.home[[machine.axes.index(axis) for axis in region.free_axes]]
    words = [word.strip() for word in text.split(",")]
    return parse_row(words, machine.axes, machine.axis_units, region.poses(home[None])[0], "--pose")


def _cut_region(region: Region, slices: Sequence[str]) -> list[Region]:
    """Cut the slices to map: those of --slice, else one through home, or all of a region that is flat already."""
    machine, cuts = region.machine, []
    for text in slices:
        values = split_axes(machine, text, "--slice", "Z=-100")
        if len(values) != 1:
            raise InputError(f"{quote(text)}: one axis and its value expected", "--slice")
        ((axis, value),) = values.items()
        if axis not in region.free_axes or len(region.free_axes) < 2:
            raise InputError(f"{axis} is no place to cut at, {' '.join(region.free_axes)} are left", "--slice")
        cuts.append((axis, parse_value(axis, value, "--slice")))
        if cuts[-1] in cuts[:-1]:
            raise InputError(f"{quote(text)} is given twice", "--slice")
    if not slices and len(region.free_axes) < 3:
        return [region]
    if not slices:
        axis = region.free_axes[-1]
        cuts = [(axis, float(machine.home[machine.axes.index(axis)]))]
    return [region.fix({axis: value}) for axis, value in cuts]


_QUICK, _MOST = 20_000, 200_000  # boxes of brackets, some 3 s of six axes where no time is given


class _AtlasResults:
    """All results of a run of the command, and how they are printed.

    length : the characteristic length, mm, or None for the machine's own
    seconds : for each proof, and for the workspace
    boxes : that the amplification's brackets may examine, where no claim is made
    """

    def __init__(self, region: Region, length: float | None, seconds: float, boxes: int):
        self.boxes = boxes
        self.machine, self.region, self.length, self.seconds = region.machine, region, length, seconds
        self.performance: Performance | None = None
        self.broken_limit = ""
        self.ranges: dict[str, AxisRange] = {}
        self.proofs: list[Proof] = []
        self.brackets: Sequence[Bracket] = ()
        self.grown: SingularityDistance | None = None
        self.atlas: Atlas | None = None
        self.maps: list[PerformanceMap] = []
        self.written: dict[str, str] = {}

    def examine_pose(self, pose: Array) -> None:
        from ..performance.indices import compute_performance

        self.performance = compute_performance(self.machine, pose, self.length, self.region.mode)
        broken = int(self.machine.check(pose, mode=self.region.mode))
        self.broken_limit = self.machine.limits[broken - 1] if broken else ""

    def prove_box(self, ranges: dict[str, AxisRange], bounds: AxisRange | None, progress: ProgressBar) -> None:
        """Prove a box free of singularities, and its amplification within bounds, or bracket it if there are none."""
        from ..performance.certified.proofs import (
            bracket_extremes,
            make_pose_box,
            prove_amplification,
            prove_no_singularity,
        )

        self.ranges = ranges
        box = make_pose_box(self.region, ranges, self.length)
        kinds: list[SingularityKind] = ["parallel", "serial"]
        if self.region.machine.constraints:
            kinds.append("constraint")
        self.proofs = [prove_no_singularity(box, kind, seconds=self.seconds) for kind in kinds]
        report = progress.stage("proving", 0.0, 1.0)
        if bounds is not None:
            self.proofs.append(prove_amplification(box, *bounds, seconds=self.seconds, progress=report))
            self.brackets = self.proofs[-1].brackets
        elif all(proof.verdict == "proved" for proof in self.proofs):
            self.brackets = bracket_extremes(box, boxes=self.boxes, seconds=self.seconds, progress=report).brackets

    def grow(self, ranges: dict[str, AxisRange], shape: Literal["box", "sphere"]) -> None:
        from ..performance.certified.nearest_singularity import find_nearest_singularity

        try:
            self.grown = find_nearest_singularity(self.region, ranges, shape, seconds=self.seconds)
        except PoseError as error:
            raise InputError(str(error).removeprefix("box: "), "--box") from None

    def compute_atlas(self, step: float | None, progress: ProgressBar) -> None:
        from ..performance.atlas import atlas

        report = progress.stage("looking at the workspace", 0.0, 1.0)
        self.atlas = atlas(self.region, step, self.length, report, self.seconds)

    def write_maps(self, files: AtlasFiles, cuts: Sequence[Region], step: float | None) -> None:
        assert self.atlas is not None
        self.maps = [self._map_slice(cut, step) for cut in cuts]
        self.written = files.write(self.atlas, self.maps)

    def _map_slice(self, cut: Region, step: float | None) -> PerformanceMap:
        from ..performance.atlas import map_performance

        assert self.atlas is not None
        if cut is self.region:
            return self.atlas.map
        try:
            return map_performance(cut, step, self.length, budget=Budget(self.seconds))
        except PoseError as error:
            axis = next(axis for axis in self.region.free_axes if axis in cut.fixed_axes)
            raise InputError(f"{axis}={cut.fixed_axes[axis]:g}: {error}", "--slice") from None

    @property
    def verdict(self) -> str:
        for verdict in ("refuted", "undecided"):
            if any(proof.verdict == verdict for proof in self.proofs):
                return verdict
        return "off limits" if self.broken_limit else "ok"

    @property
    def refused(self) -> bool:
        return bool(self.broken_limit) or any(proof.verdict == "refuted" for proof in self.proofs)

    def print(self, json: bool) -> None:
        """Print the results, as JSON or as text, and the files written."""
        if json:
            print_json(self._encode())
            return
        paragraphs = []
        if self.performance is not None:
            paragraphs.append(format_performance(self.performance, self.broken_limit))
        if self.ranges:
            paragraphs.append(format_proofs(self.machine, self.ranges, self.proofs, self.brackets))
        if self.grown is not None:
            paragraphs.append(format_distance(self.grown))
        if self.atlas is not None:
            paragraphs.append(format_atlas(self.atlas))
        if self.written:
            from ..export.atlas_maps import describe_map

            lines = [f"{kind:<7} {path}" for kind, path in self.written.items()]
            paragraphs.append("\n".join([*lines, *map(describe_map, self.maps)]))
        print_text("\n\n".join(paragraphs))

    def _encode(self) -> dict[str, Any]:
        machine, fixed = self.machine, self.region.fixed_axes
        units = dict(zip(machine.axes, machine.axis_units, strict=True))
        proofs = encode_proofs(machine, self.ranges, self.proofs, self.brackets) if self.ranges else None
        return {
            "schema": "parakin.atlas/1",
            "machine": machine.name,
            "mode": self.region.mode,
            "at": {axis: to_display(fixed[axis], units[axis]) for axis in machine.axes if axis in fixed},
            "verdict": self.verdict,
            "pose": None if self.performance is None else encode_performance(self.performance, self.broken_limit),
            "box": proofs,
            "grown": None if self.grown is None else encode_distance(self.grown),
            "region": None if self.atlas is None else encode_atlas(self.atlas),
            "files": self.written,
        }
