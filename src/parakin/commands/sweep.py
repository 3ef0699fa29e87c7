"""``parakin sweep``: designs by the million, each at the poses of a problem's box, in a folder of Parquet files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from .console import ProgressBar, announce_compiling, print_json, print_remark, print_text
from .options import OFF_LIMITS, Json

if TYPE_CHECKING:
    from ..export.sweep_folder import SweepResult


def sweep(
    problem: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    designs: Annotated[int, Parameter(allow_leading_hyphen=True)] = 10_000,
    poses: Annotated[int, Parameter(allow_leading_hyphen=True)] = 1000,
    seed: Annotated[int, Parameter(allow_leading_hyphen=True)] = 0,
    scheduler: str | None = None,
    json: Json = False,
) -> int:
    """Look at designs all over the free numbers of a problem, each at poses of its box; go on where it was interrupted.

    Parameters
    ----------
    problem
        A design problem, .yaml, as for parakin design.
    output
        A folder for _sweep.json and the parts, .parquet: each design with the share of poses at which the limits are
        kept, the limit that is broken most often, and what the problem bounds or minimises.
    designs
        How many designs are drawn.
    poses
        How many poses each is looked at: the corners of the box, and places drawn in it.
    seed
        Of what is drawn.
    scheduler
        Of Dask workers, tcp://HOST:PORT, which have parakin installed; by default the cores of this machine. Where the
        scheduler serves its dashboard (it does with bokeh), its address is told.
    """
    from .design_problem import read_design_problem

    wanted = read_design_problem(problem)
    if wanted.within is not None:
        print_remark("nominal machines are looked at: within is for parakin design, which proves it")
    announce_compiling()
    from ..export.sweep_folder import run_sweep
    from ..synthesis.sweep import SweepPlan

    plan = SweepPlan(wanted, designs, poses, seed)
    with ProgressBar() as bar:
        report = bar.stage("designs", 0.0, 1.0)
        result = run_sweep(plan, output, scheduler, report, lambda link: print_remark(f"dashboard {link}"))
    if json:
        answer = {"machine": wanted.machine.name, "designs": result.designs, "poses": poses, "made": result.made}
        answer |= {"ns_per_pose": 1e9 * result.cost if result.made else None, "kernel_ns_per_pose": 1e9 * result.kernel}
        answer |= {"keeping": result.keeping, "best": result.best, "files": {"folder": str(output)}}
        print_json({"schema": "parakin.sweep/1", **answer})
    else:
        print_text(f"{_format_result(result, wanted.machine.name)}\n\nfolder  {output}")
    return 0 if result.keeping else OFF_LIMITS


def _format_result(result: SweepResult, name: str) -> str:
    older = result.designs - result.made
    lines = [f"{name}: {result.keeping:,} of {result.designs:,} designs keep all limits and bounds at the poses"]
    lines += [f"{older:,} of them were there before"] if older else []
    if result.made:
        cost, kernel = 1e9 * result.cost, 1e9 * result.kernel
        lines.append(
            f"{cost:.3g} ns of wall time a design and pose; the bare kernel of the limits takes {kernel:.3g} ns here"
        )
    for quantity, row in result.best.items():
        lines.append(f"best {quantity}:  {', '.join(f'{column} {value:.6g}' for column, value in row.items())}")
    return "\n".join(lines)
