"""Calibration: the numbers of a machine that explain measurements best, how well they are known, and what is not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..arguments import check_arguments
from ..arrays import Array, Indices
from ..errors import PoseError
from ..families.family import Family, select_parameters
from ..machine import Machine
from ..model.geometric_parameters import SIZES, Parameter
from ..workspaces.sampled.allowed_poses import sample_allowed_poses
from .identifiability import (
    AMPLIFIED,
    Combination,
    UnidentifiableError,
    choose_independent,
    compute_scales,
    find_combinations,
    format_names,
    project_out,
)
from .linearised import Linearised, MeasuredFamily
from .measurements import Measurements, MeasuringFrame, make_measurements
from .setups import FixedPoint, InstrumentFrame, Setup, build_instrument_frame

Loss = Literal["linear", "soft_l1"]
_OUTLIER = 3.0  # standard deviations: beyond these a robust loss grows as the residual, not as its square
_FAR_OUT = 5.0  # standard deviations of an outlier that is told
_FOLDS = 5
_SEED = 0
_STRUCTURAL = 60  # poses that show which numbers no measurement of poses tells apart
# The last are left out first.
_ORDER = (SIZES, "rods", "encoders", "feet", "platform", "rails", "mounting", "head", "table")
_NO_POSE = 1e6  # standard deviations: the residual of a machine that has no pose


@dataclass(frozen=True, eq=False)
class Calibration:
    """The machine of a family that explains measurements best.

    family : of the numbers that were sought
    sizes, covariance : (k,) mm and rad, and (k, k), of the noise that was stated, or of ``fit`` times as much where
        that is more
    fixed : numbers that others replace whatever is measured of poses; they keep their values
    setups : what measured, each with the numbers that were found of it, mm and rad; ``frame`` and ``centre`` tell them
    measured : what they were found from
    residuals : (N, c) measured less predicted, mm and rad; of whole poses the twist
    before : (N, c) the same with the machine as it was
    fit, held_out : root mean square of the weighed residuals, one if noise and machine are what was stated; of rows
        that the fit knew, and of rows that it did not (5 folds)
    outliers : rows with a weighed residual beyond 5
    combinations : of the numbers, the least known first
    """

    family: Family
    sizes: Array
    covariance: Array
    fixed: tuple[str, ...]
    setups: list[tuple[Setup, Array]]
    measured: Measurements
    residuals: Array
    before: Array
    fit: float
    held_out: float
    outliers: tuple[int, ...]
    combinations: list[Combination]

    def __repr__(self) -> str:
        return (
            f"<parakin calibration of {self.family.machine.name}: {len(self.sizes)} numbers from "
            f"{len(self.measured.joints)} measurements, held-out residual {self.held_out:.3g}>"
        )

    @cached_property
    def machine(self) -> Machine:
        """The calibrated machine."""
        return self.family.at(self.sizes)

    @property
    def frame(self) -> Array | None:
        """The transform (3, 4), R and mm, from the instrument's frame to the machine's; None if it was not sought."""
        numbers = self._find_unknown(InstrumentFrame)
        return None if numbers is None else build_instrument_frame(numbers)

    @property
    def centre(self) -> Array | None:
        """The point of measured distances (3,), mm, in the machine's frame; None where that was not sought."""
        numbers = self._find_unknown(FixedPoint)
        return numbers if numbers is not None and len(numbers) else None

    def _find_unknown(self, kind: type) -> Array | None:
        return next((numbers for setup, numbers in self.setups if isinstance(setup, kind)), None)

    @cached_property
    def error(self) -> float:
        """The tip's error that the covariance predicts over the workspace, root mean square, mm."""
        poses = sample_allowed_poses(self.family.machine, _STRUCTURAL, _SEED)
        tip = sum(axis in "XYZ" for axis in self.family.machine.axes)
        return float(np.sqrt((self.predict_deviations(poses)[:, :tip] ** 2).sum(1).mean()))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The numbers found, with their standard deviations."""
        deviations = np.sqrt(np.diag(self.covariance)).tolist()
        rows = zip(self.family.parameters, self.sizes.tolist(), deviations, strict=True)
        return tuple(Parameter(p.name, p.unit, value, p.group, deviation) for p, value, deviation in rows)

    def predict_deviations(self, poses: Array) -> Array:
        """Predict the standard deviations (N, n) of the tool's twist, mm and rad.

        poses : (N, axes), mm and rad
        """
        joints = self.family.inverse(poses, self.sizes)
        slopes = self.family.twist_rates(poses, joints, self.sizes).compute_size_rates()
        return np.asarray(np.sqrt(np.einsum("nik,kl,nil->ni", slopes, self.covariance, slopes)))


@check_arguments
def calibrate(
    machine: Machine,
    measured: Measurements,
    free: Sequence[str] | None = None,
    loss: Loss = "soft_l1",
) -> Calibration:
    """Calibrate a machine: weighed least squares of what was measured less what the machine of other numbers predicts.

    machine : as it was built, with its nominal numbers
    measured : of :func:`make_measurements`
    free : names, patterns or groups of :attr:`Machine.parameters` that may change; by default all that some measurement
        of poses can tell
    loss : ``soft_l1`` bounds the pull of outliers, ``linear`` is plain least squares

    Raises :class:`UnidentifiableError` where the measurements can't tell these numbers apart, :class:`PoseError` where
    they are too few, or have no pose.
    """
    choice = choose_family(machine, free, measured.frame)
    family, fixed = choice.family, choice.fixed
    problem = CalibrationProblem(MeasuredFamily(family, measured), choice.effects)
    problem.check_count()
    combinations = problem.find_combinations()
    problem.refuse_unknown(combinations)
    solution, unknown = problem.solve(loss)
    at = problem.measured.linearise(solution, unknown)
    weighed = problem.weigh(at)
    rows = (weighed**2).sum(1)
    freedom = max(weighed.size - len(solution) - len(unknown), 1)
    fit = float(np.sqrt(rows.sum() / freedom))
    matrix = np.hstack([problem.weigh_slopes(at), problem.weigh_unknown(at)])
    every: Array = np.linalg.inv(np.asarray(matrix.T @ matrix, np.float64))
    covariance = every[: len(solution), : len(solution)] * max(1.0, fit) ** 2
    return Calibration(
        family,
        solution,
        covariance,
        fixed,
        list(zip(problem.measured.setups, problem.measured.split(unknown), strict=True)),
        measured,
        at.residuals,
        problem.at_nominal.residuals,
        fit,
        problem.validate(loss),
        tuple(np.flatnonzero(np.abs(weighed).max(1) > _FAR_OUT).tolist()),
        combinations,
    )


class FamilyChoice(NamedTuple):
    """The numbers to seek.

    fixed : names of the others, which keep their values
    effects : (poses, n, k) of the numbers on the tool over the workspace, mm; of turns at the greatest leg's length
    """

    family: Family
    fixed: tuple[str, ...]
    effects: Array


def choose_family(machine: Machine, free: Sequence[str] | None, frame: MeasuringFrame = "machine") -> FamilyChoice:
    """Choose the numbers to seek: of those that replace each other whatever is measured of poses, the first ones.

    In an instrument's own frame that is of the tip's places, and those that move the whole machine keep their values.
    """
    geometric = [p.name for p in machine.parameters if p.group != SIZES]
    parameters = select_parameters(machine, geometric if free is None else free)
    ordered = sorted(parameters, key=lambda p: _ORDER.index(p.group))
    every = Family(machine, ordered)
    poses = sample_allowed_poses(machine, _STRUCTURAL, _SEED)
    rates = every.twist_rates(poses, machine.inverse(poses), every.nominal).compute_size_rates()
    tip = sum(axis in "XYZ" for axis in machine.axes)
    rates *= np.where(np.arange(rates.shape[1]) >= tip, max(machine.leg_sizes), 1.0)[:, None]
    known = np.isfinite(rates).all((1, 2))
    rates, poses = rates[known], poses[known]
    slopes = rates if frame == "machine" else rates[:, :tip]
    columns = slopes.reshape(-1, len(ordered)) * compute_scales(machine, ordered)
    moves = _list_moves(machine, poses) if frame == "instrument" else np.empty((len(columns), 0))
    chosen, left = choose_independent(np.hstack([moves, columns]))
    chosen, left = chosen[chosen >= moves.shape[1]] - moves.shape[1], left - moves.shape[1]
    if not len(chosen):
        raise PoseError("free: no number of these moves the tool")
    fixed = tuple(ordered[i].name for i in left)
    return FamilyChoice(Family(machine, [ordered[i] for i in chosen]), fixed, rates[:, :, chosen])


def _list_moves(machine: Machine, poses: Array) -> Array:
    """List what small motions of the whole machine do to the tips, (3 poses, 6)."""
    tips = poses[:, [machine.axes.index(axis) for axis in "XYZ"]]
    frame = InstrumentFrame(tips, tips)
    return np.reshape(frame.predict(tips, frame.begin).by_unknown, (-1, len(frame.begin)))


class CalibrationProblem:
    """Least squares of a family's sizes, and of the unknown numbers of what measured."""

    def __init__(self, measured: MeasuredFamily, effects: Array):
        self.measured, self.family, self.effects = measured, measured.family, effects
        self.begin = measured.begin
        self.at_nominal = measured.linearise(self.family.nominal, self.begin)
        if not np.isfinite(self.at_nominal.slopes).all():
            row = int((~np.isfinite(self.at_nominal.slopes).all((1, 2))).argmax()) + 1
            raise PoseError(f"joints: row {row} is a singular pose, where a measurement says nothing of the machine")
        self.weights = measured.compute_weights(self.at_nominal)
        self.scales = compute_scales(self.family.machine, self.family.parameters)

    def weigh(self, at: Linearised) -> Array:
        return np.asarray(np.einsum("ncd,nd->nc", self.weights, at.residuals))

    def weigh_slopes(self, at: Linearised) -> Array:
        return np.vstack(np.einsum("ncd,ndk->nck", self.weights, at.slopes))

    def weigh_unknown(self, at: Linearised) -> Array:
        return np.vstack(np.einsum("ncd,ndk->nck", self.weights, at.unknown))

    def check_count(self) -> None:
        """Refuse fewer numbers measured than sought."""
        count, sought = self.at_nominal.residuals.size, len(self.scales) + len(self.begin)
        if count < sought:
            rows = len(self.at_nominal.residuals)
            needed = -(-sought // self.at_nominal.residuals.shape[1])
            measured = f"{rows} measurement{'s' * (rows != 1)} of {count} numbers"
            raise PoseError(f"{measured} for {sought} unknown ones, {needed} or more expected")

    def find_combinations(self) -> list[Combination]:
        return self._combine(self.own_slopes)

    def _combine(self, slopes: Array) -> list[Combination]:
        return find_combinations(self.family, slopes, self.effects, self.measured.measured.noise.length)

    @cached_property
    def own_slopes(self) -> Array:
        """The weighed slopes of what is measured, (rows, k), those of what measured projected out."""
        return project_out(self.weigh_slopes(self.at_nominal), self.weigh_unknown(self.at_nominal))

    def refuse_unknown(self, combinations: Sequence[Combination]) -> None:
        """Refuse measurements that leave a combination of the numbers unknown, and name one that would tell it."""
        unknown = [c for c in combinations if c.amplification > AMPLIFIED]
        if not unknown:
            return
        worst = unknown[0]
        known = "at all" if np.isinf(worst.amplification) else f"(noise is amplified {worst.amplification:.0f} times)"
        more = f", and {len(unknown) - 1} more combinations" if len(unknown) > 1 else ""
        raise UnidentifiableError(
            f"{self.measured.measured.describe()} can't tell {format_names(worst.names)} apart {known}{more}; "
            f"{self._suggest_measurement()}"
        )

    def _suggest_measurement(self) -> str:
        """Name the least that would have to be measured besides, at the same joints."""
        measured, machine = self.measured.measured, self.family.machine
        tip = " ".join(axis for axis in machine.axes if axis in "XYZ")
        where = " in the machine's frame" if measured.frame == "instrument" else ""
        others = [(f"measure {axis} of the tool too", axis) for axis in tip.split() if axis not in measured.axes]
        others.append((f"measure {tip.replace(' ', ', ')} of the tool{where}", tip))
        if len(machine.axes) > len(tip.split()):
            others.append((f"measure the whole pose of the tool{where}", " ".join(machine.axes)))
        known = set() if where else set(measured.axes)
        for text, axes in others:
            if known.issuperset(axes.split()):
                continue  # measured again it would tell no more than a better noise
            columns = [machine.axes.index(axis) for axis in axes.split()]
            values = self.measured.starts[:, columns]
            more = make_measurements(machine, measured.joints, values, axes, noise=measured.noise)
            try:
                other = CalibrationProblem(MeasuredFamily(self.family, more, self.measured.starts), self.effects)
            except PoseError:  # a pose of these numbers is missing: the next measurement needs none
                continue
            if self._combine(np.vstack([self.own_slopes, other.own_slopes]))[0].amplification <= AMPLIFIED:
                return text
        return "measure at more joints, farther apart (--plan chooses them), or free less numbers"

    def solve(self, loss: Loss) -> tuple[Array, Array]:
        """Solve for the sizes (k,) and the setups' numbers (u,), by Gauss' and Newton's method in a trust region."""
        k = len(self.scales)
        turn = 1.0 / max(self.family.machine.leg_sizes)
        scales = np.concatenate([self.scales, np.where(self.measured.turns, turn, 1.0)])
        begin = np.concatenate([self.family.nominal, self.begin])

        @lru_cache(maxsize=2)
        def locate_at(content: bytes) -> Linearised:
            x = np.frombuffer(content)
            point = begin + x * scales
            return self.measured.linearise(point[:k], point[k:])

        def locate(x: Array) -> Linearised:
            return locate_at(x.tobytes())

        def compute_residuals(x: Array) -> Array:
            return np.nan_to_num(self.weigh(locate(x)), nan=_NO_POSE).ravel()

        def compute_slopes(x: Array) -> Array:
            at = locate(x)
            slopes: Array = -np.hstack([self.weigh_slopes(at), self.weigh_unknown(at)]) * scales
            return np.asarray(np.nan_to_num(slopes), np.float64)

        result = least_squares(
            compute_residuals, np.zeros(len(begin)), compute_slopes, loss=loss, f_scale=_OUTLIER, xtol=1e-11, ftol=1e-11
        )
        if not np.isfinite(self.weigh(locate(result.x))).all():
            raise PoseError("the numbers that explain the measurements best leave some of them without a pose")
        point: Array = np.asarray(begin + result.x * scales, np.float64)
        return point[:k], point[k:]

    def take(self, rows: Indices) -> CalibrationProblem:
        """Take the problem of some of the measurements."""
        measured = self.measured
        own = MeasuredFamily(self.family, measured.measured.take(rows), measured.starts[rows], measured.setups)
        return CalibrationProblem(own, self.effects)

    def validate(self, loss: Loss) -> float:
        """Compute the root mean square of weighed residuals of rows that the fit did not know; NaN of too few rows."""
        measured = self.measured.measured
        order = np.random.default_rng(_SEED).permutation(len(measured.joints))
        squares = []
        for fold in np.array_split(order, _FOLDS):
            rest = np.sort(np.setdiff1d(order, fold))
            if not len(fold) or len(rest) * self.at_nominal.residuals.shape[1] <= len(self.scales) + len(self.begin):
                return float("nan")
            sizes, unknown = self.take(rest).solve(loss)
            squares.append(self.weigh(self.measured.linearise(sizes, unknown))[fold] ** 2)
        return float(np.sqrt(np.concatenate(squares).mean()))
