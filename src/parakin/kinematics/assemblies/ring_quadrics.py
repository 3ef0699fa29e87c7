"""The closures of struts hinged to rings about the tool, as quadrics in the platform's origin and axis.

A strut holds its foot on a torus about the axis u of the platform. With p for the platform's origin, |p|² and p·u are
coordinates of their own, so that the foot's squared distance s from the ring's centre and its height h over the ring
are linear, and the torus (s + R² - r²)² = 4·R²·(s - h²) of the radii R (the ring) and r (the strut) is a quadric. Five
of them and those that hold the coordinates have as many roots as the product of their degrees says, 2⁸, and no fewer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from ...algebra import Scalar
from ...arrays import Array, Flags
from ...model.limits import group_joints_by_leg
from ...model.structures.five_axis import make_least_rotation
from ...model.traces import Model
from .closure_system import ClosureSystem
from .generic_member import GenericMember
from .path_tracking import find_regular_roots
from .quadric_family import Complex, draw_complex

_SEED = 4
_COORDINATES = 9  # 1, p (3), u (3), |p|², p·u
_ONE, _ORIGIN, _AXIS, _SQUARE, _ALONG = 0, slice(1, 4), slice(4, 7), 7, 8
_VARYING = 2  # of a torus's four numbers the first ones hang on its strut's length
_SPREAD = 0.5  # of a generic strut's squared length, by its real one at home


@dataclass(frozen=True, eq=False)
class RingQuadrics(ClosureSystem):
    """Struts on rings about the tool.

    squares, heights : (struts, 9) the linear forms s and h of each strut's foot
    quadrics : (struts, 4, 9, 9) of each strut the quadrics of 1, s, s² and h²
    rings : (struts,) their radii in ``size``
    """

    squares: Array
    heights: Array
    quadrics: Array
    rings: Array
    size: float
    model: Model

    @property
    def fixed_count(self) -> int:
        return len(_make_fixed_quadrics())

    def make_systems(self, joints: Array) -> Complex:
        return self._join((self._find_lengths(joints) ** 2).astype(np.complex128))

    def _find_lengths(self, joints: Array) -> Array:
        """Find the struts' lengths (N, struts), in ``size``, for rows of joints (N, joints)."""
        radii = find_tori(self.model, list(joints.T))
        assert radii is not None
        return np.column_stack([length for _, length in radii]) / self.size

    def _join(self, squared_lengths: Complex) -> Complex:
        """Join the quadrics of the coordinates, and the tori of squared lengths (N, struts), each of length one."""
        rest = self.rings**2 - squared_lengths
        numbers = [rest**2, 2.0 * rest - 4.0 * self.rings**2, np.ones_like(rest), 4.0 * self.rings**2 + 0.0 * rest]
        tori = np.einsum("fnc,cfij->ncij", np.array(numbers), self.quadrics)
        tori /= np.linalg.norm(tori, axis=(2, 3), keepdims=True)
        fixed = np.broadcast_to(_make_fixed_quadrics(), (len(tori), 3, _COORDINATES, _COORDINATES))
        return np.ascontiguousarray(np.concatenate([fixed, tori], 1))

    @cached_property
    def steady(self) -> Flags:
        tori = (self.quadrics[:, :_VARYING] == 0.0).all(1)
        return np.concatenate([np.ones((self.fixed_count, *tori.shape[1:]), np.bool_), tori])

    @cached_property
    def own_member(self) -> GenericMember:
        """Tracked from xᵢ² = bᵢ, i = 1 … 8, all of whose roots are known: no root of any system is left out."""
        rng = np.random.default_rng(_SEED)
        home = self._find_lengths(np.array([self.model.invert(self.model.home, self.model.mode)[0]], float)) ** 2
        system = self._join(home * (1.0 + _SPREAD * draw_complex(rng, *home.shape)))
        count = _COORDINATES - 1
        phases = np.exp(2j * np.pi * rng.uniform(size=(count, 2)))
        first = np.zeros_like(system)
        for i, (own, one) in enumerate(phases.tolist()):
            first[0, i, i + 1, i + 1], first[0, i, 0, 0] = own, -one
        signs = np.array(list(product((-1.0, 1.0), repeat=count)))
        starts = np.column_stack([np.ones(len(signs)), signs * np.sqrt(phases[:, 1] / phases[:, 0])])
        starts /= np.linalg.norm(starts, axis=1, keepdims=True)
        return GenericMember(system[0], *find_regular_roots(first, system, starts, fixed=0))

    def measure_scales(self, points: Complex) -> Array:
        return np.asarray(np.abs(points[:, _ONE]))

    def compute_frames(self, points: Array) -> tuple[Array, Array]:
        places = points / points[:, [_ONE]]
        with np.errstate(divide="ignore", invalid="ignore"):  # an axis the other way round tells the axis alone
            rows = make_least_rotation(tuple(places[:, _AXIS].T))
        rotations = np.stack([np.stack(row, -1) for row in rows], 1)
        return rotations, places[:, _ORIGIN] * self.size

    def compute_points(self, rotations: Array, origins: Array) -> Array:
        p, u = origins / self.size, rotations[:, :, 2]
        points = np.column_stack([np.ones(len(p)), p, u, (p * p).sum(1), (p * u).sum(1)])
        return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))

    def bound_moves(self, points: Array, widths: Array) -> Array:
        one = np.abs(points[:, _ONE])
        with np.errstate(invalid="ignore"):
            least = np.where(one > widths, one - widths, np.nan)
            moves = [
                widths * (1.0 + np.linalg.norm(points[:, columns], axis=1) / one) / least
                for columns in (_ORIGIN, _AXIS)
            ]
        return np.stack([moves[0] * self.size, 0.5 * np.pi * moves[1]], 1)

    def find_assembled(self, points: Array, joints: Array) -> Flags:
        """Find where struts end on their rings' near sides: of ±2·R·√(s - h²) = s + R² - r² it is that of the plus."""
        places = points / points[:, [_ONE]]
        squares = places @ self.squares.T
        return np.asarray((squares + self.rings**2 >= self._find_lengths(joints[None]) ** 2).all(1))


