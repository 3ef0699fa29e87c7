"""Edge flips that unfold a surface: where a triangle looks inward, the diagonal of it and a neighbour is exchanged.

A sliver that lies folded on its neighbour covers a part of it twice, once the other way round. The other diagonal
covers the same area once, by triangles that look outward, and leaves the surface closed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Indices

_PASSES = 8


class _Flip(NamedTuple):
    """Two triangles in the place of two others, with their normals, and the lesser cosine between one and its own."""

    cosine: float
    pair: tuple[int, int]
    faces: Indices
    normals: Array


def flip_folded_triangles(vertices: Array, faces: Indices, normals: Array) -> tuple[Indices, Array]:
    """Flip edges of a closed surface until it is not folded; return its triangles and the normals at them, both (F, 3).

    vertices : (V, 3)
    normals : (F, 3) outward, unit vectors, each of the boundary near a triangle; a new triangle takes the one of the
        two in its place along which it looks more

    Where triangles are folded in a heap one flip makes room for the next. Few slivers stay.
    """
    faces, normals = faces.copy(), normals.copy()
    for _ in range(_PASSES):
        cosines = _compare(vertices[faces], normals)
        folded = np.flatnonzero(cosines < 0.0)
        if not len(folded) or not _flip_edges(folded, cosines, vertices, faces, normals):
            break
    return faces, normals


def _flip_edges(folded: Indices, cosines: Array, vertices: Array, faces: Indices, normals: Array) -> bool:
    """Flip an edge of each folded triangle where the lesser cosine grows by it, the most; tell whether any was."""
    corners = np.zeros(len(vertices), np.bool_)
    corners[faces[folded]] = True
    around = np.flatnonzero(corners[faces].any(1))
    edges = _list_edges(faces[around]).tolist()
    across = {(a, b): triangle for (a, b), triangle in zip(edges, np.repeat(around, 3).tolist(), strict=True)}
    changed: set[int] = set()
    for triangle in folded[np.argsort(cosines[folded])].tolist():
        flips = _list_flips(triangle, vertices, faces, normals, across)
        gains = [(flip.cosine - cosines[list(flip.pair)].min(), flip) for flip in flips if not changed & set(flip.pair)]
        gain, best = max(gains, key=lambda each: each[0], default=(0.0, None))
        if best is None or gain <= 0.0:
            continue
        pair = list(best.pair)
        faces[pair], normals[pair] = best.faces, best.normals
        across.update(dict.fromkeys(map(tuple, _list_edges(best.faces).tolist()), pair[0]))
        changed.update(pair)
    return bool(changed)


def _list_edges(faces: Indices) -> Indices:
    """List the directed edges (3 F, 2): the three of a triangle stand together."""
    return np.stack([faces, np.roll(faces, -1, 1)], -1).reshape(-1, 2)


def _compare(corners: Array, normals: Array) -> Array:
    """Compare triangles (..., 3, 3) with normals: the cosines between; 0 of a triangle without an area."""
    areas = np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :])
    sizes = np.linalg.norm(areas, axis=-1)
    cosines: Array = np.einsum("...i,...i->...", areas, normals) / np.where(sizes > 0.0, sizes, 1.0)
    return cosines


def _list_flips(
    triangle: int, vertices: Array, faces: Indices, normals: Array, across: dict[tuple[int, int], int]
) -> Iterator[_Flip]:
    """List the flips of a triangle's edges whose other diagonal is no edge yet."""
    for turn in range(3):
        a, b, c = np.roll(faces[triangle], -turn).tolist()
        other = across[b, a]
        d = next(corner for corner in faces[other].tolist() if corner not in (a, b))
        if (c, d) in across or (d, c) in across:
            continue
        made = np.array([(a, d, c), (b, c, d)])
        cosines = _compare(vertices[made][:, None], normals[[triangle, other]])  # of each with both normals
        chosen = cosines.argmax(1)
        yield _Flip(float(cosines.max(1).min()), (triangle, other), made, normals[[triangle, other]][chosen])
