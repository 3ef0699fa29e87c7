"""The limits of the drives' forces along a joint path, as bounds of s̈ and ṡ²."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...dynamics.inverse_dynamics import Dynamics
from ...errors import PoseError
from ...machine import Machine
from .joint_path import JointPath
from .kernels.splines import ForceRows, PathState

_BLOCK = 1 << 15  # rows at a time


class ForceLimits:
    """What the forces of a machine's drives may be, where its file says it."""

    def __init__(self, machine: Machine):
        self._greatest = np.array([drive.force for drive in machine.drives])
        self.drives = np.flatnonzero(np.isfinite(self._greatest))
        self._dynamics = Dynamics(machine) if len(self.drives) else None

    def __bool__(self) -> bool:
        return self._dynamics is not None

    def bound(self, joint_path: JointPath) -> JointPath:
        """Bound a joint path by what its motion asks of the drives: their weights, and inertia along its length.

        A drive's force is inertia·s̈ + centrifugal·ṡ² + weight, between two bounds: for each a row is divided by what
        the weight leaves.

        Raises :class:`PoseError` where a drive can't hold the weight, or a pose is singular.
        """
        if self._dynamics is None:
            return joint_path
        count = len(joint_path.segment)
        along, across = (np.empty((count, 2 * len(self.drives))) for _ in range(2))
        for begin in range(0, count, _BLOCK):
            block = np.arange(begin, min(begin + _BLOCK, count))
            row = np.where(np.append(joint_path.step, 0.0)[block] > 0.0, block, block - 1)
            shift = np.where(row == block, 0.0, joint_path.step[row])
            state = joint_path.evaluate(PathState(row, shift, np.ones(len(row)), np.zeros(len(row))))
            poses = joint_path.poses(row, shift)
            own = self._dynamics.compute_path_forces(poses, state.joints, state.speeds, state.accelerations)
            rest = self._leave_weight(joint_path, begin, own.weight[:, self.drives])
            for side, sign in enumerate((1.0, -1.0)):
                columns = slice(side * len(self.drives), (side + 1) * len(self.drives))
                along[block, columns] = sign * own.inertia[:, self.drives] / rest[side]
                across[block, columns] = sign * own.centrifugal[:, self.drives] / rest[side]
        forces = ForceRows(np.tile(self.drives, 2), along, across)
        return replace(joint_path, rows=joint_path.rows._replace(forces=forces))

    def _leave_weight(self, joint_path: JointPath, begin: int, weight: Array) -> tuple[Array, Array]:
        """Subtract the weight from what each drive can give up and down, (rows, drives) each."""
        rest = self._greatest[self.drives] - weight, self._greatest[self.drives] + weight
        lacking = ~(np.minimum(*rest) > 0.0)
        if lacking.any():
            row, drive = (int(indices[0]) for indices in np.nonzero(lacking))
            name = joint_path.posted.machine.joints[self.drives[drive]]
            where = joint_path.describe_step(min(begin + row, len(joint_path.step) - 1))
            if np.isnan(weight[row, drive]):
                raise PoseError(f"{where} the tool passes a singular pose, where forces have no bound")
            raise PoseError(f"{where} {name} can't hold the weight: its force is too small")
        return rest
