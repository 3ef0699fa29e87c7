"""Poses with their joints: a table, and its CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from ...units import name_display_unit, to_display
from ..number_format import format_fixed

if TYPE_CHECKING:
    from ...arrays import Array
    from ...kinematics.solution import Solution
    from ...machine import Machine

ColumnGroup: TypeAlias = Literal["pose", "joints"]

_LENGTH_DIGITS, _ANGLE_DIGITS = 6, 8


@dataclass(frozen=True, eq=False)
class PoseTable:
    """Poses and joints side by side, n rows; mm and rad.

    poses, joints : (n, axes) and (n, joints)
    broken : what each row breaks, a limit's name; empty where it is allowed
    solution : of the direct problem, if that was solved
    """

    machine: Machine
    poses: Array
    joints: Array
    broken: Sequence[str]
    solution: Solution | None = None

    def columns(self, side: ColumnGroup) -> tuple[tuple[str, ...], tuple[str, ...], Array]:
        """Return names, units and values (n, columns) of the poses or of the joints."""
        machine = self.machine
        if side == "pose":
            return machine.axes, machine.axis_units, self.poses
        return machine.joints, machine.joint_units, self.joints


def format_pose_csv(table: PoseTable) -> str:
    """Format the table as CSV: lengths to 1e-6 mm, angles to 1e-8 deg, a field empty where there is no value."""
    (axes, pose_units, poses), (names, joint_units, joints) = table.columns("pose"), table.columns("joints")
    units = (*pose_units, *joint_units)
    head = [f"{name} [{name_display_unit(unit)}]" for name, unit in zip((*axes, *names), units, strict=True)]
    formats = [(to_display(1.0, unit), _ANGLE_DIGITS if unit == "rad" else _LENGTH_DIGITS) for unit in units]
    residuals: list[float] = []
    if table.solution is not None:
        residuals = table.solution.residual.tolist()
        head.append("residual [mm]")
    lines = [",".join([*head, "broken"])]
    for i, (pose, joint, broken) in enumerate(zip(poses.tolist(), joints.tolist(), table.broken, strict=True)):
        cells = zip((*pose, *joint), formats, strict=True)
        texts = [
            "" if value != value else format_fixed(value * factor, digits, "") for value, (factor, digits) in cells
        ]
        texts += [f"{residual:.1e}" for residual in residuals[i : i + 1]]
        lines.append(",".join([*texts, broken]))
    return "\n".join(lines) + "\n"
