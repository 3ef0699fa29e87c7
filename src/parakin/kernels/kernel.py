"""Kernels: programs of lanes that are run over batches, by NumPy at first and compiled where that pays."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import lru_cache
from time import thread_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, split_rows
from .array_lanes import ARRAYS
from .lane_program import Program

# A program is compiled once NumPy has worked on it for a good part of the time that this takes.
PATIENCE = (0.01, 6e-5)  # s of NumPy's, and for each operation
INTERPRETING = 1e-8  # s for each operation and row, where there are many rows
_AT_ONCE = 2048  # rows of NumPy's, which stay in the second-level cache


def take_lanes(array: Array, role: str, rows: slice) -> Any:
    """Take what a program is given of an array for a slice of rows: a lane a column, or the table itself."""
    if role == "table":
        return array
    return list(array[0]) if role == "shared" else list(np.ascontiguousarray(array[rows].T))


class Kernel:
    """A program with its compiled code, once that pays. Both give the same bits."""

    def __init__(self, program: Program):
        self.program = program
        self._patience = PATIENCE[0] + PATIENCE[1] * program.length  # s of NumPy that are left
        self._compiled: Callable[..., None] | None = None
        self._least = 0

    def expect(self, rows: int) -> None:
        """Expect so many rows more in the next runs."""
        if rows * self.program.length * INTERPRETING > self._patience:
            self._patience = 0.0

    def run(self, inputs: Sequence[Array], outputs: Sequence[NDArray[Any]], threads: Any) -> None:
        """Run over all rows of C-ordered arrays; ``threads`` runs work(start, stop) over a number of rows."""
        count = len(outputs[0])
        self.expect(count)
        if self._patience > 0.0:
            begin = thread_time()
            for rows in split_rows(count, _AT_ONCE):
                self._interpret(inputs, outputs, rows)
            self._patience -= thread_time() - begin
        elif count:
            self._run_compiled(inputs, outputs, threads)

    def _interpret(self, inputs: Sequence[Array], outputs: Sequence[NDArray[Any]], rows: slice) -> None:
        """Run by NumPy over a slice of rows."""
        given = [
            take_lanes(array, columns.role, rows) for array, columns in zip(inputs, self.program.inputs, strict=True)
        ]
        with np.errstate(all="ignore"):
            results = self.program.body(ARRAYS, given)
            for array, lanes in zip(outputs, results, strict=True):
                if array.ndim == 1:
                    array[rows] = lanes[0]
                else:
                    for column, lane in enumerate(lanes):
                        array[rows, column] = lane

    def _run_compiled(self, inputs: Sequence[Array], outputs: Sequence[NDArray[Any]], threads: Any) -> None:
        """Run compiled code, on copies of whole blocks if there are too few rows."""
        from .vector_code import choose_lanes, compile_program

        if self._compiled is None:
            self._compiled = compile_program(self.program)
            self._least = choose_lanes(self.program)
        count, function = len(outputs[0]), self._compiled
        if count < self._least:
            own = [
                np.resize(array, (self._least, columns.width)) if columns.role == "rows" else array
                for array, columns in zip(inputs, self.program.inputs, strict=True)
            ]
            made = [np.empty((self._least, *array.shape[1:]), array.dtype) for array in outputs]
            self._run_compiled(own, made, threads)
            for array, rows in zip(outputs, made, strict=True):
                array[...] = rows[:count]
            return
        inputs = [np.ascontiguousarray(array, np.float64) for array in inputs]
        if not all(array.flags.c_contiguous for array in outputs):
            raise ValueError("outputs: C-ordered arrays expected")
        given = [array.__array_interface__["data"][0] for array in (*inputs, *outputs)]
        given += [
            len(array) for array, columns in zip(inputs, self.program.inputs, strict=True) if columns.role == "table"
        ]
        threads(count, lambda start, stop: function(*given, start, stop))


@lru_cache(maxsize=1024)
def find_kernel(make: Callable[..., Program], *given: Hashable) -> Kernel:
    """Return the kernel of the program make(*given); equal tapes share one."""
    return Kernel(make(*given))
