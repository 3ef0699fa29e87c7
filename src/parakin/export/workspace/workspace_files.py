"""A workspace's files by their endings, made from one sampled field."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sqrt

import numpy as np

from ...arrays import Array, Progress
from ...budget import SECONDS, Budget
from ...errors import PoseError
from ...workspaces.certified.workspace import Workspace
from ...workspaces.sampled.cross_sections import CrossSection, find_cross_sections
from ...workspaces.sampled.distance_field import SampledField, sample_field
from ...workspaces.sampled.drive_sweep import DriveWorkspace
from ...workspaces.sampled.polar_sweep import PolarWorkspace
from ...workspaces.sampled.sampling import TOO_SLOW, SampledWorkspace, find_bounding_box
from ..figure_file import PICTURES, SCREEN
from ..shaded_bodies import MOST_PRINTED
from .cells import format_cells_csv, format_cells_vtu
from .describe import AnyWorkspace
from .meshes import Mesh, format_mesh, make_mesh
from .picture import render_curves, render_plane, render_space
from .sweep_curves import build_sweep_curves

MESHES = (".stl", ".ply", ".glb")
SUFFIXES = (*MESHES, ".vtu", ".csv", *PICTURES, ".json")


def explain_unfit(suffix: str, method: str, dimension: int) -> str | None:
    """Explain why a workspace of a dimension, found by a method, has no file of a kind; None if it has one."""
    if suffix in (".vtu", ".csv") and method != "certified":
        return "only the method certified has cells"
    if suffix in MESHES and dimension != 3:
        return "a mesh needs a volume, this workspace is flat; .png .pdf .svg go, and .vtu .csv of the method certified"
    if suffix in PICTURES and dimension == 1:
        return "a picture needs an area, this workspace is a line; .vtu and .csv go, of the method certified"
    return None


@dataclass(frozen=True, eq=False)
class WorkspaceFiles:
    """A workspace with its field and its cross-sections, from which its files are made.

    field : None if the workspace is empty, or is not drawn
    undrawn : why it is not drawn, or ""
    """

    workspace: AnyWorkspace
    field: SampledField | None
    cross_sections: tuple[CrossSection, ...]
    undrawn: str = ""

    @cached_property
    def mesh(self) -> Mesh:
        return make_mesh(self._filled_field)

    @cached_property
    def printed_mesh(self) -> Mesh:
        """The mesh with no more triangles than a printed page wants, of a coarser field if need be."""
        field, mesh = self._filled_field, self.mesh
        coarser = sqrt(len(mesh.faces) / MOST_PRINTED)
        if coarser <= 1.0:
            return mesh
        step = coarser * float(field.step.max())
        return make_mesh(sample_field(field.region, field.box, step, field.distance.turns_step,
                                      seconds=field.distance.seconds))  # fmt: skip

    @property
    def _filled_field(self) -> SampledField:
        if self.field is None:
            raise PoseError(self.undrawn or "the workspace is empty")
        if not len(self.field.inside):
            raise PoseError(f"steps of {self.field.step.min():g} mm miss the workspace")
        return self.field

    def make_file(self, suffix: str) -> bytes:
        """Make the file with one of ``SUFFIXES`` but .json; raise :class:`PoseError` if it would be empty."""
        if suffix in (".csv", ".vtu"):
            assert isinstance(self.workspace, Workspace)
            if suffix == ".vtu" and self.workspace.empty:
                raise PoseError("the workspace is empty")
            return format_cells_csv(self.workspace) if suffix == ".csv" else format_cells_vtu(self.workspace)
        if suffix in MESHES:
            return format_mesh(self.mesh, suffix)
        if isinstance(self.workspace, PolarWorkspace | DriveWorkspace):
            curves = build_sweep_curves(self.workspace)
            return render_curves(self.workspace, self._filled_field, curves, self.cross_sections, suffix)
        if len(self.workspace.axes) == 3:
            mesh = self.mesh if suffix == SCREEN else self.printed_mesh
            return render_space(self.workspace, mesh, self.cross_sections, suffix)
        return render_plane(self.workspace, self._filled_field, self.cross_sections, suffix)


def prepare_files(
    workspace: AnyWorkspace, step: float | None, progress: Progress, seconds: float | None = SECONDS
) -> WorkspaceFiles:
    """Sample the field and find the cross-sections of a workspace, in the time given; ``step`` as for ``sample_field``.

    What is not drawn by then is not drawn at all.
    """
    try:
        return _draw_workspace(workspace, step, progress, Budget(seconds))
    except PoseError as error:
        if str(error) != TOO_SLOW:
            raise
        return WorkspaceFiles(workspace, None, (), TOO_SLOW)


def _draw_workspace(workspace: AnyWorkspace, step: float | None, progress: Progress, budget: Budget) -> WorkspaceFiles:
    """Sample the field and find the cross-sections; raises :class:`PoseError` where the budget is spent."""
    box = _bound_region(workspace, budget)
    if box is None:
        return WorkspaceFiles(workspace, None, ())
    in_space = len(workspace.axes) == 3
    shown = _scale_progress(progress, 0.0, 0.5 if in_space else 1.0)
    field = sample_field(workspace.region, box, step, progress=shown, seconds=_take_rest(budget))
    cross_sections: tuple[CrossSection, ...] = ()
    if len(workspace.axes) > 1:
        shown = _scale_progress(progress, 0.5, 0.5)
        cross_sections = find_cross_sections(field, step=step, progress=shown, seconds=_take_rest(budget))
    return WorkspaceFiles(workspace, field, cross_sections)


def _scale_progress(progress: Progress, begin: float, width: float) -> Progress:
    """Make the progress of a stage that is ``width`` of the whole and begins at ``begin``."""
    return lambda done: progress(begin + width * done)


def _take_rest(budget: Budget) -> float:
    """Return the time that is left, s; raises :class:`PoseError` for none."""
    if budget.is_spent():
        raise PoseError(TOO_SLOW)
    return budget.seconds_left


def _bound_region(workspace: AnyWorkspace, budget: Budget) -> tuple[Array, Array] | None:
    """Find a box proved to hold the region; None if it is empty."""
    if isinstance(workspace, SampledWorkspace):
        return find_bounding_box(workspace.region, budget)
    if workspace.box is None or workspace.stopped != "gap" or not workspace.region.every_orientation:
        return workspace.box  # a search that was stopped early, or is slow, is not followed by a long one
    box = find_bounding_box(workspace.region, budget)
    if box is None:
        return None
    low, high = np.maximum(box[0], workspace.box[0]), np.minimum(box[1], workspace.box[1])
    return (low, high) if (low < high).all() else None
