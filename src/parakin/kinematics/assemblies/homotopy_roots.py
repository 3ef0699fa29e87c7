"""The complete direct problem by homotopy continuation: every real root of a machine's quadrics."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple, TypeVar

import numpy as np

from ...arrays import Array, Flags
from ...errors import NoMethodError
from ...model.traces import Model
from ..planar_rpr import CONTINUUM
from .closure_system import ClosureSystem
from .generic_member import GenericMember
from .machine_quadrics import make_machine_quadrics
from .path_tracking import LENIENT, STRICT, align_closures, find_meetings, measure_angles, track_members
from .quadric_family import Complex
from .ring_quadrics import find_tori, make_ring_quadrics
from .root_boxes import prove_roots

_AT_INFINITY = 1e-5  # of what a singular end's place is divided by: it is infinite
_FAR = 1e-8  # of the same: an end is infinite however its path came there, and wherever it stopped
_ENDED = 1e-6  # of a quadric of the last system, where a path stops on its way to infinity
_REAL = 1e-4  # imaginary part, for a point of length one, from which Newton's method may find a real root
_CLOSED = 1e-12  # of a quadric at a point of length one: it is a root
_STRIDE = 1e-3  # along the null direction of a double root
_NEAR_STRIDE = 0.3  # of a stride: what closes farther from its end is another root
_SAME_SINGLE, _SAME_DOUBLE = 1e-7, 1e-5  # rad: between points of the same root, regular and double
_AT_END = 0.99  # t from which on a path ends at a singular root: one that stops before is lost
_PHASE = np.exp(1j)  # of the paths that are tracked where one of the first was lost
_SAME_FRAME = 1e-4  # of a rotation's entries, and of the machine's size: a root's frame is the one that a pose tells
_STEPS = 60  # of Newton's method at a double root, where each halves the distance


AnyPoints = TypeVar("AnyPoints", Array, Complex)


class RealRoots(NamedTuple):
    """The real roots of one system, and what became of all paths.

    points : (k, n) of length one, the single ones first
    complex_count, infinite_count : how many paths ended at complex roots, and at infinity
    lost_count : how many could not be followed
    """

    points: Array
    complex_count: int
    infinite_count: int
    lost_count: int


@lru_cache(maxsize=32)
def make_closure_system(model: Model) -> ClosureSystem:
    """Make the system of a machine's closures.

    Raises :class:`NoMethodError` where a leg's closure puts its platform point on no sphere and no plane, and its foot
    on no torus about the tool.
    """
    on_rings = find_tori(model, [0.0] * len(model.drives)) is not None
    return make_ring_quadrics(model) if on_rings else make_machine_quadrics(model)


def find_real_roots(model: Model, joints: Array) -> list[RealRoots]:
    """Find all real roots of a machine's quadrics for each row of joints (N, joints).

    Raises :class:`NoMethodError` for a continuum of roots.
    """
    closures = make_closure_system(model)
    own = closures.own_member
    if not len(own.roots):
        raise NoMethodError(f"{model.spec.name}: {CONTINUUM} or nearly so, or do not close, whatever the joints are")
    systems = closures.make_systems(joints)
    roots = _track_and_sort(model, systems, own)
    for row in [row for row, own_roots in enumerate(roots) if own_roots.lost_count]:
        roots[row] = _track_and_sort(model, systems[row : row + 1], own, _PHASE, STRICT)[0]
    return [of_row._replace(lost_count=of_row.lost_count + own.lost_count) for of_row in roots]


def _track_and_sort(
    model: Model, systems: Complex, own: GenericMember, phase: complex = 1.0, tolerance: float = LENIENT
) -> list[RealRoots]:
    """Track a member's roots to systems (N, n - 1, n, n), and sort each one's ends.

    phase : the member's closures are multiplied by it, which leaves their roots and leads along other paths
    """
    closures = make_closure_system(model)
    fixed = closures.fixed_count
    first, last = align_closures(own.system, systems, fixed, closures.steady)
    first[:, fixed:] *= phase
    ends = track_members(first, last, own.roots, tolerance)
    met = find_meetings(ends)
    return [
        _sort_ends(model, system, ends.points[row], ends.reached[row], met[row]) for row, system in enumerate(systems)
    ]


def _sort_ends(model: Model, system: Complex, points: Complex, reached: Array, met: Flags) -> RealRoots:
    """Sort the ends of all paths (paths, n) of one system.

    reached : (paths,) the last t of each
    met : (paths,) where another path ended too

    Of two roots beside each other, at which paths stop as at a double one, each that is proved is one of its own.
    Where several paths end in one place at infinity, the last steps are so ill conditioned that some arrive, some stop
    early, and some are taken for one.
    """
    infinite = make_closure_system(model).measure_scales(points) < _FAR
    infinite &= _measure_closures(system, points) < _ENDED
    points, reached, met = _turn_to_real(points[~infinite]), reached[~infinite], met[~infinite]
    regular, lost = reached == 1.0, reached < _AT_END
    near_real = np.abs(points.imag).max(1) < _REAL
    single = _polish_points(system.real, points[regular & near_real].real, 4)
    turned_real = _measure_closures(system.real, single) < _CLOSED
    ends_singular = _refine_singular(system, points[~regular & ~lost])
    kinds = _sort_singular(make_closure_system(model), system, ends_singular)
    beside = _turn_to_real(ends_singular[kinds == _DOUBLE]).real
    apart = np.isfinite(prove_roots(np.broadcast_to(system.real, (len(beside), *system.shape)), beside))
    doubles = _join_same(beside[~apart], _SAME_DOUBLE)
    if any(_is_in_continuum(system.real, point) for point in doubles):
        raise NoMethodError(f"{model.spec.name}: {CONTINUUM}")
    return RealRoots(
        np.concatenate([_join_same(np.concatenate([single[turned_real], beside[apart]]), _SAME_SINGLE), doubles]),
        int((regular & ~near_real).sum() + (~turned_real).sum() + (kinds == _COMPLEX).sum()),
        int(infinite.sum() + (kinds == _INFINITE).sum()),
        int((kinds == _LOST).sum() + lost.sum() + met.sum()),
    )


_DOUBLE, _COMPLEX, _INFINITE, _LOST = range(4)


def _turn_to_real(points: Complex) -> Complex:
    """Multiply points by a phase so that those with a real representative are real."""
    squares = (points * points).sum(1)
    phase = np.sqrt(squares / np.maximum(np.abs(squares), 1e-300))
    turned: Complex = points * phase.conj()[:, None]
    return turned


def _measure_closures(system: AnyPoints, points: AnyPoints) -> Array:
    """Measure the greatest quadric at points (k, n): (k,)."""
    values: Array = np.abs(np.einsum("ki,rij,kj->kr", points, system, points))
    return np.asarray(values.max(1, initial=0.0))


def _polish_points(system: AnyPoints, points: AnyPoints, steps: int) -> AnyPoints:
    """Take Newton steps of least length from points (k, n), and scale them to length one."""
    for _ in range(steps):
        halves = np.einsum("rij,kj->kri", system, points)
        values = np.einsum("kri,ki->kr", halves, points)
        matrix = np.concatenate([2.0 * halves, points.conj()[:, None, :]], 1)
        right = np.concatenate([values, np.zeros((len(points), 1))], 1)
        try:
            move = np.linalg.solve(matrix, right[..., None])[..., 0]
        except np.linalg.LinAlgError:
            break
        points = points - move
        points = points / np.linalg.norm(points, axis=1, keepdims=True)
    return points


def _refine_singular(system: Complex, points: Complex) -> Complex:
    """Bring points close to singular roots onto them by Newton's method, which halves the distance each time."""
    refined = points.copy()
    for row, point in enumerate(points):
        x = point[None]
        for _ in range(_STEPS):
            ahead = _polish_points(system, x, 1)
            if not np.isfinite(ahead).all() or np.linalg.norm(ahead - x) > 0.1:
                break
            moved = float(np.linalg.norm(ahead - x))
            x = ahead
            if moved < 1e-9:
                break
        refined[row] = x[0]
    return refined


