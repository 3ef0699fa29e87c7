"""``parakin inverse`` and ``parakin forward``: joints for poses and poses for joints, one or a CSV of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError
from .console import announce_compiling, fixed, print_json, rim, rim_unit, say, table
from .offences import offence_json, offence_line
from .options import OFF_LIMITS, Json, Mode, Name, Sizes, machine_of
from .values import parse_row

if TYPE_CHECKING:
    from ..arrays import Array
    from ..kinematics.forward import Solution
    from ..machine import Machine
    from ..toolpath.posting.offences import Judgement
    from ..toolpath.posting.posted import Offence

Csv = Annotated[Path | None, Parameter(help="Rows of values instead, mm and degrees; with a header in any order.")]
Output = Annotated[Path | None, Parameter(name=["--output", "-o"], help="Write the result there, as CSV.")]


def inverse(
    name: Name,
    /,
    *values: str,
    csv: Csv = None,
    mode: Mode = None,
    output: Output = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """Joints for poses.

    The exit code is 3 if a pose is out of reach or off limits.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    values
        A pose in mm and degrees, in the order of the axes or by name: X=10 Z=-1400; the rest comes from home.
    """
    machine = machine_of(name, sizes)
    poses, lines = _given(machine, values, csv, machine.axes, machine.axis_units, machine.home, "pose")
    announce_compiling()
    from ..toolpath.posting.offences import judge_path

    joints = machine.inverse(poses, mode)
    found = judge_path(machine, poses, joints, lines, mode)
    result = _Result(machine, poses, joints, [_name(found, i) for i in range(len(poses))])
    result.tell("inverse", "joints", csv, output, json, found.offences)
    return OFF_LIMITS if found.offences else 0


def forward(
    name: Name,
    /,
    *values: str,
    csv: Csv = None,
    near: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    output: Output = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """Poses for joints.

    The exit code is 3 if no pose is found, or one that is off limits.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    values
        Joints in mm and degrees, in their order or by name: d1=1200 d2=1250; the rest is home's.
    near
        A pose to start from and to stay near, with commas: 0,0,-1400,0,0 or X=10,Z=-1400; home by default.
    """
    import numpy as np

    machine = machine_of(name, sizes)
    announce_compiling()
    at_home = machine.inverse(machine.home)
    joints, lines = _given(machine, values, csv, machine.joints, machine.joint_units, at_home, "joints")
    start = None
    if near is not None:
        parts = [part.strip() for part in near.split(",")]
        start = parse_row(parts, machine.axes, machine.axis_units, machine.home, "--near")
    from ..toolpath.posting.offences import judge_path

    solution = machine.forward(joints, start)
    good = np.flatnonzero(solution.converged)
    found = judge_path(machine, solution.poses[good], joints[good], lines[good])
    offences = tuple(replace(offence, record=int(good[offence.record])) for offence in found.offences)
    verdicts = ["not converged"] * len(joints)
    for i, index in enumerate(good.tolist()):
        verdicts[index] = _name(found, i)
    result = _Result(machine, solution.poses, joints, verdicts, solution)
    result.tell("forward", "pose", csv, output, json, offences)
    for index in np.flatnonzero(~solution.converged).tolist()[:10]:
        place = f"{csv}:{lines[index]}" if csv else "joints"
        open_by = solution.residual[index]
        closes = np.isnan(open_by) or open_by <= machine.closure_tolerance
        say(f"{place}: no pose found" + ("" if closes else f" (the legs fail to close by {open_by:.3g} mm)"))
    lost = len(joints) - len(good)
    if lost > 10:
        say(f"{csv}: no pose found for {lost - 10:,} more rows")
    return OFF_LIMITS if lost or found.offences else 0


def _name(found: Judgement, index: int) -> str:
    broken = int(found.broken[index])
    return found.limits[broken - 1] if broken else ""


def _given(
    machine: Machine,
    values: tuple[str, ...],
    csv: Path | None,
    names: tuple[str, ...],
    units: tuple[str, ...],
    default: Array,
    what: str,
) -> tuple[Array, Any]:
    """The rows a command is given, mm and rad, and their lines in the CSV."""
    import numpy as np

    if csv is not None:
        if values:
            raise InputError("values on the line and --csv, expected one of them", what)
        from .rows import read_rows

        return read_rows(csv, names, units)
    if not values:
        raise InputError(f"no values, expected {' '.join(names)} (or --csv FILE)", what)
    return parse_row(values, names, units, default, what)[None, :], np.zeros(1, np.int64)


class _Result:
    """Poses and joints side by side, and what to say of each."""

    def __init__(
        self, machine: Machine, poses: Array, joints: Array, verdicts: list[str], solution: Solution | None = None
    ):
        self.machine, self.poses, self.joints, self.verdicts = machine, poses, joints, verdicts
        self.solution = solution  # of the direct problem

    def tell(
        self, command: str, what: str, csv: Path | None, output: Path | None, json: bool, offences: Sequence[Offence]
    ) -> None:
        """Print or write the result; ``what`` was asked for, ``joints`` or ``pose``."""
        for offence in offences:
            say(offence_line(f"{csv}:{offence.line}", offence, "row") if csv else f"pose: {offence.text}")
        if output is not None:
            from ..export.files import write_all

            write_all(output.parent, {output.name: self._csv()})
        if json:
            print_json(
                {
                    "schema": f"parakin.{command}/1",
                    "machine": self.machine.name,
                    "verdict": "off limits" if any(self.verdicts) else "ok",
                    "rows": self._rows(),
                    "offences": [offence_json(offence) for offence in offences],
                    "files": {} if output is None else {"table": str(output)},
                }
            )
        elif output is not None:
            print(f"table {output}")
        elif csv is not None:
            print(self._csv(), end="")
        else:
            names, units, values = self._columns(what)
            cells = [
                (name, "-" if value != value else fixed(rim(value, unit), 6), rim_unit(unit))
                for name, unit, value in zip(names, units, values[0].tolist(), strict=True)
            ]
            print(table(cells, (what, "", ""), " r"))
            if self.solution is not None and self.solution.converged[0]:
                print(f"\nconverged in {self.solution.steps[0]} steps, residual {self.solution.residual[0]:.1e} mm")

    def _rows(self) -> list[dict[str, Any]]:
        rows: list[dict[str, Any]] = [
            {"pose": pose, "joints": joints, "broken": verdict or None}
            for pose, joints, verdict in zip(self._named("pose"), self._named("joints"), self.verdicts, strict=True)
        ]
        if self.solution is not None:
            verdicts = zip(self.solution.residual.tolist(), self.solution.converged.tolist(), strict=True)
            for row, (residual, converged) in zip(rows, verdicts, strict=True):
                row |= {"residual": residual, "converged": converged}
        return rows

    def _columns(self, what: str) -> tuple[tuple[str, ...], tuple[str, ...], Array]:
        machine = self.machine
        if what == "pose":
            return machine.axes, machine.axis_units, self.poses
        return machine.joints, machine.joint_units, self.joints

    def _named(self, what: str) -> list[dict[str, float]]:
        names, units, values = self._columns(what)
        factors = [rim(1.0, unit) for unit in units]
        return [
            {name: value * factor for name, value, factor in zip(names, line, factors, strict=True)}
            for line in values.tolist()
        ]

    def _csv(self) -> str:
        (axes, pose_units, poses), (names, joint_units, joints) = self._columns("pose"), self._columns("joints")
        units = (*pose_units, *joint_units)
        head = [f"{n} [{rim_unit(u)}]" for n, u in zip((*axes, *names), units, strict=True)]
        form = [(rim(1.0, unit), 8 if unit == "rad" else 6) for unit in units]
        residuals: list[float] = []
        if self.solution is not None:
            residuals = self.solution.residual.tolist()
            head.append("residual [mm]")
        lines = [",".join([*head, "broken"])]
        for i, (pose, joint, verdict) in enumerate(zip(poses.tolist(), joints.tolist(), self.verdicts, strict=True)):
            cells = zip((*pose, *joint), form, strict=True)
            texts = ["" if value != value else fixed(value * factor, digits, "") for value, (factor, digits) in cells]
            texts += [f"{residual:.1e}" for residual in residuals[i : i + 1]]
            lines.append(",".join([*texts, verdict]))
        return "\n".join(lines) + "\n"
