"""The limits of the drives' forces and powers along a joint path, as bounds of s̈ and ṡ²."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags
from ...dynamics.inverse_dynamics import Dynamics, PathForces
from ...errors import PoseError
from ..posting.posted import Posted
from .joint_path import JointPath
from .kernels.splines import ForceRows, PathState

_BLOCK = 1 << 15  # rows at a time
_LEAST = 1e-12  # mm²/s², of ṡ² at which a power is replaced by its tangent
# Of ṡ² at the next rows: a tangent at less would bound it there, too, for bounds go straight between rows.
_BESIDE = 0.5


class _Demands(NamedTuple):
    """What a joint path asks of the drives at its rows, (rows, joints) each: forces, and the joints' slopes."""

    forces: PathForces
    slopes: Array


def list_cutting_force(posted: Posted) -> Array:
    """List the force on the tip of a path by the machine's translations, (translations,) N.

    Raises :class:`PoseError` for what is none.
    """
    force = np.array(posted.path.cutting_force, np.float64)
    if force.shape != (3,) or not np.isfinite(force).all():
        raise PoseError("cutting_force: three numbers expected")
    return force[["XYZ".index(axis) for axis in posted.machine.axes if axis in "XYZ"]]


class ForceLimits:
    """What the forces and powers of a machine's drives may be on a path, where the machine's file says it."""

    def __init__(self, posted: Posted):
        machine = posted.machine
        self._greatest = np.array([drive.force for drive in machine.drives])
        self._power = np.array([drive.power for drive in machine.drives])
        self._forced = np.flatnonzero(np.isfinite(self._greatest))
        self._powered = np.flatnonzero(np.isfinite(self._power))
        self._acting = list_cutting_force(posted)
        self._dynamics = Dynamics(machine) if len(self._forced) + len(self._powered) else None
        self._known: tuple[Array, _Demands] | None = None  # of the joints at the rows that were measured last

    def __bool__(self) -> bool:
        return self._dynamics is not None

    @property
    def bounds_power(self) -> bool:
        """Whether a drive's power is bounded."""
        return bool(len(self._powered))

    def bound(self, joint_path: JointPath, squares: Array | None = None) -> JointPath:
        """Bound a joint path by what its motion asks of the drives: their weights, and inertia along its length.

        A drive's force is inertia·s̈ + centrifugal·ṡ² + weight, between two bounds: for each a row is divided by what
        the weight leaves. Its power is that times q'·ṡ. The force that a power allows, power/(q'·ṡ), is convex in ṡ²,
        so its tangent at any ṡ² is on the safe side.

        squares : (rows,) ṡ² at which powers are replaced by tangents; without them they are not bounded

        Raises :class:`PoseError` where a drive can't hold the weight, or a pose is singular.
        """
        if self._dynamics is None:
            return joint_path
        demands = self._measure_demands(joint_path)
        bounds = [self._bound_forces(joint_path, demands.forces)]
        if squares is not None and self.bounds_power:
            bounds.append(self._bound_powers(demands, squares))
        drive, along, across = (np.concatenate(columns, -1) for columns in zip(*bounds, strict=True))
        forces = ForceRows(drive, np.ascontiguousarray(along), np.ascontiguousarray(across))
        return replace(joint_path, rows=joint_path.rows._replace(forces=forces))

    def _measure_demands(self, joint_path: JointPath) -> _Demands:
        assert self._dynamics is not None
        if self._known is not None and self._known[0] is joint_path.joints:
            return self._known[1]
        blocks = []
        for begin in range(0, len(joint_path.segment), _BLOCK):
            block = np.arange(begin, min(begin + _BLOCK, len(joint_path.segment)))
            row = np.where(np.append(joint_path.step, 0.0)[block] > 0.0, block, block - 1)
            shift = np.where(row == block, 0.0, joint_path.step[row])
            state = joint_path.evaluate(PathState(row, shift, np.ones(len(row)), np.zeros(len(row))))
            poses = joint_path.poses(row, shift)
            acting = self._find_acting(joint_path)[block, None] * self._acting if self._acting.any() else None
            own = self._dynamics.compute_path_forces(poses, state.joints, state.speeds, state.accelerations, acting)
            blocks.append((*own, state.speeds))
        *forces, slopes = (np.concatenate(columns) for columns in zip(*blocks, strict=True))
        self._known = joint_path.joints, _Demands(PathForces(*forces), slopes)
        return self._known[1]

    def _find_acting(self, joint_path: JointPath) -> Flags:
        """Find the rows at an end of a motion at a programmed feed, where the tool cuts."""
        rapid = joint_path.posted.path.rapid[joint_path.curve.record_of_piece[joint_path.segment]]
        cutting: Flags = ~(rapid & np.append(rapid[:1], rapid[:-1]))
        return cutting

    def _bound_forces(self, joint_path: JointPath, own: PathForces) -> tuple[Array, Array, Array]:
        drives = self._forced
        rests = self._leave_weight(joint_path, own.weight[:, drives])
        along, across = (
            np.concatenate([sign * column[:, drives] / rest for sign, rest in zip((1.0, -1.0), rests, strict=True)], 1)
            for column in (own.inertia, own.centrifugal)
        )
        return np.tile(drives, 2), along, across

    def _bound_powers(self, demands: _Demands, squares: Array) -> tuple[Array, Array, Array]:
        drives, own = self._powered, demands.forces
        slopes = np.abs(demands.slopes[:, drives])
        beside = np.maximum(np.append(squares[1:], 0.0), np.append(0.0, squares[:-1]))
        beside = np.where(squares > 0.0, np.maximum(squares, _BESIDE * beside), beside)
        weight, power = own.weight[:, drives], self._power[drives]
        with np.errstate(divide="ignore"):
            holding = (power / (slopes * np.abs(weight))) ** 2  # ṡ² at which the weight takes all of the power
        at = np.maximum(np.minimum(beside[:, None], holding), _LEAST)
        # Both sides are multiplied by the joint's speed at the tangent's place, for a joint may stand.
        speed = slopes * np.sqrt(at)
        along, across = [], []
        for sign in (1.0, -1.0):
            rest = 1.5 * power - sign * weight * speed
            along.append(sign * own.inertia[:, drives] * speed / rest)
            across.append((sign * own.centrifugal[:, drives] * speed + 0.5 * power / at) / rest)
        return np.tile(drives + len(self._power), 2), np.concatenate(along, 1), np.concatenate(across, 1)

    def _leave_weight(self, joint_path: JointPath, weight: Array) -> tuple[Array, Array]:
        """Subtract the weight from what each drive can give up and down, (rows, drives) each."""
        rest = self._greatest[self._forced] - weight, self._greatest[self._forced] + weight
        lacking = ~(np.minimum(*rest) > 0.0)
        if lacking.any():
            row, drive = (int(indices[0]) for indices in np.nonzero(lacking))
            name = joint_path.posted.machine.joints[self._forced[drive]]
            where = joint_path.describe_step(min(row, len(joint_path.step) - 1))
            if np.isnan(weight[row, drive]):
                raise PoseError(f"{where} the tool passes a singular pose, where forces have no bound")
            load = "the weight and the cutting force" if self._acting.any() else "the weight"
            raise PoseError(f"{where} {name} can't hold {load}: its force is too small")
        return rest
