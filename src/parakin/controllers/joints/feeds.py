"""How controls are told how fast a block runs: by the inverse of its time, by its speed, or by its time."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...errors import PoseError


class Feed(NamedTuple):
    """The word of a block that says how fast it runs.

    word : of the control, as ``F``
    convert : from lengths (k,) of blocks and seconds (k,) to the word's values; the same takes values to seconds
    digits : after the point
    most : the greatest value that the control takes
    text : what it is, for the program's head
    grows : whether the value grows with the time, not with the speed
    """

    word: str
    convert: Callable[[Array, Array], Array]
    digits: int
    most: float
    text: str
    grows: bool = False

    def compute_values(self, lengths: Array, seconds: Array) -> Array:
        """Compute the values as they are printed, rounded so that no block becomes faster.

        Raises :class:`PoseError` for a block that is slower than the word can say.
        """
        scale = 10.0**self.digits
        exact = self.convert(lengths, seconds)
        near = np.rint(exact * scale) / scale  # 15.0 is told as 15.000, not as 14.999
        slower = (np.ceil if self.grows else np.floor)(exact * scale) / scale
        values: Array = np.where(np.abs(near - exact) < 1e-9 * exact, near, slower)
        unsaid = values > self.most if self.grows else values <= 0.0
        if unsaid.any():
            raise PoseError(f"a motion takes {seconds[unsaid].max():.6g} s, which is slower than {self.word} can say")
        return np.minimum(values, self.most)

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
