"""``parakin atlas``: how well a machine moves and holds its tool, at a pose, over a region, and proved over a box."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError, PoseError, quote
from ..units import NUMBER, QuantityError, parse_quantity
from .atlas_files import Files
from .atlas_summary import atlas_json, atlas_text, performance_json, performance_text, proofs_json, proofs_text
from .console import Progress, announce_compiling, print_json, rim
from .options import OFF_LIMITS, Json, Mode, Name, Sizes, machine_of
from .regions import At, Without, length, parts_of, ranges_of, region_of, values_of
from .values import parse_row, parse_value

if TYPE_CHECKING:
    from ..arrays import Array
    from ..machine import Machine
    from ..performance.atlas import Atlas, PerformanceMap
    from ..performance.certified.proofs import AmplificationBrackets, Proof
    from ..performance.indices import Performance
    from ..workspaces.certified.region import Region

Spans = dict[str, tuple[float, float]]


def atlas(
    name: Name,
    /,
    *,
    at: At = None,
    pose: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    box: str | None = None,
    amplification: str | None = None,
    slices: Annotated[list[str] | None, Parameter(name="--slice")] = None,
    without: Without = None,
    step: str | None = None,
    size: Annotated[str | None, Parameter(name="--length")] = None,
    mode: Mode = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
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
        Poses all over which the claims must hold: X=-50:50,Y=-50:50,Z=-1600:-1500; turning axes go too.
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
    machine = machine_of(name, sizes)
    asked = region_of(machine, at, without=without, mode=mode)
    scale, apart = length(size, "--length"), length(step, "--step")
    spans = ranges_of(machine, box, "--box")
    bounds = _bounds(amplification, bool(spans))
    cuts = _cuts(machine, asked, slices or ())
    if slices and output is None:
        raise InputError("a map is a file, name it or its folder with -o", "--slice")
    files = Files(machine.name, output, len(cuts)) if output is not None else None
    rows = None
    if pose is not None:
        default = asked.poses(machine.home[[machine.axes.index(axis) for axis in asked.free_axes]][None])[0]
        rows = parse_row(
            [part.strip() for part in pose.split(",")], machine.axes, machine.axis_units, default, "--pose"
        )
    announce_compiling()
    found = _Found(machine, asked)
    with Progress() as progress:
        if rows is not None:
            found.look(rows, scale)
        if spans:
            found.prove(spans, values_of(machine, at, "--at"), bounds, scale, progress)
        if files is not None or not (spans or pose):
            found.draw(apart, scale, progress)
        written = {}
        if files is not None and found.atlas is not None:
            written = files.write(found.atlas, [found.mapped(cut, apart, scale) for cut in cuts])
    found.tell(json, written)
    return OFF_LIMITS if found.refused else 0


def _bounds(text: str | None, has_box: bool) -> tuple[float, float] | None:
    """The ends of a claim on the amplification."""
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


def _cuts(machine: Machine, asked: Region, slices: Sequence[str]) -> list[Region]:
    """The regions to draw: those that --slice names, else one through home, or all of one that is flat already."""
    held = []
    for text in slices:
        parts = parts_of(machine, text, "--slice", "Z=-100")
        if len(parts) != 1:
            raise InputError(f"{quote(text)}: one axis and its value expected", "--slice")
        axis, value = parts[0]
        if axis not in asked.free_axes or len(asked.free_axes) < 2:
            raise InputError(f"{axis} is no place to cut at, {' '.join(asked.free_axes)} are left", "--slice")
        held.append((axis, parse_value(axis, value, "--slice")))
        if held[-1] in held[:-1]:
            raise InputError(f"{quote(text)} is given twice", "--slice")
    if not slices and len(asked.free_axes) < 3:
        return [asked]
    if not slices:
        axis = asked.free_axes[-1]
        held = [(axis, float(machine.home[machine.axes.index(axis)]))]
    return [asked.fix({axis: value}) for axis, value in held]


class _Found:
    """All that a run of the command finds, and how it is told."""

    def __init__(self, machine: Machine, asked: Region):
        self.machine, self.asked = machine, asked
        self.pose: Performance | None = None
        self.broken = ""
        self.spans: Spans = {}
        self.proofs: list[Proof] = []
        self.brackets: AmplificationBrackets | None = None
        self.atlas: Atlas | None = None

    def look(self, pose: Array, length: float | None) -> None:
        from ..performance.indices import compute_performance

        self.pose = compute_performance(self.machine, pose, length, self.asked.mode)
        broken = int(self.machine.check(pose, mode=self.asked.mode))
        self.broken = self.machine.limits[broken - 1] if broken else ""

    def prove(
        self,
        spans: Spans,
        at: dict[str, float],
        bounds: tuple[float, float] | None,
        length: float | None,
        progress: Progress,
    ) -> None:
        from ..performance.certified.proofs import (
            bracket_extremes,
            make_pose_box,
            prove_amplification,
            prove_no_singularity,
        )

        self.spans = spans
        box = make_pose_box(self.machine, spans, at, length, self.asked.mode)
        self.proofs = [prove_no_singularity(box, "parallel"), prove_no_singularity(box, "serial")]
        told = progress.part("proving", 0.0, 1.0)
        if bounds is not None:
            self.proofs.append(prove_amplification(box, *bounds, progress=told))
        elif all(proof.verdict == "proved" for proof in self.proofs):
            self.brackets = bracket_extremes(box, progress=told)

    def draw(self, step: float | None, length: float | None, progress: Progress) -> None:
        from ..performance.atlas import atlas

        self.atlas = atlas(self.asked, step, length, progress.part("looking at the workspace", 0.0, 1.0))

    def mapped(self, cut: Region, step: float | None, length: float | None) -> PerformanceMap:
        from ..performance.atlas import map_performance

        assert self.atlas is not None
        if cut is self.asked:
            return self.atlas.map
        try:
            return map_performance(cut, step, length)
        except PoseError as error:
            axis = next(axis for axis in self.asked.free_axes if axis in cut.fixed_axes)
            raise InputError(f"{axis}={cut.fixed_axes[axis]:g}: {error}", "--slice") from None

    @property
    def verdict(self) -> str:
        for verdict in ("refuted", "undecided"):
            if any(proof.verdict == verdict for proof in self.proofs):
                return verdict
        return "off limits" if self.broken else "ok"

    @property
    def refused(self) -> bool:
        return bool(self.broken) or any(proof.verdict == "refuted" for proof in self.proofs)

    def tell(self, json: bool, written: dict[str, str]) -> None:
        machine = self.machine
        if json:
            told: dict[str, Any] = {
                "schema": "parakin.atlas/1",
                "machine": machine.name,
                "mode": self.asked.mode,
                "at": {
                    axis: rim(value, unit)
                    for axis, unit in zip(machine.axes, machine.axis_units, strict=True)
                    if (value := self.asked.fixed_axes.get(axis)) is not None
                },
                "verdict": self.verdict,
                "pose": None if self.pose is None else performance_json(self.pose, self.broken),
                "box": proofs_json(machine, self.spans, self.proofs, self.brackets) if self.spans else None,
                "region": None if self.atlas is None else atlas_json(self.atlas),
                "files": written,
            }
            print_json(told)
            return
        parts = []
        if self.pose is not None:
            parts.append(performance_text(self.pose, self.broken))
        if self.spans:
            parts.append(proofs_text(machine, self.spans, self.proofs, self.brackets))
        if self.atlas is not None:
            parts.append(atlas_text(self.atlas))
        if written:
            parts.append("\n".join(f"{kind:<7} {path}" for kind, path in written.items()))
        print("\n\n".join(parts))
