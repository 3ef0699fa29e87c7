"""Study's eight parameters of a rigid motion, and the legs' closures in them as quadrics.

A motion is a point x = (e, g) of projective space: the quaternion e turns, and 2·g·e*/|e|² moves. Its points lie on
Study's quadric e·g = 0 (Husty, An algorithm for solving the direct kinematics of general Stewart-Gough platforms,
1996). Quaternions have their real part first.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array


def make_left_product(a: Array) -> Array:
    """Make the matrices of v ↦ a·v for quaternions a, (..., 4): (..., 4, 4)."""
    w, x, y, z = np.moveaxis(np.asarray(a), -1, 0)
    rows = [[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def make_right_product(a: Array) -> Array:
    """Make the matrices of v ↦ v·a for quaternions a, (..., 4): (..., 4, 4)."""
    w, x, y, z = np.moveaxis(np.asarray(a), -1, 0)
    rows = [[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def compute_study_points(rotations: Array, origins: Array) -> Array:
    """Compute the parameters, (N, 8) with |e| = 1, of rotations (N, 3, 3) and origins (N, 3)."""
    r = np.asarray(rotations)
    xx, yy, zz = r[:, 0, 0], r[:, 1, 1], r[:, 2, 2]
    off = [r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]]
    on = [r[:, 2, 1] + r[:, 1, 2], r[:, 0, 2] + r[:, 2, 0], r[:, 1, 0] + r[:, 0, 1]]
    # Rows of 4·e·eᵀ; the one of the greatest component has no cancellation.
    rows = np.stack(
        [
            np.stack([1.0 + xx + yy + zz, *off], -1),
            np.stack([off[0], 1.0 + xx - yy - zz, on[2], on[1]], -1),
            np.stack([off[1], on[2], 1.0 - xx + yy - zz, on[0]], -1),
            np.stack([off[2], on[1], on[0], 1.0 - xx - yy + zz], -1),
        ],
        1,
    )
    greatest = np.einsum("nii->ni", rows).argmax(1)
    e = rows[np.arange(len(rows)), greatest]
    e = e / np.linalg.norm(e, axis=1, keepdims=True)
    moved = np.column_stack([np.zeros(len(e)), origins])
    return np.column_stack([e, 0.5 * np.einsum("nij,nj->ni", make_left_product(moved), e)])


def compute_frames(points: Array) -> tuple[Array, Array]:
    """Compute rotations (N, 3, 3) and origins (N, 3) of points (N, 8) on Study's quadric with e ≠ 0."""
    e, g = points[:, :4], points[:, 4:]
    square = (e * e).sum(1)
    conjugate = e * [1.0, -1.0, -1.0, -1.0]
    turn = make_left_product(e) @ make_right_product(conjugate)
    moved = 2.0 * np.einsum("nij,nj->ni", make_right_product(conjugate), g)
    return turn[:, 1:, 1:] / square[:, None, None], moved[:, 1:] / square[:, None]


def make_closure_quadrics(platform: Array) -> Array:
    """Make the quadrics of |p|², of p's three coordinates and of 1, each times |e|², (5, 8, 8) symmetric.

    p : a point of the platform in the base, ``platform`` (3,) in the platform
    """
    left = make_left_product(np.column_stack([np.zeros(3), np.eye(3)]))  # of the base's axes
    right = make_right_product(np.array([0.0, *platform]))
    one = np.zeros((8, 8), right.dtype)
    one[:4, :4] = np.eye(4)
    square = (platform @ platform) * one
    square[4:, 4:] = 4.0 * np.eye(4)
    _add_mixed(square, 4.0 * right)
    coordinates = np.zeros((3, 8, 8), right.dtype)
    for quadric, axis in zip(coordinates, left, strict=True):
        turned = axis.T @ right
        quadric[:4, :4] = 0.5 * (turned + turned.T)
        _add_mixed(quadric, 2.0 * axis)
    return np.concatenate([square[None], coordinates, one[None]])


def make_inverse_closure_quadrics(foot: Array) -> Array:
    """Make the quadrics of :func:`make_closure_quadrics` for a point of the base, ``foot`` (3,), in the platform."""
    inverse = np.array([1.0, -1.0, -1.0, -1.0] * 2)  # the inverse motion: both quaternions conjugated
    quadrics: Array = make_closure_quadrics(foot) * inverse[:, None] * inverse
    return quadrics


def _add_mixed(quadric: Array, mixed: Array) -> None:
    """Add gᵀ·mixed·e to a symmetric quadric, in place."""
    quadric[4:, :4] += 0.5 * mixed
    quadric[:4, 4:] += 0.5 * mixed.T
