"""The tool's error over the workspace, where numbers of a machine are within tolerances: deviations, budget, bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from ..arguments import RowsLike, check_arguments, check_positive
from ..arrays import Array
from ..errors import PoseError
from ..machine import Machine
from ..workspaces.sampled.allowed_poses import SAMPLES, choose_poses
from .tolerances import UNIFORM, Tolerance, ToleranceFamily, make_tolerance_family, read_tolerances

_STILL = 1e-12  # of the greatest slope of the tip by a number: what is rounding


@dataclass(frozen=True, eq=False)
class Accuracy:
    """The tool's error at poses, of machines whose numbers lie evenly within their tolerances, to the first order.

    tolerances : those given, and the family of the k numbers that have them
    poses, joints : (N, axes), (N, joints), mm and rad
    slopes : (N, n, k) of the tool's twist by the numbers, while the joints stand
    deviations : (N,) root mean square of the tip's error, mm
    turns : (N,) root mean square of the tool's turn, rad
    greatest : (N,) mm, a bound of the first order of the tip's error, all numbers at the worst ends of their tolerances
    shares : (N, tolerances) of the tip's variance
    """

    tolerances: ToleranceFamily
    poses: Array
    joints: Array
    slopes: Array
    deviations: Array
    turns: Array
    greatest: Array
    shares: Array

    def __repr__(self) -> str:
        half, most = (1e3 * self.percentile(percent) for percent in (50, 100))
        return (
            f"<parakin accuracy of {self.machine.name}: {len(self.poses)} poses, {half:.3g} um, at most {most:.3g} um>"
        )

    @property
    def machine(self) -> Machine:
        """The machine that this is about."""
        return self.tolerances.family.machine

    @property
    def worst(self) -> int:
        """The index in :attr:`poses` of the greatest deviation of the tip."""
        return int(self.deviations.argmax())

    def percentile(self, percent: float) -> float:
        """Compute a percentile over the poses of the tip's deviation, mm.

        percent : 0 to 100
        """
        return float(np.percentile(self.deviations, percent))

    @property
    def budget(self) -> list[tuple[Tolerance, float, float]]:
        """Each tolerance with its mean share of the variance and its share at the worst pose, the greatest first."""
        mean, worst = self.shares.mean(0).tolist(), self.shares[self.worst].tolist()
        rows = zip(self.tolerances.tolerances, mean, worst, strict=True)
        return sorted(rows, key=lambda row: -row[1])


@check_arguments
def analyse_accuracy(
    machine: Machine,
    tolerances: Mapping[str, str] | Sequence[tuple[str, str]],
    poses: RowsLike | None = None,
    samples: int = SAMPLES,
) -> Accuracy:
    """Analyse the tool's error where numbers of a machine lie evenly within tolerances.

    machine : with its nominal numbers
    tolerances : by names, patterns or groups of :attr:`Machine.parameters`, either way, with units: ``{"feet": "0.05
        mm", "rods": "0.02 mm", "encoders": "2 um"}``; each coordinate of a point has it
    poses : (N, axes), mm and rad; by default as many as ``samples`` all over the workspace, clear of singularities

    The joints stay those of the nominal machine. With more drives than freedoms the tool is where the closures' least
    squares are, as in :meth:`Machine.forward`.

    Raises :class:`PoseError` for a tolerance of no number, without a unit, or not above zero.
    """
    within = make_tolerance_family(machine, read_tolerances(tolerances))
    rows = choose_poses(machine, poses, samples)
    joints = machine.inverse(rows)
    rates = within.family.twist_rates(rows, joints, within.family.nominal)
    slopes = rates.compute_size_rates()
    tip = sum(axis in "XYZ" for axis in machine.axes)
    own = slopes * within.halves
    variances = (own[:, :tip] ** 2).sum(1) * UNIFORM**2
    by_group = np.stack([variances[:, columns].sum(1) for columns in within.groups], 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = by_group / by_group.sum(1, keepdims=True)
    turns = np.sqrt((own[:, tip:] ** 2).sum((1, 2))) * UNIFORM
    greatest = np.sqrt((np.abs(own[:, :tip]).sum(2) ** 2).sum(1))
    return Accuracy(within, rows, joints, slopes, np.sqrt(by_group.sum(1)), turns, greatest, shares)


@check_arguments
def allocate_tolerances(
    accuracy: Accuracy, error: float, costs: Mapping[str, float] | None = None
) -> tuple[Tolerance, ...]:
    """Find the tolerances of the least cost that keep the tip's deviation within an error at every pose, mm.

    accuracy : of :func:`analyse_accuracy`, at whose poses the error is kept
    error : root mean square of the tip's error, mm
    costs : for each tolerance's name, what a number that moves the tip costs at a tolerance of 1 mm or 1 rad: the cost
        goes with its inverse; by default 1, of an angle at the greatest leg's length

    Returns the tolerances with other values, mm and rad, in the order in which they were given. The cost is convex in
    their squares, in which the variance is linear.

    Raises :class:`PoseError` for an error that is not above zero, a cost of no tolerance, and a tolerance that does not
    move the tip.
    """
    if not 0.0 < error < np.inf:
        raise PoseError(f"error: a number above 0 mm expected, not {error:g}")
    within, size = accuracy.tolerances, max(accuracy.machine.leg_sizes)
    names = [tolerance.name for tolerance in within.tolerances]
    for name, cost in (costs or {}).items():
        if name not in names:
            raise PoseError(f"costs: unknown {name}, one of {', '.join(names)} expected")
        check_positive(f"costs {name}", cost)
    variances = accuracy.shares * accuracy.deviations[:, None] ** 2
    units = np.array([1.0 if tolerance.unit == "mm" else 1.0 / size for tolerance in within.tolerances])
    values = np.array([tolerance.value for tolerance in within.tolerances]) / units
    of_one = variances / values**2 / error**2
    if not (of_one.max(0) > 0.0).all():
        idle = names[int((of_one.max(0) == 0.0).argmax())]
        raise PoseError(f"tolerance {idle}: it does not move the tip, so any is allowed; leave it out")
    tip = sum(axis in "XYZ" for axis in accuracy.machine.axes)
    reach = np.abs(accuracy.slopes[:, :tip]).max((0, 1))
    counts = [np.count_nonzero(reach[columns] > _STILL * reach.max()) for columns in within.groups]
    weights = np.array([(costs or {}).get(name, 1.0) * count for name, count in zip(names, counts, strict=True)])
    # In logarithms of the tolerances: a sum of exponentials under bounds on sums of exponentials, both convex.
    begin = -0.5 * np.log(of_one.max(0) * len(names))
    result = minimize(
        lambda x: float(np.log(np.sum(weights * np.exp(-x)))),
        begin,
        jac=lambda x: -weights * np.exp(-x) / np.sum(weights * np.exp(-x)),
        method="SLSQP",
        constraints={
            "type": "ineq",
            "fun": lambda x: 1.0 - of_one @ np.exp(2.0 * x),
            "jac": lambda x: -2.0 * of_one * np.exp(2.0 * x),
        },
        options={"maxiter": 500, "ftol": 1e-12},
    )
    squares = np.exp(2.0 * result.x)
    squares /= max(float((of_one @ squares).max()), 1e-300)  # on the bound, whatever the rounding
    values = np.sqrt(squares) * units
    return tuple(
        tolerance._replace(value=value) for tolerance, value in zip(within.tolerances, values.tolist(), strict=True)
    )
