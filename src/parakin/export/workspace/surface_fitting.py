"""A surface of marching cubes fitted to the planes that touch the boundary: smooth faces, and edges that are edges.

Marching cubes cut off every edge where two limits meet. After Y. Ohtake, A. Belyaev, A. Pasko, Dynamic meshes for
accurate polygonization of implicit surfaces with sharp features, The Visual Computer 19 (2003): each vertex moves to
where it is nearest to the planes at the middles of the triangles around it, in the sense of least squares.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Indices
from ...workspaces.sampled.distance_field import NearestLimits, SampledField, TangentPlanes

_PASSES = 4
_LANDINGS = 2  # Newton's steps of a point to the boundary
_FLAT = 0.01  # of the greatest eigenvalue: a vertex does not move along directions in which its planes differ less
_FARTHEST = 2.0  # steps of the grid that a vertex may move along each axis


class FittedSurface(NamedTuple):
    """A surface whose vertices were moved.

    vertices : (V, 3) mm
    normals : (F, 3) outward, of the boundary at the middle of each triangle
    """

    vertices: Array
    normals: Array


class _Landing(NamedTuple):
    """Points (N, 3) on the boundary's planes, the planes' normals (N, 3), and whether each is the boundary's, (N,)."""

    point: Array
    normal: Array
    is_known: Flags


def fit_surface(field: SampledField, vertices: Array, faces: Indices) -> FittedSurface:
    """Fit the vertices (V, 3) of a field's surface to the planes that touch its boundary.

    Raises :class:`PoseError` where the field's time is up.
    """
    low, high = field.box
    first, reach = vertices, _FARTHEST * field.step
    nearest = field.distance.find_nearest_limits(vertices[faces].mean(1))
    deciding = np.unique(nearest.swept, axis=0)
    planes = _find_planes(field, vertices, faces, nearest)
    for _ in range(_PASSES):
        moved = _move_to_planes(vertices, faces, planes)
        vertices = np.clip(moved, np.maximum(first - reach, low), np.minimum(first + reach, high))
        nearest = field.distance.find_nearest_limits(vertices[faces].mean(1), deciding)
        planes = _find_planes(field, vertices, faces, nearest)
    for _ in range(_LANDINGS):  # of the vertices, beside an edge on one of its limits after the other
        nearest = field.distance.find_nearest_limits(vertices, deciding)
        vertices = _place_on_planes(vertices, field.distance.find_tangent_planes(vertices, nearest), field).point
    return FittedSurface(np.clip(vertices, low, high), planes.normal)


def compute_areas(vertices: Array, faces: Indices) -> Array:
    """Compute twice the area of each triangle as a vector across it, (F, 3), outward."""
    a, b, c = (vertices[corner] for corner in faces.T)
    return np.cross(b - a, c - a)


def _find_planes(field: SampledField, vertices: Array, faces: Indices, nearest: NearestLimits) -> _Landing:
    """Find the plane that touches the boundary at each triangle; the triangle's own where the limit tells none."""
    areas = compute_areas(vertices, faces)
    sizes = np.linalg.norm(areas, axis=1, keepdims=True)
    own = areas / np.where(sizes > 0.0, sizes, 1.0)
    points = vertices[faces].mean(1)
    for _ in range(_LANDINGS):
        landing = _place_on_planes(points, field.distance.find_tangent_planes(points, nearest), field)
        points = landing.point
    return landing._replace(normal=np.where(landing.is_known[:, None], landing.normal, own))


def _place_on_planes(points: Array, planes: TangentPlanes, field: SampledField) -> _Landing:
    """Place points on their planes; those whose plane is farther than a step of the grid stay where they are."""
    with np.errstate(invalid="ignore"):
        is_known = np.abs(planes.distance) < float(field.step.max())
        landed = points + planes.distance[:, None] * planes.normal
    return _Landing(np.where(is_known[:, None], landed, points), planes.normal, is_known)


def _move_to_planes(vertices: Array, faces: Indices, planes: _Landing) -> Array:
    """Move each vertex to the least sum of squared distances from its triangles' planes, from their points' mean."""
    corner, face = faces[planes.is_known].ravel(), np.repeat(np.flatnonzero(planes.is_known), 3)
    count = np.bincount(corner, minlength=len(vertices))

    def take_mean(values: Array) -> Array:
        columns = values.reshape(len(values), -1)[face].T
        sums = [np.bincount(corner, column, len(vertices)) for column in columns]
        means: Array = (np.array(sums) / np.maximum(count, 1)).T
        return means.reshape(len(vertices), *values.shape[1:])

    start = take_mean(planes.point)
    matrix = take_mean(np.einsum("fi,fj->fij", planes.normal, planes.normal))
    offset = np.einsum("fi,fi->f", planes.normal, planes.point)
    wanted = take_mean(planes.normal * offset[:, None]) - np.einsum("vij,vj->vi", matrix, start)
    size, along = np.linalg.eigh(matrix)
    kept = size > _FLAT * np.maximum(size[:, -1:], _FLAT)
    shift = np.einsum("vji,vj->vi", along, wanted) * kept / np.where(kept, size, 1.0)
    moved: Array = np.where(count[:, None] > 0, start + np.einsum("vij,vj->vi", along, shift), vertices)
    return moved
