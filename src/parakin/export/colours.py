"""The colours of figures and pages."""

from __future__ import annotations

from itertools import chain, repeat
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..toolpath.timing import Trajectory

INK, FAINT, BLUE = "#263238", "#e3e8ec", "#1565c0"
_FEED, _REST = "#9fb3c0", "#546e7a"
_COLOURS = (
    "#d32f2f", "#f57c00", "#7b1fa2", "#00838f", "#c2185b", "#558b2f", "#5d4037", "#fbc02d",
    "#303f9f", "#00695c", "#e64a19", "#9e9d24", "#512da8", "#0277bd",
)  # fmt: skip


def choose_binding_colours(trajectory: Trajectory) -> dict[str, str]:
    """Choose a colour for each limit that sets the pace anywhere, in the order of their fractions."""
    free = chain(_COLOURS, repeat(_REST))
    return {name: _FEED if name == "feed" else next(free) for name in trajectory.binding_fractions}
