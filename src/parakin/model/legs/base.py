"""What every leg kind answers. A kind is one module here: a frozen dataclass whose fields are its sizes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from ...algebra import Scalar, Vec
from ..parts import Drive, Point, Unit


@dataclass(frozen=True)
class Reach:
    """What must be ≥ 0 for a leg to reach a point, mm²; of a rod its length less the distance to span, both squared."""

    margin: Scalar
    rod: float = 0.0  # mm; 0 where it is no matter of one rod's length


@dataclass(frozen=True)
class Inverse:
    """A leg's joints for one platform point, and their reach, joint by joint."""

    joints: list[Scalar]
    reach: tuple[Reach, ...] = ()


@dataclass(frozen=True)
class Leg(ABC):
    """A leg from the base to ``platform``, the point of the platform's joint in the platform's frame.

    All its methods are written in :mod:`parakin.algebra`, so they serve numbers, NumPy arrays and traces alike.
    ``point`` is the platform's joint in the base frame, mm.
    """

    kind: ClassVar[str]
    units: ClassVar[tuple[Unit, ...]]  # of the joints, in order
    branches: ClassVar[str] = ""  # the working mode if the file names none: a sign for each choice of the inverse

    drives: tuple[Drive, ...]
    platform: Point

    @abstractmethod
    def closures(self, point: Vec, joints: list[Scalar]) -> list[Scalar]:
        """f(point, q) = 0 where the leg closes, one a joint; smooth, without roots or quotients of its own."""

    @abstractmethod
    def inverse(self, point: Vec, signs: str) -> Inverse:
        """Joints that close the leg, in the working mode ``signs``; NaN where it can't."""

    @abstractmethod
    def struts(self, point: Vec, joints: list[Scalar]) -> list[tuple[Vec, Vec]]:
        """Both ends of each strut, base frame, the foot's end first; the strut to the platform comes first."""

    def inside(self, point: Vec, joints: list[Scalar]) -> tuple[Scalar, ...]:
        """What is ≥ 0 where a leg that closes does so as it is built: its closures may hold elsewhere too."""
        return ()

    def held_at(self) -> Vec | None:
        """The foot of a leg whose foot does not move; legs that share it can't be kept clear of each other."""
        return None

    def size(self, at_home: float) -> float:
        """A length, mm, that the leg (``at_home`` at home) seldom falls below: it turns closures into distances."""
        return at_home

    def sphere(self, joints: list[Scalar]) -> tuple[Vec, Scalar] | None:
        """Centre and radius of the sphere on which the platform's joint lies; None if the leg holds it otherwise."""
        return None
