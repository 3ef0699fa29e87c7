"""Tests of the limits at many places: 0 where a place is allowed, else 1 + the first limit broken; NaN breaks one.

A block of rows ends as soon as no lane is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .batch import run_here, run_in_threads
from .elementary import Lane, Lanes
from .kernel import find_kernel
from .lane_program import Columns, Program
from .operations import run_operations
from .staged import StagedProgram

Codes = NDArray[Any]
_AT_ONCE = 1 << 15  # places of a grid that are written out at a time, a column an axis: they stay in the cache


def _test_limits(lanes: Lanes, program: StagedProgram, inputs: Sequence[Lane], broken: Lane) -> Lane:
    """Test the limits in the lanes where ``broken`` is 0: it becomes 1 + the first limit broken, if there is one."""
    registers = dict(enumerate(inputs))

    def run_stages(number: int, broken: Lane) -> Lane:
        start, stop, first_test, last_test = program.stages[number]
        run_operations(lanes, program.tape, registers, start, stop)
        tests = zip(program.tests[first_test:last_test], program.lines[first_test:last_test], strict=True)
        for (register, first, second), (k0, k1, l0, l1) in tests:
            value = registers[register]
            now = lanes.select(k0 + k1 * value >= 0.0, lanes.constant(0.0), first + 1.0)
            if second != first:
                now = lanes.select((l0 + l1 * value >= 0.0) | (now > 0.0), now, second + 1.0)
            broken = lanes.select(broken > 0.0, broken, now)
        if number + 1 == len(program.stages):
            return broken
        return lanes.branch(broken == 0.0, lambda: [run_stages(number + 1, broken)], lambda: [broken])[0]

    return run_stages(0, broken)


def write_places(program: StagedProgram, axes: int, kind: str) -> Program:
    """Write the program of places, an array an axis -> the first limit broken."""

    def compute(lanes: Lanes, given: Sequence[Sequence[Lane]]) -> Sequence[Sequence[Lane]]:
        return [[_test_limits(lanes, program, [lane for (lane,) in given], lanes.constant(0.0))]]

    return Program((Columns(1),) * axes, (Columns(1, kind=kind),), compute, len(program.tape.code))


def write_turns(program: StagedProgram, axes: int, turns: int, every: bool, kind: str) -> Program:
    """Write the program of places, codes and a table of turns -> codes, by :func:`sweep_turns`."""

    def compute(lanes: Lanes, given: Sequence[Any]) -> Sequence[Sequence[Lane]]:
        places, (codes,), table = given

        def test_turn(state: Sequence[Lane], turn: Sequence[Lane]) -> tuple[list[Lane], Lane]:
            (code,) = state
            zero = lanes.constant(0.0)
            begin = code if every else lanes.select(code > 0.0, zero, 1.0)
            broken = _test_limits(lanes, program, [*places, *turn], begin)
            if every:
                return [broken], broken == 0.0
            code = lanes.select(broken == 0.0, zero, code)
            return [code], code > 0.0

        return [lanes.walk(table, [codes], test_turn)]

    given = (Columns(axes), Columns(1), Columns(turns, "table"))
    return Program(given, (Columns(1, kind=kind),), compute, len(program.tape.code))


def sweep_grid(program: StagedProgram, coordinates: Sequence[Array], out: Codes, begin: int) -> None:
    """Test the places of a grid, C-ordered, from the ``begin``-th on, into ``out`` (n,).

    coordinates : of each axis
    """
    shape = [len(axis) for axis in coordinates]
    length = shape[-1]
    kernel = find_kernel(write_places, program, len(shape), out.dtype.name)
    kernel.expect(len(out))

    def sweep(start: int, stop: int) -> None:
        lines = max(1, _AT_ONCE // length)
        for first in range((begin + start) // length, (begin + stop - 1) // length + 1, lines):
            last = min(first + lines, prod(shape[:-1]))
            low, high = max(first * length, begin + start), min(last * length, begin + stop)
            index = np.unravel_index(np.arange(first, last), shape[:-1]) if len(shape) > 1 else ()
            columns = [np.repeat(axis[i], length) for axis, i in zip(coordinates, index, strict=False)]
            columns.append(np.tile(coordinates[-1], last - first))
            within = slice(low - first * length, high - first * length)
            inputs = [column[within].reshape(-1, 1) for column in columns]
            kernel.run(inputs, [out[low - begin : high - begin]], run_here)

    run_in_threads(len(out), sweep)


def sweep_turns(program: StagedProgram, places: Array, turns: Array, every: bool, codes: Codes) -> Codes:
    """Test places (N, d) with all rows of ``turns`` (S, u), the rest of the tape's inputs; returns new codes (N,).

    With ``every``, codes that are 0 become the first limit broken in the first turn that breaks one; else those that
    are not become 0 where a turn breaks none.
    """
    out = np.empty_like(codes)
    kernel = find_kernel(write_turns, program, places.shape[1], turns.shape[1], every, codes.dtype.name)
    kernel.expect(len(codes) * len(turns))
    kernel.run([places, codes.astype(np.float64).reshape(-1, 1), turns], [out], run_in_threads)
    return out
