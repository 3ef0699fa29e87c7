"""The direct problem: poses for joints, never a silent wrong answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import NoMethodError, PoseError
from ..kernels.batch import Roots, run, run_checked, solve

if TYPE_CHECKING:
    from ..machine import Array, Machine

GOOD = 1e-9  # greatest closure error of an answer, mm in a machine of a metre
MOST_STEPS = 24
FREE = 1e-9  # rad: a tool that leans less has no C of its own, only rounding's
WITHIN_A_TURN = 6  # steps of half a radian at most, which can't leave the start's turn
CONTINUATIONS = (8, 64)  # parts of the way from a known pose, where Newton's method in one go fails


@dataclass(frozen=True, eq=False)
class Solution:
    """Poses with what is known of them; all have the joints' leading shape.

    poses : (..., axes), NaN where not converged; C of an upright tool is the near pose's, else 0
    residual : (...,) the greatest distance by which a leg fails to close there, mm
    converged : (...,) True where the legs close and the pose is of the same assembly mode as the start
    steps : (...,) Newton's steps; 0 in closed form
    """

    poses: Array
    residual: Array
    converged: Any
    steps: Any


def forward(machine: Machine, joints: ArrayLike, near: ArrayLike | None = None, method: str | None = None) -> Solution:
    """Poses for joints, (..., joints) -> :class:`Solution`.

    Parameters
    ----------
    joints : mm and rad
    near : poses (axes,) or (..., axes) to start from and to stay near; without them the machine's home, and its
        assembly mode (in closed form: its working mode first)
    method : ``"closed"`` (three spheres, two circles), ``"newton"``, or ``"constant"`` (the Jacobian of the start kept
        throughout: FME Transactions 41, (31)); by default the closed form where there is one, else Newton

    Newton's answer counts only if it lies in the start's assembly mode: where the determinant of A changes sign on the
    way the answer is sought once more along the joints' straight line from the start, and refused if that fails too.
    """
    rows, lead = machine.rows(joints, machine.joints, "joints")
    starts = None
    if near is not None:
        start_rows, start_lead = machine.rows(near, machine.axes, "near")
        if start_lead == lead:
            starts = start_rows
        else:
            try:
                wide = np.broadcast_to(start_rows.reshape(*start_lead, len(machine.axes)), (*lead, len(machine.axes)))
            except ValueError:
                raise PoseError(f"near: shape {(*lead, len(machine.axes))} expected, not {np.shape(near)}") from None
            starts = np.ascontiguousarray(wide.reshape(-1, len(machine.axes)))
    if method is None:
        method = "closed" if machine.model.by_spheres else "newton"
    if method == "closed":
        found = _closed(machine, rows, starts)
    elif method == "newton":
        found = _newton(machine, rows, starts)
    elif method == "constant":
        found = _constant(machine, rows, starts)
    else:
        raise PoseError(f'method {method!r}: "closed", "newton" or "constant" expected')
    poses, residual, converged, steps = found
    if not converged.all():
        poses[~converged] = np.nan
    if machine.axes[3:] == ("B", "C"):
        along_z = np.abs(poses[:, 3] - 0.5 * np.pi) > 0.5 * np.pi - FREE
        poses[along_z, 4] = 0.0 if starts is None else starts[along_z, 4]
    elif steps.max(initial=0) > WITHIN_A_TURN:
        _count_turns(machine, poses, machine.home if starts is None else starts)
    return Solution(
        poses.reshape(*lead, len(machine.axes)),
        residual.reshape(lead)[()],
        converged.reshape(lead)[()],
        steps.reshape(lead)[()],
    )


def _count_turns(machine: Machine, poses: Array, near: Array) -> None:
    """Bring the angles of a free platform to B within ±90° and within half a turn of those near by; in place."""
    angles = {axis: poses[:, i] for i, axis in enumerate(machine.axes) if axis in "ABC"}
    if len(angles) == 3:
        b = angles["B"]
        b -= 2.0 * np.pi * np.round(b / (2.0 * np.pi))
        over = np.abs(b) > 0.5 * np.pi
        b[over] = np.copysign(np.pi, b[over]) - b[over]
        angles["A"][over] += np.pi
        angles["C"][over] += np.pi
        del angles["B"]
    for axis, angle in angles.items():
        angle -= 2.0 * np.pi * np.round((angle - near[..., machine.axes.index(axis)]) / (2.0 * np.pi))


_Found = tuple["Array", "Array", NDArray[np.bool_], NDArray[np.int32]]


def tolerance(machine: Machine) -> float:
    """Greatest closure error of an answer, mm: rounding grows with the machine."""
    return GOOD * max(1.0, max(machine.model.sizes) / 1000.0)


def poses_of(machine: Machine, coordinates: Array, joints: Array) -> Array:
    """Poses for the motion's coordinates and the joints of head and table."""
    return run(machine.model.end_tape(), coordinates, np.empty((len(joints), len(machine.axes))), joints)


def roots(
    machine: Machine,
    near: Array,
    joints: Array,
    *,
    most: int = MOST_STEPS,
    poses: bool = True,
    side: Array | None = None,
) -> Roots:
    """Newton on the closures from ``near`` (1 or N rows), poses or else the motion's coordinates, to the same kind.

    ``most`` = 0 only looks at the start. ``side`` tells the side of the singularities to end on, as
    :func:`side_of` gives it; by default that of the start.
    """
    model = machine.model
    size = max(model.sizes)
    # A step goes a third of the legs' size or half a radian at most.
    caps = np.array([size / 3.0 if word.startswith("t") else 0.5 for word in model.structure.coordinates])
    tapes = model.begin_tape(poses), model.newton_tape(True), model.newton_tape(False), model.end_tape(poses)
    return solve(
        tapes, np.ascontiguousarray(near), joints, caps, min(model.sizes), most, np.empty(0) if side is None else side
    )


