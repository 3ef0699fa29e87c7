"""A machine at a pose as named points, lines and polygons in mm, in the machine frame M.

All of it follows from the description: a rail is where a drive's range takes a strut's foot, a strut on a foot that
no drive moves is a telescope, and so on. Nothing here knows a machine or a leg kind.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import isfinite, pi
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...algebra import IDENTITY, ORIGIN, Scalar
from ...arguments import RowsLike
from ...dynamics.polygon import Points, coincide, find_distinct, list_polygon
from ...errors import PoseError
from ...machine import Machine
from ...model.chain import UNIT, compose_chain
from ...model.elements import Step
from ...model.equations import Equations
from ...model.legs import Leg
from ...model.structures import PlatformPlacement

SceneKind = Literal["base", "rail", "telescope", "rod", "arm", "platform", "central", "head", "tool", "table", "axis"]

_NEAR = 1e-6  # mm; points nearer than this are one
_DISC = np.linspace(0.0, 2.0 * pi, 33)[:-1]


_FARTHEST = 1e9  # mm, of what can be drawn


@dataclass(frozen=True, eq=False)
class SceneItem:
    """One thing to draw: ``points`` (k, 3) in order, a polygon if ``closed``; a single point is a joint."""

    kind: SceneKind
    name: str
    points: Points
    closed: bool = False


@dataclass(frozen=True, eq=False)
class Scene:
    """A machine at a pose.

    items : what to draw, without what has no place at a pose out of reach
    labels : names of the drives and where to write them
    frames : (3, 4) of the machine (its origin), the tool and, on a machine with a table, the workpiece
    normal : of the plane of a planar machine, else None
    """

    items: tuple[SceneItem, ...]
    labels: tuple[tuple[str, Points], ...]
    frames: dict[str, Points]
    normal: Points | None

    def of(self, *kinds: SceneKind) -> tuple[SceneItem, ...]:
        """List the items of these kinds."""
        return tuple(item for item in self.items if item.kind in kinds)

    @property
    def box(self) -> Points:
        """(2, 3): least and greatest coordinates of all items."""
        points = np.vstack([item.points for item in self.items])
        return np.array([points.min(0), points.max(0)])

    @property
    def size(self) -> float:
        """A length to scale thicknesses by, mm: the diagonal of the box."""
        return float(np.linalg.norm(np.ptp(self.box, axis=0)))

    @property
    def workpiece(self) -> Points:
        """(3, 4): the frame in which poses are given, in M."""
        return self.frames.get("workpiece", self.frames["machine"])


def build_scene(
    machine: Machine, pose: RowsLike | None = None, joints: ArrayLike | None = None, mode: str | None = None
) -> Scene:
    """Build the scene of a machine at a pose, home by default.

    Parameters
    ----------
    pose : (axes,) mm, rad
    joints : (joints,) those that a path really takes there, if they are known; they decide an angle that is free
    mode : working mode
    """
    rows = machine.rows(machine.home if pose is None else pose, machine.axes, "pose")[0]
    if len(rows) != 1:
        raise PoseError(f"pose: one pose of {' '.join(machine.axes)} expected, not {len(rows)}")
    if (np.abs(rows) > _FARTHEST).any():
        raise PoseError(f"pose: beyond what can be drawn, {_FARTHEST:g} mm")
    row, mode = rows[0], mode or machine.mode
    q = machine.inverse(row, mode) if joints is None else machine.rows(joints, machine.joints, "joints")[0][0]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        placement = machine.place_platform(row, mode, None if joints is None else q)
        builder = _SceneBuilder(_Stance(machine, placement, q.tolist()))
        builder.build()
    items = tuple(item for item in builder.items if np.isfinite(item.points).all())
    labels = _join_labels([label for label in builder.labels if np.isfinite(label[1]).all()])
    missing = [letter for letter in "XYZ" if letter not in machine.axes]
    normal: Points | None = np.array(machine.structure.mount)[:, "XYZ".index(missing[0])] if missing else None
    return Scene(items, labels, builder.frames, None if machine.structure.table else normal)


def trace_scene(
    machine: Machine, pose: Sequence[Scalar], joints: Sequence[Scalar], equations: Equations | None = None
) -> tuple[list[NDArray[np.object_]], NDArray[np.object_]]:
    """Trace the points, (k, 3) each, of the items of home's scene, at another pose on scalars of any kind.

    Also the frame (3, 4) in which poses are given. ``joints`` are those of the pose. Rails and the base stand where
    they are at home. ``equations`` are those of the machine with other sizes, scalars of any kind too.
    """
    bodies: Machine | Equations = machine if equations is None else equations
    home = machine.home
    with np.errstate(invalid="ignore", divide="ignore"):
        builder = _SceneBuilder(
            _Stance(machine, machine.place_platform(home, machine.mode), list(machine.inverse(home)))
        )
        builder.build()
        serial = list(joints[machine.leg_count :])
        placement = bodies.structure.place_with_joints(list(pose), serial)
    stance = _Stance(bodies, placement, list(joints))
    rotation, origin = [(np.eye(3), np.zeros(3)), *stance.list_table_frames()][-1]
    points = [np.asarray(place(stance), dtype=object) for place in builder.places]
    return points, np.column_stack([rotation, origin])


class _Stance:
    """Where a machine's bodies are, on scalars of any kind: all points that a scene has, in the base frame or in M."""

    def __init__(self, machine: Machine | Equations, placement: PlatformPlacement, joints: Sequence[Scalar]):
        self.machine, self.structure, self.joints = machine, machine.structure, list(joints)
        self.placement = placement
        self.rotation: Points = np.array(placement.rotation)
        self.origin: Points = np.array(placement.origin)
        self.points = machine.place_leg_joints(placement)
        self.leg_joints = machine.group_joints(self.joints)
        self.rods = machine.locate_passive_rods(placement, self.leg_joints)

    def locate_struts(self, leg: int) -> list[Points]:
        """Locate both ends (2, 3) of a leg's struts, base frame."""
        return [np.array(ends) for ends in self.machine.legs[leg].struts(self.points[leg], self.leg_joints[leg])]

    def locate_on_platform(self, points: Points) -> Points:
        """Locate points of the platform's frame in the base frame."""
        located: Points = points @ self.rotation.T + self.origin
        return located

    def list_head_frames(self) -> list[tuple[Points, Points]]:
        """List rotation and origin after every step of the head, in the platform's frame."""
        return list(_compose_steps(self.structure.head, list(self.placement.serial)[: self.structure.head_joints]))

    def list_table_frames(self) -> list[tuple[Points, Points]]:
        """List rotation and origin after every step of the table, in M."""
        return list(_compose_steps(self.structure.table, list(self.placement.serial)[self.structure.head_joints :]))

    def locate_anchor(self, leg: int, strut: int) -> Points:
        """Locate the foot (3,) of a leg's strut, base frame."""
        return np.array(self.machine.legs[leg].struts(self.points[leg], self.leg_joints[leg])[strut][0])

    def to_machine(self, points: ArrayLike) -> Points:
        """Transform points of the base frame into M."""
        mount: NDArray[Any] = np.array(self.structure.mount)
        base: NDArray[Any] = np.array(self.structure.base)
        points_in_m: Points = np.asarray(points).reshape(-1, 3) @ mount.T + base
        return points_in_m


