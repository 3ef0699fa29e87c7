"""A sweep in a folder: a Parquet file for each chunk of designs, so that it goes on where it was interrupted."""

from __future__ import annotations

import json
import os
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ..arguments import check_arguments
from ..arrays import Progress, Writer
from ..budget import CLOCK
from ..errors import InputError, quote
from ..synthesis.sweep import SweepChunk, SweepEvaluator, SweepPlan
from ..units import name_display_unit
from ..version import __version__
from .files import write_files

if TYPE_CHECKING:
    import pyarrow as pa

_PLAN = "_sweep.json"
_SCHEMA = "parakin.sweep-plan/1"
_WAITING = 3  # chunks for each thread of the scheduler's workers that are asked for at a time
_RETRIES = 5  # of a chunk whose worker is lost
_TIMEOUT = 10.0  # s until a scheduler answers, and until it has a worker


@dataclass(frozen=True, eq=False)
class SweepResult:
    """What a sweep found.

    designs : how many
    keeping : how many of them keep all limits and bounds at the poses
    made : how many designs were evaluated this time, not before
    cost : of these, the wall time that a design took at a pose, files included, s; NaN where none was
    kernel : what it takes the bare kernel on this machine, limits alone, s
    best : by the name of each objective, the best of those that keep all: its columns by their names
    """

    designs: int
    keeping: int
    made: int
    cost: float
    kernel: float
    best: dict[str, dict[str, Any]]

    def __repr__(self) -> str:
        return f"<parakin sweep result: {self.keeping:,} of {self.designs:,} designs keep all limits and bounds>"


@check_arguments
def run_sweep(
    plan: SweepPlan,
    folder: str | os.PathLike[str],
    scheduler: str | None = None,
    progress: Progress | None = None,
    show_dashboard: Callable[[str], None] | None = None,
) -> SweepResult:
    """Evaluate what a sweep's folder does not hold yet, and tell what all of it says.

    Parameters
    ----------
    plan : the machine, its free numbers and how they are drawn
    folder : for ``_sweep.json`` (the plan) and ``part-00000.parquet``, ...; lengths mm, angles degrees. What is there
        of the same plan is kept, so an interrupted sweep goes on.
    scheduler : of Dask's workers, such as ``tcp://host:8786``, which have parakin installed; by default this process
        and its cores. What a lost worker was doing is done again by another.
    progress : called now and then with the fraction done
    show_dashboard : called once with the address of the scheduler's dashboard, if it has one (with bokeh)

    Raises :class:`InputError` for a folder with another sweep or a scheduler that does not answer.
    """
    base, names = Path(folder), [f"part-{number:05d}.parquet" for number in range(plan.chunk_count)]
    _refuse_another_sweep(plan, base)
    missing = [number for number, name in enumerate(names) if not (base / name).exists()]
    evaluator = SweepEvaluator(plan)
    made, begin = 0, CLOCK.read()
    wanted = sum(_count_designs(plan, number) for number in missing)
    with _open_source(plan, evaluator, missing, scheduler, show_dashboard) as chunks:
        _write_plan(plan, base)  # not before: a scheduler that does not answer leaves no folder
        for number, chunk in chunks:
            write_files(base, {names[number]: _write_parquet(plan, evaluator.limits, chunk)})
            made += len(chunk.designs)
            if progress:
                progress(made / wanted)
    cost = (CLOCK.read() - begin) / (made * plan.poses) if made else nan
    keeping, best = _summarise(plan, [base / name for name in names])
    return SweepResult(plan.designs, keeping, made, cost, evaluator.measure_kernel(), best)


def _count_designs(plan: SweepPlan, chunk: int) -> int:
    return min(plan.chunk_size, plan.designs - chunk * plan.chunk_size)


def _refuse_another_sweep(plan: SweepPlan, base: Path) -> None:
    file = base / _PLAN
    if not file.exists():
        return
    try:
        kept = json.loads(file.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"can't be read: {error}", str(file)) from None
    if not isinstance(kept, dict) or kept.get("digest") != plan.digest:
        raise InputError("another sweep is in this folder; choose another one", str(file))


def _write_plan(plan: SweepPlan, base: Path) -> None:
    said = {"schema": _SCHEMA, "machine": plan.problem.machine.name, "designs": plan.designs, "poses": plan.poses}
    said |= {"seed": plan.seed, "digest": plan.digest}
    if not (base / _PLAN).exists():
        write_files(base, {_PLAN: json.dumps(said, indent=1) + "\n"})


# Where chunks come from.


