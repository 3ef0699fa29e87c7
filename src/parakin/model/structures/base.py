"""What a motion, a mounting, a head and a table make together: from the tool's pose to the platform's and back.

All is written in :mod:`parakin.algebra`. Poses are of the tool in the workpiece's frame (the machine frame M where
there is no table), joints of head and table together are the serial ones, and the platform's frame is given in the base
frame.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Literal, NamedTuple

from ...algebra import IDENTITY, ORIGIN, Mat, Scalar, Vec, norm
from ..chain import UNIT, Pointing, compose_chain
from ..elements import ROTATIONS, TRANSLATIONS
from ..legs.lambda_ import Lambda
from ..spec import Spec

# Axis letters of a pose, ISO 841, by the elementary transforms that move along and about them.
LETTERS = {"tx": "X", "ty": "Y", "tz": "Z", "rx": "A", "ry": "B", "rz": "C"}


@dataclass(frozen=True)
class PlatformPlacement:
    """Where a pose puts the platform, with the joints and coordinates that follow from it.

    rotation, origin : the platform's frame in the base frame, 3 rows of 3, and mm
    coordinates : of the motion, mm and rad
    serial : joints of head and table, mm and rad
    reach : negative where head or table can't point the tool there
    freedom : 0 where the first joint of head or table is free; None without two that turn
    off_axis : the vector whose square that is
    constraint_reach : without unit, negative where the constraints can't be kept
    """

    rotation: Mat
    origin: Vec
    coordinates: list[Scalar]
    serial: list[Scalar]
    reach: tuple[Scalar, ...] = ()
    freedom: Scalar | None = None
    off_axis: Vec | None = None
    constraint_reach: tuple[Scalar, ...] = ()


class DirectionColumns(NamedTuple):
    """The columns of B and C in a pose, side by side, where these two tell the tool's axis.

    b, c : their indices
    """

    b: int
    c: int

    @property
    def pair(self) -> slice:
        """Both columns, B first."""
        return slice(self.b, self.c + 1)


class Structure(ABC):
    """What a motion, a mounting, a head and a table make together."""

    axes: tuple[str, ...]
    turns: tuple[str, ...] = ()  # names of the small turns that :meth:`closure` takes
    branches: str = ""  # default working mode of head and table
    pointing: Pointing | None = None  # the two turning axes of head and table, in the order in which they follow
    serial_order: tuple[int, ...] = ()  # the serial joints that turn them, in that order
    direction: DirectionColumns | None = None  # where of the orientation the tool's axis counts only
    has_central_leg: bool = False
    carries_pole: bool = False  # the pose turns the platform, and with it the first axis of ``pointing``
    writes_frames_once: bool = True  # whether its coordinates hold every frame that its motion's words reach
    has_slides: bool = False  # the table's drives slide it
    sign: float = 1.0  # of the central leg's length
    tip: Vec = ORIGIN  # of a fixed tool, in the platform's frame
    assembly_method: Literal["planar", "lambda"] | None = None  # closed form of the complete direct problem

    def __init__(self, spec: Spec):
        self.spec = spec
        self.mount, self.base = compose_chain(spec.mounting, ())
        self.head, self.table = spec.head, spec.table
        self.coordinates = spec.motion
        self.head_joints = sum(step.drive is not None for step in spec.head)

    @property
    def has_turning_table(self) -> bool:
        """Whether drives turn the table."""
        return any(step.drive is not None and step.axis in ROTATIONS for step in self.spec.table)

    @property
    def lambda_legs(self) -> list[Lambda]:
        """The legs that are Lambdas."""
        return [leg for leg in self.spec.legs if isinstance(leg, Lambda)]

    def measure_tool_reach(self) -> float:
        """Measure how far the tip is from the last driven axis of the head, or from the platform, mm."""
        head = self.spec.head
        last = max((i for i, step in enumerate(head) if step.drive is not None), default=-1)
        return float(norm(compose_chain(head[last + 1 :], ())[1]))

    def bound_shift(self) -> float:
        """Bound how far mounting, head and table together shift a point, mm; infinite where a drive shifts it."""
        steps = [step for step in (*self.spec.mounting, *self.spec.head, *self.spec.table) if step.axis in TRANSLATIONS]
        return inf if any(step.drive is not None for step in steps) else sum(abs(step.value) for step in steps)

    def bound_platform_way(self, ways: Sequence[Scalar]) -> Scalar | None:
        """Bound the squared distance, mm², between the platform's origins at two poses, from the poses' difference.

        Head and table may stand in any of their modes. None where such a bound is not known.
        """
        return None

    def list_constraint_rates(self, pose: Sequence[Scalar], rotation: Mat, origin: Vec) -> list[list[Scalar]]:
        """List how fast each constraint changes with each parasitic motion, for the platform's frame at a pose.

        A square matrix, translations first, then turns (mm); it is singular where the constraints fail to hold the
        platform. Empty for a machine without constraints.
        """
        return []

    @property
    def is_solved(self) -> bool:
        """Whether parasitic motions are solved for in steps, the legs that carry rods in their own modes."""
        return False

    @property
    def parasitic_turns(self) -> int:
        """How many of the parasitic motions are turns."""
        return sum(word in ROTATIONS for word in self.spec.parasitic)

    @property
    def has_direction(self) -> bool:
        """Whether of the orientation the tool's axis counts only, and B and C tell it."""
        return self.direction is not None

    @abstractmethod
    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> PlatformPlacement:
        """Place the platform for a pose; ``first`` gives the first serial joint where it is free."""

    @property
    def tool_rotation(self) -> Mat:
        """The tool's rotation in the machine frame where all turns of the pose are zero."""
        return IDENTITY

    @property
    def tool_axis(self) -> Vec:
        """The tool's axis in the machine frame where all turns of the pose are zero."""
        return UNIT["tz"]

    def turn_first_axis(self, pose: Sequence[Scalar]) -> Mat:
        """Compute the rotation in M of the frame that carries the first axis of :attr:`pointing`."""
        return IDENTITY

    @abstractmethod
    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        """Compute the platform's frame in the base for the motion's coordinates."""

    def place_with_joints(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> PlatformPlacement:
        """Place the platform for the serial joints that a path takes there, whatever their working mode."""
        return replace(self.place(pose, self.branches), serial=list(serial))

    def coordinates_at(self, origin: Vec) -> list[Scalar]:
        """Find the motion's coordinates for the platform's origin in the base, of a motion without turns."""
        return list(origin)

    def coordinates_of(self, rotation: Mat, origin: Vec) -> list[Scalar]:
        """Find the motion's coordinates for the platform's frame in the base."""
        return self.coordinates_at(origin)

    @property
    def middle_turn(self) -> int | None:
        """The column of a pose's second turn of three: beyond ±90° the angles' rates change sign, not the tool's."""
        return None

    @abstractmethod
    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        """Compute the tool's pose; at a vertical tool axis C is 0."""

    def list_motion(self, placement: PlatformPlacement) -> list[tuple[str, Scalar]]:
        """List the motion's elementary transforms, mm and rad, that passive limits bound."""
        return list(zip(self.coordinates, placement.coordinates, strict=True))

    def list_coordinate_margins(self, coordinates: Sequence[Scalar]) -> list[Scalar]:
        """List margins ≥ 0 within which the coordinates write each frame once and keep their determinant's sign."""
        return []

    @abstractmethod
    def closure(
        self, pose: Sequence[Scalar], serial: Sequence[Scalar], turn: Sequence[Scalar] = ()
    ) -> tuple[Mat, Vec, list[Scalar]]:
        """Compute the platform's frame from pose and serial joints, and the closures of head and table.

        There is no quotient in it that a singular head would spoil. The closures are 0 where head and table point the
        tool along the pose's axis.

        ``turn`` turns the tool on about its tip, to the first order, by small angles named in :attr:`turns`: they have
        rates where the pose's own angles have none.
        """
