"""The wrist: two turning axes that point the tool, their two working modes, and the pole between these.

Two pairs of angles point a tool: the turning joints of head and table (:class:`Wrist`), and B and C of a pose whose
orientation is the tool's axis only (functions with ``direction`` in their names). Of each pair the *first* axis carries
the *second*. Two values of the pair, its two modes, point the tool the same way. They meet on the *pole*, where the
tool's axis lies along the first axis: there the first angle is free, and close by it swings. A path that passes over
the pole goes on in the other mode, so that the first angle need not turn by half a turn; the second changes its sign
instead.

Where the way over the pole is taken: a path of poses in :mod:`~.follow`; one point after the other in
``toolpath/linearise/continuation.py``; a tool path is led through the pole in ``toolpath/linearise/pole_passes.py``;
``toolpath/checking/motions.py`` proves that nothing else happens; ``controllers/linuxcnc/runtime.c`` does the same as
``follow`` in the controller.

All thresholds at poles stand here. Angles are rad; those "off the pole" are between the tool's axis and the first axis.

========== ============ ==============================================================================================
name       value, rad   reason
========== ============ ==============================================================================================
EXACT      1e-9         off the pole: nearer, float64 tells the first angle by rounding only
PRINTED    2e-6         off the pole: nearer, the six decimals of a CL file tell no first angle
PROVED     4e-6         off the pole: a box of poses proved to be nearer counts as on it
ASIDE      8e-6         second angle by which a pose is moved off the pole to have its rates bounded
LEEWAY     1.6e-5       second angle that may change while the first one is free
SAME_MODE  1e-6         joints no farther from those of a mode are in that mode; mm too, for machines up to a metre
NEAR_MODE  0.01         the same, mm too, for joints as a controller's drives stand: they are never just where told
SWING      90°          first angles of neighbours farther apart than this swing: the other mode is tried
FLIP       0.01         off the pole: farther away no path changes its mode
DISTINCT   0.01         off the pole: from here on the first joint is as exact as the others
VICINITY   0.12         off the pole: a motion that stays farther away does not pass it
TRAVEL     0.05         tool axis: its travel before and behind a pass over which a swing is measured
REPORTED   45°          first angle: a swing that is reported
TILTED     0.2          second angle at which a tool that starts on the pole is tilted to choose its mode
NEAR_START 0.1          off the pole: a program comes to a first record that is nearer from aside
NEAR_TURN  0.02         off the pole: a tool that is nearer is tilted so far while whole turns are taken back
STANDING   8e-6         off the pole: nearer, a controller's first joint stands still, whatever the rounded pose says
NEAR_HOLD  1e-5         off the pole: no tool axis is held nearer, or printed digits would turn the first angle
FAR_TILT   30°          second angle at home of a controller: moves about it go neither round the pole nor through it
========== ============ ==============================================================================================
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..algebra import Scalar, Trace, dot
from ..arrays import Array, AxisRange, Flags, Indices
from ..kernels.batch import evaluate_tape
from ..kernels.tape import Tape, compile_tape
from ..model.elements import Drive
from ..model.structures import DirectionColumns, compute_axis_angles, compute_tool_axis
from ..model.traces import Model
from .inverse import solve_inverse
from .turns import count_nearest_turns, find_nearest_turn, measure_whole_turns, wrap_angle

EXACT = 1e-9
PRINTED = 2e-6
PROVED = 2.0 * PRINTED
ASIDE = 8e-6
LEEWAY = 8.0 * PRINTED
SAME_MODE = 1e-6
NEAR_MODE = 0.01
SWING = 0.5 * np.pi
FLIP = 0.01
DISTINCT = 0.01
VICINITY = 0.12
TRAVEL = 0.05
REPORTED = np.radians(45.0)
TILTED = 0.2
NEAR_START = 0.5 * TILTED
NEAR_TURN = 0.02
STANDING = 8e-6
NEAR_HOLD = 5.0 * PRINTED
FAR_TILT = np.pi / 6.0

# Working modes of the wrist along a path: the path's own, its other one, either one (on the pole, or not known).
OWN, OTHER, EITHER = 0, 1, 2
WristModes = NDArray[np.int8]

# Ranges of the turning axes that hold every rotation, every turn about one axis, and every direction, once.
EVERY_ROTATION: dict[str, AxisRange] = {"A": (-np.pi, np.pi), "B": (-np.pi / 2, np.pi / 2), "C": (-np.pi, np.pi)}
EVERY_TURN: AxisRange = (-np.pi, np.pi)
EVERY_DIRECTION: dict[str, AxisRange] = {"B": (0.0, np.pi), "C": (-np.pi, np.pi)}

GAIN = 0.25  # of the squared way in the same mode: what the way in the other mode may be, for the path to change
MODE_LEVER = 100.0  # mm/rad: where the joints of two modes are compared, how far a turn by one rad is


def convert_to_freedom(angle: float) -> float:
    """Convert an angle off the pole to its sin², the measure of :meth:`Wrist.measure_freedom`."""
    return float(np.sin(angle) ** 2)


def has_swing(pairs: Array) -> bool:
    """Tell whether first angles of neighbours on a path (n, 2 or more; first, second) swing."""
    return bool((np.abs(wrap_angle(np.diff(pairs[:, 0]))) > SWING).any())


def spares_swing(before: Array, here: Array, there: Array) -> Flags:
    """Tell where going on from ``before`` in the other mode spares a swing; angles (n, 2 or more; first, second).

    here, there : the angles in the same mode and in the other one
    """
    stay, cross = wrap_angle(here - before), wrap_angle(there - before)
    with np.errstate(invalid="ignore"):
        spared: Flags = (np.abs(stay[:, 0]) > SWING) & ((cross**2).sum(1) < GAIN * (stay**2).sum(1))
    return spared


def find_crossings(here: Array, there: Array) -> Flags:
    """Find the rows of a path (n,) that go on in the other mode, whose angles are ``there`` (n, 2 or more).

    Every step that spares a swing changes the mode of all that follows, back and forth.
    """
    spared = spares_swing(here[:-1], here[1:], there[1:])
    return np.concatenate([np.zeros(min(len(here), 1), bool), np.cumsum(spared) % 2 == 1])


def get_leg_signs(mode: str) -> str:
    """Return the legs' signs of a working mode that ends with head and table's."""
    return mode[:-1]


def flip_mode(mode: str) -> str:
    """Return a working mode with the other sign of head and table."""
    return mode[:-1] + ("-" if mode[-1] == "+" else "+")


# A direction: C is the first angle, B the second.


def is_on_pole(square: Any, within: float) -> Any:
    """Tell where a tool's axis, a unit vector, is on a pole, by the square of its part across the pole."""
    return square < within * within


