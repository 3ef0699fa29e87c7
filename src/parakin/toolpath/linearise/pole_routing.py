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


class _SqueezedWay(NamedTuple):
    """The way of a window's points in the projection about the pole, by the line through it that is squeezed towards.

    line, normal : (2,) directions along the line and across
    along, across : (m + 1,) places of the points
    weight : (m + 1,) by how much of its offset each point is moved
    widest : greatest offset where the way enters or leaves the circle
    """

    line: Array
    normal: Array
    along: Array
    across: Array
    weight: Array
    widest: float

    @property
    def squeezed(self) -> Array:
        """(m + 1,) offsets across the line that are left."""
        return (1.0 - self.weight) * self.across

    def find_crossings(self) -> tuple[Indices, Array]:
        """Find the steps on which the pole is passed, and the fractions of them at which it is."""
        a = self.along
        crossings = np.flatnonzero(a[:-1] * a[1:] < 0.0)
        return crossings, a[crossings] / (a[crossings] - a[crossings + 1])


def _route_through_pole(
    pole: Pole, programmed: ProgrammedPath, steps: PoleSteps, window: tuple[int, int], squeeze: _Squeeze
) -> PoleRoute | None:
    """Route the steps of a window over the pole by squeezing them; None if that moves an axis too far.

    In the projection about the pole the path is squeezed towards a line through it: an offset b from the line, after a
    on it, becomes b·(a/radius)². So the free angle turns evenly, by no more than it must, and without a swing.
    """
    way = _project_way(steps, window, squeeze.radius)
    if way is None:
        return None
    bends = squeeze.is_pose and (not pole.is_upright or way.widest > _STRAIGHT * squeeze.radius)
    shift = _find_shift(pole, programmed, steps, window) if bends else 0.0
    way = way._replace(along=way.along + np.where(way.weight > 0.0, shift, 0.0))
    if not _is_within_angle(way, squeeze):
        return None
    first, inside = window[0], slice(window[0], window[1] + 1)
    starts_at_record = steps.begin[first] == 0.0
    records = np.concatenate([[steps.record[first] - starts_at_record], steps.record[inside]])
    at_record = np.concatenate([[starts_at_record], steps.end[inside] == 1.0])
    distance = np.where(at_record, np.hypot(way.along, way.squeezed), np.inf)
    if pole.moves and np.count_nonzero(distance < _SNAPPED * squeeze.angle) > 1:
        return None  # even poses bow out beside a pole that goes along with them, in a direction of their own
    moved = at_record & (way.weight * np.maximum(np.abs(way.across), shift) > (EXACT if bends else PRINTED))
    squeezed = way.squeezed
    nearest = int(distance.argmin())
    if bends and not shift and distance[nearest] < _SNAPPED * squeeze.angle:
        if np.hypot(way.along[nearest], way.across[nearest]) > _MOST_MOVED * squeeze.angle:
            return None
        way.along[nearest], moved[nearest], squeezed[nearest] = 0.0, True, 0.0
        if len(way.find_crossings()[0]):
            return None
    projected = np.outer(way.along, way.line) + np.outer(squeezed, way.normal)
    record = records[moved]
    at_records = programmed.tip[record], programmed.axis[record]
    axis = pole.find_axes(*at_records, projected[moved], programmed.get_extension(record))
    crossing, share, ends = -1, 0.0, tuple[float, ...]()
    for place, fraction in zip(*way.find_crossings(), strict=True):
        crossing = first + int(place)
        share, ends = steps.locate(crossing, fraction), _find_inner_ends(steps, window, crossing, squeeze.radius)
    nearest_step = first + int(steps.nearest[inside].argmin())
    miss, rays = float(steps.nearest[nearest_step]), tuple[tuple[int, float, Array], ...]()
    if bends:
        at_pole = steps.record[[nearest_step]], steps.share[[nearest_step]]
        inner = pole.list_inner_radii(programmed.interpolate(*at_pole)[1][0], _OUTERMOST * squeeze.radius)
        ends, rays = (), _place_rays(steps, window, way, squeeze, inner)
    return PoleRoute(window, miss, record, axis, crossing, share, ends, rays)


def _project_way(steps: PoleSteps, window: tuple[int, int], radius: float) -> _SqueezedWay | None:
    """Project the points of a window; None if the path begins or ends on the pole, or bends too much to be squeezed."""
    first, last = window
    x = np.concatenate([steps.first[first : first + 1], steps.last[first : last + 1]])
    if min(np.hypot(*x[0]), np.hypot(*x[-1])) < radius:
        return None
    line = _find_line(x[0], x[-1], radius)
    normal = np.array([-line[1], line[0]])
    along, across = x @ line, x @ normal
    weight = np.where(np.hypot(along, across) < radius, 1.0 - (along / radius) ** 2, 0.0)
    entries = meet_circle(x[0], x[1], radius), meet_circle(x[-1], x[-2], radius)
    widest = max((abs(float(entry @ normal)) for entry in entries if entry is not None), default=0.0)
    return None if widest > _BENT * radius else _SqueezedWay(line, normal, along, across, weight, widest)


def _is_within_angle(way: _SqueezedWay, squeeze: _Squeeze) -> bool:
    """Tell whether a squeezed way passes the pole at most once and moves no axis farther than it may be."""
    radius = squeeze.radius
    crossings, fraction = way.find_crossings()
    on_line = np.abs(way.across[crossings] + fraction * (way.across[crossings + 1] - way.across[crossings]))
    at_edge = way.widest**3 / radius**2  # what is left to move where the path enters and leaves the circle
    between = _WIDEST * way.widest / np.sqrt(1.0 - (way.widest / radius) ** 2)  # where the way to the pole is straight
    most = max(between, np.abs(way.weight * way.across).max(), *on_line, at_edge)
    return bool(most <= _MOST_MOVED * squeeze.angle) and len(crossings) <= 1


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
    steps: PoleSteps, window: tuple[int, int], way: _SqueezedWay, squeeze: _Squeeze, inner: list[float]
) -> tuple[tuple[int, float, Array], ...]:
    """Place records on a squeezed way at places along the line through the pole that grow by a factor.

    inner : further places between the innermost and the pole
    """
    a, b, rays = way.along, way.across, []
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
                across = (b[index] + fraction * (b[index + 1] - b[index])) * (at / squeeze.radius) ** 2
                across *= radius > innermost  # straight there: the free angle is the same before the pole and behind
                if _EDGE < share < 1.0 - _EDGE:
                    rays.append((int(steps.record[step]), share, at * way.line + across * way.normal))
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
