"""How controls are told how fast a block runs: by the inverse of its time, by its speed, or by its time."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...arrays import Array


class Feed(NamedTuple):
    """The word of a block that says how fast it runs.

    word : of the control, as ``F``
    convert : from lengths (k,) of blocks and seconds (k,) to the word's values; the same takes values to seconds
    digits : after the point
    most : the greatest value that the control takes
    text : what it is, for the program's head
    """

    word: str
    convert: Callable[[Array, Array], Array]
    digits: int
    most: float
    text: str

    def compute_values(self, lengths: Array, seconds: Array) -> Array:
        """Compute the values as they are printed, rounded so that no block becomes faster."""
        scale = 10.0**self.digits
        exact = self.convert(lengths, seconds)
        near = np.rint(exact * scale) / scale
        printed = np.abs(near - exact) < 1e-9 * exact  # 15.0 is told as 15.000, not as 14.999
        faster_up = self.convert(lengths, exact * 1.01) < self.convert(lengths, exact)
        rounded = np.where(faster_up, np.floor(exact * scale), np.ceil(exact * scale)) / scale
        return np.minimum(np.where(printed, near, rounded), self.most)

    def compute_seconds(self, lengths: Array, values: Array) -> Array:
        """Compute what blocks take whose words have these values."""
        return self.convert(lengths, values)


def invert_minutes(lengths: Array, seconds: Array) -> Array:
    """Take seconds to the inverse of minutes (G93), and back."""
    return 60.0 / seconds


def measure_speed(lengths: Array, seconds: Array) -> Array:
    """Take seconds to the length per minute, and back."""
    return 60.0 * lengths / seconds


def keep_seconds(lengths: Array, seconds: Array) -> Array:
    """Tell the time itself."""
    return seconds + 0.0
