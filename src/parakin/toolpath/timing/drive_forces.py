"""The drives' forces and powers along a trajectory, by inverse dynamics."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arguments import RowsLike, check_arguments, read_rows
from ...arrays import Array, Indices
from ...dynamics.inverse_dynamics import WATT, Dynamics, Motion
from ...dynamics.masses import sum_masses
from ...errors import PoseError
from ...model.elements import Drive
from .force_limits import list_cutting_force
from .kernels.splines import PathState
from .trajectory import Trajectory

_BLOCK = 1 << 15  # states at a time
_FULL = 1.0 + 1e-3  # of a limit: what the planner keeps between the rows of a path is off by no more
_MOST_STATES = 6_000_000  # in memory


@dataclass(frozen=True, eq=False)
class DriveForces:
    """What a trajectory asks of the drives: in each piece of constant jerk at its start, its middle and its end.

    trajectory : the motion
    force : (translations,) N, that acts on the tool's tip at programmed feeds, along the pose's axes; not in rapid
    times : (N,) s
    forces : (N, joints) N along a joint, Nmm about one; positive drives the joint up
    powers : (N, joints) W; negative where the drive brakes
    rms : (joints,) root of the mean square of the forces over the trajectory's time
    masses : kg, of all that moves, by kinds of bodies
    """

    trajectory: Trajectory
    force: Array
    times: Array
    forces: Array
    powers: Array
    rms: Array
    masses: dict[str, float]

    @property
    def force_axes(self) -> tuple[str, ...]:
        """The axes that :attr:`force` is along."""
        return tuple(axis for axis in self.trajectory.posted.machine.axes if axis in "XYZ")

    @property
    def peaks(self) -> Array:
        """The greatest force of each drive, either way, (joints,) N along a joint, Nmm about one."""
        return np.asarray(np.abs(self.forces).max(axis=0))

    @property
    def peak_powers(self) -> Array:
        """The greatest power of each drive, either way, (joints,) W."""
        return np.asarray(np.abs(self.powers).max(axis=0))

    @property
    def force_use(self) -> Array:
        """The greatest force of each drive over its limit, (joints,); 0 where its file gives none."""
        return np.asarray(self.peaks / np.array([drive.force for drive in self._drives]))

    @property
    def rated_use(self) -> Array:
        """The rms of each drive over what it may be, (joints,); 0 where its file gives none."""
        return np.asarray(self.rms / np.array([drive.rated for drive in self._drives]))

    @property
    def power_use(self) -> Array:
        """The greatest power of each drive over its limit, (joints,); 0 where its file gives none."""
        return np.asarray(self.peak_powers / (WATT * np.array([drive.power for drive in self._drives])))

    @property
    def overloaded(self) -> tuple[str, ...]:
        """The joints whose drives would have to give more than their file says."""
        use = np.maximum(np.maximum(self.force_use, self.rated_use), self.power_use)
        return tuple(drive.name for drive, own in zip(self._drives, use, strict=True) if own > _FULL)

    @property
    def _drives(self) -> tuple[Drive, ...]:
        return self.trajectory.posted.machine.drives

    def describe_peak(self, joint: int) -> str:
        """Describe where on the path a drive's force is greatest.

        joint : its index
        """
        path_rows = self.trajectory.joint_path
        time = self.times[int(np.abs(self.forces[:, joint]).argmax())]
        row = int(np.searchsorted(self.trajectory.profile.row_times, time, "right")) - 1
        return path_rows.describe_step(min(row, len(path_rows.segment) - 1))

    def __repr__(self) -> str:
        return f"<parakin drive forces: {len(self.times)} states on {self.trajectory.posted.machine.name}>"


@check_arguments
def compute_drive_forces(trajectory: Trajectory, force: RowsLike | None = None) -> DriveForces:
    """Compute the drives' forces and powers along a trajectory: weights, inertia and a force on the tool.

    trajectory : :attr:`Job.trajectory`
    force : N by the machine's translations, (t,) or a dict, on the tool's tip at programmed feeds; by default
        :attr:`ToolPath.cutting_force`

    Bodies are of what the machine's file says (``bodies``), else of steel and aluminium and as thick as they are drawn.
    There is no friction; motors and screws count with the drives' ``inertia``.

    Raises :class:`PoseError` for a path of more than some millions of pieces, :class:`NoMethodError` where a leg's kind
    tells nothing of its bodies.
    """
    machine = trajectory.posted.machine
    acting = list_cutting_force(trajectory.posted)
    if force is not None:
        axes = tuple(axis for axis in machine.axes if axis in "XYZ")
        acting = read_rows(force, axes, ["mm"] * len(axes), lambda: np.zeros(len(axes)), "force")
        if acting.shape != (len(axes),) or not np.isfinite(acting).all():
            raise PoseError(f"force: one number each for {' '.join(axes)} expected")
    motion = TimedMotion(trajectory, acting)
    dynamics = Dynamics(machine)
    forces, powers = (np.empty((len(motion.times), len(machine.joints))) for _ in range(2))
    for block, state, tip in motion.list_blocks():
        forces[block] = dynamics.compute_forces(state, tip)
        powers[block] = WATT * forces[block] * state.speeds
    if not np.isfinite(forces.sum()):
        raise PoseError("the tool passes a singular pose, where forces have no bound")
    rms = np.sqrt(motion.weights @ forces**2)
    return DriveForces(trajectory, acting, motion.times, forces, powers, rms, sum_masses(machine))


class TimedMotion:
    """The motion of a trajectory at the start, the middle and the end of each piece, N of them in all.

    acting : (translations,) N on the tip at programmed feeds
    times : (N,) s

    Raises :class:`PoseError` for a path of more than some millions of pieces.
    """

    def __init__(self, trajectory: Trajectory, acting: Array):
        self._trajectory, self._acting = trajectory, acting
        self.times, self._rows, self._state = _list_states(trajectory)
        if len(self.times) > _MOST_STATES:
            pieces = f"{len(self.times) // 3:,} pieces, at most {_MOST_STATES // 3:,} are possible"
            raise PoseError(f"a trajectory of {pieces}")

    def __repr__(self) -> str:
        return f"<parakin timed motion: {len(self.times)} states>"

    @cached_property
    def weights(self) -> Array:
        """The weights of values (N,) whose sum is their mean over the time, by Simpson's rule in each piece."""
        if not self._trajectory.seconds > 0.0:
            return np.full(len(self.times), 1.0 / len(self.times))
        spans = np.diff(self._trajectory.profile.time)[:, None] / self._trajectory.seconds
        return np.ravel(spans * np.array([1.0, 4.0, 1.0]) / 6.0)

    def list_blocks(self) -> Iterator[tuple[slice, Motion, Array]]:
        """Yield some states at a time: which they are, the motion, and the force on the tip (n, translations)."""
        trajectory, state = self._trajectory, self._state
        segment = trajectory.joint_path.segment[self._rows]
        cuts = ~trajectory.posted.path.rapid[trajectory.curve.record_of_piece[segment]]
        for begin in range(0, len(self.times), _BLOCK):
            block = slice(begin, begin + _BLOCK)
            own = PathState(state.row[block], state.shift[block], *(rate[block] for rate in state[2:]))
            yield block, _evaluate(trajectory, own), cuts[block, None] * self._acting