class _SceneBuilder:
    """Choose the items of one scene; each has a rule that places its points, in M, for any stance."""

    def __init__(self, stance: _Stance):
        self.stance, self.machine, self.structure = stance, stance.machine, stance.structure
        self.items: list[SceneItem] = []
        self.places: list[Callable[[_Stance], Points]] = []
        self.labels: list[tuple[str, Points]] = []
        self.frames = {"machine": np.eye(3, 4)}

    def build(self) -> None:
        self._add_legs()
        self._add_platform()
        self._add_head()
        if self.structure.table:
            self._add_table()

    def _add(self, kind: SceneKind, name: str, place: Callable[[_Stance], Points], closed: bool = False) -> None:
        """Add an item whose points are placed in M."""
        self.items.append(SceneItem(kind, name, np.asarray(place(self.stance), float), closed))
        self.places.append(place)

    def _add_legs(self) -> None:
        anchors: list[tuple[int, int]] = []
        for leg in range(len(self.machine.legs)):
            anchors += [(leg, strut) for strut in self._add_leg(leg)]
        for name in self.stance.rods:
            self._add("rod", name, _place_passive_rod(name))
        if self.structure.has_central_leg:
            self._add("central", "central leg", lambda at: at.to_machine([np.zeros(3), at.origin]))
        if anchors:
            order = list_polygon(np.array([self.stance.locate_anchor(*anchor) for anchor in anchors], float))
            ring = [anchors[i] for i in order]
            self._add(
                "base", "base", lambda at: at.to_machine([at.locate_anchor(*anchor) for anchor in ring]), len(ring) > 2
            )

    def _add_leg(self, number: int) -> list[int]:
        """Add a leg's rails and struts, and labels; return the struts whose feet no drive moves."""
        at, leg, anchors = self.stance, self.machine.legs[number], []
        struts = at.locate_struts(number)
        moved: dict[int, list[str]] = {}
        sweeps = _sweep_joints(leg, at.leg_joints[number], struts[0])
        for drive, unit, sweep in zip(leg.drives, leg.units, sweeps, strict=True):
            feet = np.array([[ends[0] for ends in leg.struts(at.points[number], q)] for q in sweep], float)
            for strut in np.flatnonzero(np.ptp(feet, axis=0).max(axis=-1) > _NEAR).tolist():
                moved.setdefault(strut, []).append(drive.name)
                # An arm that ends at the foot is what moves it; there is no rail then.
                if not any(coincide(other[1], struts[strut][0]) for other in struts):
                    ends = [sweep[0], sweep[-1]] if unit == "mm" else sweep
                    self._add("rail", drive.name, _place_rail(number, strut, at.points[number], ends))
        for strut in range(len(struts)):
            first: SceneKind = "rod" if moved.get(0) else "telescope"
            name = leg.drives[min(strut, len(leg.drives) - 1)].name
            self._add(first if strut == 0 else "arm", name, _place_strut(number, strut))
            if strut not in moved:
                anchors.append(strut)
        for strut, names in moved.items():
            self.labels.append((", ".join(names), at.to_machine(struts[strut][0])[0]))
        of_feet = [name for names in moved.values() for name in names]
        of_strut = [drive.name for drive in leg.drives if drive.name not in of_feet]
        if of_strut:
            self.labels.append((", ".join(of_strut), at.to_machine(struts[0].mean(axis=0))[0]))
        return anchors

    def _add_platform(self) -> None:
        stance = self.stance
        rods = self.machine.passive_rods.values()
        points = [leg.place_joint(IDENTITY, ORIGIN) for leg in self.machine.legs] + [rod.platform for rod in rods]
        order = list_polygon(np.array(points, float))

        def locate_corners(at: _Stance) -> Points:
            corners = [*at.points, *(end for _, end in at.rods.values())]
            return np.array([corners[i] for i in order])

        self._add("platform", "platform", lambda at: at.to_machine(locate_corners(at)), len(order) > 2)
        if not coincide(locate_corners(stance).mean(axis=0), stance.origin) and not self.structure.has_central_leg:
            self._add(
                "head", "platform", lambda at: at.to_machine(np.array([locate_corners(at).mean(axis=0), at.origin]))
            )

    def _add_head(self) -> None:
        at, chain = self.stance, self.stance.list_head_frames()
        # Joints of the links, the platform's origin first; those at one place count once.
        kept = find_distinct([np.zeros(3), *[origin for _, origin in chain]])

        def place_links(at: _Stance, first: int, last: int) -> Points:
            origins = [np.zeros(3), *[origin for _, origin in at.list_head_frames()]]
            return at.to_machine(at.locate_on_platform(np.array([origins[i] for i in kept[first:last]])))

        if len(kept) > 2:
            self._add("head", "head", lambda at: place_links(at, 0, len(kept) - 1))
        if len(kept) > 1:
            self._add("tool", "tool", lambda at: place_links(at, len(kept) - 2, len(kept)))
        for step, (_, origin) in zip(self.structure.head, chain, strict=True):
            if step.drive is not None:
                self.labels.append((step.drive.name, at.to_machine(at.locate_on_platform(origin))[0]))
        rotation, tip = chain[-1] if chain else (np.eye(3), np.zeros(3))
        place = at.to_machine(at.locate_on_platform(tip))[0]
        mount = np.array(self.structure.mount, float)
        self.frames["tool"] = np.column_stack([mount @ at.rotation @ rotation, place])

    def _add_table(self) -> None:
        """Add a disc at the workpiece's frame, and the axes that turn it; these are in M, whatever the mounting."""
        chain = self.stance.list_table_frames()
        rotation, origin = chain[-1]
        self.frames["workpiece"] = np.column_stack([rotation, origin])
        radius = 0.12 * float(np.linalg.norm(np.ptp(np.vstack([item.points for item in self.items]), axis=0)))
        disc = np.column_stack([np.cos(_DISC), np.sin(_DISC), 0.0 * _DISC]) * radius
        self._add("table", "table", lambda at: _place_on_table(at, disc), True)
        for number, (step, (turned, _)) in enumerate(zip(self.structure.table, chain, strict=True)):
            if step.drive is None:
                continue
            unit = np.array(UNIT[step.axis], float)
            # An axis at right angles to the disc carries it from below; another one passes by on both sides.
            if abs(float((turned @ unit) @ rotation[:, 2])) > 0.999:
                stem = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.5 * radius]])
                self._add("axis", step.drive.name, lambda at, stem=stem: _place_on_table(at, stem))  # type: ignore[misc]
            else:
                self._add("axis", step.drive.name, _place_axis(number, 1.3 * radius * unit))
            self.labels.append((step.drive.name, self.items[-1].points[1]))


