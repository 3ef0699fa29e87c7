"""parakin: design, analyse and program parallel kinematic machine tools."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike, fspath
from typing import TYPE_CHECKING

from .errors import DescriptionError, InputError, InputErrors, NoMethodError, ParakinError, PoseError

if TYPE_CHECKING:
    from .kinematics.forward import Solution
    from .machine import Machine
    from .performance.atlas import Atlas, atlas
    from .toolpath.job import Job, Tolerances, prepare
    from .toolpath.path import ToolPath
    from .toolpath.placing.placement import Placement, find_placement
    from .toolpath.posting.frames import workpiece
    from .toolpath.reading.detect import read_path
    from .toolpath.timing.trajectory import Trajectory
    from .workspaces.certified.region import Region
    from .workspaces.certified.region import make_region as region
    from .workspaces.certified.workspace import Workspace, workspace
    from .workspaces.sampled.drive_sweep import sweep_drives

__version__ = "0.1.0"
__all__ = [
    "Atlas",
    "DescriptionError",
    "InputError",
    "InputErrors",
    "Job",
    "Machine",
    "NoMethodError",
    "ParakinError",
    "Placement",
    "PoseError",
    "Region",
    "Solution",
    "Tolerances",
    "ToolPath",
    "Trajectory",
    "Workspace",
    "atlas",
    "find_placement",
    "load",
    "machines",
    "prepare",
    "read_path",
    "region",
    "sweep_drives",
    "workpiece",
    "workspace",
]


def machines() -> list[str]:
    """Names of the shipped machines."""
    from .description import list_shipped_machines

    return sorted(list_shipped_machines())


def load(name: str | PathLike[str], parameters: Mapping[str, float | str] | None = None) -> Machine:
    """A machine by its shipped name or by the path of its file.

    Parameters
    ----------
    name : one of :func:`machines`, or a YAML file
    parameters : sizes to override, by the names in the file; numbers are mm or rad, text carries its unit

    Raises :class:`InputError` with file and line for a file that is no machine, or none that works.
    """
    from .description import find_key_line, find_machine_file, read_machine
    from .machine import Machine

    path = find_machine_file(name)
    spec = read_machine(path, parameters)
    try:
        return Machine(spec)
    except DescriptionError as error:
        raise InputError(str(error), fspath(path), find_key_line(path, error.part)) from None


# The public names that are loaded when they are first used: the module, and the name there if it is another.
_LAZY = {
    "Atlas": "performance.atlas",
    "Job": "toolpath.job",
    "Machine": "machine",
    "Placement": "toolpath.placing.placement",
    "Region": "workspaces.certified.region",
    "Solution": "kinematics.forward",
    "Tolerances": "toolpath.job",
    "ToolPath": "toolpath.path",
    "Trajectory": "toolpath.timing.trajectory",
    "Workspace": "workspaces.certified.workspace",
    "atlas": "performance.atlas",
    "find_placement": "toolpath.placing.placement",
    "prepare": "toolpath.job",
    "read_path": "toolpath.reading.detect",
    "region": "workspaces.certified.region:make_region",
    "sweep_drives": "workspaces.sampled.drive_sweep",
    "workpiece": "toolpath.posting.frames",
    "workspace": "workspaces.certified.workspace",
}


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name in _LAZY:
        module, _, own_name = _LAZY[name].partition(":")
        return getattr(import_module(f"{__name__}.{module}"), own_name or name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