def solve_direction(k: Array) -> tuple[Array, Array, Flags]:
    """Solve k = Rz(C)·Ry(B)·z, (n, 3), for B from 0 to 180° and C; tell where C is free, to printed digits."""
    b, c = compute_axis_angles(list(k.T))
    return b, c, is_on_pole(k[:, 0] * k[:, 0] + k[:, 1] * k[:, 1], PRINTED)


def point_direction(b: Array, c: Array) -> Array:
    """Compute the tool axes k = Rz(C)·Ry(B)·z, unit vectors (n, 3)."""
    return np.stack(compute_tool_axis(b, c)[0], axis=-1)


def is_upright(b: Array, within: float = EXACT) -> Flags:
    """Tell where a tool at B, within half a turn, stands on the pole of B and C, up or down."""
    upright: Flags = np.abs(np.abs(b) - 0.5 * np.pi) > 0.5 * np.pi - within
    return upright


def flip_direction(c: Array, b: Array) -> Array:
    """Return the other C and B, (n, 2), that point the tool the same way."""
    return np.column_stack([c + np.pi, -b])


def cross_direction_pole(turns: Array, at: Indices) -> None:
    """Let B and C along a path (n, 2) go on over their pole at the regular rows ``at``; in place."""
    here = turns[at][:, ::-1]
    if has_swing(here):
        there = flip_direction(here[:, 0], here[:, 1])
        across = find_crossings(here, there)
        turns[at[across]] = there[across][:, ::-1]