def _place_strut(leg: int, strut: int) -> Callable[[_Stance], Points]:
    """Make the rule that places a leg's strut."""
    return lambda at: at.to_machine(at.locate_struts(leg)[strut])


def _place_passive_rod(name: str) -> Callable[[_Stance], Points]:
    """Make the rule that places a passive rod."""
    return lambda at: at.to_machine(np.array(at.rods[name]))


def _place_on_table(at: _Stance, points: Points) -> Points:
    """Place points of the workpiece's frame."""
    rotation, origin = at.list_table_frames()[-1]
    placed: Points = points @ rotation.T + origin
    return placed


def _place_axis(step: int, half: Points) -> Callable[[_Stance], Points]:
    """Make the rule that places the axis of a table's step, by half of its length to both sides."""

    def place(at: _Stance) -> Points:
        turned, pivot = at.list_table_frames()[step]
        return np.array([pivot - turned @ half, pivot + turned @ half])

    return place


def _join_labels(labels: list[tuple[str, Points]]) -> tuple[tuple[str, Points], ...]:
    """Join the labels at one place into one."""
    joined: list[tuple[str, Points]] = []
    for name, place in labels:
        same = next((i for i, (_, other) in enumerate(joined) if coincide(place, other)), None)
        if same is None:
            joined.append((name, place))
        else:
            joined[same] = (f"{joined[same][0]}, {name}", place)
    return tuple(joined)


