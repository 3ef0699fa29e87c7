"""What a machine's closures are to the homotopy: quadrics in homogeneous coordinates that tell the platform's place."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from ...arrays import Array, Flags
from .generic_member import GenericMember
from .quadric_family import Complex


class ClosureSystem(ABC):
    """A machine's closures as n - 1 quadrics in n homogeneous coordinates, lengths in ``size``."""

    size: float

    @property
    @abstractmethod
    def fixed_count(self) -> int:
        """How many of the quadrics, the first ones, do not depend on the joints."""

    @abstractmethod
    def make_systems(self, joints: Array) -> Complex:
        """Make the systems (N, n - 1, n, n) of rows of joints (N, joints), each closure of length one."""

    @property
    @abstractmethod
    def steady(self) -> Flags:
        """Where joints change entries of the quadrics (n - 1, n, n) by no more than the scale of a closure."""

    @property
    @abstractmethod
    def own_member(self) -> GenericMember:
        """A system of the machine's own, with generic complex numbers for what depends on joints, and all its roots."""

    @abstractmethod
    def measure_scales(self, points: Complex) -> Array:
        """Measure what places are divided by, (k,), for points (k, n) of length one: next to zero it is at infinity."""

    @abstractmethod
    def compute_frames(self, points: Array) -> tuple[Array, Array]:
        """Compute platform frames, rotations (k, 3, 3) and origins (k, 3) in mm, of real points (k, n)."""

    @abstractmethod
    def compute_points(self, rotations: Array, origins: Array) -> Array:
        """Compute points (k, n) of length one of platform frames, rotations (k, 3, 3) and origins (k, 3) in mm."""

    @abstractmethod
    def bound_moves(self, points: Array, widths: Array) -> Array:
        """Bound by how much (mm, rad), (k, 2), frames differ whose points are (k, n), and nearer to them than widths.

        NaN where no bound is known.
        """

    def find_assembled(self, points: Array, joints: Array) -> Flags:
        """Find which roots (k, n) are legs as they are built, (k,), for one row of joints (joints,)."""
        return np.ones(len(points), np.bool_)
