"""How far a machine can go along a line of poses, proved by interval arithmetic in steps that grow and shrink.

Over a step the mean value theorem bounds every margin from its value at the step's start and the range of its
derivative; bounds of the margin itself count where they are better. What is proved so is true of every pose on the way,
and ends within :data:`FINEST` of where a limit is broken, but where margins only touch zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import inf, pi
from typing import NamedTuple

import numpy as np

from ..algebra import Scalar, Trace, derivative
from ..arrays import Array, Flags
from ..kernels.intervals import IntervalProgram, JumpFreeTrace
from ..kernels.tape import Tape
from ..model.rates import compute_twist_rates, trace_determinant
from ..model.traces import Model
from ..units import AXIS_UNITS
from .inverse import solve_inverse
from .limit_margins import find_broken_limits
from .turns import count_nearest_turns
from .wrist.pole_crossing import flip_mode, spares_swing
from .wrist.pole_thresholds import EXACT, PROVED, convert_to_freedom
from .wrist.turning_joints import find_wrist

SINGULARITY, UNDECIDED = "singularity", "untold"  # what ends a way besides a limit, as checked paths name it
FINEST = {"mm": 1e-7, "rad": 1e-10}  # a way this long is not cut
FARTHEST = {"mm": 1e6, "rad": 8.0 * pi}  # ways end there where nothing else ends them

_NEAR_SINGULAR = 1e-4  # of det A at home: a way keeps off singularities by as much
_SHRINKS = 2.0 ** -np.arange(24.0)  # steps that are tried at once, over the longest of them
_GROWTH = 16.0  # of the longest step tried over the last one proved
_HOP = 1e4  # of the finest way: a step over a pole, where the wrist's first joint is free
_LOOK = 2.0 ** np.arange(13.0)  # of the finest way: how far ahead the limit is looked for that ends a way
_MOST_TURN = 3.0  # rad of a turning joint over a step, for its turns to be counted


@dataclass(frozen=True, eq=False)
class TravelEnd:
    """How far a way is proved, and what ends it.

    distance : mm, rad, or multiples of the direction
    pose : (axes,) mm and rad, at its end
    limit : the limit that is broken next, ``singularity``, ``untold`` where it could not be told, or None where the way
        goes on beyond 1e6 mm or 8π rad
    """

    distance: float
    pose: Array
    limit: str | None

    def __repr__(self) -> str:
        return f"<parakin end of travel: {self}>"

    def __str__(self) -> str:
        return f"{self.distance:.6g} until {self.limit or 'nothing'}"


@dataclass(frozen=True, eq=False)
class Travel:
    """The travel left along a direction, both ways.

    ahead, back : along it, and against it
    """

    ahead: TravelEnd
    back: TravelEnd

    def __repr__(self) -> str:
        return f"<parakin travel: ahead {self.ahead}, back {self.back}>"


class LineTapes(NamedTuple):
    """Margins along a line of poses, for other interpreters of intervals.

    values : takes start, direction and share t to the margins, det A and more
    rates : takes them to the derivatives of margins and det A by t, and more
    sign, floor : of det A at home, and what det A times it has to stay above
    """

    values: Tape
    rates: Tape
    sign: float
    floor: float


class _LineBounds:
    """Bounds of margins, det A and wrist over spans [a, b] of lines of poses, in one working mode.

    first_given : the wrist's first joint is given, as on its pole, where it is free
    """

    def __init__(self, model: Model, mode: str, first_given: bool):
        self.width, self._model, self._mode, self._first_given = len(model.axes), model, mode, first_given
        trace = Trace()
        margins, determinant, _, freedom = self._trace_line(trace)
        self._values = IntervalProgram(trace, [*margins, determinant, freedom])
        has_poles = find_wrist(model) is not None and not first_given
        self._rates = [self._compile_rates(t) for t in ([JumpFreeTrace(), Trace()] if has_poles else [JumpFreeTrace()])]

    def _trace_line(self, trace: Trace) -> tuple[list[Scalar], Scalar, list[Scalar], Scalar]:
        """Trace the margins, det A, the turning joints, and the wrist's freedom, at start + t·direction."""
        model, n = self._model, self.width
        share = trace.input(2 * n)
        pose = [x + share * d for x, d in zip(trace.inputs(n), trace.inputs(n, n), strict=True)]
        joints, placed, _ = model.invert(pose, self._mode, trace.input(2 * n + 1) if self._first_given else None)
        listed = model.margins(pose, joints, self._mode) if self._first_given else model.own_margins(pose, self._mode)
        rates = compute_twist_rates(model.spec, model.structure, pose, joints)
        height, width = model.parallel_block
        determinant = trace_determinant([row[:width] for row in rates.a[:height]])
        turning = [joints[i] for i in model.turning_joints]
        return [m for _, m in listed], determinant, turning, 1.0 if placed.freedom is None else placed.freedom

    def _compile_rates(self, trace: Trace) -> IntervalProgram:
        margins, determinant, turning, _ = self._trace_line(trace)
        share = trace.input(2 * self.width)
        return IntervalProgram(trace, [derivative(value, share) for value in (*margins, determinant, *turning)])

    @property
    def tapes(self) -> tuple[Tape, Tape]:
        """The tapes of values and rates."""
        return self._values.tape, self._rates[0].tape

    def bound_values(self, line: Array, begin: Array, end: Array) -> tuple[Array, Array]:
        """Bound margins, det A and freedom over spans (k,) of a line: (k, margins + 2) each.

        line : (2·axes + 1,) start, direction, and the wrist's first joint
        """
        return self._values(*_stack_boxes(line, begin, end))

    def bound_rates(self, line: Array, begin: Array, end: Array) -> tuple[Array, Array]:
        """Bound the derivatives of margins, det A and turning joints, (k, margins + 1 + turning) each."""
        down, up = self._rates[0](*_stack_boxes(line, begin, end))
        for program in self._rates[1:]:
            lower, upper = program(*_stack_boxes(line, begin, end))
            down, up = np.maximum(down, lower), np.minimum(up, upper)
        return down, up


