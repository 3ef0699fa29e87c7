"""Which working modes carry a path whole, and in which assembly mode it stays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..model.traces import Model
from .assembly_side import find_sides
from .follow import follow_path
from .limit_margins import find_broken_limits


class PathMode(NamedTuple):
    """A path of poses in one working mode.

    mode : the working mode
    broken : the first pose that is out of reach or off a limit, None where the mode carries the path whole
    limit : the name of the limit that is broken there, or empty
    side : the sign of det A at the first pose
    crossing : the first pose on a parallel singularity or on its other side, None where the path stays in its assembly
        mode, as far as it is carried
    """

    mode: str
    broken: int | None
    limit: str
    side: float
    crossing: int | None

    @property
    def carries(self) -> bool:
        """Whether the mode carries the path whole, in one assembly mode."""
        return self.broken is None and self.crossing is None


def find_path_modes(model: Model, poses: Array, modes: Sequence[str]) -> list[PathMode]:
    """Follow a path (n, axes) in working modes: where each breaks a limit or meets a parallel singularity.

    The poses are looked at, and not what lies between them.
    """
    return [_follow_in(model, poses, mode) for mode in modes]


def _follow_in(model: Model, poses: Array, mode: str) -> PathMode:
    joints = follow_path(model, poses, mode)
    codes = find_broken_limits(model, poses, joints, mode)
    off = np.flatnonzero(codes)
    carried = int(off[0]) if len(off) else len(poses)
    sides = np.sign(find_sides(model, poses, mode))
    away = np.flatnonzero((sides[:carried] == 0.0) | (sides[:carried] != sides[:1]))
    return PathMode(
        mode,
        int(off[0]) if len(off) else None,
        model.limits[int(codes[off[0]]) - 1].name if len(off) else "",
        float(sides[0]),
        int(away[0]) if len(away) else None,
    )
