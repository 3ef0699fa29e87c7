"""The interface of a leg kind. A kind is one module here: a frozen dataclass whose fields are its sizes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Literal

from ...algebra import Mat, Scalar, Vec, add, apply, dot, sub
from ...errors import NoMethodError
from ..elements import Drive, Point, Unit


@dataclass(frozen=True)
class Reach:
    """A margin that is ≥ 0 where a leg reaches a point.

    margin : mm²; of a rod its squared length less the squared distance
    rod : its length, mm; 0 where the reach does not depend on one rod alone
    """

    margin: Scalar
    rod: float = 0.0


@dataclass(frozen=True)
class Inverse:
    """A leg's joints for one platform point.

    joints : mm and rad
    reach : joint by joint
    """

    joints: list[Scalar]
    reach: tuple[Reach, ...] = ()


@dataclass(frozen=True)
class Link:
    """A rigid part of a leg, in the base frame, where it is at one position of the leg's joints.

    joint : what joins it, at ``start``, to the link that carries it: it slides along ``axis``, turns about it, or turns
        about the point
    end : where it ends; a carriage ends where it starts
    axis : of a ball joint: along the link, where its ends don't tell
    drive : which of the leg's drives moves it; None: what the leg's closure leaves it
    carrier : the link that carries it, by its number in the leg; None: the base
    meets : what a ball joint holds its end to: the platform's joint, or a link of the leg; a hinge along it holds it to
        a ring about the platform's z
    """

    joint: Literal["slide", "hinge", "ball"]
    start: Vec
    end: Vec
    axis: Vec | None = None
    drive: int | None = None
    carrier: int | None = None
    meets: Literal["platform", "ring"] | int | None = None


def close_rod(foot: Vec, point: Vec, square: Scalar) -> Scalar:
    """Return the closure ½(|u|² - L²), mm², of a rod from ``foot`` to ``point`` whose squared length is ``square``."""
    u = sub(point, foot)
    return 0.5 * (dot(u, u) - square)


@dataclass(frozen=True)
class Leg(ABC):
    """A leg from the base to ``platform``, a point in the platform's frame: its joint's, or of its ring the centre.

    All its methods are written in :mod:`parakin.algebra`, so they serve numbers, NumPy arrays and traces alike.
    ``point`` is the platform's joint in the base frame, mm.
    """

    kind: ClassVar[str]
    family: ClassVar[str]  # of machines with such legs
    units: ClassVar[tuple[Unit, ...]]  # of the joints, in order
    branches: ClassVar[str] = ""  # the working mode if the file names none: a sign for each choice of the inverse
    # Where the platform's joint moves by d, less than a fifth of the rod's length L, the rod's vector changes by less
    # than sway·L·d / (branch margin); None where that is not known.
    sway: ClassVar[float | None] = None
    has_carriers: ClassVar[bool] = False  # its drives move what a passive rod could stand on
    platform_parameters: ClassVar[str] = "xyz"  # the coordinates of ``platform`` that may differ from leg to leg

    drives: tuple[Drive, ...]
    platform: Point

    def place_joint(self, rotation: Mat, origin: Vec) -> Vec:
        """Place the platform's joint in the base frame, mm, for the platform's frame there."""
        return add(origin, apply(rotation, self.platform))

    def find_fixed_joint(self) -> Vec | None:
        """Return the platform's joint in the platform's frame; None where it moves there."""
        return self.platform

    @abstractmethod
    def closures(self, point: Vec, joints: list[Scalar]) -> list[Scalar]:
        """Return closures f(point, q) = 0 of the leg, one for each joint.

        They are smooth, without roots or quotients of their own.
        """

    @abstractmethod
    def inverse(self, point: Vec, signs: str) -> Inverse:
        """Compute the joints that close the leg, in the working mode ``signs``; NaN where none do."""

    @abstractmethod
    def struts(self, point: Vec, joints: list[Scalar]) -> list[tuple[Vec, Vec]]:
        """Return both ends of each strut, base frame, the foot's end first; the strut to the platform comes first."""

    def links(self, point: Vec, joints: list[Scalar]) -> list[Link]:
        """Return the leg's rigid parts where they are for these joints, carriers first.

        Raises :class:`NoMethodError` for a kind that tells none.
        """
        raise NoMethodError(f"legs of kind {self.kind} tell nothing of their bodies")

    def carry(self, foot: Vec, joints: list[Scalar], drive: int) -> Vec:
        """Place a point, mm, of what one of the leg's drives moves, given where it is with all joints at 0.

        Raises :class:`NoMethodError` for a kind without :attr:`has_carriers`.
        """
        raise NoMethodError(f"legs of kind {self.kind} have no carriage or arm")

    def assembly_margins(self, point: Vec, joints: list[Scalar]) -> tuple[Scalar, ...]:
        """Return margins ≥ 0 where a leg closes as it is built; its closures may be zero elsewhere too."""
        return ()

    def branch_margins(self, point: Vec, joints: list[Scalar], signs: str) -> list[Scalar] | None:
        """Measure, mm, how clear of the other branches joints that close the leg are; positive in the branches' own.

        It spares the inverse. None where only the inverse tells it.
        """
        return None

    def fixed_foot(self) -> Vec | None:
        """Return the foot of a leg if it does not move; no clearance is kept between legs that share it."""
        return None

    def size(self, at_home: float) -> float:
        """Return a length, mm, that the leg seldom falls below.

        It turns closures into distances. ``at_home``: the leg's length at home.
        """
        return at_home

    def sphere(self, joints: list[Scalar]) -> tuple[Vec, Scalar] | None:
        """Return centre and radius of the sphere that ``platform`` lies on; None if there is no such sphere."""
        return None

    def torus(self, joints: list[Scalar]) -> tuple[Scalar, Scalar] | None:
        """Return the radii of the torus about the platform's z, ``platform`` its centre, that the foot lies on.

        The ring's and the strut's, mm; None if there is no such torus.
        """
        return None

    def bound_platform(self, joints: list[Scalar]) -> tuple[Vec, Scalar] | None:
        """Return centre and radius of a ball that holds ``platform``; None where none is known."""
        return self.sphere(joints)
