"""Stations: places at even distances along a programmed path, however dense or sparse its records are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Indices
from ..path import ToolPath
from ..programmed_path import ProgrammedPath

_TIP, _AXIS = 5.0, np.radians(2.0)  # mm and rad of tip and axis from station to station, where there is room
_MOST = 8192  # stations of a path


@dataclass(frozen=True, eq=False)
class Stations:
    """m stations along a path of n records.

    motion, share : (m,) where: motions by the record they lead to, and shares of them
    of_record : (n,) where the records are, in stations: 2.5 is half way from the third to the fourth
    """

    motion: Indices
    share: Array
    of_record: Array

    def locate(self, motion: Indices, share: Array) -> Array:
        """Locate places on motions, by the record they lead to and a share: in stations, (k,)."""
        begin = self.of_record[motion - 1]
        located: Array = begin + share * (self.of_record[motion] - begin)
        return located

    def interpolate(self, values: Array) -> Array:
        """Interpolate values (n,) of the records at the stations, (m,)."""
        begin = values[self.motion - 1]
        between: Array = begin + self.share * (values[self.motion] - begin)
        return between


def place_stations(path: ToolPath) -> Stations:
    """Place stations along a path of two or more records; the first and the last are its ends."""
    length, angle = ProgrammedPath(path).measure_motions(np.arange(1, len(path)))
    travel = np.concatenate([[0.0], np.cumsum(np.maximum(length / _TIP, angle / _AXIS))])
    intervals = max(1, min(_MOST - 1, int(np.ceil(travel[-1]))))
    of_record = travel * (intervals / travel[-1]) if travel[-1] > 0.0 else travel
    places = np.linspace(0.0, of_record[-1], intervals + 1)
    motion = np.clip(np.searchsorted(of_record, places), 1, len(path) - 1)
    begin, end = of_record[motion - 1], of_record[motion]
    share = np.divide(places - begin, end - begin, out=np.zeros_like(places), where=end > begin)
    return Stations(motion, np.clip(share, 0.0, 1.0), of_record)
