"""From the tool's pose to the platform's and back: the three ways a platform, a head and a table make a machine.

All are written in :mod:`parakin.algebra`. Poses are of the tool in the workpiece's frame (the machine frame M
where there is no table), joints of head and table together are the serial ones, and the platform's frame is given in
the base frame.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi

from ..algebra import (
    IDENTITY,
    Mat,
    Scalar,
    Vec,
    add,
    along,
    apply,
    atan2,
    dot,
    norm,
    product,
    scale,
    sincos,
    smaller,
    sqrt,
    sub,
    transposed,
    turn,
)
from ..errors import DescriptionError
from .chain import UNIT, Pointing, back, frame, inverse_rotations, rotation_about
from .parts import ROTATIONS, TRANSLATIONS, Step
from .spec import Spec

# Axis letters of a pose, ISO 841, by the elementary transforms that move along and about them.
LETTERS = {"tx": "X", "ty": "Y", "tz": "Z", "rx": "A", "ry": "B", "rz": "C"}


@dataclass(frozen=True)
class Placement:
    """Where a pose puts the platform, with the joints and coordinates that follow from it."""

    rotation: Mat
    origin: Vec
    coordinates: list[Scalar]  # of the motion
    serial: list[Scalar]  # joints of head and table
    reach: tuple[Scalar, ...] = ()  # negative where head or table can't point the tool there
    freedom: Scalar | None = None  # 0 where the first joint of head or table is free


class Structure(ABC):
    """What a motion, a mounting, a head and a table make together."""

    axes: tuple[str, ...]
    branches: str = ""  # default working mode of head and table

    def __init__(self, spec: Spec):
        self.spec = spec
        self.mount, self.base = frame(spec.mounting, ())
        self.coordinates = spec.motion
        self.head_joints = sum(step.drive is not None for step in spec.head)

    @abstractmethod
    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> Placement:
        """The platform for a pose; ``first`` gives the first serial joint where it is free."""

    @abstractmethod
    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        """The platform's frame in the base for the motion's coordinates."""

    def held(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> Placement:
        """As :meth:`place`, for the serial joints that a path takes there, whatever their working mode."""
        return self.place(pose, self.branches)

    def coordinates_at(self, origin: Vec) -> list[Scalar]:
        """The motion's coordinates for the platform's origin in the base, of a motion without turns."""
        return list(origin)

    @abstractmethod
    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        """The tool's pose; at a vertical tool axis C is 0."""

    @abstractmethod
    def closure(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> tuple[Mat, Vec, list[Scalar]]:
        """The platform's frame from pose and serial joints without any quotient that a singular head would spoil,
        and what is 0 where head and table point the tool along the pose's axis."""


class Free(Structure):
    """The motion is the pose: translations, and no, one or three turns. Tool and mounting are fixed frames."""

    def __init__(self, spec: Spec):
        super().__init__(spec)
        words = set(spec.motion)
        turns = [w for w in spec.motion if w in ROTATIONS]
        if len(turns) == 2 or any(w in TRANSLATIONS for w in spec.motion[len(spec.motion) - len(turns) :]):
            raise DescriptionError(
                "motion",
                f"{' '.join(spec.motion)}: a free motion has its translations first, then no, one or three turns",
            )
        if len(turns) == 3 and len(words) != 6:
            raise DescriptionError(
                "motion", f"{' '.join(spec.motion)}: with three turns a free motion has three translations"
            )
        if len(turns) < 3 and spec.mounting:
            if not words >= set(TRANSLATIONS):
                raise DescriptionError(
                    "mounting", "a planar machine is mounted by the words of its motion (tx tz: upright)"
                )
            if turns and any(step.axis in ROTATIONS and step.value for step in spec.mounting):
                raise DescriptionError("mounting", "a machine that turns about one axis only can't be inclined")
        self.coordinates = tuple(word for word in (*TRANSLATIONS, *ROTATIONS) if word in words)
        self.axes = tuple(LETTERS[word] for word in self.coordinates)
        self.tool, self.tip = frame(spec.head, ())

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> Placement:
        rotation, origin = self.frame(pose)
        return Placement(rotation, origin, list(pose), [])

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        given = dict(zip(self.axes, coordinates, strict=True))
        rotation = IDENTITY
        for letter, word in (("C", "rz"), ("B", "ry"), ("A", "rx")):
            if letter in given:
                rotation = product(rotation, turn(word, *sincos(given[letter])))
        if len(self.axes) == 6:  # the tool's frame is posed; the platform's follows
            rotation = product(product(transposed(self.mount), rotation), transposed(self.tool))
        tip = back(self.mount, self.base, tuple(given.get(letter, 0.0) for letter in "XYZ"))
        origin = sub(tip, apply(rotation, self.tip))
        return rotation, tuple(o if letter in given else 0.0 for o, letter in zip(origin, "XYZ", strict=True))

    def coordinates_of(self, rotation: Mat, origin: Vec) -> list[Scalar]:
        """The pose X Y Z A B C of a platform's frame; B in [-90°, 90°]."""
        r = product(product(self.mount, rotation), self.tool)
        tip = add(apply(self.mount, add(origin, apply(rotation, self.tip))), self.base)
        b = atan2(-r[2][0], sqrt(r[0][0] * r[0][0] + r[1][0] * r[1][0]))
        return [*tip, atan2(r[2][1], r[2][2]), b, atan2(r[1][0], r[0][0])]

    def coordinates_at(self, origin: Vec) -> list[Scalar]:
        tip = add(apply(self.mount, add(origin, self.tip)), self.base)
        return [tip["XYZ".index(letter)] for letter in self.axes]

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        return list(coordinates)

    def closure(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> tuple[Mat, Vec, list[Scalar]]:
        return (*self.frame(pose), [])


def tool_axis(b: Scalar, c: Scalar) -> tuple[Vec, Vec, Vec]:
    """The tool's axis k = Rz(C)·Ry(B)·z, and two directions at right angles to it."""
    sb, cb = sincos(b)
    sc, cc = sincos(c)
    return (sb * cc, sb * sc, cb), (cb * cc, cb * sc, -sb), (-sc, cc, 0.0)


def axis_angles(k: Vec) -> list[Scalar]:
    """B in [0, π] and C of a tool axis (FME Transactions 41, (8) and (9)); C is 0 where it is free."""
    return [atan2(sqrt(k[0] * k[0] + k[1] * k[1]), k[2]), atan2(k[1], k[0])]


class FiveAxis(Structure):
    """A tool of which only tip and axis count: axes X Y Z B C."""

    axes = ("X", "Y", "Z", "B", "C")
    branches = "+"

    def _tilt_rows(self, pose: Sequence[Scalar], k: Vec) -> list[Scalar]:
        _, e1, e2 = tool_axis(pose[3], pose[4])
        return [dot(e1, k), dot(e2, k)]


class Carried(FiveAxis):
    """A platform that only translates; head and table together turn twice."""

    def __init__(self, spec: Spec):
        super().__init__(spec)
        self.coordinates = TRANSLATIONS
        chain = [*inverse_rotations(spec.table), *spec.mounting, *spec.head]
        self.pointing = Pointing.of(chain, "head" if self.head_joints else "table")
        # The turning axes as they follow on each other: the table's, inverted, then the head's.
        drives = [step.drive for step in spec.head if step.drive] + [step.drive for step in spec.table if step.drive]
        self.order = [drives.index(step.drive) for step in chain if step.drive is not None]

    def _split(self, serial: Sequence[Scalar]) -> tuple[Sequence[Scalar], Sequence[Scalar]]:
        return serial[: self.head_joints], serial[self.head_joints :]

    def _origin(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> Vec:
        head, table = self._split(serial)
        top, place = frame(self.spec.table, table)
        world = add(place, apply(top, pose[:3]))
        _, tip = frame(self.spec.head, head)
        return sub(back(self.mount, self.base, world), tip)

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> Placement:
        k, _, _ = tool_axis(pose[3], pose[4])
        found = self.pointing.solve(k, branch, first)
        serial = [found.joints[self.order.index(i)] for i in range(2)]
        origin = self._origin(pose, serial)
        return Placement(IDENTITY, origin, list(origin), serial, found.reach, found.freedom)

    def held(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> Placement:
        origin = self._origin(pose, serial)
        reach = self.place(pose, self.branches).reach
        return Placement(IDENTITY, origin, list(origin), list(serial), reach)

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        return IDENTITY, tuple(coordinates)

    def _axis(self, serial: Sequence[Scalar]) -> Vec:
        head, table = self._split(serial)
        k = apply(self.mount, apply(frame(self.spec.head, head)[0], UNIT["tz"]))
        return apply(transposed(frame(self.spec.table, table)[0]), k)

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        head, table = self._split(serial)
        tip = add(tuple(coordinates), frame(self.spec.head, head)[1])
        top, place = frame(self.spec.table, table)
        return [*back(top, place, add(apply(self.mount, tip), self.base)), *axis_angles(self._axis(serial))]

    def closure(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> tuple[Mat, Vec, list[Scalar]]:
        return IDENTITY, self._origin(pose, serial), self._tilt_rows(pose, self._axis(serial))


class CentralLeg(FiveAxis):
    """A passive central leg: two turns, a sliding tube, the platform at its end, and a wrist whose axes meet on it.

    With a third turn (``rz ry rz tz``) the platform turns about the central leg and takes the wrist's first axis.
    """

    def __init__(self, spec: Spec):
        super().__init__(spec)
        turns = tuple(word for word in spec.motion if word in ROTATIONS)
        if spec.motion[-1] != "tz" or len(turns) != len(spec.motion) - 1 or len(turns) not in (2, 3):
            raise DescriptionError("motion", f"{' '.join(spec.motion)}: a central leg is two or three turns, then tz")
        if len(turns) == 3 and turns[2] != "rz":
            raise DescriptionError(
                "motion", f"{' '.join(spec.motion)}: the third turn of a central leg is about itself, rz"
            )
        if spec.table:
            raise DescriptionError("table", "a machine with a central leg has its turning axes in the head")
        self.roll = len(turns) == 3
        spin = [Step("rz", drive=spec.legs[0].drives[0])] if self.roll else []
        self.wrist = Pointing.of([*spin, *spec.head], "head")
        self.above, self.reach = self._wrist_centre()
        self.sign = 1.0
        home = tuple(float(spec.home.get(letter, 0.0)) for letter in self.axes)
        self.sign = 1.0 if self._centre(home)[2] > 0.0 else -1.0
        swing = [Step(turns[0], drive=spec.legs[0].drives[0]), Step(turns[1], drive=spec.legs[0].drives[0])]
        self.swing = Pointing.of(swing, "motion")
        self.swing = Pointing(self.swing.first, self.swing.second, (0.0, 0.0, self.sign))

    def _wrist_centre(self) -> tuple[float, float]:
        """(h, l): the point (0, 0, h) of the platform lies at the tip + l·k in every position of the head."""
        poses = [(0.0, 0.0), (0.7, 0.4), (-1.1, 0.9), (0.3, -1.3)]
        frames = [frame(self.spec.head, angles[2 - self.head_joints :]) for angles in poses]
        tips = [tip for _, tip in frames]
        axes = [apply(rotation, UNIT["tz"]) for rotation, _ in frames]
        change = sub(axes[1], axes[0])
        length = -float(dot(sub(tips[1], tips[0]), change) / dot(change, change))
        centres = [along(tip, k, length) for tip, k in zip(tips, axes, strict=True)]
        height = centres[0][2]
        if max(norm(sub(c, (0.0, 0.0, height))) for c in centres) > 1e-9 * (1.0 + abs(length) + abs(height)):
            raise DescriptionError("head", "its axes must meet in one point of the central leg, on the tool's axis")
        return float(height), length

    def _centre(self, pose: Sequence[Scalar]) -> Vec:
        k, _, _ = tool_axis(pose[3], pose[4])
        return back(self.mount, self.base, along(tuple(pose[:3]), k, self.reach))

    def _swing(self, pose: Sequence[Scalar]) -> tuple[Mat, Scalar, list[Scalar]]:
        """Rotation of the central leg's two turns, tz, and both turns' angles."""
        centre = self._centre(pose)
        distance = norm(centre)
        found = self.swing.solve(scale(centre, 1.0 / distance), "+")
        rotation = IDENTITY
        axes = self.swing.first, self.swing.second
        if self.roll:  # hanging along the first axis its turn is free, and 0 then: no quotient may stand in the way
            for axis, angle in zip(axes, found.joints, strict=True):
                rotation = product(rotation, rotation_about(axis, *sincos(angle)))
        else:
            scales = 1.0 / found.freedom, 1.0 / found.second_size
            for axis, (s, c), size in zip(axes, found.turns, scales, strict=True):
                rotation = product(rotation, rotation_about(axis, s * size, c * size))
        return rotation, self.sign * distance - self.above, list(found.joints)

    def _platform(self, pose: Sequence[Scalar], branch: str, first: Scalar | None) -> Placement:
        rotation, tz, angles = self._swing(pose)
        k = apply(transposed(self.mount), tool_axis(pose[3], pose[4])[0])
        found = self.wrist.solve(apply(transposed(rotation), k), branch, first)
        serial = list(found.joints)
        if self.roll:
            spin = serial.pop(0)
            rotation = product(rotation, turn("rz", *sincos(spin)))
            angles.append(spin)
        origin = scale([row[2] for row in rotation], tz)
        return Placement(rotation, origin, [*angles, tz], serial, found.reach, found.freedom)

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> Placement:
        return self._platform(pose, branch, first)

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        rotation = IDENTITY
        for word, angle in zip(self.coordinates, coordinates[:-1], strict=False):
            rotation = product(rotation, turn(word, *sincos(angle)))
        return rotation, scale([row[2] for row in rotation], coordinates[-1])

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        rotation, origin = self.frame(coordinates)
        turned, tip = frame(self.spec.head, serial)
        world = add(apply(self.mount, add(origin, apply(rotation, tip))), self.base)
        k = apply(self.mount, apply(rotation, apply(turned, UNIT["tz"])))
        b, c = axis_angles(k)
        # Beyond these the leg points there the other way round, with its platform turned: no pose says that.
        for margin in self._inside(coordinates):
            b = smaller(b, 2.0 * pi + sqrt(margin))
        return [*world, b, c]

    def _inside(self, coordinates: Sequence[Scalar]) -> Iterator[Scalar]:
        """What is ≥ 0 where :meth:`place` would give these coordinates back."""
        yield self.sign * (coordinates[-1] + self.above)
        if not self.roll:
            s, c = sincos(coordinates[1])
            yield c if self.swing.level else s

    def held(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> Placement:
        if not self.roll:
            return super().held(pose, serial)
        rotation, tz, angles = self._swing(pose)
        k = apply(transposed(self.mount), tool_axis(pose[3], pose[4])[0])
        v = apply(transposed(rotation), k)
        w = apply(frame(self.spec.head, serial)[0], UNIT["tz"])  # turned onto v by the platform's own turn
        spin = atan2(w[0] * v[1] - w[1] * v[0], w[0] * v[0] + w[1] * v[1])
        rotation = product(rotation, turn("rz", *sincos(spin)))
        return Placement(rotation, scale([row[2] for row in rotation], tz), [*angles, spin, tz], list(serial))

    def closure(self, pose: Sequence[Scalar], serial: Sequence[Scalar]) -> tuple[Mat, Vec, list[Scalar]]:
        turned, _ = frame(self.spec.head, serial)
        if self.roll:  # the platform's own turn takes one of the two conditions
            placed = self._platform(pose, self.branches, None)
            k = apply(transposed(self.mount), tool_axis(pose[3], pose[4])[0])
            along_leg = dot([row[2] for row in placed.rotation], k)
            return placed.rotation, placed.origin, [apply(turned, UNIT["tz"])[2] - along_leg]
        rotation, tz, _ = self._swing(pose)
        k = apply(self.mount, apply(rotation, apply(turned, UNIT["tz"])))
        return rotation, scale([row[2] for row in rotation], tz), self._tilt_rows(pose, k)


def structure_of(spec: Spec) -> Structure:
    """The structure of a machine, or a :class:`DescriptionError` that says why it is none."""
    twice = [bound.name for bound in spec.limits.passive if spec.motion.count(bound.name) > 1]
    if twice:
        raise DescriptionError("limits", f"passive {twice[0]} stands twice in the motion, so it is not one coordinate")
    drives = [(step.axis, step.drive.name) for step in (*spec.head, *spec.table) if step.drive is not None]
    for axis, name in drives:
        if axis in TRANSLATIONS:
            raise DescriptionError("head", f"joint {name}: the drives of head and table turn; {axis} can't be one")
    driven = len(drives)
    if spec.motion[0] in ROTATIONS:
        return CentralLeg(spec)
    if driven == 0:
        if spec.table:
            raise DescriptionError("table", "a table without a driven turn does nothing; leave it out")
        return Free(spec)
    if set(spec.motion) != set(TRANSLATIONS) or len(spec.motion) != 3:
        raise DescriptionError(
            "motion",
            f"{' '.join(spec.motion)}: with a driven head or table it is tx ty tz, or a central leg (rx ry tz)",
        )
    return Carried(spec)
