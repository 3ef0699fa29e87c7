"""The two turning joints of head and table that point the tool, asked by rows of poses and joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Flags, find_finite_rows
from ...kernels.batch import evaluate_tape
from ...kernels.tape import Tape
from ...model.elements import Drive
from ...model.structures import DirectionColumns
from ...model.traces import Model
from ..inverse import solve_inverse
from ..turns import count_nearest_turns, wrap_angle
from .pole_crossing import EITHER, OTHER, OWN, WristModes, find_crossings, flip_mode, has_swing, spares_swing
from .pole_thresholds import DISTINCT, EXACT, PRINTED, SAME_MODE, SWING, convert_to_freedom

MODE_LEVER = 100.0  # mm/rad: where the joints of two modes are compared, how far a turn by one rad is
_SLIGHTLY = 1e-4  # rad: a turn by which the rates of joints are told


@dataclass(frozen=True, eq=False)
class Wrist:
    """The two turning joints of head and table that point the tool; see :mod:`parakin.kinematics.wrist`.

    model : the machine's mathematics
    first, second : their indices in the joint vector

    Its methods share these arguments:

    poses, pose : rows (n, axes), or one (axes,), mm and rad
    joints : rows (n, joints), or one (joints,), mm and rad
    mode : working mode
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
        """Find poses (n, axes) no farther than ``within`` off the pole, rad: the first joint is free there."""
        free: Flags = self.measure_freedom(poses) < convert_to_freedom(within)
        return free

    def solve_with_first(self, poses: Array, mode: str, first: Array) -> Array:
        """Solve the inverse problem of poses (n, axes) with the joint ``first`` given, (n,) rad: joints (n, joints)."""
        given = np.ascontiguousarray(first.reshape(-1, 1))
        into = np.empty((len(poses), len(self.model.drives)))
        return evaluate_tape(self.first_given_tape(mode), np.ascontiguousarray(poses), into, given)

    def solve_nearest(
        self, poses: Array, mode: str, guess: Array, within: float, modes: WristModes | None = None
    ) -> tuple[Array, WristModes]:
        """Solve the inverse problem of poses (n, axes) in both modes and keep the joints nearer to a guess.

        Turns are counted, and MODE_LEVER mm of a leg's way are as far as a rad. A mode that does not reach a pose is
        not kept if the other one does. No farther than ``within`` rad off the pole the first joint is the guess's.

        Parameters
        ----------
        mode : the path's own
        guess : (n, joints), mm and rad
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

    def measure_blur(self, poses: Array, mode: str, joints: Array) -> Array:
        """Compute how many units of rounding joints (n, joints) of poses (n, axes) are off, (n, joints), mm and rad.

        Off the pole that is a joint's size, at least 1. Beside it the first joint is less exact, and so are the others
        that turn what it turns.
        """
        blur = np.maximum(1.0, np.abs(joints))
        off_pole = np.sqrt(np.maximum(self.measure_freedom(poses), convert_to_freedom(EXACT)))
        near = np.flatnonzero(off_pole < DISTINCT)
        first = joints[near, self.first]
        turned, still = (self.solve_with_first(poses[near], mode, first + by) for by in (_SLIGHTLY, 0.0))
        vague = blur[near, self.first] * DISTINCT / off_pole[near]
        blur[near] += np.nan_to_num(vague[:, None] * np.abs(turned - still) / _SLIGHTLY)
        return blur

    def find_reachable(self, joints: Array) -> Flags:
        """Find rows of joints (n, joints) that exist and whose second joint is within its range."""
        second = joints[:, self.second]
        reachable: Flags = find_finite_rows(joints) & (second >= self.drive.low) & (second <= self.drive.high)
        return reachable

    def cross_pole(self, poses: Array, mode: str, joints: Array, regular: Flags) -> None:
        """Let joints along a path (n, joints) go on over the pole in the other mode if that spares a swing; in place.

        A stretch stays as it is if the other mode takes the second joint out of its range there, or a leg out of reach.

        regular : (n,) rows off the pole
        """
        first = joints[:, self.first]
        at = np.flatnonzero(regular & np.isfinite(first))
        if not has_swing(first[at]):
            return
        here = joints[at][:, self.pair]
        other = solve_inverse(self.model, poses[at], self.other_mode(mode))
        across = find_crossings(here, other[:, self.pair])
        stretch = np.cumsum(np.diff(across, prepend=False))  # numbered; the odd ones are across
        across &= ~np.isin(stretch, stretch[across & ~self.find_reachable(other)])
        joints[at[across]] = other[across]

    def continue_joints(self, poses: Array, mode: str, before: tuple[Array, Array]) -> Array:
        """Solve the inverse problem of poses (n, axes), each going on from a row before.

        before : the poses and joints of these rows

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
        """Return joints (joints,) on the pole, the second one turned by ``angle``, rad, the way a mode stands for."""
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
