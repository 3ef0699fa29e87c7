"""The report's card of time: the cycle, which limit sets the pace for how long and where, and the curves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..colours import choose_binding_colours
from ..number_format import format_duration, format_value
from .binding_limits import render_binding_bars
from .cards import make_card
from .figures import embed_figure
from .tables import sum_programmed_time
from .timing_curves import draw_timing_curves

if TYPE_CHECKING:
    from ...toolpath.timing import Trajectory


_STILL = 1e-3  # s: a cycle as short has nothing to draw


def format_cycle(trajectory: Trajectory) -> str:
    """Format the cycle time beside that at the programmed feeds, one line of HTML."""
    path = trajectory.posted.path
    spans = np.diff(trajectory.times, prepend=0.0)
    cut, rapid = (float(spans[path.rapid == fast].sum()) for fast in (False, True))
    programmed, unknown = sum_programmed_time(path)
    beside = f"{format_duration(programmed)} at the programmed feeds"
    if unknown > 0.0:
        beside += f", {format_value(unknown, 'mm')} without a feed not counted"
    tail = f", {format_duration(rapid)} in rapid" if rapid > 0.0 else ""
    cycle, feed = format_duration(trajectory.seconds), format_duration(cut)
    return f"Cycle time <b>{cycle}</b>: {feed} in feed motions ({beside}){tail}."


def render_timing_card(trajectory: Trajectory) -> str:
    """Render the card; a trajectory that stands still has its cycle time only."""
    if trajectory.seconds < _STILL:
        return make_card("Time", "", format_cycle(trajectory))
    shades = choose_binding_colours(trajectory)
    figure, height = draw_timing_curves(trajectory, shades)
    body = (
        f"<h3>What sets the pace</h3>{render_binding_bars(trajectory, shades)}"
        "<p class=sub>Where on the path: choose “what sets the pace” as the colour in the picture above.</p>"
        f"<h3>Over the cycle</h3><div class=wide>{embed_figure('time', figure, f'{height}px')}</div>"
        "<p class=sub>Limits are dashed where they are near. Orange, red and violet: here this joint’s speed,"
        " acceleration or jerk sets the pace; of its force and power the bars above tell. Of every stretch the least"
        " and the greatest value is drawn, so no extreme is left out.</p>"
    )
    return make_card("Time", body, format_cycle(trajectory))
