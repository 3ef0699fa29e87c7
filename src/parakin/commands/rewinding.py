"""The options of ``parakin post`` that say where turns of a joint may be taken back."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from ..errors import InputError

if TYPE_CHECKING:
    from ..arrays import Array
    from ..machine import Machine
    from ..toolpath.path import ToolPath
    from ..toolpath.posting.rewinds import Rewind


def check_clearance(rewind: float | None, clearance: float | None) -> None:
    """Raise :class:`InputError` for values that are none of their options."""
    if rewind is not None and not (rewind > 0.0 and isfinite(rewind)):
        raise InputError("expected a length above zero, in mm", "--rewind")
    if clearance is not None and not isfinite(clearance):
        raise InputError("expected a height, in mm", "--clearance")


def rewind_part(
    machine: Machine,
    path: ToolPath,
    stated: tuple[float | None, float | None],
    workpiece: Array | None,
    mode: str | None,
) -> tuple[ToolPath, tuple[Rewind, ...]]:
    """Insert the rewinds that a path needs where ``stated``, --rewind and --clearance, allows them."""
    if stated == (None, None):
        return path, ()
    from ..toolpath.posting.rewinds import Clearance, rewind_path

    rewound = rewind_path(machine, path, Clearance(*stated), workpiece=workpiece, mode=mode)
    return rewound.path, rewound.rewinds
