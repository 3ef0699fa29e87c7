"""The joint table of a posted tool path, as CSV and as Parquet."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...arrays import Progress, Writer
from ...kernels.batch import count_cores
from ...toolpath.posting.posted import Posted
from ...units import name_display_unit

Bytes: TypeAlias = NDArray[np.uint8]
Fill: TypeAlias = Callable[[int, int, Bytes], int]  # writes rows from, to as text into a buffer; returns the bytes

_BATCH = 1 << 14  # rows formatted at a time; a batch's text stays in the cache
_GROUP = 1 << 18  # rows in one of Parquet's row groups
LENGTH_DIGITS, ANGLE_DIGITS, _FEED_DIGITS = 6, 8, 4
DEGREES = 180.0 / math.pi


def name_joint_columns(posted: Posted) -> list[str]:
    """Name the table's columns, with units.

    They are ``record``, ``line``, ``X [mm]``, ..., ``d1 [mm]``, ..., ``broken``.
    """
    machine = posted.machine
    names = zip((*machine.axes, *machine.joints), _list_units(posted), strict=True)
    moving = [f"{name} [{name_display_unit(unit)}]" for name, unit in names]
    return ["record", "line", *moving, "feed [mm/min]", "rapid", "broken"]


def _list_units(posted: Posted) -> tuple[str, ...]:
    return (*posted.machine.axis_units, *posted.machine.joint_units)


def make_joint_csv(posted: Posted, progress: Progress | None = None) -> Writer:
    """Make the writer of the table as CSV: lengths to 1e-6 mm, angles to 1e-8 deg, a field empty for no value.

    ``record`` counts from 0, ``rapid`` is 0 or 1, ``broken`` names the first limit that the record breaks.
    """

    def write(file: BinaryIO) -> None:
        file.write((",".join(name_joint_columns(posted)) + "\n").encode())
        _write_rows(posted, file, progress or (lambda fraction: None))

    return write


def _write_rows(posted: Posted, file: BinaryIO, say: Progress) -> None:
    from .decimal_text import WIDEST, JointColumns, LimitNames, NumberFormat, format_joint_rows

    units = _list_units(posted)
    digits = [ANGLE_DIGITS if unit == "rad" else LENGTH_DIGITS for unit in units]
    scales = [10.0**d * (DEGREES if unit == "rad" else 1.0) for d, unit in zip(digits, units, strict=True)]
    names = [name.encode() for name in posted.limits]
    path = posted.path
    columns = JointColumns(path.line, posted.poses, posted.joints, path.feed, path.rapid, posted.broken)
    form = NumberFormat(np.array([*scales, 10.0**_FEED_DIGITS]), np.array([*digits, _FEED_DIGITS]))
    limits = LimitNames(np.frombuffer(b"".join(names) or b" ", np.uint8), np.cumsum([0, *map(len, names)]))
    count = len(path)
    widest = WIDEST * (len(units) + 4) + max(map(len, names), default=0)

    def fill(start: int, stop: int, buffer: Bytes) -> int:
        return int(format_joint_rows(start, stop, columns, form, limits, buffer))

    write_batches(file, count, widest, fill, say)


def write_batches(file: BinaryIO, count: int, widest: int, fill: Fill, say: Progress) -> None:
    """Write ``count`` rows of text, each at most ``widest`` bytes; batches are formatted in threads."""
    workers = count_cores() if count > _BATCH else 1
    buffers = [np.empty(widest * min(_BATCH, count), np.uint8) for _ in range(workers + 1)]

    def format_batch(start: int, buffer: Bytes) -> memoryview:
        return buffer.data[: fill(start, min(start + _BATCH, count), buffer)]

    # Each batch is formatted while those before it are written; a buffer is used again once its text is written.
    with ThreadPoolExecutor(workers) as pool:
        pending: list[Future[memoryview]] = []
        for number, start in enumerate(range(0, count, _BATCH)):
            if len(pending) == len(buffers):
                file.write(pending.pop(0).result())
                say(start / count)
            pending.append(pool.submit(format_batch, start, buffers[number % len(buffers)]))
        for future in pending:
            file.write(future.result())
    say(1.0)


def make_joint_parquet(posted: Posted, progress: Progress | None = None) -> Writer:
    """Make the writer of the table as Parquet: the CSV's columns in full precision, null for no value."""

    def write(file: BinaryIO) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        names, units = name_joint_columns(posted), _list_units(posted)
        types = [pa.int64(), pa.int64(), *[pa.float64() for _ in units], pa.float64(), pa.bool_()]
        kinds = [*types, pa.dictionary(pa.int32(), pa.string())]
        schema = pa.schema(list(zip(names, kinds, strict=True)))
        limits = pa.array(posted.limits, pa.string())
        path, factors = posted.path, [DEGREES if unit == "rad" else 1.0 for unit in units]
        axes = len(posted.machine.axes)
        with pq.ParquetWriter(file, schema) as writer:
            for start in range(0, len(path), _GROUP):
                rows = slice(start, start + _GROUP)
                moving = [posted.poses[rows, c] * f for c, f in enumerate(factors[:axes])]
                moving += [posted.joints[rows, c] * f for c, f in enumerate(factors[axes:])]
                broken = posted.broken[rows]
                index = pa.array((broken - 1).astype(np.int32), mask=broken == 0)
                arrays = [
                    pa.array(np.arange(start, start + len(broken))),
                    pa.array(path.line[rows]),
                    *[pa.array(values, from_pandas=True) for values in (*moving, path.feed[rows])],
                    pa.array(path.rapid[rows]),
                    pa.DictionaryArray.from_arrays(index, limits),
                ]
                writer.write_table(pa.Table.from_arrays(arrays, schema=schema))
                if progress:
                    progress(min(1.0, (start + _GROUP) / len(path)))

    return write
