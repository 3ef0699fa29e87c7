"""Setpoints of a trajectory at a steady rate, as CSV and as Parquet, written a block at a time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from ...arrays import Array, Progress, Writer
from ...errors import InputError
from ...units import name_display_unit
from .joints import ANGLE_DIGITS, DEGREES, LENGTH_DIGITS, Bytes, write_batches

if TYPE_CHECKING:
    from ...toolpath.timing import Trajectory

MOST_ROWS = 100_000_000  # some 20 GB of text
_GROUP = 1 << 16  # rows in one of Parquet's row groups
_TIME_DIGITS = 8
_KINDS = (("", ""), (" speed", "/s"), (" acceleration", "/s2"))  # of a joint's columns: name, and what the unit is per


def name_setpoint_columns(trajectory: Trajectory) -> list[str]:
    """Name the columns: time, the joints, their speeds and accelerations, the axes.

    ``time [s]``; ``d1 [mm]``, ...; ``d1 speed [mm/s]``, ...; ``d1 acceleration [mm/s2]``, ...; ``X [mm]``, ...
    """
    machine = trajectory.posted.machine
    joints = list(zip(machine.joints, machine.joint_units, strict=True))
    axes = zip(machine.axes, machine.axis_units, strict=True)
    names = [f"{name}{kind} [{name_display_unit(unit)}{per}]" for kind, per in _KINDS for name, unit in joints]
    return ["time [s]", *names, *(f"{name} [{name_display_unit(unit)}]" for name, unit in axes)]


def _find_angles(trajectory: Trajectory) -> list[bool]:
    """Find which columns after the time are angles."""
    machine = trajectory.posted.machine
    return [unit == "rad" for unit in (*(machine.joint_units * len(_KINDS)), *machine.axis_units)]


def count_setpoints(trajectory: Trajectory, rate: float) -> int:
    """Count the setpoints at ``rate`` Hz; the last is the first one at which the motion is over.

    Raises :class:`InputError` for a rate that isn't above 0, or at which there would be more than ``MOST_ROWS``.
    """
    if not 0.0 < rate < math.inf:
        raise InputError(f"more than 0 expected, in Hz, not {rate:g}", "--rate")
    count = math.ceil(min(trajectory.seconds * rate, 1e18) - 1e-9) + 1
    if count > MOST_ROWS:
        least = f"at most {MOST_ROWS:,} expected"
        raise InputError(
            f"{rate:g} Hz over {trajectory.seconds:,.1f} s would make {count:.3g} setpoints, {least}", "--rate"
        )
    return count


def _sample_setpoints(trajectory: Trajectory, rate: float, start: int, stop: int) -> Array:
    """Sample the setpoints ``start`` to ``stop``, (k, columns), mm, rad and s."""
    return trajectory.at(np.arange(start, stop) / rate).table


def make_setpoint_csv(trajectory: Trajectory, rate: float, progress: Progress | None = None) -> Writer:
    """Make the writer of the setpoints at ``rate`` Hz as CSV, with the digits of the joint table; times to 1e-8 s.

    Raises :class:`InputError` as :func:`count_setpoints` does.
    """
    count, is_angle = count_setpoints(trajectory, rate), _find_angles(trajectory)
    digits = np.array([_TIME_DIGITS, *(ANGLE_DIGITS if angle else LENGTH_DIGITS for angle in is_angle)])
    scales = 10.0**digits * np.array([1.0, *(DEGREES if angle else 1.0 for angle in is_angle)])

    def write(file: BinaryIO) -> None:
        from .decimal_text import WIDEST, format_cells

        def fill(start: int, stop: int, buffer: Bytes) -> int:
            return int(format_cells(_sample_setpoints(trajectory, rate, start, stop), scales, digits, buffer))

        file.write((",".join(name_setpoint_columns(trajectory)) + "\n").encode())
        write_batches(file, count, WIDEST * len(digits), fill, progress or (lambda fraction: None))

    return write


def make_setpoint_parquet(trajectory: Trajectory, rate: float, progress: Progress | None = None) -> Writer:
    """Make the writer of the setpoints at ``rate`` Hz as Parquet: the CSV's columns in full precision.

    Raises :class:`InputError` as :func:`count_setpoints` does.
    """
    count = count_setpoints(trajectory, rate)
    factors = [1.0, *(DEGREES if angle else 1.0 for angle in _find_angles(trajectory))]

    def write(file: BinaryIO) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        schema = pa.schema([(name, pa.float64()) for name in name_setpoint_columns(trajectory)])
        with pq.ParquetWriter(file, schema, use_dictionary=False) as writer:  # hardly a value comes twice
            for start in range(0, count, _GROUP):
                stop = min(start + _GROUP, count)
                columns = zip(_sample_setpoints(trajectory, rate, start, stop).T, factors, strict=True)
                writer.write_table(pa.Table.from_arrays([pa.array(c * f) for c, f in columns], schema=schema))
                if progress:
                    progress(stop / count)

    return write