def _compose_steps(steps: Sequence[Step], joints: Sequence[float]) -> Iterator[tuple[Points, Points]]:
    """Yield rotation and origin after every step of a serial chain."""
    driven = 0
    for count, step in enumerate(steps, start=1):
        driven += step.drive is not None
        rotation, origin = compose_chain(steps[:count], joints[:driven])
        yield np.array(rotation), np.array(origin)


def _place_rail(leg: int, strut: int, point: Sequence[float], sweep: list[list[float]]) -> Callable[[_Stance], Points]:
    """Make the rule that places the feet of a leg's strut where given joints take it, its platform's joint at home."""
    return lambda at: at.to_machine([at.machine.legs[leg].struts(point, q)[strut][0] for q in sweep])


def _sweep_joints(leg: Leg, joints: list[float], strut: Points) -> Iterator[list[list[float]]]:
    """Yield a leg's joints over each drive's range, the drives after it at their low end."""
    length = float(np.linalg.norm(strut[1] - strut[0]))
    spans = [
        _cut_range(d.low, d.high, q, unit, length) for d, q, unit in zip(leg.drives, joints, leg.units, strict=True)
    ]
    for number, (low, high) in enumerate(spans):
        after = [low for low, _ in spans[number + 1 :]]
        yield [[*joints[:number], q, *after] for q in np.linspace(low, high, 49).tolist()]


def _cut_range(low: float, high: float, q: float, unit: str, length: float) -> tuple[float, float]:
    """Cut a drive's range where it has no end: to a full turn, or half a strut's length to both sides."""
    reach = pi if unit == "rad" else 0.5 * length
    low, high = (low if isfinite(low) else q - reach), (high if isfinite(high) else q + reach)
    return (q - pi, q + pi) if unit == "rad" and high - low > 2.0 * pi else (low, high)
