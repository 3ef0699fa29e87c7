"""The elements of a machine, as plain frozen data: drives, elementary transforms, limits.

Lengths are mm, angles rad, speeds mm/s or rad/s, accelerations mm/s² or rad/s², jerks mm/s³ or rad/s³. Machine files
are read into these by :mod:`parakin.description`; nothing here knows a file.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Final, Literal, NewType

ABSOLUTE: Final = "absolute"  # of a drive's homing: its encoder knows where it is
_BEYOND = 0.1  # of a joint's range: how far outside of it a home switch may be

Unit = Literal["mm", "rad"]
Vector = tuple[float, float, float]

# The type of a leg kind's field; the reader of machine files chooses its parser by it.
Point = NewType("Point", Vector)  # mm
Direction = NewType("Direction", Vector)  # unit vector
Size = NewType("Size", float)  # a length > 0, mm
Signs = NewType("Signs", str)  # a working mode: one of "+" and "-" for each choice the inverse has

TRANSLATIONS = ("tx", "ty", "tz")
ROTATIONS = ("rx", "ry", "rz")
MOTION_UNITS: dict[str, Unit] = {**dict.fromkeys(TRANSLATIONS, "mm"), **dict.fromkeys(ROTATIONS, "rad")}


@dataclass(frozen=True)
class Drive:
    """One actuated joint: its name, its unit, its range, its greatest rates, and how a controller drives it.

    name, unit : the joint's, unit ``mm`` or ``rad``
    low, high : its range
    speed, acceleration, jerk : the greatest, mm/s, mm/s², mm/s³, or rad
    counts, lead : steps or encoder counts of a motor's turn, and what the joint moves meanwhile, negative where the
        motor turns the other way; None: not said
    homing : where the home switch trips, or ``absolute`` for an encoder that needs none; None: not said
    offset : what a leg's joint is more than the drive says, mm or rad; ranges and homing are what the drive says
    force, rated : the greatest force of the drive, and the greatest root of its mean square, N along a joint, Nmm about
        one
    power : its greatest power, Nmm/s
    inertia : what motor and screw add, t along a joint, t mm² about one
    stiffness : N/mm, Nmm/rad of slide, screw and motor together
    """

    name: str
    unit: Unit
    low: float = -inf
    high: float = inf
    speed: float = inf
    acceleration: float = inf
    jerk: float = inf
    counts: float | None = None
    lead: float | None = None
    homing: float | Literal["absolute"] | None = None
    offset: float = 0.0
    force: float = inf
    rated: float = inf
    power: float = inf
    inertia: float = 0.0
    stiffness: float | None = None

    @property
    def has_near_switch(self) -> bool:
        """Tell whether a home switch, if there is one, trips within the range or a tenth of it beyond."""
        beyond = _BEYOND * (self.high - self.low)
        return not isinstance(self.homing, float) or self.low - beyond <= self.homing <= self.high + beyond

    def __repr__(self) -> str:
        return f"<parakin drive {self.name}: {self.low:.6g} to {self.high:.6g} {self.unit}>"


@dataclass(frozen=True)
class BodyBuild:
    """What bodies of a kind are made of; None for what is not stated.

    density : t/mm³
    modulus : N/mm², of elasticity
    diameter, wall : mm, of round bars; without a wall they are solid
    rods : how many bars stand side by side
    mass : t, of each body
    """

    density: float | None = None
    modulus: float | None = None
    diameter: float | None = None
    wall: float | None = None
    rods: int = 1
    mass: float | None = None


@dataclass(frozen=True)
class Step:
    """One elementary transform of a head, a table or a mounting: along or about ``axis`` by ``value`` + ``sign``·q.

    axis : one of :data:`TRANSLATIONS` and :data:`ROTATIONS`
    value : mm or rad
    drive : whose joint is q; None: the transform is fixed
    sign : 1 or -1
    """

    axis: str
    value: float = 0.0
    drive: Drive | None = None
    sign: float = 1.0


@dataclass(frozen=True)
class Range:
    """low ≤ value ≤ high of a named quantity: a passive coordinate of the motion, or a difference of two joints.

    name : the coordinate's, such as ``rx``
    low, high : mm or rad
    """

    name: str
    low: float = -inf
    high: float = inf


@dataclass(frozen=True)
class Gap:
    """low ≤ q[second] - q[first] ≤ high: two sliders that share a shaft.

    first, second : their joints' names
    low, high : mm
    """

    first: str
    second: str
    low: float = -inf
    high: float = inf


@dataclass(frozen=True)
class Cone:
    """The rods of all legs stay within ``angle``, rad, of ``axis`` at the joint ``at`` the foot or the platform.

    ``axis`` is in the base frame for the foot, in the platform frame for the platform; it points along the rod's
    direction from foot to platform when the joint is centred. None: each rod's own direction at home.
    """

    at: Literal["foot", "platform"]
    angle: float
    axis: Direction | None = None


@dataclass(frozen=True)
class PlaneConstraint:
    """A closure without a drive: a point of one body stays in a plane of the other, g(platform's frame) = 0, mm.

    plane_of : which body carries the plane; the point is of the other one
    platform, foot : in the frames of platform and base: the point, and the point through which the plane goes
    normal : the plane's, in the frame of the body that carries it
    """

    plane_of: Literal["base", "platform"]
    platform: Point
    foot: Point
    normal: Direction


@dataclass(frozen=True)
class RodConstraint:
    """A closure without a drive: a rod of fixed length from the platform to the base, or to what a leg's drive moves.

    platform : in the platform's frame
    foot : in the base frame; of what a drive moves where all joints of its leg are 0
    rod : mm
    drive : the drive of a leg on whose carriage or arm the foot is; None: the base
    """

    platform: Point
    foot: Point
    rod: Size
    drive: str | None = None


@dataclass(frozen=True)
class Limits:
    """The limits of a machine besides its drives' ranges.

    passive : of the motion's coordinates, by their names (rx, ry, tz, ...)
    gaps : between two sliders of one shaft
    cones : about the rods' joints
    clearance : least distance of the centre lines of two struts that hold the platform, mm; None: no limit
    joined : pairs of struts that meet in one joint and keep no clearance; None: those whose joints lie together
    """

    passive: tuple[Range, ...] = ()
    gaps: tuple[Gap, ...] = ()
    cones: tuple[Cone, ...] = ()
    clearance: float | None = None
    joined: tuple[tuple[str, str], ...] | None = None
