"""A region's surface as a closed mesh, in mm, and its files: STL, PLY, GLB."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arguments import check_arguments
from ...arrays import Array, Indices
from ...errors import PoseError
from ...workspaces.sampled.distance_field import SampledField
from ..shaded_bodies import ShadedBody, smooth_normals
from .edge_flips import flip_folded_triangles
from .surface_fitting import fit_surface


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of a closed surface, a body for each component of the region, counterclockwise from outside.

    vertices : (V, 3) mm
    faces : (F, 3) indices of vertices
    normals : (F, 3) of the boundary at the middle of each triangle, outward, by the gradient of the limit that makes it
    """

    vertices: Array
    faces: Indices
    normals: Array

    @property
    def volume(self) -> float:
        """The volume inside, mm³, by the divergence theorem."""
        a, b, c = np.moveaxis(self.vertices[self.faces] - self.vertices.mean(0), 1, 0)
        return float((np.cross(a, b) * c).sum() / 6.0)

    def make_body(self, colours: Array, opacity: float = 1.0) -> ShadedBody:
        """Make the body to be drawn.

        colours : (F, 3) red, green, blue of its triangles, 0 to 1
        opacity : 0 to 1, of the walls that face the viewer
        """
        normals = smooth_normals(self.vertices, self.faces, self.normals)
        return ShadedBody(self.vertices[self.faces], normals, colours, opacity)

    def __repr__(self) -> str:
        return f"<parakin mesh: {len(self.vertices)} vertices, {len(self.faces)} triangles, {self.volume:.6g} mm³>"


@check_arguments
def make_mesh(field: SampledField) -> Mesh:
    """Make the surface where a field in space is 0, by marching cubes, fitted to the boundary's tangent planes.

    field : of :func:`parakin.sample_field`

    Raises :class:`PoseError` for a field that is not in space, and where its time is up.
    """
    from skimage.measure import marching_cubes

    if field.values.ndim != 3:
        raise PoseError("a mesh needs a volume, this workspace is flat")
    vertices, faces, _, _ = marching_cubes(field.values, 0.0, gradient_direction="ascent")
    faces = faces.astype(np.int64)
    fitted = fit_surface(field, field.refine_crossings(vertices.astype(np.float64)), faces)
    return Mesh(fitted.vertices, *flip_folded_triangles(fitted.vertices, faces, fitted.normals))


def format_mesh(mesh: Mesh, kind: str) -> bytes:
    """Format the file of a kind, ``.stl`` (binary), ``.ply`` or ``.glb``; lengths are mm in all of them."""
    from trimesh import Trimesh

    written = Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type=kind.removeprefix("."))
    return written if isinstance(written, bytes) else str(written).encode()
