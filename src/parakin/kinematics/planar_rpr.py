"""The planar 3-RPR problem in closed form: a triangle whose corners lie at given distances from three points.

Eliminating the place leaves a trigonometric polynomial in the turn, a sextic in its half angle's tangent, so there are
at most six solutions (Gosselin, Sefrioui and Richard, 1992).
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import NoMethodError
from .turns import wrap_angle

CONTINUUM = "the assemblies are a continuum here: the legs leave the platform free to move"
_SAMPLES = 16  # the polynomial has harmonics up to the fourth (which cancels), so nine would do
_BESIDE, _NARROWER, _CLOSEST = 1e-2, 0.1, 1e-12  # rad: turns that may be one root, at each look closer, and at the last
_NODES = np.cos(np.pi * (np.arange(9) + 0.5) / 9)  # of an interval, where the eliminant is looked at closer
_BESIDE_LINE = 0.1  # of half an interval: how far roots may leave it
_STEPS, _IDLE = 50, 4
_SINGULAR, _STRIDE = 1e-6, 1e-3  # of the greatest singular value, and of the size: what tells a continuum
_NEAR_PLANAR_STRIDE = 0.3  # of a stride: what closes farther from its end is another root
_FREE = 1e-11  # of the size: what closes so well a stride away is free to move


def solve_planar_rpr(centres: Array, radii: Array, corners: Array) -> Array:
    """Find all (x, y, φ), (k, 3), with |(x, y) + R(φ)·corner - centre| = radius for three centres, radii and corners.

    centres, corners : (3, 2), mm; radii : (3,), mm. Turns are in (-π, π].
    """
    size = float(np.abs(centres - centres[0]).max() + np.abs(corners).max() + np.abs(radii).max())
    angles = _find_turns(centres / size, radii / size, corners / size)
    starts = [start for angle in angles for start in _find_starts(angle, centres, radii, corners)]
    polished = [_polish_pose(start, centres, radii, corners) for start in starts]
    poses: list[Array] = []
    for error, pose in sorted(polished, key=lambda item: item[0]):  # of equal ones the best closed
        if error < 1e-11 * size and not any(_is_same(pose, other, size) for other in poses):
            poses.append(pose)
    if any(_is_in_continuum(pose, centres, radii, corners) for pose in poses):
        raise NoMethodError(CONTINUUM)
    return np.array(sorted(poses, key=lambda p: (p[2], p[0], p[1]))).reshape(-1, 3)


def _find_turns(centres: Array, radii: Array, corners: Array) -> Array:
    """Find turns near all at which the eliminant is zero, some more than once, for lengths of the order of one."""
    turns = 2.0 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    harmonics = np.fft.fft(_compute_eliminant(turns, centres, radii, corners)) / _SAMPLES
    top = 4
    scale = np.abs(harmonics).max()
    while top > 0 and abs(harmonics[top]) < 1e-13 * scale:
        top -= 1
    z = np.roots([harmonics[h] for h in range(top, -top - 1, -1)])  # of z^(h + top), z = exp(iφ)
    # A root of n leaves the unit circle by the n-th root of the rounding; the polishing decides.
    turns = -1j * np.log(z[np.abs(np.abs(z) - 1.0) < _BESIDE])
    turns = turns[np.argsort(turns.real)]
    if len(turns):  # none that lie together stand at both ends
        seam = int(np.argmax(np.diff(turns.real, append=turns[0].real + 2.0 * np.pi))) + 1
        turns = np.concatenate([turns[seam:], turns[:seam] + 2.0 * np.pi])
    return _separate(turns, _BESIDE, centres, radii, corners).real


def _separate(turns: Array, beside: float, centres: Array, radii: Array, corners: Array) -> Array:
    """Find those of sorted turns anew that lie within ``beside`` of each other, and their middle, from the eliminant.

    Its harmonics are rounded as its greatest values are, and about roots that meet it is far less than these: of equal
    triangles that are turned alike it has four in one place. Sampled there it is rounded as its values there are.

    turns : complex, as roots that meet may leave the real ones
    """
    if len(turns) < 2:
        return turns
    separated = []
    for group in np.split(turns, np.flatnonzero(np.diff(turns.real) > beside) + 1):
        middle = group.real.mean()
        half = 4.0 * np.abs(group - middle).max()
        closer = group[:0]
        if len(group) > 1 and half > _CLOSEST:
            values = _compute_eliminant(middle + half * _NODES, centres, radii, corners)
            roots = np.polynomial.chebyshev.chebroots(np.polynomial.chebyshev.chebfit(_NODES, values, len(_NODES) - 1))
            closer = roots[(np.abs(roots.real) < 1.0) & (np.abs(roots.imag) < _BESIDE_LINE)]
            closer = middle + half * closer[np.argsort(closer.real)]
            closer = _separate(closer, _NARROWER * beside, centres, radii, corners)
        separated.append(np.append(closer, middle) if len(closer) else group)
    return np.concatenate(separated)


def _is_in_continuum(pose: Array, centres: Array, radii: Array, corners: Array) -> bool:
    """Tell whether a solution belongs to a continuum: steps along the null direction, both ways, can be closed there.

    Another root beside it lies one way.
    """
    _, jacobian = _linearise(pose, centres, corners)
    size = float(np.abs(jacobian).max())
    units = np.array([1.0, 1.0, 1.0 / max(size, 1e-300)])  # the turn in units of a length of its own
    _, values, directions = np.linalg.svd(jacobian * units)
    if values[-1] > _SINGULAR * values[0]:
        return False
    for step in (_STRIDE * size * directions[-1] * units, -_STRIDE * size * directions[-1] * units):
        error, moved = _polish_pose(pose + step, centres, radii, corners, _SINGULAR)
        aside = moved - pose - step
        aside[2] = wrap_angle(aside[2])
        if not (error < _FREE * size and float(np.linalg.norm(aside / units)) < _NEAR_PLANAR_STRIDE * _STRIDE * size):
            return False
    return True


def _turn_points(angle: Array, points: Array) -> Array:
    s, c = np.sin(angle)[..., None], np.cos(angle)[..., None]
    x, y = points[:, 0], points[:, 1]
    return np.stack([c * x - s * y, s * x + c * y], -1)


def _compute_eliminant(angle: Array, centres: Array, radii: Array, corners: Array) -> Array:
    """Compute the trigonometric polynomial that is zero where the circles about centre - R·corner share a point."""
    m = centres - _turn_points(angle, corners)  # circles' centres, (..., 3, 2)
    k = (m * m).sum(-1) - radii**2
    u, v = m[..., 1, :] - m[..., 0, :], m[..., 2, :] - m[..., 0, :]
    a, b = k[..., 1] - k[..., 0], k[..., 2] - k[..., 0]  # 2·u·p = a, 2·v·p = b
    det = 2.0 * (u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])
    x = a * v[..., 1] - b * u[..., 1]  # p·det
    y = b * u[..., 0] - a * v[..., 0]
    first = m[..., 0, :]
    value: Array = x * x + y * y - 2.0 * det * (x * first[..., 0] + y * first[..., 1]) + det * det * k[..., 0]
    return value


def _find_starts(angle: float, centres: Array, radii: Array, corners: Array) -> list[Array]:
    """Find starting poses for a turn: the common points of every two of its circles."""
    m = centres - _turn_points(np.array(angle), corners)
    starts = []
    for i, j in ((0, 1), (0, 2), (1, 2)):
        u = m[j] - m[i]
        d2 = float(u @ u)
        if d2 == 0.0:
            continue
        t = 0.5 * (1.0 + (radii[i] ** 2 - radii[j] ** 2) / d2)
        height = np.sqrt(max(radii[i] ** 2 / d2 - t * t, 0.0))
        for side in (height, -height):
            x, y = m[i] + t * u + side * np.array([-u[1], u[0]])
            starts.append(np.array([x, y, angle]))
    return starts


def _polish_pose(
    pose: Array, centres: Array, radii: Array, corners: Array, least_value: float = 1e-13
) -> tuple[float, Array]:
    """Polish a pose by Newton's method as long as it improves; return the best and its greatest error of a radius.

    least_value : of the greatest singular value: along directions of less it does not move
    """
    best, least, idle = pose, np.inf, 0
    for _ in range(_STEPS):
        rods, jacobian = _linearise(pose, centres, corners)
        f = 0.5 * ((rods * rods).sum(1) - radii**2)
        error = float(np.abs(np.linalg.norm(rods, axis=1) - np.abs(radii)).max())
        idle = 0 if error < 0.5 * least else idle + 1
        if error < least:
            best, least = pose, error
        if idle > _IDLE:
            break
        pose = pose - np.linalg.lstsq(jacobian, f, rcond=least_value)[0]
    return least, np.array([best[0], best[1], np.pi - (np.pi - best[2]) % (2.0 * np.pi)])


def _linearise(pose: Array, centres: Array, corners: Array) -> tuple[Array, Array]:
    """Compute the rods (3, 2), and the derivatives (3, 3) of half their squared lengths by x, y and φ."""
    arms = _turn_points(pose[2], corners)
    rods = pose[:2] + arms - centres
    return rods, np.column_stack([rods, rods[:, 1] * arms[:, 0] - rods[:, 0] * arms[:, 1]])


def _is_same(a: Array, b: Array, size: float) -> bool:
    return bool(np.hypot(a[0] - b[0], a[1] - b[1]) < 1e-6 * size and abs(wrap_angle(a[2] - b[2])) < 1e-6)