def _list_states(trajectory: Trajectory) -> tuple[Array, Indices, PathState]:
    """List times, rows and motion at the start, the middle and the end of each piece; of a single point, at rest."""
    profile = trajectory.profile
    if not len(profile.row):
        row, still = np.zeros(1, np.int64), np.zeros(1)
        return still, row, PathState(row, still, still, still)
    fractions = np.array([0.0, 0.5, 1.0])
    t = np.diff(profile.time)[:, None] * fractions
    v, a, e = (column[:, None] for column in (profile.speed, profile.acceleration, profile.jerk))
    shift = profile.shift[:, None] + t * (v + t * (0.5 * a + t * e / 6.0))
    row = np.repeat(profile.row, 3)
    shift = np.clip(shift.ravel(), 0.0, trajectory.joint_path.step[row])
    speed, acceleration = (v + t * (a + 0.5 * t * e)).ravel(), (a + t * e).ravel()
    times = (profile.time[:-1, None] + t).ravel()
    return times, row, PathState(row, shift, np.maximum(speed, 0.0), acceleration)


def _evaluate(trajectory: Trajectory, state: PathState) -> Motion:
    if not len(trajectory.profile.row):
        joints, still = trajectory.posted.joints[:1], np.zeros((1, len(trajectory.posted.machine.joints)))
        return Motion(trajectory.posted.poses[:1], joints, still, still)
    own = trajectory.joint_path.evaluate(state)
    return Motion(trajectory.joint_path.poses(state.row, state.shift), own.joints, own.speeds, own.accelerations)