@lru_cache(maxsize=32)
def _compile_line(model: Model, mode: str, first_given: bool = False) -> _LineBounds:
    return _LineBounds(model, mode, first_given)


def _stack_boxes(line: Array, begin: Array, end: Array) -> tuple[Array, Array]:
    fixed = np.tile(line, (len(begin), 1))
    return tuple(np.column_stack([fixed[:, :-1], share, fixed[:, -1]]) for share in (begin, end))  # type: ignore[return-value]


def find_travel(model: Model, pose: Array, direction: Array, mode: str) -> Travel:
    """Find the travel left from a pose (axes,) along a direction (axes,), mm and rad, both ways."""
    return Travel(*(_Way(model, pose, sign * direction, mode).prove() for sign in (1.0, -1.0)))


def compile_line_tapes(model: Model, mode: str) -> LineTapes:
    """Compile the margins along a line of poses, and their rates, of a machine without a wrist."""
    bounds, at = _compile_line(model, mode), np.zeros(1)
    down, _ = bounds.bound_values(np.concatenate([model.home, np.zeros(len(model.axes) + 1)]), at, at)
    sign = -1.0 if down[0, len(model.limits)] < 0.0 else 1.0
    return LineTapes(*bounds.tapes, sign, _find_least_determinant(model))


def _find_least_determinant(model: Model) -> float:
    """Find the least det A that counts as regular, a fraction of home's; 0 where home tells none."""
    joints = solve_inverse(model, np.array([model.home]), model.mode)[0]
    wrist, at = find_wrist(model), np.zeros(1)
    line = np.concatenate([model.home, np.zeros(len(model.axes)), [0.0 if wrist is None else joints[wrist.first]]])
    down, up = _compile_line(model, model.mode, first_given=wrist is not None).bound_values(line, at, at)
    least = _NEAR_SINGULAR * float(np.maximum(np.abs(down), np.abs(up))[0, len(model.limits)])
    return least if np.isfinite(least) else 0.0


