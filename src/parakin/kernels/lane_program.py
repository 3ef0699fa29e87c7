"""Programs of lanes: what is computed of each row."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

from .elementary import Lane, Lanes


class Columns(NamedTuple):
    """What a program takes from an array of rows, or writes to one.

    role : "rows", a row each; "shared", one row for all; "table", any number of rows, all for each
    kind : the type of a number; one that is not float64 stands alone in its row
    """

    width: int
    role: str = "rows"
    kind: str = "float64"


LaneFunction: TypeAlias = Callable[[Lanes, Sequence[Sequence[Lane]]], Sequence[Sequence[Lane]]]


class Program(NamedTuple):
    """What is computed of each row.

    inputs, outputs : an array each
    body : takes lanes for every column of every input, gives those of the outputs
    length : operations, about
    """

    inputs: tuple[Columns, ...]
    outputs: tuple[Columns, ...]
    body: LaneFunction
    length: int