def _closed(machine: Machine, joints: Array, starts: Array | None) -> _Found:
    model = machine.model
    if not model.by_spheres:
        raise NoMethodError(f"{machine.name}: no closed form of the direct problem; use method='newton'")
    poses = np.empty((len(joints), len(machine.axes)))
    if starts is None:
        residual = _in_the_working_mode(machine, joints, poses)
    else:
        residual = run_checked(model.spheres_tape(None), joints, poses, starts)
    return poses, residual, residual <= tolerance(machine), np.zeros(len(joints), np.int32)


def _in_the_working_mode(machine: Machine, joints: Array, poses: Array) -> Array:
    """Residuals; into ``poses`` of the two common points that on home's side, or, where only the other one has these
    joints in the machine's own working mode, that one."""
    model, nothing = machine.model, np.empty((len(joints), 0))
    residual = run_checked(model.spheres_tape(model.home_side), joints, poses, nothing)
    if not model.has_modes:
        return residual
    legs = len(model.drives) - model.serial

    def out_of_mode(found: Array, given: Array) -> NDArray[np.bool_]:
        off = np.abs(machine.inverse(found) - given)[:, :legs].max(1)
        fits: NDArray[np.bool_] = off <= 1e3 * tolerance(machine)
        return ~fits

    lost = np.flatnonzero(out_of_mode(poses, joints) & np.isfinite(residual))
    if len(lost):
        given = joints[lost]
        other = np.empty((len(lost), poses.shape[1]))
        found = run_checked(model.spheres_tape(-model.home_side), given, other, nothing[lost])
        fit = ~out_of_mode(other, given)
        poses[lost[fit]], residual[lost[fit]] = other[fit], found[fit]
    return residual


def side_of(machine: Machine, poses: Array) -> Array:
    """The determinant of the closures' derivatives at poses, (N,): its sign tells the assembly mode."""
    return roots(machine, poses, machine.inverse(poses), most=0, side=np.ones(1)).turned


def _newton(machine: Machine, joints: Array, starts: Array | None) -> _Found:
    near = machine.home[None, :] if starts is None else starts
    result = roots(machine, near, joints, side=side_of(machine, near) if starts is None else None)
    good = (result.residual <= tolerance(machine)) & (result.turned > 0.0)
    if not good.all():
        _continue(machine, near, joints, result, good)
    return result.found, result.residual, good, result.steps


def _continue(machine: Machine, near: Array, joints: Array, result: Roots, good: NDArray[np.bool_]) -> None:
    """Seek what Newton in one go did not find along the joints' line from the start; mends ``result`` and ``good``."""
    whole = np.isfinite(joints).all(1) & np.isfinite(near).all(1)
    for parts in CONTINUATIONS:
        lost = np.flatnonzero(~good & whole)
        if not len(lost):
            return
        walk = np.broadcast_to(near if len(near) == 1 else near[lost], (len(lost), near.shape[1]))
        begin = machine.inverse(walk)
        side = side_of(machine, np.ascontiguousarray(walk))
        with np.errstate(invalid="ignore", over="ignore"):
            for part in range(1, parts + 1):
                step = roots(machine, walk, begin + (part / parts) * (joints[lost] - begin), side=side)
                walk = step.found
                result.steps[lost] += step.steps
            fine = (step.residual <= tolerance(machine)) & (step.turned > 0.0)
        result.found[lost[fine]], result.residual[lost[fine]] = walk[fine], step.residual[fine]
        good[lost[fine]] = True


def _constant(machine: Machine, joints: Array, starts: Array | None) -> _Found:
    """x ← x + J⁻¹·(d - d(x)) with the Jacobian of the start, FME Transactions 41, (31); steps to 1 µm in every leg."""
    model = machine.model
    legs = len(model.drives) - model.serial
    m = len(model.structure.coordinates)
    tape = model.legs_tape(machine.mode)
    given = machine.home[None, :] if starts is None else starts
    wide = np.ascontiguousarray(np.broadcast_to(given, (len(joints), given.shape[1])))
    y = run(model.begin_tape(), wide, np.empty((len(joints), m)), joints)
    both = run(tape, y, np.empty((len(y), legs + legs * m)))
    singular = ~np.isfinite(both).all(1)
    matrices = both[:, legs:].reshape(-1, legs, m).copy()
    matrices[singular] = np.eye(m)
    inverse = np.linalg.pinv(matrices)
    steps = np.zeros(len(y), np.int32)
    with np.errstate(invalid="ignore", over="ignore"):
        for _ in range(200):
            off = joints[:, :legs] - both[:, :legs]
            going = np.abs(off).max(1, initial=0.0) > 1e-3
            if not going.any():
                break
            y[going] += np.einsum("nij,nj->ni", inverse[going], off[going])
            steps[going] += 1
            both = run(tape, y, np.empty((len(y), legs + legs * m)))
        for _ in range(40):  # on to rounding, uncounted: the verdict is the same for every method
            y += np.einsum("nij,nj->ni", inverse, joints[:, :legs] - both[:, :legs])
            both = run(tape, y, np.empty((len(y), legs + legs * m)))
    residual = roots(machine, y, joints, most=0, poses=False).residual
    return poses_of(machine, y, joints), residual, residual <= tolerance(machine), steps
