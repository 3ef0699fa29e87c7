"""Lanes as NumPy's arrays: what needs no compiler, for few rows, and what compiled code is held against."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import Array
from .elementary import Lane, define_turns


class ArrayLanes:
    """Arithmetic on arrays, a number a row.

    Every kind of lanes has these functions, and lanes on which the operators of Python work.
    """

    select = staticmethod(np.where)
    sqrt = staticmethod(np.sqrt)

    def __init__(self) -> None:
        self.sincos, self.atan2 = define_turns(self.select, self.read_bits, self.make_number)

    @staticmethod
    def read_bits(x: Any) -> Any:
        """Return the bits of float64 as integers."""
        return np.asarray(x, np.float64).view(np.int64)

    @staticmethod
    def make_number(bits: Any) -> Any:
        """Return the float64 that has these bits."""
        return bits.view(np.float64)

    @staticmethod
    def constant(value: float) -> Lane:
        """Return a number that is the same in every lane."""
        return np.float64(value)

    @staticmethod
    def branch(wanted: Lane, make: Callable[[], list[Lane]], otherwise: Callable[[], list[Lane]]) -> list[Lane]:
        """Return make() where any lane wants it, else otherwise(): both for all lanes."""
        return make() if np.any(wanted) else otherwise()

    @staticmethod
    def repeat(state: Sequence[Lane], step: Callable[[list[Lane]], tuple[list[Lane], Lane]]) -> list[Lane]:
        """Repeat state, going = step(state) until no lane goes on; returns the last state."""
        going: Any = True
        state = list(state)
        while np.any(going):
            state, going = step(state)
        return state

    @staticmethod
    def walk(
        table: Array, state: Sequence[Lane], step: Callable[[list[Lane], Sequence[Lane]], tuple[list[Lane], Lane]]
    ) -> list[Lane]:
        """Repeat state, going = step(state, row) with the rows of a table until no lane goes on."""
        state = list(state)
        for row in table:
            state, going = step(state, list(row))
            if not np.any(going):
                break
        return state


ARRAYS = ArrayLanes()
