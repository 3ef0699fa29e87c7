"""Programs that evaluate a tape for rows: all of it, a row with closures and margins behind it, the first below 0."""

from __future__ import annotations

from collections.abc import Sequence

from .elementary import Lane, Lanes
from .lane_program import Columns, Program
from .operations import evaluate
from .tape import Tape


def find_spoiled(lanes: Sequence[Lane], bad: Lane = 0.0) -> Lane:
    """Return zero where all numbers are finite, else NaN; ``bad`` is one to go on from."""
    for lane in lanes:
        bad = bad + 0.0 * lane
    return bad


def find_positive(lanes: Lanes, margins: Sequence[Lane]) -> Lane:
    """Tell where all margins are positive; NaN is not."""
    holds = lanes.constant(1.0) > 0.0
    for margin in margins:
        holds = holds & (margin > 0.0)
    return holds


def write_rows(tape: Tape, widths: tuple[int, ...], whole: bool) -> Program:
    """Write the program x, z -> tape(x, z).

    With ``whole`` a row is NaN where an input or output is not finite; else that spoils only what follows from it.
    """

    def compute(lanes: Lanes, given: Sequence[Sequence[Lane]]) -> Sequence[Sequence[Lane]]:
        inputs = [lane for columns in given for lane in columns]
        outputs = evaluate(lanes, tape, inputs)
        if whole:
            bad = find_spoiled([*inputs, *outputs])
            outputs = [lane + bad for lane in outputs]
        return [outputs]

    return Program(tuple(map(Columns, widths)), (Columns(tape.outputs),), compute, len(tape.code))


def write_closed_rows(tape: Tape, widths: tuple[int, ...], rows: int, closures: int) -> Program:
    """Write the program x, z, greatest closure -> rows, residual, settled.

    The tape's first outputs are a row, the next closures, the others margins. Rows and residual are NaN where an input,
    an output of the row or a closure is not finite.
    """

    def compute(lanes: Lanes, given: Sequence[Sequence[Lane]]) -> Sequence[Sequence[Lane]]:
        *columns, (closed,) = given
        inputs = [lane for each in columns for lane in each]
        outputs = evaluate(lanes, tape, inputs)
        bad = find_spoiled([*inputs, *outputs[: rows + closures]])
        residual = lanes.constant(0.0)
        for lane in outputs[rows : rows + closures]:
            residual = lanes.select(abs(lane) > residual, abs(lane), residual)
        residual = residual + bad
        settled = find_positive(lanes, outputs[rows + closures :]) & (residual <= closed)
        return [[lane + bad for lane in outputs[:rows]], [residual], [settled]]

    made = (Columns(rows), Columns(1), Columns(1, kind="bool"))
    return Program((*map(Columns, widths), Columns(1, "shared")), made, compute, len(tape.code))


def write_first_negative(tape: Tape, widths: tuple[int, ...]) -> Program:
    """Write the program x, z -> 0 where all outputs are ≥ 0 and the inputs finite, else 1 + the first that is not."""

    def compute(lanes: Lanes, given: Sequence[Sequence[Lane]]) -> Sequence[Sequence[Lane]]:
        inputs = [lane for columns in given for lane in columns]
        outputs = evaluate(lanes, tape, inputs)
        first = lanes.select(find_spoiled(inputs) == 0.0, lanes.constant(0.0), 1.0)
        for number, lane in reversed(list(enumerate(outputs))):
            first = lanes.select(lane >= 0.0, first, number + 1.0)
        return [[first]]

    return Program(tuple(map(Columns, widths)), (Columns(1, kind="int64"),), compute, len(tape.code))
