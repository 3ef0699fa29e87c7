"""parakin: design, analyse and program parallel kinematic machine tools."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike, fspath
from typing import TYPE_CHECKING

from .displays import register_display
from .errors import DescriptionError, InputError, InputErrors, NoMethodError, ParakinError, PoseError
from .version import __version__

if TYPE_CHECKING:
    from pathlib import Path

    from .accuracy.accuracy import Accuracy, allocate_tolerances, analyse_accuracy
    from .accuracy.worst_case import WorstCase, bound_worst_case
    from .calibration.calibration import Calibration, calibrate
    from .calibration.identifiability import UnidentifiableError
    from .calibration.measurement_plan import MeasurementPlan, plan_measurements
    from .calibration.measurements import Measurements, MeasuringSetup, Noise, make_measurements
    from .comparison.comparison import Comparison, compare
    from .controllers.joints.program import make_joint_program
    from .controllers.joints.program_reader import JointProgram, read_joint_program
    from .controllers.linuxcnc.configuration import make_linuxcnc_configuration
    from .controllers.linuxcnc.program import make_linuxcnc_program
    from .export.accuracy_map import render_accuracy_map
    from .export.calibration import format_calibrated_yaml, render_residuals
    from .export.comparison_page import render_comparison_page
    from .export.files import write_files
    from .export.force_curves import render_drive_forces
    from .export.front_page import render_front_page
    from .export.machine.picture import render_machine_picture
    from .export.page.page import render_machine_page, render_path_page
    from .export.report.report import render_report
    from .export.stiffness_map import render_stiffness_map
    from .export.sweep_folder import SweepResult, run_sweep
    from .export.workspace.meshes import Mesh, make_mesh
    from .families.family import Family
    from .families.family import make_family as family
    from .kinematics.assemblies import Assemblies
    from .kinematics.solution import Solution
    from .machine import Machine
    from .model.geometric_parameters import Parameter
    from .model.spec import Spec
    from .performance.atlas import Atlas, atlas
    from .performance.certified.nearest_singularity import SingularityDistance, find_nearest_singularity
    from .stiffness.stiffness import Stiffness, analyse_stiffness
    from .synthesis.designs import Designs, ProvedDesign, UnprovedDesign, find_designs
    from .synthesis.problem import DesignProblem
    from .synthesis.sweep import SweepPlan
    from .toolpath.job import Job, Tolerances, prepare
    from .toolpath.linearise.rewinds import Clearance, Rewind, RewoundPath, rewind_path
    from .toolpath.path import ToolPath
    from .toolpath.placing.placement import Placement, find_placement, find_placements
    from .toolpath.posting.frames import workpiece
    from .toolpath.posting.tool_lengths import fit_tool_lengths
    from .toolpath.reading.detect import read_path
    from .toolpath.reading.tool_table import read_tool_table
    from .toolpath.timing.drive_forces import DriveForces, compute_drive_forces
    from .toolpath.timing.trajectory import Trajectory
    from .toolpath.tool_turn.choice import ToolTurn, choose_tool_turn
    from .toolpath.turned_job import TurnedJob, prepare_turned
    from .workspaces.certified.region import Region
    from .workspaces.certified.region import make_region as region
    from .workspaces.certified.workspace import Workspace, workspace
    from .workspaces.connected.components import Components, find_components
    from .workspaces.inscribed.largest_box import InscribedBox, find_largest_box
    from .workspaces.sampled.cross_sections import CrossSection, find_cross_sections
    from .workspaces.sampled.distance_field import SampledField, sample_field
    from .workspaces.sampled.drive_sweep import DriveWorkspace, sweep_drives
    from .workspaces.sampled.grid import GridWorkspace, sample_grid
    from .workspaces.sampled.polar_sweep import PolarWorkspace, sweep_polar

__all__ = [
    "Accuracy",
    "Assemblies",
    "Atlas",
    "Calibration",
    "Clearance",
    "Comparison",
    "Components",
    "CrossSection",
    "DescriptionError",
    "DesignProblem",
    "Designs",
    "DriveForces",
    "DriveWorkspace",
    "Family",
    "GridWorkspace",
    "InputError",
    "InputErrors",
    "InscribedBox",
    "Job",
    "JointProgram",
    "Machine",
    "MeasurementPlan",
    "Measurements",
    "MeasuringSetup",
    "Mesh",
    "NoMethodError",
    "Noise",
    "ParakinError",
    "Parameter",
    "Placement",
    "PolarWorkspace",
    "PoseError",
    "ProvedDesign",
    "Region",
    "Rewind",
    "RewoundPath",
    "SampledField",
    "SingularityDistance",
    "Solution",
    "Stiffness",
    "SweepPlan",
    "SweepResult",
    "Tolerances",
    "ToolPath",
    "ToolTurn",
    "Trajectory",
    "TurnedJob",
    "UnidentifiableError",
    "UnprovedDesign",
    "Workspace",
    "WorstCase",
    "__version__",
    "allocate_tolerances",
    "analyse_accuracy",
    "analyse_stiffness",
    "atlas",
    "bound_worst_case",
    "calibrate",
    "choose_tool_turn",
    "compare",
    "compute_drive_forces",
    "family",
    "find_components",
    "find_cross_sections",
    "find_designs",
    "find_largest_box",
    "find_nearest_singularity",
    "find_placement",
    "find_placements",
    "fit_tool_lengths",
    "format_calibrated_yaml",
    "load",
    "machines",
    "make_joint_program",
    "make_linuxcnc_configuration",
    "make_linuxcnc_program",
    "make_measurements",
    "make_mesh",
    "plan_measurements",
    "prepare",
    "prepare_turned",
    "read_joint_program",
    "read_path",
    "read_tool_table",
    "region",
    "render_accuracy_map",
    "render_comparison_page",
    "render_drive_forces",
    "render_front_page",
    "render_machine_page",
    "render_machine_picture",
    "render_path_page",
    "render_report",
    "render_residuals",
    "render_stiffness_map",
    "rewind_path",
    "run_sweep",
    "sample_field",
    "sample_grid",
    "sweep_drives",
    "sweep_polar",
    "workpiece",
    "workspace",
    "write_files",
]


def machines() -> list[str]:
    """List the names of the shipped machines."""
    from .description import list_shipped_machines

    return sorted(list_shipped_machines())


def load(name: str | PathLike[str], parameters: Mapping[str, float | str] | None = None) -> Machine:
    """Load a machine by its shipped name or by the path of its file.

    Parameters
    ----------
    name : one of :func:`machines`, or a YAML file
    parameters : sizes to override, by the names in the file; numbers are mm or rad, text carries its unit

    Raises :class:`InputError` with file and line for a file that describes no machine that works.
    """
    if not isinstance(name, (str, PathLike)):
        raise InputError(f"name: a text or a path expected, not a {type(name).__name__}")
    if parameters is not None and not (isinstance(parameters, Mapping) and all(isinstance(k, str) for k in parameters)):
        raise InputError(f"parameters: a dict by names expected, not a {type(parameters).__name__}")
    from functools import partial

    from .description import find_key_line, find_machine_file, read_machine
    from .machine import Machine

    path = find_machine_file(name)
    spec = read_machine(path, parameters)
    try:
        return Machine(spec, partial(_read_with_sizes, path, dict(parameters or {})))
    except DescriptionError as error:
        raise InputError(str(error), fspath(path), find_key_line(path, error.key)) from None


def _read_with_sizes(path: Path, given: Mapping[str, float | str], sizes: Mapping[str, float]) -> Spec:
    """Read a machine file with other sizes in place of those that it was loaded with."""
    from .description import read_machine

    return read_machine(path, {**given, **sizes})


# The public names that are loaded when they are first used: the module, and the name there if it is another.
_LAZY = {
    "Accuracy": "accuracy.accuracy",
    "Atlas": "performance.atlas",
    "Calibration": "calibration.calibration",
    "Components": "workspaces.connected.components",
    "Comparison": "comparison.comparison",
    "CrossSection": "workspaces.sampled.cross_sections",
    "DesignProblem": "synthesis.problem",
    "Designs": "synthesis.designs",
    "ProvedDesign": "synthesis.designs",
    "UnprovedDesign": "synthesis.designs",
    "find_designs": "synthesis.designs",
    "find_nearest_singularity": "performance.certified.nearest_singularity",
    "DriveForces": "toolpath.timing.drive_forces",
    "run_sweep": "export.sweep_folder",
    "SweepPlan": "synthesis.sweep",
    "SweepResult": "export.sweep_folder",
    "DriveWorkspace": "workspaces.sampled.drive_sweep",
    "Family": "families.family",
    "GridWorkspace": "workspaces.sampled.grid",
    "InscribedBox": "workspaces.inscribed.largest_box",
    "Job": "toolpath.job",
    "JointProgram": "controllers.joints.program_reader",
    "Machine": "machine",
    "MeasurementPlan": "calibration.measurement_plan",
    "Measurements": "calibration.measurements",
    "MeasuringSetup": "calibration.measurements",
    "Mesh": "export.workspace.meshes",
    "Noise": "calibration.measurements",
    "Parameter": "model.geometric_parameters",
    "Placement": "toolpath.placing.placement",
    "PolarWorkspace": "workspaces.sampled.polar_sweep",
    "Region": "workspaces.certified.region",
    "SampledField": "workspaces.sampled.distance_field",
    "Assemblies": "kinematics.assemblies",
    "Solution": "kinematics.solution",
    "SingularityDistance": "performance.certified.nearest_singularity",
    "Stiffness": "stiffness.stiffness",
    "Tolerances": "toolpath.job",
    "Clearance": "toolpath.linearise.rewinds",
    "Rewind": "toolpath.linearise.rewinds",
    "RewoundPath": "toolpath.linearise.rewinds",
    "rewind_path": "toolpath.linearise.rewinds",
    "ToolPath": "toolpath.path",
    "ToolTurn": "toolpath.tool_turn.choice",
    "Trajectory": "toolpath.timing.trajectory",
    "TurnedJob": "toolpath.turned_job",
    "UnidentifiableError": "calibration.identifiability",
    "Workspace": "workspaces.certified.workspace",
    "WorstCase": "accuracy.worst_case",
    "allocate_tolerances": "accuracy.accuracy",
    "analyse_accuracy": "accuracy.accuracy",
    "analyse_stiffness": "stiffness.stiffness",
    "bound_worst_case": "accuracy.worst_case",
    "atlas": "performance.atlas",
    "calibrate": "calibration.calibration",
    "choose_tool_turn": "toolpath.tool_turn.choice",
    "compare": "comparison.comparison",
    "compute_drive_forces": "toolpath.timing.drive_forces",
    "family": "families.family:make_family",
    "find_components": "workspaces.connected.components",
    "find_cross_sections": "workspaces.sampled.cross_sections",
    "find_largest_box": "workspaces.inscribed.largest_box",
    "find_placement": "toolpath.placing.placement",
    "find_placements": "toolpath.placing.placement",
    "fit_tool_lengths": "toolpath.posting.tool_lengths",
    "format_calibrated_yaml": "export.calibration",
    "make_joint_program": "controllers.joints.program",
    "make_linuxcnc_configuration": "controllers.linuxcnc.configuration",
    "make_linuxcnc_program": "controllers.linuxcnc.program",
    "make_measurements": "calibration.measurements",
    "make_mesh": "export.workspace.meshes",
    "plan_measurements": "calibration.measurement_plan",
    "prepare": "toolpath.job",
    "prepare_turned": "toolpath.turned_job",
    "read_joint_program": "controllers.joints.program_reader",
    "read_path": "toolpath.reading.detect",
    "read_tool_table": "toolpath.reading.tool_table",
    "region": "workspaces.certified.region:make_region",
    "render_accuracy_map": "export.accuracy_map",
    "render_comparison_page": "export.comparison_page",
    "render_drive_forces": "export.force_curves",
    "render_front_page": "export.front_page",
    "render_machine_page": "export.page.page",
    "render_path_page": "export.page.page",
    "render_machine_picture": "export.machine.picture",
    "render_report": "export.report.report",
    "render_residuals": "export.calibration",
    "render_stiffness_map": "export.stiffness_map",
    "sample_field": "workspaces.sampled.distance_field",
    "sample_grid": "workspaces.sampled.grid",
    "sweep_drives": "workspaces.sampled.drive_sweep",
    "sweep_polar": "workspaces.sampled.polar_sweep",
    "workpiece": "toolpath.posting.frames",
    "workspace": "workspaces.certified.workspace",
    "write_files": "export.files",
}


def __dir__() -> list[str]:
    return sorted(__all__)


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name in _LAZY:
        module, _, own_name = _LAZY[name].partition(":")
        return getattr(import_module(f"{__name__}.{module}"), own_name or name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


# What notebooks show: a class, and the function of :mod:`.notebook` that renders its objects.
_DISPLAYED = {"Machine": "format_machine", "Job": "format_job", "Workspace": "format_workspace"}


def _make_renderer(name: str) -> Callable[[object], str | None]:
    """Make what a notebook calls for an object; nothing heavy is imported before something is shown."""

    def render(shown: object) -> str | None:
        from . import notebook

        html: str | None = getattr(notebook, name)(shown)
        return html

    return render


for _class_name, _render_name in _DISPLAYED.items():
    register_display(_class_name, _make_renderer(_render_name))
