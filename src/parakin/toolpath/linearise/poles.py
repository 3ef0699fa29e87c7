"""Poles: tool axes along a turning axis, where that axis's angle is free and beside which it swings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...machine import Machine
from ..path import Floats
from ..posting.posted import Posted
from .deviation import Under

_STEPS = 60
_EXACT = 1e-15
_BLOCK = 1 << 12  # points looked at together


@dataclass(frozen=True, eq=False)
class Pole:
    """A turning axis of head, table or pose along which the tool's axis may come to lie.

    text : as a note has it
    angle : the name of what is free there: a joint, or C
    joint : its index in the joint vector; None for C
    first : the turning axis, a unit vector in the frame that carries it
    """

    machine: Machine
    text: str
    angle: str
    joint: int | None
    first: Floats

    @property
    def moves(self) -> bool:
        """Whether the pose turns the pole: a central leg carries it."""
        return self.joint is not None and self.machine.structure.has_central_leg

    @property
    def upright(self) -> bool:
        """B = 0, or the same axis."""
        return not self.moves and bool(np.abs(np.cross(self.first, [0.0, 0.0, 1.0])).max() < 1e-12)

    def angles(self, posted: Posted) -> Floats:
        """The angle that the pole frees along a posted path, (n,) rad."""
        return posted.poses[:, 4] if self.joint is None else posted.joints[:, self.joint]

    def beside(self, tip: Floats, axis: Floats) -> Floats:
        """Where tool axes (m, 3) pass a plane at right angles to the pole, at a distance of 1: (m, 2), (0, 0) on it.

        Great circles are straight there, where the pole stands still. Infinite at right angles to the pole.
        """
        place = np.empty((len(tip), 2))
        for start in range(0, len(tip), _BLOCK):
            some = slice(start, start + _BLOCK)
            seen = np.einsum("mji,mj->mi", self._rotation(tip[some], axis[some]), axis[some])
            with np.errstate(divide="ignore", invalid="ignore"):
                place[some] = (seen @ self._across.T) / (seen @ self.first)[:, None]
        return place

    def pointing(self, tip: Floats, axis: Floats, place: Floats) -> Floats:
        """Tool axes (m, 3) with :meth:`beside` = ``place`` (m, 2), on the side of the pole on which ``axis`` are."""
        first = self.first
        seen = first + place @ self._across
        seen /= np.linalg.norm(seen, axis=1)[:, None]
        along = np.einsum("mji,mj,i->m", self._rotation(tip, axis), axis, first)
        seen = np.where(along[:, None] < 0.0, -seen, seen)
        # Turning the tool about its tip turns the central leg a little too.
        for _ in range(_STEPS):
            before = axis
            axis = np.einsum("mij,mj->mi", self._rotation(tip, before), seen)
            if np.abs(axis - before).max(initial=0.0) < _EXACT:
                break
        return axis

    @property
    def _across(self) -> Floats:
        """Two directions at right angles to the pole, (2, 3)."""
        one = np.cross(self.first, np.eye(3)[np.abs(self.first).argmin()])
        one /= np.linalg.norm(one)
        return np.stack([one, np.cross(self.first, one)])

    def _rotation(self, tip: Floats, axis: Floats) -> Floats:
        """Of the frame that carries the pole, (m, 3, 3) in M."""
        if not self.moves:
            return np.broadcast_to(np.eye(3), (len(tip), 3, 3))
        kx, ky, kz = axis.T
        pose = [*tip.T, np.arctan2(np.hypot(kx, ky), kz), np.arctan2(ky, kx)]
        with np.errstate(divide="ignore", invalid="ignore"):
            rotation = self.machine.structure.turn_first_axis(pose)
        return np.stack([np.stack(np.broadcast_arrays(*row, kx)[:3], axis=-1) for row in rotation], axis=-2)


def poles_of(machine: Machine, under: Under, turned: bool) -> list[Pole]:
    """The poles that matter: of head and table always, and B = 0 where the pose's angles go evenly.

    ``turned`` where the program gives C itself: then nothing is free at B = 0.
    """
    wrist, found = machine.wrist, []
    if wrist is not None:
        text = f"the {'head' if wrist.is_in_head else 'table'}'s pole"
        found.append(Pole(machine, text, machine.joints[wrist.first], wrist.first, wrist.first_axis))
    if under == "pose" and machine.has_direction and not any(pole.upright for pole in found):
        found.append(Pole(machine, "Z, where C is free", "C", None, np.array([0.0, 0.0, 1.0])))
    return [pole for pole in found if not (turned and pole.upright)]
