"""The surface of a workspace as data of a page: corners in 16 bits, and whose triangles they are."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array, Indices
from ...workspaces.sampled.distance_field import SampledField
from ..workspace.meshes import make_mesh
from .packed_arrays import pack_array

_FINEST = 2**16 - 1  # steps along the longest edge


def encode_page_surface(field: SampledField) -> dict[str, Any]:
    """Encode where a field over two or three positions is 0; in a plane all of what is inside.

    Corners are told in steps from the lowest one, mm, triangles by their numbers; both little-endian, in base64.
    """
    axes = [field.region.machine.axes.index(axis) for axis in field.region.free_axes]
    corners, faces = (_make_area if field.values.ndim == 2 else _make_surface)(field)
    low = corners.min(0)
    step = max(float(np.ptp(corners, axis=0).max()), 1e-6) / _FINEST
    wide = len(corners) > _FINEST
    return {
        "axes": axes,
        "low": low.tolist(),
        "step": step,
        "corners": pack_array(np.rint((corners - low) / step), "<u2"),
        "faces": pack_array(faces, "<u4" if wide else "<u2"),
        "wide": wide,
    }


def _make_surface(field: SampledField) -> tuple[Array, Indices]:
    mesh = make_mesh(field)
    return mesh.vertices, mesh.faces


def _make_area(field: SampledField) -> tuple[Array, Indices]:
    """Make triangles over what is inside a field in a plane: corners (V, 2) mm and numbers (F, 3).

    They are the upper half of a thin body between two planes outside, which begins and ends on the boundary.
    """
    from skimage.measure import marching_cubes

    outside = np.full_like(field.values, field.values.min())
    body = np.stack([field.values, outside], axis=2)
    corners, faces, _, _ = marching_cubes(body, 0.0)
    at = corners[:, :2].astype(np.float64)
    on_boundary = corners[:, 2] == 0.0
    places = field.low + at * field.step
    places[on_boundary] = field.refine_crossings(at[on_boundary])
    return places, faces.astype(np.int64)
