"""Poles: a tool axis along a turning axis leaves that axis's angle free, and close by the angle swings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...kinematics.wrist.pole_thresholds import NEAR_Z, RIM
from ...kinematics.wrist.pose_angles import solve_direction
from ...machine import Machine
from ..posting.posted import Posted
from .deviation import Interpolation

_PARALLEL = 1e-12  # sine of the angle between two axes of a machine: below this it is rounding
_CONVERGED = 1e-15  # of a unit vector
_ROUNDS = 60
_POINTS_AT_ONCE = 1 << 12
_BENDING = 0.1  # sine of B: where C turns as much as for a tool more upright, even poses are not straight
_RATIOS = (4.0, 2.0, 1.0)  # of RIM
_CLOSE_RATIOS = (*(2.0 ** (0.5 * k) for k in range(12, -1, -1)), 0.989, 0.97)  # of RIM, where the tool is NEAR_Z


@dataclass(frozen=True, eq=False)
class Pole:
    """A turning axis of head, table or pose along which the tool's axis may come to lie.

    text : its name in a note
    angle : the name of what is free there: a joint, or C
    joint : its index in the joint vector; None for C
    first : the turning axis, a unit vector in the frame that carries it
    """

    machine: Machine
    text: str
    angle: str
    joint: int | None
    first: Array

    @property
    def moves(self) -> bool:
        """Whether the pose turns the pole: a central leg carries it."""
        return self.joint is not None and self.machine.structure.carries_pole

    @property
    def is_upright(self) -> bool:
        """Whether the pole is that of B = 0, or lies on the same axis."""
        return not self.moves and bool(np.abs(np.cross(self.first, [0.0, 0.0, 1.0])).max() < _PARALLEL)

    def list_inner_radii(self, axis: Array, radius: float) -> list[float]:
        """List the radii within ``radius``, descending, at which records keep even poses straight to this pole.

        axis : (3,) of the tool there, in M

        Where the tool is nearly upright C turns on the way, so that even poses bend: both sides of the pole would tell
        another free angle, and the joint would jump when a controller lets go of it. Corners there are not rounded.
        """
        lean = np.hypot(axis[0], axis[1])
        if self.is_upright or lean > _BENDING:
            return []
        ratios = _CLOSE_RATIOS if lean < NEAR_Z else _RATIOS  # C turns far where both poles are in one place
        return [ratio * RIM for ratio in ratios if ratio * RIM < radius]

    def get_angles(self, posted: Posted) -> Array:
        """Return the angle that the pole frees along a posted path, (n,) rad."""
        if self.joint is not None:
            return posted.joints[:, self.joint]
        assert self.machine.direction is not None
        return posted.poses[:, self.machine.direction.c]

    def project_axes(self, tip: Array, axis: Array) -> Array:
        """Project tool axes (m, 3) from the centre onto the plane that touches the unit sphere at the pole: (m, 2).

        The gnomonic projection: great circles are straight there, where the pole stands still. An axis on the pole is
        at (0, 0), one at right angles to it infinitely far.
        """
        projected = np.empty((len(tip), 2))
        for start in range(0, len(tip), _POINTS_AT_ONCE):
            block = slice(start, start + _POINTS_AT_ONCE)
            carried = np.einsum("mji,mj->mi", self._compute_rotations(tip[block], axis[block]), axis[block])
            with np.errstate(divide="ignore", invalid="ignore"):
                projected[block] = (carried @ self._across.T) / (carried @ self.first)[:, None]
        return projected

    def find_axes(self, tip: Array, axis: Array, projected: Array, extension: Array) -> Array:
        """Find the tool axes (m, 3) at points (m, 2) of the projection, on the side of the pole on which ``axis`` are.

        tip, axis : (m, 3) of the machine's own tool; extension : (m,) mm by which the path's tool is longer

        Turning the tool about its tip turns the central leg a little too, so the axes are found by iteration. It is
        the tip of the longer tool that stays.
        """
        held_tip = tip - extension[:, None] * axis
        first = self.first
        carried = first + projected @ self._across
        carried /= np.linalg.norm(carried, axis=1)[:, None]
        along = np.einsum("mji,mj,i->m", self._compute_rotations(tip, axis), axis, first)
        carried = np.where(along[:, None] < 0.0, -carried, carried)
        for _ in range(_ROUNDS):
            before = axis
            rotations = self._compute_rotations(held_tip + extension[:, None] * before, before)
            axis = np.einsum("mij,mj->mi", rotations, carried)
            if np.abs(axis - before).max(initial=0.0) < _CONVERGED:
                break
        return axis

    @property
    def _across(self) -> Array:
        """Two directions at right angles to the pole, (2, 3)."""
        one = np.cross(self.first, np.eye(3)[np.abs(self.first).argmin()])
        one /= np.linalg.norm(one)
        return np.stack([one, np.cross(self.first, one)])

    def _compute_rotations(self, tip: Array, axis: Array) -> Array:
        """Compute the rotations (m, 3, 3) in M of the frame that carries the pole."""
        if not self.moves:
            return np.broadcast_to(np.eye(3), (len(tip), 3, 3))
        pose = [*tip.T, *solve_direction(axis)[:2]]
        with np.errstate(divide="ignore", invalid="ignore"):
            rotation = self.machine.structure.turn_first_axis(pose)
        return np.stack([np.stack(np.broadcast_arrays(*row, axis[:, 0])[:3], axis=-1) for row in rotation], axis=-2)


def find_poles(machine: Machine, interpolation: Interpolation, has_turns: bool) -> list[Pole]:
    """Find the poles that matter: that of the wrist always, and B = 0 where the pose's angles go evenly.

    has_turns : the program gives C itself, so that nothing is free at B = 0
    """
    poles: list[Pole] = []
    wrist = machine.wrist
    if wrist is not None:
        text = f"the {'head' if wrist.is_in_head else 'table'}'s pole"
        poles.append(Pole(machine, text, machine.joints[wrist.first], wrist.first, wrist.first_axis))
    direction = machine.direction
    if interpolation == "pose" and direction is not None and not any(pole.is_upright for pole in poles):
        poles.append(Pole(machine, "Z, where C is free", machine.axes[direction.c], None, np.array([0.0, 0.0, 1.0])))
    return [pole for pole in poles if not (has_turns and pole.is_upright)]
