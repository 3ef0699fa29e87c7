"""A machine's closures as quadrics, and its own generic member."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...algebra import IDENTITY, ORIGIN, Scalar, Term, Trace, derivative, dot, evaluate_trace, scale
from ...arrays import Array, Flags
from ...errors import NoMethodError
from ...model.elements import RodConstraint
from ...model.limits import group_joints_by_leg
from ...model.structures import locate_rod
from ...model.traces import Model
from .closure_system import ClosureSystem
from .generic_member import GenericMember, find_generic_member
from .path_tracking import align_members, find_regular_roots
from .quadric_family import Complex, QuadricFamily, draw_complex, make_family
from .study import compute_frames, compute_study_points, make_closure_quadrics, make_inverse_closure_quadrics

_SEED = 3
_RIGID = ("tx", "ty", "tz", "rz", "ry", "rx")
_SAMPLES = 60  # of joints
_VARIES = 1e-9  # of the greatest singular value: a number that depends on the joints
_NO_TURN = 1e-6  # |e| of a point of length one, in the machine's size: it is no frame


@dataclass(frozen=True, eq=False)
class MachineQuadrics(ClosureSystem):
    """Closures as quadrics in the coordinates of a motion's family, a subspace of Study's.

    matrices : (closures, 5, n, n) of |p|², p's coordinates and 1 for each closure's platform point, and each
        constraint's point
    trace, numbers : the five numbers of every closure, from zeros for the point and the joints
    """

    family: QuadricFamily
    matrices: Array
    trace: Trace
    numbers: list[Scalar]
    size: float
    model: Model

    @property
    def fixed_count(self) -> int:
        return len(self.family.fixed)

    def make_systems(self, joints: Array) -> Complex:
        return self.family.make_member(self.combine(self.compute_numbers(joints)))

    def compute_numbers(self, joints: Array) -> Array:
        """Compute the closures' numbers, (N, closures, 5): factors of |p|², of p's coordinates, and the rest."""
        values = evaluate_trace(self.trace, self.numbers, [0.0, 0.0, 0.0, *joints.T])
        columns = np.stack([np.broadcast_to(np.asarray(v, float), (len(joints),)) for v in values], 1)
        return columns.reshape(len(joints), len(values) // 5, 5) / self.size ** np.array([0.0, 1.0, 1.0, 1.0, 2.0])

    def combine(self, numbers: Array | Complex) -> Complex:
        """Combine the matrices by the closures' numbers (N, closures, 5): (N, closures, n, n), each of length one."""
        quadrics = np.einsum("ncf,cfij->ncij", numbers, self.matrices)
        scaled: Complex = quadrics / np.linalg.norm(quadrics, axis=(2, 3), keepdims=True)
        return scaled

    @cached_property
    def own_member(self) -> GenericMember:
        generic = find_generic_member(_name_family(self.model))
        numbers = _draw_numbers(self._samples)
        system = self.family.make_member(self.combine(numbers))
        first, last = align_members(generic.system, system, self.fixed_count)
        roots, lost_count = find_regular_roots(first, last, generic.roots, self.fixed_count)
        turns = np.linalg.norm(roots @ self.family.hull[:, :4], axis=1) > _NO_TURN
        return GenericMember(system[0], roots[turns], lost_count)

    @cached_property
    def _samples(self) -> Array:
        return self.compute_numbers(_sample_joints(self.model))

    @cached_property
    def steady(self) -> Flags:
        closures = [
            (matrices[(np.abs(basis) > _VARIES).any(0)] == 0.0).all(0)
            for (_, basis), matrices in zip(_find_variations(self._samples), self.matrices, strict=True)
        ]
        n = self.matrices.shape[2]
        return np.concatenate([np.ones((self.fixed_count, n, n), np.bool_), np.array(closures)])

    def measure_scales(self, points: Complex) -> Array:
        e = points @ self.family.hull[:, :4]
        return np.asarray(np.abs((e * e).sum(1)))

    def compute_frames(self, points: Array) -> tuple[Array, Array]:
        rotations, origins = compute_frames(points @ self.family.hull)
        return rotations, origins * self.size

    def compute_points(self, rotations: Array, origins: Array) -> Array:
        points = compute_study_points(rotations, origins / self.size) @ self.family.hull.T
        return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))

    def bound_moves(self, points: Array, widths: Array) -> Array:
        x = points @ self.family.hull
        e, g = np.linalg.norm(x[:, :4], axis=1), np.linalg.norm(x[:, 4:], axis=1)
        with np.errstate(invalid="ignore"):
            least = e - widths
            turn = np.where(least > 0.0, 4.0 * widths / least, np.nan)
            move = np.where(least > 0.0, 2.0 * widths / least * (1.0 + 2.0 * (g + widths) / least), np.nan)
        return np.stack([move * self.size, turn], 1)


