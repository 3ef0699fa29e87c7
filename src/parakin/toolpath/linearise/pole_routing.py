"""Routes of passes through a pole: how the tool axis is led over the pole itself, within the angle tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Indices
from ...kinematics.wrist.pole_thresholds import EXACT, PRINTED
from ..path import ToolPath
from ..programmed_path import ProgrammedPath
from .pole_steps import PoleSteps, meet_circle
from .poles import Pole

_MOST_MOVED = 0.98  # of the angle tolerance: what an axis may be moved; the rest is for rounding
_BENT = 0.342  # sine of 20°, of the way into the circle off the line through the pole: what bends more is held
_WIDEST = 0.385  # greatest t·(1 - t²): the most by which a straight way is squeezed, of its offset where a = radius
_STRAIGHT = 5e-4  # of the offset on the circle: what bends less turns so little on the pole that controllers take it
_SNAPPED = 0.2  # fraction of the angle tolerance: a record that would be led so near to the pole is put onto it
_INNERMOST = 0.02  # fraction of the angle tolerance: the first radius at which records keep a way straight
_GROWTH, _OUTERMOST = 4.0, 0.7  # of these radii, and the last one as a fraction of the circle's
_SHIFT = 4.0 * PRINTED  # rad, by which an axis leans ahead so that C is told, whatever the rest of its lean
_UNTOLD = 1.1 * PRINTED  # rad off Z: such a lean may be lost, for it tells no C
_EXACT_LEAN = 1e-12  # rad: what is rounding
_EDGE = 1e-9  # of a motion: what is rounding


@dataclass(frozen=True, eq=False)
class PoleRoute:
    """A way through a pole that keeps within the angle tolerance.

    steps : first and last of the :class:`PoleSteps` that it takes
    miss : rad by which the programmed axis passes beside the pole
    record, axis : (k,) records whose tool axes are moved, and where to, (k, 3) in M
    crossing : the step on which the pole is passed, -1 if none
    share : where on its motion
    ends : shares of that motion at which the way to the pole begins and ends, where that is within it
    rays : motions, shares and projections (2,) of records that keep the way straight towards the pole
    """

    steps: tuple[int, int]
    miss: float
    record: Indices
    axis: Array
    crossing: int
    share: float
    ends: tuple[float, ...]
    rays: tuple[tuple[int, float, Array], ...] = ()


@dataclass(frozen=True, eq=False)
class PolePass:
    """A pass led through a pole.

    miss : rad by which the programmed axis misses the pole
    begin, end : where it begins and ends, in motions from the start of the path
    line : the source line of its nearest point
    """

    pole: Pole
    miss: float
    begin: float
    end: float
    line: int

    @property
    def key(self) -> tuple[str, float]:
        """What tells it from other passes."""
        return self.pole.text, self.begin


def locate_pass(pole: Pole, path: ToolPath, steps: PoleSteps, route: PoleRoute) -> PolePass:
    """Locate a route on the path."""
    first, last = route.steps
    nearest = first + int(steps.nearest[first : last + 1].argmin())
    begin, end = steps.record[first] - 1 + steps.begin[first], steps.record[last] - 1 + steps.end[last]
    return PolePass(pole, route.miss, float(begin), float(end), int(path.line[steps.record[nearest]]))


def find_pole_routes(
    pole: Pole, programmed: ProgrammedPath, steps: PoleSteps, angle: float, is_pose: bool
) -> list[PoleRoute]:
    """Find routes of the passes that can be led through a pole with no axis moved by ``angle`` rad or more.

    is_pose : whether the pose's coordinates go evenly from record to record. Then what is squeezed would turn on the
        pole itself, and what is straight in the projection bends but at B = 0. So a record near the pole is moved onto
        it, and more records are put on the way, the nearer to the pole the closer.

    Around each pass circles about the pole are tried, the largest first, each half as large as the one before.
    """
    close = steps.nearest <= _MOST_MOVED * angle
    follows = steps.joined & np.concatenate([[False], close[:-1]])[: len(close)]
    starts = np.flatnonzero(close & ~follows)
    stops = np.flatnonzero(close & ~np.concatenate([close[1:] & steps.joined[1:], [False]])[: len(close)])
    radii = np.sqrt(angle) * 0.5 ** np.arange(max(1.0, np.ceil(-np.log2(2.0 * np.sqrt(angle)))))
    windows = [_find_windows(steps, starts, stops, radius) for radius in radii.tolist()]
    routes: list[PoleRoute] = []
    for number in range(len(starts)):
        if routes and starts[number] <= routes[-1].steps[1]:
            continue
        for (first, last), radius in zip(windows, radii.tolist(), strict=True):
            window = int(first[number]), int(last[number])
            route = _route_through_pole(pole, programmed, steps, window, _Squeeze(radius, angle, is_pose))
            if route is not None:
                routes.append(route)
                break
    return routes


def _find_windows(steps: PoleSteps, starts: Indices, stops: Indices, radius: float) -> tuple[Indices, Indices]:
    """Find the first and the last of the steps about each pass that are no farther than ``radius`` from the pole."""
    if not len(steps.record):
        return starts, stops
    begins = np.flatnonzero((np.hypot(*steps.first.T) >= radius) | ~steps.joined)
    ends = np.flatnonzero((np.hypot(*steps.last.T) >= radius) | ~np.append(steps.joined[1:], False))
    return begins[np.searchsorted(begins, starts, "right") - 1], ends[np.searchsorted(ends, stops)]


class _Squeeze(NamedTuple):
    """The circle about a pole within which a path is squeezed, the angle tolerance, and whether poses go evenly."""

    radius: float
    angle: float
    is_pose: bool


def _route_through_pole(
    pole: Pole, programmed: ProgrammedPath, steps: PoleSteps, window: tuple[int, int], squeeze: _Squeeze
) -> PoleRoute | None:
    """Route the steps of a window over the pole by squeezing them; None if that moves an axis too far.

    In the projection about the pole the path is squeezed towards a line through it: an offset b from the line, after a
    on it, becomes b·(a/radius)². So the free angle turns evenly, by no more than it must, and without a swing.
    """
    radius, angle = squeeze.radius, squeeze.angle
    first, last = window
    inside_window = slice(first, last + 1)
    x = np.concatenate([steps.first[first : first + 1], steps.last[inside_window]])
    if min(np.hypot(*x[0]), np.hypot(*x[-1])) < radius:
        return None  # the path begins or ends on the pole
    line = _find_line(x[0], x[-1], radius)
    normal = np.array([-line[1], line[0]])
    a, b = x @ line, x @ normal
    weight = np.where(np.hypot(a, b) < radius, 1.0 - (a / radius) ** 2, 0.0)
    entries = meet_circle(x[0], x[1], radius), meet_circle(x[-1], x[-2], radius)
    # What is left to move where the path enters and leaves the circle.
    offsets = [abs(float(entry @ normal)) for entry in entries if entry is not None]
    edge, widest = [offset**3 / radius**2 for offset in offsets], max(offsets, default=0.0)
    if widest > _BENT * radius:
        return None
    bends = squeeze.is_pose and (not pole.is_upright or widest > _STRAIGHT * radius)
    shift = _find_shift(pole, programmed, steps, window) if bends else 0.0
    a = a + np.where(weight > 0.0, shift, 0.0)
    crossings = np.flatnonzero(a[:-1] * a[1:] < 0.0)
    fraction = a[crossings] / (a[crossings] - a[crossings + 1])
    miss_line = np.abs(b[crossings] + fraction * (b[crossings + 1] - b[crossings]))
    between = _WIDEST * widest / np.sqrt(1.0 - (widest / radius) ** 2)  # where the way to the pole is straight
    if not max(between, np.abs(weight * b).max(), *miss_line, *edge) <= _MOST_MOVED * angle:
        return None
    if len(crossings) > 1:
        return None
    records = np.concatenate([[steps.record[first] - (steps.begin[first] == 0.0)], steps.record[inside_window]])
    at_record = np.concatenate([[steps.begin[first] == 0.0], steps.end[inside_window] == 1.0])
    if pole.moves and np.count_nonzero(at_record & (np.hypot(a, (1.0 - weight) * b) < _SNAPPED * angle)) > 1:
        return None  # even poses bow out beside a pole that goes along with them, in a direction of their own
    moved = at_record & (weight * np.maximum(np.abs(b), shift) > (EXACT if bends else PRINTED))
    squeezed = (1.0 - weight) * b
    if bends and not shift:
        nearest = int(np.where(at_record, np.hypot(a, squeezed), np.inf).argmin())
        if np.hypot(a[nearest], squeezed[nearest]) < _SNAPPED * angle:
            if np.hypot(a[nearest], b[nearest]) > _MOST_MOVED * angle:
                return None
            a, moved[nearest], squeezed[nearest] = np.where(np.arange(len(a)) == nearest, 0.0, a), True, 0.0
            crossings = np.flatnonzero(a[:-1] * a[1:] < 0.0)
            fraction = a[crossings] / (a[crossings] - a[crossings + 1])
            if len(crossings):
                return None
    projected = np.outer(a, line) + np.outer(squeezed, normal)
    record = records[moved]
    at_records = programmed.tip[record], programmed.axis[record]
    axis = pole.find_axes(*at_records, projected[moved], programmed.get_extension(record))
    share, crossing = 0.0, -1
    ends: tuple[float, ...] = ()
    if len(crossings):
        crossing = first + int(crossings[0])
        share = steps.locate(crossing, fraction[0])
        ends = _find_inner_ends(steps, window, crossing, radius)
    nearest_step = first + int(steps.nearest[inside_window].argmin())
    miss, rays = float(steps.nearest[nearest_step]), tuple[tuple[int, float, Array], ...]()
    if bends:
        at_pole = steps.record[[nearest_step]], steps.share[[nearest_step]]
        inner = pole.list_inner_radii(programmed.interpolate(*at_pole)[1][0], _OUTERMOST * radius)
        rays = _place_rays(steps, window, np.column_stack([a, b]), (line, normal), squeeze, inner)
    return PoleRoute(window, miss, record, axis, crossing, share, () if bends else ends, rays)


def _find_shift(pole: Pole, programmed: ProgrammedPath, steps: PoleSteps, window: tuple[int, int]) -> float:
    """Find how far ahead along its way the axis has to lean for a pose to tell exactly where it points, rad.

    Where a pole that moves is passed so near to Z that C is free to printed digits, but is not on Z, the small lean
    that leads over it would be lost, and the free angle be another one behind the pole.
    """
    if not pole.moves:
        return 0.0
    nearest = window[0] + int(steps.nearest[window[0] : window[1] + 1].argmin())
    at = steps.record[[nearest]], steps.share[[nearest]]
    on_pole = pole.find_axes(*programmed.interpolate(*at), np.zeros((1, 2)), programmed.interpolate_extension(*at))
    return _SHIFT if _EXACT_LEAN < np.hypot(*on_pole[0, :2]) < _UNTOLD else 0.0


def _place_rays(
    steps: PoleSteps,
    window: tuple[int, int],
    way: Array,
    axes: tuple[Array, Array],
    squeeze: _Squeeze,
    inner: list[float],
) -> tuple[tuple[int, float, Array], ...]:
    """Place records on a squeezed way at places along the line through the pole that grow by a factor.

    way : (m + 1, 2) along the line and off it, as programmed
    axes : directions along the line and across, (2,) each
    inner : further places between the innermost and the pole
    """
    a, rays = way[:, 0], []
    innermost = _INNERMOST * squeeze.angle
    count = max(0, int(np.ceil(np.log(_OUTERMOST * squeeze.radius / innermost) / np.log(_GROWTH))))
    outer = (innermost * _GROWTH ** np.arange(count)).tolist()
    closest = max(inner, default=0.0)
    for radius in [*inner, *(radius for radius in outer if radius > closest)]:
        for at in (-radius, radius):
            places = np.flatnonzero((a[:-1] - at) * (a[1:] - at) < 0.0)
            for index in sorted({*places[:1].tolist(), *places[-1:].tolist()}):  # in and out again where it turns back
                step, fraction = window[0] + index, (at - a[index]) / (a[index + 1] - a[index])
                share = steps.locate(step, fraction)
                across = (way[index, 1] + fraction * (way[index + 1, 1] - way[index, 1])) * (at / squeeze.radius) ** 2
                across *= radius > innermost  # straight there: the free angle is the same before the pole and behind
                if _EDGE < share < 1.0 - _EDGE:
                    rays.append((int(steps.record[step]), share, at * axes[0] + across * axes[1]))
    return tuple(rays)


def _find_line(begin: Array, end: Array, radius: float) -> Array:
    """Find the direction (2,) in which the pole is passed, from where the path comes and goes."""
    directions = [x / np.hypot(*x) for x in (-begin, end) if np.hypot(*x) >= radius]
    if len(directions) == 2 and directions[0] @ directions[1] < 0.0:
        directions[1] = -directions[1]  # the path turns back
    total: Array = np.sum(directions, axis=0) if directions else end - begin
    size = np.hypot(*total)
    return np.array(total / size if size > 0.0 else [1.0, 0.0], dtype=np.float64)


def _find_inner_ends(steps: PoleSteps, window: tuple[int, int], crossing: int, radius: float) -> tuple[float, ...]:
    """Find the shares of the motion that crosses the pole at which it enters the circle and leaves it again."""
    ends = []
    first, last = window
    for step, outside, inside in ((first, steps.first, steps.last), (last, steps.last, steps.first)):
        entry = meet_circle(outside[step], inside[step], radius)
        if entry is None or steps.record[step] != steps.record[crossing]:
            continue
        fraction = np.hypot(*(entry - steps.first[step])) / np.hypot(*(steps.last[step] - steps.first[step]))
        share = steps.locate(step, fraction)
        if 0.0 < share < 1.0:
            ends.append(share)
    return tuple(ends)