def flip_azimuth(azimuth: float, sense: float = 1.0) -> float:
    """Return the azimuth about a pole at which the first angle is the same in the other mode, half a turn on."""
    return azimuth + sense * np.pi


def continue_turns(turns: Array, row: int) -> None:
    """Let C of the turns A, B, C (n, 3) behind a row go on from that row's by whole turns; in place."""
    turns[row + 1 :, 2] += measure_whole_turns(turns[row + 1, 2], turns[row, 2])


def fold_direction(turns: Array) -> tuple[Array, Array]:
    """Return B ≥ 0 and C, (n,) each, that point the tool as B and C (n, 2) do."""
    return np.abs(turns[:, 0]), np.where(turns[:, 0] < 0.0, turns[:, 1] + np.pi, turns[:, 1])


def continue_direction(turns: Array, before: Array) -> None:
    """Let B and C (n, 2) each go on from those of a row of ``before`` (n, 2), over the pole too; in place."""
    (b, c), (b0, c0) = fold_direction(turns), fold_direction(before)
    flipped, was_free = before[:, 0] < 0.0, np.abs(np.sin(before[:, 0])) < PRINTED
    flipped = flipped ^ spares_swing(np.column_stack([c0, b0]), np.column_stack([c, b]), flip_direction(c, b))
    flipped = np.where(was_free, np.abs(wrap_angle(c - before[:, 1])) > SWING, flipped)
    free = np.sin(b) < PRINTED
    turns[:, 0] = np.where(flipped & ~free, -b, b)
    turns[:, 1] = find_nearest_turn(np.where(free, before[:, 1], np.where(flipped, c + np.pi, c)), before[:, 1])


def compare_ways(stay: Sequence[Scalar], flip: Sequence[Scalar]) -> Scalar:
    """Compare the ways of angles from others in two modes: negative where the second way is shorter, by its square."""
    return dot(flip, flip) - dot(stay, stay)


def compile_way_comparison() -> Tape:
    """Compile the ways of B and C, then those of the other B and C -> :func:`compare_ways`, for other interpreters."""
    trace = Trace()
    return compile_tape(trace, [compare_ways(trace.inputs(2), trace.inputs(2, 2))], 4)


def find_nearest_direction(axis: Array, near: Array) -> Array:
    """Find A = 0, B and C (m, 3) that point a tool along ``axis`` (m, 3), of both modes those nearest to others."""
    b, c = compute_axis_angles(list(axis.T))
    c = np.where(np.sin(b) < EXACT, near[:, 2], c)
    other = flip_direction(c, b)
    modes = [
        find_nearest_turn(np.column_stack([0.0 * b, *pair]), near) for pair in ((b, c), (other[:, 1], other[:, 0]))
    ]
    stay, flip = (list((turns - near)[:, 1:].T) for turns in modes)
    flipped = compare_ways(stay, flip) < 0.0
    return np.where(flipped[:, None], modes[1], modes[0])


def flip_rotation(turns: Array) -> Array:
    """Return the other A, B, C (n, 3) of the same rotation Rz(C)·Ry(B)·Rx(A); their pole is B = ±90°."""
    return np.column_stack([turns[:, 0] + np.pi, np.pi - turns[:, 1], turns[:, 2] + np.pi])


def bring_within_poles(turns: Array) -> Array:
    """Return the A, B, C (n, 3) of the same rotations with B within ±90°."""
    a, b, c = turns[:, 0], wrap_angle(turns[:, 1]), turns[:, 2]
    over = np.abs(b) > 0.5 * np.pi
    across = np.copysign(np.pi, b) - b
    return np.column_stack([np.where(over, a + np.pi, a), np.where(over, across, b), np.where(over, c + np.pi, c)])


