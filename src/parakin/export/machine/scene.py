"""A machine at a pose as named points, lines and polygons in mm, in the machine frame M.

All of it follows from the description: a rail is where a drive's range takes a strut's foot, a strut on a foot that
no drive moves is a telescope, and so on. Nothing here knows a machine or a leg kind.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite, pi
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arguments import RowsLike
from ...machine import Machine
from ...model.chain import UNIT, compose_chain
from ...model.elements import Step
from ...model.legs import Leg
from ...model.structures import PlatformPlacement

Points = NDArray[np.float64]
SceneKind = Literal["base", "rail", "telescope", "rod", "arm", "platform", "central", "head", "tool", "table", "axis"]

_NEAR = 1e-6  # mm; points nearer than this are one
_DISC = np.linspace(0.0, 2.0 * pi, 33)[:-1]


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
    row = machine.rows(machine.home if pose is None else pose, machine.axes, "pose")[0][0]
    mode = mode or machine.mode
    q = machine.inverse(row, mode) if joints is None else machine.rows(joints, machine.joints, "joints")[0][0]
    with np.errstate(invalid="ignore", divide="ignore"):
        placement = machine.place_platform(row, mode, None if joints is None else q)
        builder = _SceneBuilder(machine, placement, q)
        builder.build()
    items = tuple(item for item in builder.items if np.isfinite(item.points).all())
    labels = _join_labels([label for label in builder.labels if np.isfinite(label[1]).all()])
    missing = [letter for letter in "XYZ" if letter not in machine.axes]
    normal = builder.mount[:, "XYZ".index(missing[0])] if missing and not machine.structure.table else None
    return Scene(items, labels, builder.frames, normal)


class _SceneBuilder:
    """Gather the items of one scene in the base frame and put them into M."""

    def __init__(self, machine: Machine, placement: PlatformPlacement, joints: Points):
        self.machine, self.structure = machine, machine.structure
        self.placement, self.joints = placement, joints
        self.mount = np.array(self.structure.mount, float)
        self.base = np.array(self.structure.base, float)
        self.rotation, self.origin = np.array(placement.rotation, float), np.array(placement.origin, float)
        self.items: list[SceneItem] = []
        self.labels: list[tuple[str, Points]] = []
        self.frames = {"machine": np.eye(3, 4)}

    def build(self) -> None:
        self._add_legs()
        self._add_platform()
        self._add_head()
        if self.structure.table:
            self._add_table()

    def _to_machine(self, points: ArrayLike) -> Points:
        """Transform points of the base frame into M."""
        points_in_m: Points = np.asarray(points, float) @ self.mount.T + self.base
        return points_in_m

    def _add(self, kind: SceneKind, name: str, points: ArrayLike, closed: bool = False) -> None:
        self.items.append(SceneItem(kind, name, self._to_machine(points).reshape(-1, 3), closed))

    def _add_legs(self) -> None:
        legs, anchors = self.machine.legs, []
        points = self.machine.place_leg_joints(self.placement)
        for leg, point, q in zip(legs, points, self.machine.group_joints(self.joints.tolist()), strict=True):
            struts = [np.array(ends, float) for ends in leg.struts(point, q)]
            moved: dict[int, list[str]] = {}
            for number, (drive, feet) in enumerate(zip(leg.drives, _sweep_feet(leg, point, q, struts[0]), strict=True)):
                for strut in np.flatnonzero(np.ptp(feet, axis=0).max(axis=-1) > _NEAR):
                    moved.setdefault(int(strut), []).append(drive.name)
                    # An arm that ends at the foot is what moves it; there is no rail then.
                    if not any(_coincide(other[1], struts[strut][0]) for other in struts):
                        rail = feet[[0, -1], strut] if leg.units[number] == "mm" else feet[:, strut]
                        self._add("rail", drive.name, rail)
            for number, ends in enumerate(struts):
                first: SceneKind = "rod" if moved.get(0) else "telescope"
                self._add(first if number == 0 else "arm", leg.drives[min(number, len(leg.drives) - 1)].name, ends)
                if number not in moved:
                    anchors.append(ends[0])
            for number, names in moved.items():
                self.labels.append((", ".join(names), self._to_machine(struts[number][0])))
            if not moved:
                self.labels.append((leg.drives[0].name, self._to_machine(struts[0].mean(axis=0))))
        if self.structure.has_central_leg:
            self._add("central", "central leg", [np.zeros(3), self.origin])
        if anchors:
            ring = order_polygon(np.array(anchors))
            self._add("base", "base", ring, len(ring) > 2)

    def _add_platform(self) -> None:
        ring = order_polygon(np.array([leg.platform for leg in self.machine.legs], float))
        self._add("platform", "platform", ring @ self.rotation.T + self.origin, len(ring) > 2)
        middle = ring.mean(axis=0) @ self.rotation.T + self.origin
        if not _coincide(middle, self.origin) and not self.structure.has_central_leg:
            self._add("head", "platform", [middle, self.origin])

    def _add_head(self) -> None:
        head = self.structure.head
        serial = list(self.placement.serial)[: self.structure.head_joints]
        chain = list(_compose_steps(head, serial))
        links = _remove_duplicates([np.zeros(3), *[origin for _, origin in chain]])
        rotation, tip = chain[-1] if chain else (np.eye(3), np.zeros(3))
        at = np.array(links) @ self.rotation.T + self.origin
        if len(at) > 2:
            self._add("head", "head", at[:-1])
        if len(at) > 1:
            self._add("tool", "tool", at[-2:])
        for step, (_, origin) in zip(head, chain, strict=True):
            if step.drive is not None:
                self.labels.append((step.drive.name, self._to_machine(self.rotation @ origin + self.origin)))
        place = self._to_machine(self.rotation @ tip + self.origin)
        self.frames["tool"] = np.column_stack([self.mount @ self.rotation @ rotation, place])

    def _add_table(self) -> None:
        """Add a disc at the workpiece's frame, and the axes that turn it; these are in M, whatever the mounting."""
        table = self.structure.table
        serial = list(self.placement.serial)[self.structure.head_joints :]
        chain = list(_compose_steps(table, serial))
        rotation, origin = chain[-1]
        self.frames["workpiece"] = np.column_stack([rotation, origin])
        radius = 0.12 * float(np.linalg.norm(np.ptp(np.vstack([item.points for item in self.items]), axis=0)))
        disc = np.column_stack([np.cos(_DISC), np.sin(_DISC), 0.0 * _DISC]) * radius
        self.items.append(SceneItem("table", "table", disc @ rotation.T + origin, True))
        for step, (turned, pivot) in zip(table, chain, strict=True):
            if step.drive is None:
                continue
            axis = turned @ np.array(UNIT[step.axis])
            # An axis at right angles to the disc carries it from below; another one passes by on both sides.
            upright = abs(float(axis @ rotation[:, 2])) > 0.999
            reach = 1.3 * radius * axis
            ends = [origin, origin - 0.5 * radius * rotation[:, 2]] if upright else [pivot - reach, pivot + reach]
            self.items.append(SceneItem("axis", step.drive.name, np.array(ends)))
            self.labels.append((step.drive.name, ends[1]))


