"""Performance indices at poses: amplification of velocity and force, condition number, manipulability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, find_finite_matrices
from ..machine import Machine
from .characteristic_length import CharacteristicLength, choose_characteristic_length
from .jacobians import ScaledRates, compute_scaled_rates, list_twist_names
from .singularities import derive_margins, find_home_signs, list_margin_names

_SINGULAR = 1e-13  # singular values below this fraction of the greatest count as zero


@dataclass(frozen=True, eq=False)
class Performance:
    """Performance indices at poses (..., axes), in one unit: angles are multiplied by the characteristic length.

    J maps joints' rates to the tool's twist, t' = J q'. With more drives than freedoms only such rates q' go together
    as the pose's change asks for, q' = B⁻¹A t', and J is the pseudo-inverse of B⁻¹A. NaN where the machine is out of
    reach; a singularity gives infinity and zero.

    machine, length : the one that this is about, and what its angles are multiplied by
    twist : names of the twist's n components
    poses : (..., axes) mm and rad
    psi : (..., n) singular values of J, the greatest first: how much faster than the drives the tool moves; (8) of
        Chablat and Wenger (Chemnitz, 2000)
    directions : (..., n, n), a row for each of ``psi``: the direction, a unit twist in the order of ``twist``, of the
        velocity ellipsoid's semi-axis of that length (tool velocities for drive rates of size 1). The force ellipsoid
        (J⁻ᵀ: wrenches that drive forces of size 1 hold) has the same directions with the lengths 1/psi.
    margins : (..., margins) of singularities, named in ``margin_names``
    """

    machine: Machine
    length: CharacteristicLength
    twist: tuple[str, ...]
    margin_names: tuple[str, ...]
    poses: Array
    psi: Array
    directions: Array
    margins: Array

    @property
    def greatest(self) -> Array:
        """Greatest velocity amplification, (...,)."""
        return self.psi[..., 0]

    @property
    def least(self) -> Array:
        """Least velocity amplification, (...,); its reciprocal is the greatest amplification of force."""
        return self.psi[..., -1]

    @property
    def condition(self) -> Array:
        """Condition number of J, σmax/σmin, (...,): 1 at an isotropic pose, infinite at a singular one.

        It is the first (7) of Chablat and Wenger without the root printed there, for their σ are roots already.
        """
        return _divide_quietly(self.greatest, self.least)

    @property
    def manipulability(self) -> Array:
        """|det J|, the product of psi (Yoshikawa), (...,); NaN where J has both an infinite psi and a psi of zero."""
        with np.errstate(invalid="ignore", over="ignore"):
            return np.asarray(self.psi.prod(-1))

    @property
    def force(self) -> Array:
        """Force amplification along ``directions``: 1/psi, (..., n)."""
        return _divide_quietly(np.ones_like(self.psi), self.psi)

    def __repr__(self) -> str:
        return f"<parakin performance of {self.machine.name}: poses {self.poses.shape}>"


def _divide_quietly(x: Array, y: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return x / y


def compute_performance(
    machine: Machine, poses: ArrayLike, length: float | None = None, mode: str | None = None
) -> Performance:
    """Compute amplification, conditioning and singularity margins at poses.

    Parameters
    ----------
    poses : (..., axes), mm and rad; any leading shape
    length : characteristic length by which angles become mm, mm; by default by the rule of
        :func:`~.characteristic_length.choose_characteristic_length`
    mode : working mode

    Limits are not checked. Raises :class:`PoseError` for invalid poses, length or mode.
    """
    rows, lead = machine.rows(poses, machine.axes, "poses")
    mode, scale = machine.checked_mode(mode), choose_characteristic_length(machine, length)
    rates = compute_scaled_rates(machine, rows, scale, mode)
    margins = derive_margins(machine, rates, find_home_signs(machine, scale, mode))
    psi, directions = _compute_amplifications(rates)
    n = rows.shape[1]
    return Performance(
        machine,
        scale,
        list_twist_names(machine),
        list_margin_names(machine),
        rows.reshape(*lead, n),
        psi.reshape(*lead, n),
        directions.reshape(*lead, n, n),
        margins.reshape(*lead, margins.shape[1]),
    )


def _compute_amplifications(rates: ScaledRates) -> tuple[Array, Array]:
    """Compute psi (N, n), the greatest first, and their directions (N, n, n), by singular values of J or of J⁻¹."""
    a, b = rates.a, rates.b
    n = a.shape[2]
    if a.shape[1] > n:
        return _compute_redundant_amplifications(a, b)
    known = find_finite_matrices(a, b)
    a, b = (np.where(known[:, None, None], m, np.eye(n)) for m in (a, b))
    size_a, size_b = np.abs(np.linalg.det(a)), np.abs(np.linalg.det(b))
    backward = size_b >= size_a  # by the matrix that is farther from singular
    divisor, dividend = np.where(backward[:, None, None], b, a), np.where(backward[:, None, None], a, b)
    solvable = np.maximum(size_a, size_b) > 0.0
    u, s, v = np.linalg.svd(np.linalg.solve(np.where(solvable[:, None, None], divisor, np.eye(n)), dividend))
    both = ~solvable | (s[:, 0] * _SINGULAR > 1.0)  # legs and drives are singular together: J has no value at all
    s = np.where(s <= _SINGULAR * s[:, :1], 0.0, s)
    with np.errstate(divide="ignore"):
        psi = np.where(backward[:, None], 1.0 / s[:, ::-1], s)
    directions = np.where(backward[:, None, None], v[:, ::-1], u.swapaxes(1, 2))
    if both.any():
        psi[both], directions[both] = np.nan, np.nan
        psi[both, 0], psi[both, -1] = np.inf, 0.0
    psi[~known], directions[~known] = np.nan, np.nan
    return psi, directions


def _compute_redundant_amplifications(a: Array, b: Array) -> tuple[Array, Array]:
    """Compute psi and directions of J = (B⁻¹A)⁺, for more drives than freedoms, by the CS decomposition.

    Twists t' and drive rates q' that go together, A t' = B q', are the null space of (A, -B). In an orthonormal basis
    (T, Q) of it the singular values of T, c, and of Q, s, have c² + s² = 1, and psi = c/s.
    """
    n, rows = a.shape[2], a.shape[1]
    known = find_finite_matrices(a, b)
    both = np.where(known[:, None, None], np.concatenate([a, -b], 2), np.eye(rows, n + rows))
    _, sizes, v = np.linalg.svd(both)
    basis = v[:, rows:].swapaxes(1, 2)
    directions, c, _ = np.linalg.svd(basis[:, :n])
    s = np.linalg.svd(basis[:, n:], compute_uv=False)[:, ::-1]
    c, s = (np.where(size <= _SINGULAR, 0.0, size) for size in (c, s))
    with np.errstate(divide="ignore"):
        psi = c / s
    directions = directions.swapaxes(1, 2).copy()
    lost = sizes[:, -1] <= _SINGULAR * sizes[:, 0]  # legs and drives are singular together
    psi[lost], directions[lost] = np.nan, np.nan
    psi[lost, 0], psi[lost, -1] = np.inf, 0.0
    psi[~known], directions[~known] = np.nan, np.nan
    return psi, directions