@dataclass(frozen=True, eq=False)
class Wrist:
    """The two turning joints of head and table that point the tool; see the module.

    first, second : their indices in the joint vector
    """

    model: Model
    first: int
    second: int

    @property
    def pair(self) -> list[int]:
        """Both indices, the first axis first."""
        return [self.first, self.second]

    @property
    def direction(self) -> DirectionColumns:
        """The columns of B and C in a pose, which tell the axis that the wrist points the tool along."""
        direction = self.model.structure.direction
        assert direction is not None
        return direction

    @property
    def drive(self) -> Drive:
        """The second joint's drive."""
        return self.model.drives[self.second]

    @property
    def is_in_head(self) -> bool:
        """Whether the first axis is the head's, and not the table's."""
        return self.first - self.model.leg_count < self.model.structure.head_joints

    @property
    def first_axis(self) -> Array:
        """The first axis, a unit vector (3,) in the frame that carries it."""
        assert self.model.structure.pointing is not None
        return np.array(self.model.structure.pointing.first, dtype=np.float64)

    def other_mode(self, mode: str) -> str:
        """Return the working mode with the wrist's other solution."""
        return flip_mode(mode)

    def measure_freedom(self, poses: Array) -> Array:
        """Compute sin² of the angle off the pole at poses (n, axes): (n,)."""
        return evaluate_tape(self.freedom_tape(), np.ascontiguousarray(poses), np.empty((len(poses), 1)))[:, 0]

    def find_free(self, poses: Array, within: float) -> Flags:
        """Find poses (n, axes) no farther than ``within`` rad off the pole: the first joint is free there."""
        free: Flags = self.measure_freedom(poses) < convert_to_freedom(within)
        return free

    def solve_with_first(self, poses: Array, mode: str, first: Array) -> Array:
        """Solve the inverse problem of poses (n, axes) with the first joint given (n,): joints (n, joints)."""
        given = np.ascontiguousarray(first.reshape(-1, 1))
        into = np.empty((len(poses), len(self.model.drives)))
        return evaluate_tape(self.first_given_tape(mode), np.ascontiguousarray(poses), into, given)

    def solve_nearest(
        self, poses: Array, mode: str, guess: Array, within: float, modes: WristModes | None = None
    ) -> tuple[Array, WristModes]:
        """Solve the inverse problem of poses (n, axes) in both modes and keep the joints nearer to a guess (n, joints).

        Turns are counted, and MODE_LEVER mm of a leg's way are as far as a rad. A mode that does not reach a pose is
        not kept if the other one does. No farther than ``within`` rad off the pole the first joint is the guess's.

        Parameters
        ----------
        mode : the path's own
        modes : (n,) which mode to keep off the pole; EITHER where it is not known

        Returns the joints, and the mode of each row: EITHER on the pole.
        """
        free = np.flatnonzero(self.find_free(poses, within) & np.isfinite(guess[:, self.first]))
        solutions, ways = [], []
        scale = np.array([1.0 if drive.unit == "rad" else MODE_LEVER for drive in self.model.drives])
        for each in (mode, self.other_mode(mode)):
            joints = solve_inverse(self.model, poses, each)
            if len(free):
                joints[free] = self.solve_with_first(poses[free], each, guess[free, self.first])
            count_nearest_turns(joints, guess, self.model.turning_joints)
            solutions.append(joints)
            ways.append((np.abs(joints - guess) / scale).sum(1))
        own, other = solutions
        lost = np.isnan(own[:, self.first]) & np.isfinite(other[:, self.first])
        kept = np.where(lost | (ways[OTHER] < ways[OWN]), OTHER, OWN).astype(np.int8)
        if modes is not None:
            kept = np.where(modes == EITHER, kept, modes)
        at = np.flatnonzero(kept == OTHER)
        own[at] = other[at]
        kept[free] = EITHER
        return own, kept

    def measure_blur(self, poses: Array) -> Array:
        """Compute the factor (n,), ≥ 1, by which the first joint is less exact than the others at poses (n, axes)."""
        freedom = np.maximum(self.measure_freedom(poses), convert_to_freedom(EXACT))
        blur: Array = np.maximum(1.0, DISTINCT / np.sqrt(freedom))
        return blur

    def find_reachable(self, joints: Array) -> Flags:
        """Find rows of joints (n, joints) that exist and whose second joint is within its range."""
        second = joints[:, self.second]
        reachable: Flags = np.isfinite(joints).all(1) & (second >= self.drive.low) & (second <= self.drive.high)
        return reachable

    def cross_pole(self, poses: Array, mode: str, joints: Array, regular: Flags) -> None:
        """Let joints along a path (n, joints) go on over the pole in the other mode if that spares a swing; in place.

        A stretch stays as it is if the other mode takes the second joint out of its range there, or a leg out of reach.

        regular : (n,) rows off the pole
        """
        at = np.flatnonzero(regular & np.isfinite(joints[:, self.first]))
        here = joints[at][:, self.pair]
        if not has_swing(here):
            return
        other = solve_inverse(self.model, poses[at], self.other_mode(mode))
        across = find_crossings(here, other[:, self.pair])
        stretch = np.cumsum(np.diff(across, prepend=False))  # numbered; the odd ones are across
        across &= ~np.isin(stretch, stretch[across & ~self.find_reachable(other)])
        joints[at[across]] = other[across]

    def continue_joints(self, poses: Array, mode: str, before: tuple[Array, Array]) -> Array:
        """Solve the inverse problem of poses (n, axes), each going on from the poses and joints of a row before.

        Turns are left as the inverse gives them.
        """
        before_poses, before_joints = before
        joints, there = solve_inverse(self.model, poses, mode), solve_inverse(self.model, poses, self.other_mode(mode))
        begin = solve_inverse(self.model, before_poses, mode)
        was_free = self.find_free(before_poses, PRINTED)
        over = (np.abs(wrap_angle(before_joints - begin))[:, self.pair] > SAME_MODE).any(1)
        over = over ^ spares_swing(begin[:, self.pair], joints[:, self.pair], there[:, self.pair])
        turned = np.abs(wrap_angle(joints[:, self.first] - before_joints[:, self.first]))
        over = np.where(was_free, turned > SWING, over) & self.find_reachable(there)
        joints[over] = there[over]
        free = self.find_free(poses, PRINTED)
        if free.any():
            joints[free] = self.solve_with_first(poses[free], mode, before_joints[free, self.first])
        return joints

    def has_mode(self, poses: Array, joints: Array, mode: str) -> Flags:
        """Tell which joints (n, joints), turns apart, are those of poses (n, axes) in a mode, by both joints."""
        off = wrap_angle((solve_inverse(self.model, poses, mode) - joints)[:, sorted(self.pair)])
        return np.asarray((np.abs(off) < SAME_MODE).all(1))

    def find_mode(self, pose: Array, joints: Array, mode: str) -> str:
        """Find the mode of joints (joints,) at a pose (axes,): the given one, else the other one."""
        return mode if self.has_mode(pose[None], joints[None], mode)[0] else self.other_mode(mode)

    def has_both_modes(self, poses: Array, mode: str) -> bool:
        """Tell whether the second joint stays in its range in both modes at all poses (n, axes) that are reached."""
        both = [solve_inverse(self.model, poses, each)[:, self.second] for each in (mode, self.other_mode(mode))]
        second = np.concatenate(both)
        with np.errstate(invalid="ignore"):
            return not ((second < self.drive.low) | (second > self.drive.high)).any()

    def tilt(self, joints: Array, mode: str, angle: float) -> Array:
        """Return joints (joints,) on the pole with the second one turned by ``angle`` the way a mode stands for."""
        tilted = joints.copy()
        tilted[self.second] += angle if mode[-1] == "+" else -angle
        return tilted

    # The tapes, for other interpreters of them.

    def freedom_tape(self) -> Tape:
        """Compile pose -> sin² of the angle off the pole."""
        return self.model.freedom_tape()

    def first_given_tape(self, mode: str) -> Tape:
        """Compile pose, first joint -> joints."""
        return self.model.inverse_with_first_tape(mode)


def find_wrist(model: Model) -> Wrist | None:
    """Find the wrist of a machine; None where head and table have no two turning joints."""
    return None if model.wrist_joints is None else Wrist(model, *model.wrist_joints)