class _Way:
    """A line of poses, start + t·direction, proved from t = 0 to ``share``.

    joints : (joints,) at the end of what is proved, turns counted
    margins : (limits + 1,) bounds from below of the margins there, and of det A with the sign that it has at the start
    """

    def __init__(self, model: Model, pose: Array, direction: Array, mode: str):
        self.model, self.mode, self.share = model, mode, 0.0
        self.pose, self.direction = pose, direction
        self.wrist = find_wrist(model)
        units = [AXIS_UNITS[axis] for axis in model.axes]
        moving = np.flatnonzero(direction)
        self.finest, self.most = (
            min(float(lengths[units[i]] / abs(direction[i])) for i in moving) for lengths in (FINEST, FARTHEST)
        )
        self._number_columns()
        self.joints = self._find_first_joints()
        self.sign = 1.0
        self.sign = -1.0 if self._bound_point(0.0, self.joints, mode)[-1] < 0.0 else 1.0
        self.floor = _find_least_determinant(model)
        self.margins = self._bound_point(0.0, self.joints, mode)
        self.is_allowed = bool((self.margins[:-1] >= 0.0).all())
        if np.isfinite(self.joints).all() and not find_broken_limits(model, pose[None], self.joints[None], mode)[0]:
            self.margins[:-1] = np.maximum(self.margins[:-1], 0.0)  # a start on a limit may leave it
            self.is_allowed = True
        self.is_allowed &= bool(self.margins[-1] > self.floor)

    def _number_columns(self) -> None:
        """Find the columns of each turning joint's limits, with the joint's sign in the margin, and the wrist's."""
        columns = {limit.name: column for column, limit in enumerate(self.model.limits)}
        self.turn_columns = {
            joint: [
                (columns[name], sign)
                for side, sign in (("min", 1.0), ("max", -1.0))
                if (name := f"{self.model.drives[joint].name}.{side}") in columns
            ]
            for joint in self.model.turning_joints
        }
        self.counts_turns, self.of_wrist = (np.zeros(len(columns) + 1, bool) for _ in range(2))
        for joint, pairs in self.turn_columns.items():
            own = [column for column, _ in pairs]
            self.counts_turns[own] = True
            self.of_wrist[own] = self.wrist is not None and joint in self.wrist.pair

    def _find_first_joints(self) -> Array:
        """Solve for the joints at the start; a first joint of the wrist that is free stands as the way needs it."""
        poses = self._pose_at(np.array([0.0, _HOP * self.finest]))
        joints = solve_inverse(self.model, poses, self.mode)
        if self.wrist is not None and self.wrist.find_free(poses[:1], EXACT)[0]:
            return np.asarray(self.wrist.solve_with_first(poses[:1], self.mode, joints[1:, self.wrist.first])[0])
        return np.asarray(joints[0])

    def _is_free(self, share: float) -> bool:
        return self.wrist is not None and bool(self.wrist.find_free(self._pose_at(np.array([share])), EXACT)[0])

    def _make_line(self, joints: Array) -> Array:
        """Return start, direction, and the wrist's first joint."""
        first = 0.0 if self.wrist is None else float(joints[self.wrist.first])
        return np.concatenate([self.pose, self.direction, [first]])

    def _bound_point(self, share: float, joints: Array, mode: str) -> Array:
        """Bound the margins and det A with the start's sign from below at a point, turns counted, (limits + 1,)."""
        at, first_given = np.array([share]), self._is_free(share)
        bounds = _compile_line(self.model, mode, first_given)
        down, up = (ends[0] for ends in bounds.bound_values(self._make_line(joints), at, at))
        margins = np.append(down[:-2], down[-2] if self.sign > 0.0 else -up[-2])
        if not first_given:
            own = solve_inverse(self.model, self._pose_at(at), mode)[0]
            for joint, pairs in self.turn_columns.items():
                for column, sign in pairs:
                    margins[column] += sign * (joints[joint] - own[joint])
        return np.where(np.isnan(margins), -inf, margins)

    def _pose_at(self, share: Array) -> Array:
        return np.ascontiguousarray(self.pose + share[:, None] * self.direction)

    def prove(self) -> TravelEnd:
        """Prove steps as long as there are any."""
        step = self.most
        while self.is_allowed and self.share < self.most:
            tried = min(_GROWTH * step, self.most - self.share) * _SHRINKS
            step = self._take_step(tried)
            while step == 0.0 and tried[-1] > self.finest:
                tried = tried[-1] * _SHRINKS[1:]
                step = self._take_step(tried[tried >= 0.5 * self.finest])
            if step == 0.0:
                break
        limit = None if self.is_allowed and self.share >= self.most else self._name_end()
        return TravelEnd(self.share, self._pose_at(np.array([self.share]))[0], limit)

    def _take_step(self, tried: Array) -> float:
        """Go on by the longest of some steps that is proved; return it, or 0 where none is."""
        begin, end = np.full(len(tried), self.share), self.share + tried
        kept, least, on_pole = self._bound_spans(begin, end, first_given=False)
        if on_pole.any():
            kept[on_pole], least[on_pole], _ = self._bound_spans(begin[on_pole], end[on_pole], first_given=True)
        before = self.share
        for row in np.flatnonzero(kept).tolist():
            if self._go_on(float(end[row]), least[row]):
                return self.share - before
        return 0.0

    def _bound_spans(self, begin: Array, end: Array, first_given: bool) -> tuple[Flags, Array, Flags]:
        """Bound margins and det A over spans (k,): which keep all, the least at their ends, which are on the pole.

        first_given : the wrist's first joint stands still, and its limits count at the ends only
        """
        bounds, count, size = (
            _compile_line(self.model, self.mode, first_given),
            len(self.model.limits),
            (end - begin)[:, None],
        )
        line = self._make_line(self.joints)
        down, up = bounds.bound_values(line, begin, end)
        rate_down, rate_up = bounds.bound_rates(line, begin, end)
        values = np.column_stack([down[:, :count], down[:, count] if self.sign > 0.0 else -up[:, count]])
        slopes = np.column_stack([rate_down[:, :count], rate_down[:, count] if self.sign > 0.0 else -rate_up[:, count]])
        with np.errstate(invalid="ignore"):
            least = self.margins + np.minimum(slopes * size, 0.0)
            turned = np.maximum(np.abs(rate_down), np.abs(rate_up))[:, count + 1 :] * size
        least = np.where(self.counts_turns, least, np.fmax(least, values))
        if first_given and self.wrist is not None:
            least[:, self.of_wrist] = 0.0
            turned[:, np.isin(self.model.turning_joints, self.wrist.pair)] = 0.0
        is_kept = (least[:, :count] >= 0.0).all(1) & (least[:, count] > self.floor) & (turned < _MOST_TURN).all(1)
        least[:, self.of_wrist & first_given] = -inf
        free = convert_to_freedom(PROVED)
        is_hop = (down[:, -1] <= free) & (size[:, 0] <= _HOP * self.finest) & (size[:, 0] >= 0.5 * _HOP * self.finest)
        on_pole = np.asarray(((up[:, -1] <= free) | is_hop) & (self.wrist is not None))
        return np.asarray(is_kept), least, on_pole

    def _go_on(self, share: float, least: Array) -> bool:
        """Move the end of what is proved, with margins of at least ``least`` there; False where the wrist can't."""
        mode, joints = self._find_joints(share)
        if not np.isfinite(joints).all():
            return False
        margins = np.maximum(self._bound_point(share, joints, mode), least)
        if not ((margins[:-1] >= 0.0).all() and margins[-1] > self.floor):
            return False
        self.share, self.joints, self.mode, self.margins = share, joints, mode, margins
        return True

    def _find_joints(self, share: float) -> tuple[str, Array]:
        """Find the working mode and the joints with which the way goes on at a share."""
        pose, mode = self._pose_at(np.array([share])), self.mode
        joints = solve_inverse(self.model, pose, mode)
        if self.wrist is not None and self._is_free(share):
            joints = self.wrist.solve_with_first(pose, mode, self.joints[[self.wrist.first]])
        elif self.wrist is not None:
            other = solve_inverse(self.model, pose, flip_mode(mode))
            pair = np.array(self.wrist.pair)
            if spares_swing(self.joints[None, pair], joints[:, pair], other[:, pair])[0]:
                mode, joints = flip_mode(mode), other
        count_nearest_turns(joints, self.joints[None], self.model.turning_joints)
        return mode, joints[0]

    def _name_end(self) -> str:
        """Name what is broken just beyond the end of what is proved."""
        for share in (self.share + (self.finest * _LOOK if self.is_allowed else np.zeros(1))).tolist():
            mode, joints = self._find_joints(share)
            broken = find_broken_limits(self.model, self._pose_at(np.array([share])), joints[None], mode)[0]
            if broken:
                return str(self.model.limits[broken - 1].name)
            if not self._bound_point(share, joints, mode)[-1] > self.floor:
                return SINGULARITY
        return UNDECIDED
