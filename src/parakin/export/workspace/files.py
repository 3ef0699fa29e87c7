"""A workspace's files by their endings, from one sampled field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ...workspaces.certified.workspace import Workspace
from ...workspaces.sampled.cross_sections import CrossSection, find_cross_sections
from ...workspaces.sampled.distance_field import SampledField, sample_field
from ...workspaces.sampled.drive_sweep import DriveWorkspace
from ...workspaces.sampled.polar_sweep import PolarWorkspace
from ...workspaces.sampled.sampling import SampledWorkspace, find_bounding_box
from .cells import cells_csv, cells_vtu
from .curves import curves
from .meshes import Shell, mesh_file, shell
from .picture import curves_png, plane_png, space_png

MESHES = (".stl", ".ply", ".glb")
SUFFIXES = (*MESHES, ".vtu", ".csv", ".png", ".json")


def unfit(suffix: str, method: str, dimension: int) -> str | None:
    """Why a workspace of a dimension, found by a method, has no file of a kind; None if it has one."""
    if suffix in (".vtu", ".csv") and method != "certified":
        return "only the method certified has cells"
    if suffix in MESHES and dimension != 3:
        return "a mesh needs a volume, this workspace is flat; .png goes, and .vtu and .csv of the method certified"
    if suffix == ".png" and dimension == 1:
        return "a picture needs an area, this workspace is a line; .vtu and .csv go, of the method certified"
    return None


@dataclass(frozen=True, eq=False)
class Drawing:
    """A workspace with its field (None if it is empty) and its cross-sections, from which its files are made."""

    found: Workspace | SampledWorkspace
    whole: SampledField | None
    slices: tuple[CrossSection, ...]

    @cached_property
    def shell(self) -> Shell:
        return shell(self._whole)

    @property
    def _whole(self) -> SampledField:
        if self.whole is None:
            raise PoseError("the workspace is empty")
        if not len(self.whole.inside):
            raise PoseError(f"steps of {self.whole.step.min():g} mm miss the workspace")
        return self.whole

    def content(self, suffix: str) -> bytes:
        """The file with one of ``SUFFIXES`` but .json; raises :class:`PoseError` if there is nothing to put in it."""
        if suffix in (".csv", ".vtu"):
            assert isinstance(self.found, Workspace)
            if suffix == ".vtu" and self.found.empty:
                raise PoseError("the workspace is empty")
            return cells_csv(self.found) if suffix == ".csv" else cells_vtu(self.found)
        if suffix in MESHES:
            return mesh_file(self.shell, suffix)
        if isinstance(self.found, PolarWorkspace | DriveWorkspace):
            return curves_png(self.found, self._whole, curves(self.found), self.slices)
        if len(self.found.axes) == 3:
            return space_png(self.found, self.shell, self.slices)
        return plane_png(self.found, self._whole, self.slices)


def drawing(found: Workspace | SampledWorkspace, step: float | None, progress: Callable[[float], None]) -> Drawing:
    """The field and the cross-sections of a workspace; ``step`` as for ``sample_field``."""
    box = _box(found)
    if box is None:
        return Drawing(found, None, ())
    space = len(found.axes) == 3
    whole = sample_field(found.region, box, step, progress=lambda done: progress(0.5 * done if space else done))
    slices: tuple[CrossSection, ...] = ()
    if len(found.axes) > 1:
        slices = find_cross_sections(whole, step=step, progress=lambda done: progress(0.5 + 0.5 * done))
    return Drawing(found, whole, slices)


def _box(found: Workspace | SampledWorkspace) -> tuple[Array, Array] | None:
    """A box proved to hold the region; None if it is empty."""
    if isinstance(found, SampledWorkspace):
        return find_bounding_box(found.region)
    if found.box is None or found.stopped != "gap" or not found.region.every_orientation:
        return found.box  # nothing more that takes long
    box = find_bounding_box(found.region)
    if box is None:
        return None
    low, high = np.maximum(box[0], found.box[0]), np.minimum(box[1], found.box[1])
    return (low, high) if (low < high).all() else None
