"""Setpoints of a trajectory at a steady rate, as CSV and as Parquet, written a block at a time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from ...errors import InputError
from ...toolpath.path import Floats
from .joints import ANGLE_DIGITS, DEGREES, LENGTH_DIGITS, Progress, Writer, in_batches

if TYPE_CHECKING:
    from ...toolpath.timing import Trajectory

MOST_ROWS = 100_000_000  # some 20 GB of text
_GROUP = 1 << 16  # rows in one of Parquet's row groups
_TIME_DIGITS = 8


def setpoint_columns(trajectory: Trajectory) -> list[str]:
    """``time [s]``; ``d1 [mm]``, ...; ``d1 speed [mm/s]``, ...; ``d1 acceleration [mm/s2]``, ...; ``X [mm]``, ..."""
    machine = trajectory.posted.machine
    joints = [*zip(machine.joints, _rim_units(machine.joint_units), strict=True)]
    names = [f"{name}{kind} [{unit}{per}]" for kind, per in _KINDS for name, unit in joints]
    axes = zip(machine.axes, _rim_units(machine.axis_units), strict=True)
    return ["time [s]", *names, *(f"{name} [{unit}]" for name, unit in axes)]


_KINDS = (("", ""), (" speed", "/s"), (" acceleration", "/s2"))


def _rim_units(units: tuple[str, ...]) -> list[str]:
    return ["deg" if unit == "rad" else unit for unit in units]


def _turning(trajectory: Trajectory) -> list[bool]:
    """Which columns behind the time are angles, in the trajectory's own order."""
    machine = trajectory.posted.machine
    return [unit == "rad" for unit in (*(machine.joint_units * len(_KINDS)), *machine.axis_units)]


def count_setpoints(trajectory: Trajectory, rate: float) -> int:
    """How many setpoints there are at ``rate`` Hz, the last the first one at which the motion is over.

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


def _block(trajectory: Trajectory, rate: float, start: int, stop: int) -> Floats:
    """Setpoints ``start`` to ``stop``, (k, columns), mm, rad and s."""
    return trajectory.at(np.arange(start, stop) / rate).table


def make_setpoint_csv(trajectory: Trajectory, rate: float, progress: Progress | None = None) -> Writer:
    """What writes the setpoints at ``rate`` Hz as CSV, with the digits of the joint table; times to 1e-8 s.

    Raises :class:`InputError` as :func:`count_setpoints` does.
    """
    count, turning = count_setpoints(trajectory, rate), _turning(trajectory)
    digits = np.array([_TIME_DIGITS, *(ANGLE_DIGITS if turns else LENGTH_DIGITS for turns in turning)])
    scales = 10.0**digits * np.array([1.0, *(DEGREES if turns else 1.0 for turns in turning)])

    def write(file: BinaryIO) -> None:
        from .decimals import WIDEST, format_cells

        file.write((",".join(setpoint_columns(trajectory)) + "\n").encode())
        in_batches(
            file,
            count,
            WIDEST * len(digits),
            lambda start, stop, buffer: format_cells(_block(trajectory, rate, start, stop), scales, digits, buffer),
            progress or (lambda fraction: None),
        )

    return write


def make_setpoint_parquet(trajectory: Trajectory, rate: float, progress: Progress | None = None) -> Writer:
    """What writes the setpoints at ``rate`` Hz as Parquet: the CSV's columns in full precision.

    Raises :class:`InputError` as :func:`count_setpoints` does.
    """
    count = count_setpoints(trajectory, rate)
    factors = [1.0, *(DEGREES if turns else 1.0 for turns in _turning(trajectory))]

    def write(file: BinaryIO) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        schema = pa.schema([(name, pa.float64()) for name in setpoint_columns(trajectory)])
        with pq.ParquetWriter(file, schema, use_dictionary=False) as writer:  # hardly a value comes twice
            for start in range(0, count, _GROUP):
                stop = min(start + _GROUP, count)
                columns = zip(_block(trajectory, rate, start, stop).T, factors, strict=True)
                writer.write_table(pa.Table.from_arrays([pa.array(c * f) for c, f in columns], schema=schema))
                if progress:
                    progress(stop / count)

    return write