@contextmanager
def _open_source(
    plan: SweepPlan,
    evaluator: SweepEvaluator,
    missing: Sequence[int],
    scheduler: str | None,
    show_dashboard: Callable[[str], None] | None,
) -> Iterator[Iterator[tuple[int, SweepChunk]]]:
    if scheduler is None or not missing:
        yield ((number, evaluator.evaluate(number)) for number in missing)
        return
    try:
        from distributed import Client
    except ImportError:
        raise InputError("needs Dask: pip install parakin[dask]", "--scheduler") from None
    try:
        client = Client(scheduler, timeout=_TIMEOUT)
    except (OSError, ValueError) as error:
        raise InputError(f"{quote(scheduler)}: no scheduler answers: {error}", "--scheduler") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_TIMEOUT)
        except TimeoutError:
            raise InputError(f"{quote(scheduler)}: the scheduler has no worker", "--scheduler") from None
        link = find_dashboard(client)
        if link and show_dashboard:
            show_dashboard(link)
        yield _gather_chunks(client, plan, missing)


def find_dashboard(client: Any) -> str:
    """Find the address of a scheduler's dashboard; empty where it serves none."""
    served = "dashboard" in client.scheduler_info(n_workers=0).get("services", {})
    return str(client.dashboard_link) if served else ""


def _gather_chunks(client: Any, plan: SweepPlan, missing: Sequence[int]) -> Iterator[tuple[int, SweepChunk]]:
    """Compute chunks by the workers, a few ahead for each thread; yields them as they come."""
    from concurrent.futures import CancelledError

    from distributed import KilledWorker, as_completed

    threads = sum(worker["nthreads"] for worker in client.scheduler_info(n_workers=-1)["workers"].values())
    waiting = iter(missing)

    def ask() -> Any:
        number = next(waiting, None)
        return None if number is None else client.submit(evaluate_chunk, plan, number, pure=False, retries=_RETRIES)

    first = [future for _ in range(_WAITING * max(1, threads)) if (future := ask()) is not None]
    coming = as_completed(first)
    for future in coming:
        try:
            result = future.result()
        except (RuntimeError, ImportError, CancelledError, KilledWorker) as error:
            reason = " ".join(str(error).split())
            raise InputError(
                f"a worker can't do it, is parakin {__version__} installed there? {reason}", "--scheduler"
            ) from None
        yield result
        following = ask()
        if following is not None:
            coming.add(following)


_KEPT = 2  # evaluators that a worker keeps
_evaluators: OrderedDict[str, SweepEvaluator] = OrderedDict()


def evaluate_chunk(plan: SweepPlan, number: int) -> tuple[int, SweepChunk]:
    """Evaluate a chunk in a worker, which keeps the plan's tapes for the next one."""
    evaluator = _evaluators.get(plan.digest) or SweepEvaluator(plan)
    _evaluators[plan.digest] = evaluator
    while len(_evaluators) > _KEPT:
        _evaluators.popitem(last=False)
    return number, evaluator.evaluate(number)


# Files.


def _write_parquet(plan: SweepPlan, limits: Sequence[str], chunk: SweepChunk) -> Writer:
    def write(file: BinaryIO) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        units = [parameter.unit for parameter in plan.problem.family.parameters]
        factors = [np.degrees(1.0) if unit == "rad" else 1.0 for unit in units]
        factors += [1.0] * (len(plan.problem.variables) - len(units))  # shifts
        names = _list_names(plan)
        columns: dict[str, Any] = {
            names[name]: factor * values
            for name, factor, values in zip(plan.problem.variables, factors, chunk.designs.T, strict=True)
        }
        named = pa.array(np.array([*limits, None], object)[chunk.limit], pa.string())
        columns |= {"allowed": chunk.allowed, "limit": named.dictionary_encode()}
        columns |= dict(zip(plan.quantities, chunk.values.T, strict=True))
        pq.write_table(pa.table(columns | {"keeps": chunk.keeps}), file, write_page_checksum=True)

    return write


def _list_names(plan: SweepPlan) -> dict[str, str]:
    """List the columns of variables and quantities by their names."""
    units = {parameter.name: name_display_unit(parameter.unit) for parameter in plan.problem.family.parameters}
    variables = {name: f"{name} [{units.get(name, 'mm')}]" for name in plan.problem.variables}
    return variables | {name: name for name in plan.quantities}


def _summarise(plan: SweepPlan, files: Sequence[Path]) -> tuple[int, dict[str, dict[str, Any]]]:
    """Count the designs that keep all, and find the best of them."""
    names = _list_names(plan)
    keeping, best = 0, dict[str, dict[str, Any]]()
    for file in files:
        kept = _read_part(file, list(names.values()))
        keeping += len(kept)
        for name in plan.problem.objectives if len(kept) else ():
            sign = plan.problem.get_sign(name)
            values = sign * kept.column(names[name]).to_numpy()
            row = kept.slice(int(values.argmin()), 1).to_pylist()[0]
            if name not in best or sign * row[names[name]] < sign * best[name][names[name]]:
                best[name] = row
    return keeping, best


def _read_part(file: Path, columns: list[str]) -> pa.Table:
    """Read the designs of a part that keep all limits and bounds."""
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(file, page_checksum_verification=True) as reader:
            return reader.read(columns=[*columns, "keeps"]).filter(pc.field("keeps")).drop(["keeps"])
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"is no part of this sweep, remove it: {error}", str(file)) from None