def _join_labels(labels: list[tuple[str, Points]]) -> tuple[tuple[str, Points], ...]:
    """Join the labels at one place into one."""
    joined: list[tuple[str, Points]] = []
    for name, place in labels:
        same = next((i for i, (_, other) in enumerate(joined) if _coincide(place, other)), None)
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
        yield np.array(rotation, float), np.array(origin, float)


def _sweep_feet(leg: Leg, point: Sequence[float], joints: list[float], strut: Points) -> Iterator[Points]:
    """Yield all struts' feet over each drive's range, (samples, struts, 3), the drives after it at their low end."""
    length = float(np.linalg.norm(strut[1] - strut[0]))
    spans = [
        _cut_range(d.low, d.high, q, unit, length) for d, q, unit in zip(leg.drives, joints, leg.units, strict=True)
    ]
    for number, (low, high) in enumerate(spans):
        after = [low for low, _ in spans[number + 1 :]]
        sweep = np.linspace(low, high, 49)
        yield np.array([[ends[0] for ends in leg.struts(point, [*joints[:number], q, *after])] for q in sweep], float)


def _cut_range(low: float, high: float, q: float, unit: str, length: float) -> tuple[float, float]:
    """Cut a drive's range where it has no end: to a full turn, or half a strut's length to both sides."""
    reach = pi if unit == "rad" else 0.5 * length
    low, high = (low if isfinite(low) else q - reach), (high if isfinite(high) else q + reach)
    return (q - pi, q + pi) if unit == "rad" and high - low > 2.0 * pi else (low, high)


def order_polygon(points: Points) -> Points:
    """Order the distinct points round their middle in their own plane; of a line return the ends."""
    points = np.array(_remove_duplicates(list(points)))
    if len(points) < 3:
        return points
    off = points - points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(off)
    if sizes[1] < 1e-9 * sizes[0]:
        along = off @ axes[0]
        return points[[along.argmin(), along.argmax()]]
    return points[np.argsort(np.arctan2(off @ axes[1], off @ axes[0]))]


def _remove_duplicates(points: list[Points]) -> list[Points]:
    kept: list[Points] = []
    for point in points:
        if not any(_coincide(point, other) for other in kept):
            kept.append(point)
    return kept


def _coincide(a: Points, b: Points) -> bool:
    return bool(np.linalg.norm(a - b) < _NEAR)