def find_tori(model: Model, joints: Sequence[Scalar]) -> list[tuple[Scalar, Scalar]] | None:
    """Find both radii, mm, of each leg's torus; None where a leg puts its foot on none."""
    given = group_joints_by_leg(model.spec, joints)
    tori = [leg.torus(own) for leg, own in zip(model.spec.legs, given, strict=True)]
    known = [torus for torus in tori if torus is not None]
    return known if len(known) == len(tori) else None


def make_ring_quadrics(model: Model) -> RingQuadrics:
    """Make the quadrics of a machine whose legs are all hinged to rings about the tool."""
    size = max(model.sizes)
    forms = []
    for leg in model.spec.legs:
        foot = np.array(leg.fixed_foot(), float) / size
        height = float(leg.platform[2]) / size
        square, along = np.zeros(_COORDINATES), np.zeros(_COORDINATES)
        square[_ONE], square[_SQUARE], square[_ALONG] = foot @ foot + height**2, 1.0, 2.0 * height
        square[_ORIGIN], square[_AXIS] = -2.0 * foot, -2.0 * height * foot
        along[_ONE], along[_AXIS], along[_ALONG] = -height, foot, -1.0
        forms.append((square, along))
    one = np.eye(_COORDINATES)[_ONE]
    quadrics = [[_multiply(one, one), _multiply(s, one), _multiply(s, s), _multiply(h, h)] for s, h in forms]
    radii = find_tori(model, [0.0] * len(model.drives))
    assert radii is not None
    squares, heights = np.array(forms).swapaxes(0, 1)
    rings = np.array([ring for ring, _ in radii], float) / size
    return RingQuadrics(squares, heights, np.array(quadrics), rings, size, model)


def _multiply(one: Array, other: Array) -> Array:
    """Multiply two linear forms to a symmetric quadric."""
    return np.asarray(0.5 * (np.outer(one, other) + np.outer(other, one)))


def _make_fixed_quadrics() -> Complex:
    """Make the quadrics that hold the coordinates: |p|², p·u, and u of length one."""
    e = np.eye(_COORDINATES)
    square = sum(_multiply(a, a) for a in e[_ORIGIN]) - _multiply(e[_SQUARE], e[_ONE])
    along = sum(_multiply(a, b) for a, b in zip(e[_ORIGIN], e[_AXIS], strict=True)) - _multiply(e[_ALONG], e[_ONE])
    unit = sum(_multiply(a, a) for a in e[_AXIS]) - _multiply(e[_ONE], e[_ONE])
    fixed: Complex = np.array([square, along, unit], np.complex128)
    return fixed
