"""Which poses to measure: a D-optimal choice, by greedy selection and Fedorov's exchange."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arguments import check_arguments
from ..arrays import Array, Indices
from ..errors import PoseError
from ..machine import Machine
from ..workspaces.sampled.allowed_poses import sample_allowed_poses
from .calibration import CalibrationProblem, choose_family
from .identifiability import Combination, UnidentifiableError
from .linearised import MeasuredFamily
from .measurements import Noise, make_measurements

_CANDIDATES = 800
_EXCHANGES = 3  # passes over all chosen poses
_BEGIN = 1e-6  # of the information: what makes the first choices regular
_MOST = 400


@dataclass(frozen=True, eq=False)
class MeasurementPlan:
    """Poses to measure.

    machine : the one to measure
    poses, joints : (N, axes) and (N, joints), mm and rad, inside all limits
    axes : what is measured there
    combinations : of the numbers that such measurements tell, the least known first
    error : root mean square of the tool's error after the calibration, over the workspace and all directions, mm; a
        turn counts at the greatest leg's length
    """

    machine: Machine
    poses: Array
    joints: Array
    axes: tuple[str, ...]
    combinations: list[Combination]
    error: float

    def __repr__(self) -> str:
        return f"<parakin measurement plan for {self.machine.name}: {len(self.poses)} poses, error {self.error:.3g} mm>"


@check_arguments
def plan_measurements(
    machine: Machine,
    count: int,
    free: Sequence[str] | None = None,
    axes: str | None = None,
    noise: Noise | None = None,
    seed: int = 0,
) -> MeasurementPlan:
    """Plan measurements whose information on a machine's numbers has the greatest determinant, of poses inside limits.

    machine : whose limits and nominal numbers the plan is for
    count : how many poses
    free, noise : as of :func:`calibrate`
    axes : what will be measured: all axes (by default), or some of X, Y and Z
    seed : of the random candidates, among which the poses are chosen

    Raises :class:`UnidentifiableError` where no such measurements tell the numbers apart, :class:`PoseError` where the
    poses are too few.
    """
    if not 1 <= count <= _MOST:
        raise PoseError(f"count: a number from 1 to {_MOST} expected, not {count}")
    choice = choose_family(machine, free)
    poses = sample_allowed_poses(machine, _CANDIDATES, seed + 1)
    joints = machine.inverse(poses)
    names = axes or " ".join(machine.axes)
    columns = [machine.axes.index(axis) for axis in names.split() if axis in machine.axes]
    measured = make_measurements(machine, joints, poses[:, columns], axes=names, noise=noise)
    problem = CalibrationProblem(MeasuredFamily(choice.family, measured, poses), choice.effects)
    problem.refuse_unknown(problem.find_combinations())
    scaled = np.einsum("ncd,ndk->nck", problem.weights, problem.at_nominal.slopes) * problem.scales
    rows = choose_rows(scaled, count)
    chosen = problem.take(rows)
    chosen.check_count()
    combinations = chosen.find_combinations()
    try:
        chosen.refuse_unknown(combinations)
    except UnidentifiableError as error:
        raise UnidentifiableError(f"{count} poses are too few: {error}") from None
    spread = sum(c.amplification**2 for c in combinations) ** 0.5 * measured.noise.length
    return MeasurementPlan(machine, poses[rows], joints[rows], measured.axes, combinations, spread)


def choose_rows(slopes: Array, count: int) -> Indices:
    """Choose rows of weighed slopes (N, c, k) whose information Σ JᵀJ has the greatest determinant."""
    _, width, unknown = slopes.shape
    information = np.einsum("nci,ncj->ij", slopes, slopes) * _BEGIN
    one, chosen = np.eye(width), list[int]()

    def choose_best(matrix: Array, taken_rows: list[int]) -> int:
        """Choose the row that multiplies the determinant most."""
        solved = np.linalg.solve(matrix, slopes.reshape(-1, unknown).T).T.reshape(slopes.shape)
        gains = np.linalg.det(one + np.einsum("nci,ndi->ncd", slopes, solved))
        gains[taken_rows] = -np.inf
        return int(gains.argmax())

    for _ in range(count):
        chosen.append(choose_best(information, chosen))
        information = information + slopes[chosen[-1]].T @ slopes[chosen[-1]]
    for _ in range(_EXCHANGES):
        before = list(chosen)
        for i, row in enumerate(before):
            information = information - slopes[row].T @ slopes[row]
            chosen[i] = choose_best(information, chosen[:i] + chosen[i + 1 :])
            information = information + slopes[chosen[i]].T @ slopes[chosen[i]]
        if chosen == before:
            break
    return np.array(sorted(chosen), np.int64)