def _sort_singular(closures: ClosureSystem, system: Complex, points: Complex) -> Array:
    """Tell real double roots, complex ones, ends at infinity, and what is no root."""
    kinds = np.full(len(points), _LOST)
    if not len(points):
        return kinds
    turned = _turn_to_real(points)
    closed = np.abs(np.einsum("ki,rij,kj->kr", points, system, points)).max(1) < 1e-9
    kinds[closed & (np.abs(turned.imag).max(1) < _REAL)] = _DOUBLE
    kinds[closed & (np.abs(turned.imag).max(1) >= _REAL)] = _COMPLEX
    kinds[closures.measure_scales(points) < _AT_INFINITY] = _INFINITE
    return kinds


def _join_same(points: Array, angle: float) -> Array:
    """Keep one of points (k, n) that are the same but for their sign, within an angle, rad."""
    one, other = np.tril_indices(len(points), -1)
    same = measure_angles(points[one], points[other]) < angle
    kept = np.ones(len(points), np.bool_)
    kept[one[same]] = False
    return points[kept]


def _is_in_continuum(system: Array, point: Array) -> bool:
    """Tell whether steps along the null direction of a singular root, both ways, can be closed again there.

    Another root beside it lies one way.
    """
    matrix = np.vstack([2.0 * np.einsum("rij,j->ri", system, point), point])
    along = _STRIDE * np.linalg.svd(matrix)[2][-1]
    return all(_is_closable(system, (point + step) / np.linalg.norm(point + step)) for step in (along, -along))


def _is_closable(system: Array, start: Array) -> bool:
    """Tell whether a point can be closed where it is, without a move along a null direction."""
    x = start
    for _ in range(20):
        half = np.einsum("rij,j->ri", system, x)
        x = x - np.linalg.lstsq(np.vstack([2.0 * half, x]), np.append(half @ x, 0.0), rcond=1e-6)[0]
        x = x / np.linalg.norm(x)
    closes = _measure_closures(system, x[None])[0] < _CLOSED
    return bool(closes and np.linalg.norm(x - start) < _NEAR_STRIDE * _STRIDE)


def find_coordinates(model: Model, points: Array, joints: Array) -> Array:
    """Compute the motion's coordinates (k, m) of real roots (k, n) for one row of joints (joints,).

    A row is NaN where no pose tells it: constraints hold the platform in another of their solutions, a central leg
    points the other way, or a leg closes otherwise than it is built.
    """
    closures = make_closure_system(model)
    rotations, origins = closures.compute_frames(points)
    columns = model.structure.coordinates_of(
        [[rotations[:, i, j] for j in range(3)] for i in range(3)], list(origins.T)
    )
    coordinates = np.ascontiguousarray(np.stack(np.broadcast_arrays(*columns), 1))
    coordinates[~closures.find_assembled(points, joints)] = np.nan
    if (model.spec.constraints or not model.structure.writes_frames_once) and len(coordinates):
        with np.errstate(invalid="ignore", divide="ignore"):
            turned, place = model.structure.frame(list(coordinates.T))
        off = [np.abs(turned[i][j] - rotations[:, i, j]) for i in range(3) for j in range(3)]
        off += [np.abs(place[i] - origins[:, i]) / closures.size for i in range(3)]
        coordinates[~(np.max(np.broadcast_arrays(*off), 0) < _SAME_FRAME)] = np.nan
    return coordinates
