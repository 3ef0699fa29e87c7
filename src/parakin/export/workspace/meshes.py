"""A region's shell as a closed mesh, in mm, and its files: STL, PLY, GLB."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import PoseError
from ...workspaces.sampled.distance_field import SampledField


@dataclass(frozen=True, eq=False)
class Shell:
    """Triangles of a closed surface, one body a part of the region, seen counterclockwise from outside.

    vertices : (V, 3) mm
    faces : (F, 3) indices of vertices
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]

    @property
    def volume(self) -> float:
        """mm³, by the divergence theorem."""
        a, b, c = np.moveaxis(self.vertices[self.faces] - self.vertices.mean(0), 1, 0)
        return float((np.cross(a, b) * c).sum() / 6.0)


def shell(field: SampledField) -> Shell:
    """Where a field in space is 0, by marching cubes.

    Raises :class:`PoseError` for a field that is not in space.
    """
    from skimage.measure import marching_cubes

    if field.values.ndim != 3:
        raise PoseError("a mesh needs a volume, this workspace is flat")
    vertices, faces, _, _ = marching_cubes(field.values, 0.0, gradient_direction="ascent")
    return Shell(field.refine_crossings(vertices.astype(np.float64)), faces.astype(np.int64))


def mesh_file(shape: Shell, kind: str) -> bytes:
    """The file of a kind, ``.stl`` (binary), ``.ply`` or ``.glb``; lengths are mm in all of them."""
    from trimesh import Trimesh

    written = Trimesh(shape.vertices, shape.faces, process=False).export(file_type=kind.removeprefix("."))
    return written if isinstance(written, bytes) else str(written).encode()
