"""The direct problem: poses for joints, never a silent wrong answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import NoMethodError, PoseError
from .kernels.batch import run, solve

if TYPE_CHECKING:
    from .machine import Array, Machine

GOOD = 1e-9  # greatest closure error of an answer, mm in a machine of a metre
MOST_STEPS = 24
CONTINUATIONS = (8, 64)  # parts of the way from a known pose, where Newton's method in one go fails


@dataclass(frozen=True, eq=False)
class Solution:
    """Poses with what is known of them; all have the joints' leading shape.

    poses : (..., axes), NaN where not converged
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
        assembly mode
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
                wide = np.broadcast_to(start_rows.reshape(*start_lead, -1), (*lead, len(machine.axes)))
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
    poses[~converged] = np.nan
    return Solution(
        poses.reshape(*lead, -1), residual.reshape(lead)[()], converged.reshape(lead)[()], steps.reshape(lead)[()]
    )


_Found = tuple["Array", "Array", NDArray[np.bool_], NDArray[np.int64]]


def tolerance(machine: Machine) -> float:
    """Greatest closure error of an answer, mm: rounding grows with the machine."""
    return GOOD * max(1.0, max(machine.model.sizes) / 1000.0)


def poses_of(machine: Machine, coordinates: Array, joints: Array) -> Array:
    """Poses for the motion's coordinates and the joints of head and table."""
    return run(machine.model.pose_tape(), coordinates, np.empty((len(joints), len(machine.axes))), joints)


def closing(machine: Machine, coordinates: Array, joints: Array) -> tuple[Array, Array]:
    """Greatest closure error, mm, and the determinant of the closures' derivatives."""
    _, residual, _, det = solve(machine.model.newton_tape(), coordinates, joints, np.ones(coordinates.shape[1]), 0)
    return residual, det


def _closed(machine: Machine, joints: Array, starts: Array | None) -> _Found:
    model = machine.model
    if not model.by_spheres:
        raise NoMethodError(f"{machine.name}: no closed form of the direct problem; use method='newton'")
    out = np.empty((len(joints), len(model.structure.coordinates)))
    if starts is None:
        coordinates = run(model.spheres_tape(model.home_side), joints, out)
    else:
        coordinates = run(model.spheres_tape(None), joints, out, starts)
    residual, _ = closing(machine, coordinates, joints)
    poses = poses_of(machine, coordinates, joints)
    return poses, residual, residual <= tolerance(machine), np.zeros(len(joints), np.int64)


def _start(machine: Machine, starts: Array | None) -> Array:
    model = machine.model
    given = machine.home[None, :] if starts is None else starts
    return run(model.start_tape(), np.ascontiguousarray(given), np.empty((len(given), len(model.structure.coordinates))))


def _caps(machine: Machine) -> Array:
    """Greatest change of each coordinate in a step: a third of the legs' size, half a radian."""
    size = max(machine.model.sizes)
    return np.array([size / 3.0 if word.startswith("t") else 0.5 for word in machine.model.structure.coordinates])


def _newton(machine: Machine, joints: Array, starts: Array | None) -> _Found:
    tape, caps, limit = machine.model.newton_tape(), _caps(machine), tolerance(machine)
    y0 = _start(machine, starts)
    y, residual, steps, det = solve(tape, y0, joints, caps, MOST_STEPS)
    from_joints = machine.inverse(machine.home[None, :] if starts is None else starts)
    with np.errstate(invalid="ignore"):
        _, sign = closing(machine, y0, from_joints)
        good = (residual <= limit) & (det * sign > 0.0)
        for parts in CONTINUATIONS:
            lost = np.flatnonzero(~good & np.isfinite(joints).all(1) & np.isfinite(np.broadcast_to(sign, good.shape)))
            if not len(lost):
                break
            begin = from_joints if len(from_joints) == 1 else from_joints[lost]
            walk = np.ascontiguousarray(np.broadcast_to(y0 if len(y0) == 1 else y0[lost], (len(lost), y0.shape[1])))
            for part in range(1, parts + 1):
                target = begin + (part / parts) * (joints[lost] - begin)
                walk, error, more, turn = solve(tape, walk, target, caps, MOST_STEPS)
                steps[lost] += more
            fine = (error <= limit) & (turn * (sign if len(sign) == 1 else sign[lost]) > 0.0)
            y[lost[fine]], residual[lost[fine]] = walk[fine], error[fine]
            good[lost[fine]] = True
    return poses_of(machine, y, joints), residual, good, steps


def _constant(machine: Machine, joints: Array, starts: Array | None) -> _Found:
    """x ← x + J⁻¹·(d - d(x)) with the Jacobian of the start, FME Transactions 41, (31); steps to 1 µm in every leg."""
    model = machine.model
    legs = len(model.drives) - model.serial
    m = len(model.structure.coordinates)
    tape = model.legs_tape(machine.mode)
    y = np.ascontiguousarray(np.broadcast_to(_start(machine, starts), (len(joints), m))).copy()
    both = run(tape, y, np.empty((len(y), legs + legs * m)))
    singular = ~np.isfinite(both).all(1)
    matrices = both[:, legs:].reshape(-1, legs, m).copy()
    matrices[singular] = np.eye(m)
    inverse = np.linalg.pinv(matrices)
    steps = np.zeros(len(y), np.int64)
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
    residual, _ = closing(machine, y, joints)
    return poses_of(machine, y, joints), residual, residual <= tolerance(machine), steps