def make_machine_quadrics(model: Model) -> MachineQuadrics:
    """Make a machine's quadrics: of more closures than freedoms the leading ones.

    Raises :class:`NoMethodError` where a leg's closure puts its platform point on no sphere and no plane.
    """
    family = make_family(_name_family(model))
    trace, every_number, every_platform = _list_closure_numbers(model)
    platforms = [every_platform[i] for i in model.leading_closures]
    numbers = [number for i in model.leading_closures for number in every_number[5 * i : 5 * i + 5]]
    size = max(model.sizes)
    quadrics = [make_closure_quadrics(p / size) for p in platforms]
    for constraint in model.spec.constraints:
        if isinstance(constraint, RodConstraint):
            numbers += _list_rod_numbers(model, constraint, trace)
            quadrics.append(make_closure_quadrics(np.array(constraint.platform, float) / size))
            continue
        foot, platform = np.array(constraint.foot, float), np.array(constraint.platform, float)
        of_base = constraint.plane_of == "base"
        quadrics.append(
            make_closure_quadrics(platform / size) if of_base else make_inverse_closure_quadrics(foot / size)
        )
        numbers += [0.0, *constraint.normal, -float(np.dot(constraint.normal, foot if of_base else platform))]
    matrices = family.hull @ np.array(quadrics) @ family.hull.T
    return MachineQuadrics(family, matrices, trace, numbers, size, model)


def _name_family(model: Model) -> tuple[str, ...]:
    """Name a motion's family by its words; all six in any order make every rigid motion, and one family."""
    motion = tuple(model.spec.motion)
    return _RIGID if sorted(motion) == sorted(_RIGID) else motion


def _list_closure_numbers(model: Model) -> tuple[Trace, list[Scalar], list[Array]]:
    """List the five numbers of every closure as a trace, and the platform point of each."""
    trace = Trace()
    point, joints = list(trace.inputs(3)), trace.inputs(len(model.drives), 3)
    numbers: list[Scalar] = []
    platforms = []
    for leg, own in zip(model.spec.legs, group_joints_by_leg(model.spec, joints), strict=True):
        fixed = leg.find_fixed_joint()
        if fixed is None:
            raise NoMethodError(
                f"{model.spec.name}: a leg's joint moves on the platform, and its closure is no quadric"
            )
        for closure in leg.closures(tuple(point), own):
            slopes = [derivative(closure, x) for x in point]
            _check_form(model, slopes, point)
            numbers += [0.5 * derivative(slopes[0], point[0]), *slopes, closure]
            platforms.append(np.array(fixed, float))
    return trace, numbers, platforms


def _list_rod_numbers(model: Model, rod: RodConstraint, trace: Trace) -> list[Scalar]:
    """List the five numbers of a passive rod, whose foot the joints tell: half its square less half the distance's."""
    joints = group_joints_by_leg(model.spec, trace.inputs(len(model.drives), 3))
    foot, _ = locate_rod(model.spec, rod, IDENTITY, ORIGIN, joints)
    return [0.5, *scale(foot, -1.0), 0.5 * (dot(foot, foot) - rod.rod**2)]


def _check_form(model: Model, slopes: list[Scalar], point: list[Term]) -> None:
    """Refuse a closure that is no sphere and no plane: its second derivatives are one number, and zeros."""
    bends = [[derivative(slope, x) for x in point] for slope in slopes]
    unequal = [bends[i][j] - (bends[0][0] if i == j else 0.0) for i in range(3) for j in range(3)]
    if any(isinstance(bend, Term) or bend != 0.0 for bend in unequal):
        raise NoMethodError(f"{model.spec.name}: a leg's closure is no sphere and no plane")


def _sample_joints(model: Model) -> Array:
    """Sample joints within their ranges."""
    rng = np.random.default_rng(_SEED)
    size = max(model.sizes)
    low = np.array([drive.low if np.isfinite(drive.low) else -size for drive in model.drives])
    high = np.array([drive.high if np.isfinite(drive.high) else size for drive in model.drives])
    return rng.uniform(low, high, (_SAMPLES, len(low)))


def _find_variations(samples: Array) -> list[tuple[Array, Array]]:
    """Find how samples (N, closures, 5) of each closure's numbers vary: standard deviations (k,) along rows (k, 5)."""
    variations = []
    for own in samples.swapaxes(0, 1):
        _, values, basis = np.linalg.svd(own - own.mean(0), full_matrices=False)
        varies = values > _VARIES * max(np.abs(own).max(), 1e-300)
        variations.append((values[varies] / np.sqrt(len(samples)), basis[varies]))
    return variations


def _draw_numbers(samples: Array) -> Complex:
    """Draw generic complex numbers, (1, closures, 5), from the affine span of samples of each closure's."""
    rng = np.random.default_rng(_SEED)
    drawn: Complex = samples.mean(0)[None].astype(np.complex128)
    for closure, (spread, basis) in enumerate(_find_variations(samples)):
        drawn[0, closure] += (draw_complex(rng, len(spread)) * spread * 2.0) @ basis
    return drawn
