"""Bodies of triangles in matplotlib's space: lit pixel by pixel on the screen, polygons on a printed page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..arrays import Array, Indices
from .rasterising import find_front_faces

if TYPE_CHECKING:
    from matplotlib.artist import Artist

MOST_PRINTED = 18_000  # triangles of a surface that is printed, half of them out of sight: some 2 MB

_SAMPLES = 3  # along a pixel's edge
_CREASE = np.cos(np.deg2rad(35.0))  # beyond which two faces do not make one smooth surface
_LIGHT = np.array([0.30, -0.55, 0.78]) / np.linalg.norm([0.30, -0.55, 0.78])
_DARK, _BRIGHT = 0.55, 0.45  # of what faces away from the light, and what facing it adds
_GLOSS, _SHARPNESS = 0.10, 24.0  # of the light's reflection
_RIM = 0.45  # opacity that a wall that is seen through gains where it is seen edge on
_SEAM = 0.4  # points: lines of a polygon's own colour hide what antialiasing leaves between two
_VISIBLE_PIXELS = 2000  # across a printed figure, to tell which triangles are seen at all


class ShadedBody(NamedTuple):
    """Triangles to be lit.

    corners : (F, 3, 3) mm
    normals : (F, 3, 3) unit vectors, outward, at each corner
    colours : (F, 3) red, green, blue, 0 to 1
    opacity : of the walls that face the viewer; those behind them are opaque in any case
    """

    corners: Array
    normals: Array
    colours: Array
    opacity: float = 1.0


def smooth_normals(vertices: Array, faces: Indices, normals: Array) -> Array:
    """Smooth normals of faces (F, 3) to their corners (F, 3, 3), each the mean of the faces that meet it at no edge."""
    corner, face = faces.ravel(), np.repeat(np.arange(len(faces)), 3)
    order = np.argsort(corner, kind="stable")
    corner, face = corner[order], face[order]
    count = np.bincount(corner, minlength=len(vertices))
    # Every pair of two faces at one vertex.
    one = np.repeat(np.arange(len(face)), count[corner])
    start = np.repeat((np.cumsum(count) - count)[corner], count[corner])
    block = np.repeat(np.cumsum(count[corner]) - count[corner], count[corner])
    other = start + np.arange(len(one)) - block
    alike = np.einsum("pi,pi->p", normals[face[one]], normals[face[other]]) > _CREASE
    sums = [np.bincount(one[alike], normals[face[other[alike]], axis], len(face)) for axis in range(3)]
    mean = np.array(sums).T
    smooth = np.empty((len(face), 3))
    smooth[order] = mean / np.linalg.norm(mean, axis=1, keepdims=True)
    return smooth.reshape(len(faces), 3, 3)


def add_bodies(axes: Any, bodies: Sequence[ShadedBody], zorder: float = 5.0) -> None:
    """Add bodies to axes in space; they hide each other as they should, and what is added below ``zorder``."""
    axes.add_artist(_make_artist(bodies, zorder))


def project(axes: Any, points: Array) -> Array:
    """Project points (N, 3) of axes in space to dots of the figure, and a depth that grows away from the viewer."""
    from mpl_toolkits.mplot3d import proj3d

    x, y, depth = proj3d.proj_transform(*points.T, axes.get_proj())
    return np.column_stack([axes.transData.transform(np.column_stack([x, y])), depth])


def print_bodies(figure: Any) -> None:
    """Let all bodies of a figure be drawn as polygons, for a vector format."""
    for artist in figure.findobj(lambda item: hasattr(item, "is_printed")):
        artist.is_printed = True


def _make_artist(bodies: Sequence[ShadedBody], zorder: float) -> Artist:
    from matplotlib.artist import Artist

    class ShadedBodies(Artist):
        """Draws bodies by the projection of their axes."""

        is_printed = False

        def draw(self, renderer: Any) -> None:
            view = _View(self.axes, bodies)
            if self.is_printed:
                _paint_polygons(view, renderer, self)
            else:
                _draw_image(view, renderer, self)

    artist = ShadedBodies()
    artist.set_zorder(zorder)
    artist.set_in_layout(False)
    return artist


class _View:
    """Bodies as their axes show them, all in one list of faces.

    screen : (F, 3, 3) corners in dots, and their depth
    eye : unit vector towards the viewer
    is_front : (F,) whether a face's outer side is seen
    """

    def __init__(self, axes: Any, bodies: Sequence[ShadedBody]):
        corners = np.concatenate([body.corners for body in bodies])
        self.normals = np.concatenate([body.normals for body in bodies])
        self.colours = np.concatenate([body.colours for body in bodies])
        self.opacity = np.concatenate([np.full(len(body.corners), body.opacity) for body in bodies])
        self.screen = project(axes, corners.reshape(-1, 3)).reshape(-1, 3, 3)
        up, around = np.radians(axes.elev), np.radians(axes.azim)
        self.eye = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
        (a, b), (c, d) = (self.screen[:, k, :2].T - self.screen[:, 0, :2].T for k in (1, 2))
        self.is_front = a * d > b * c
        self.is_clear = self.is_front & (self.opacity < 1.0)

    def shade(self, normals: Array, colours: Array) -> Array:
        """Shade colours (N, 3) by their normals (N, 3); of a wall that is seen from behind, by its inner side."""
        facing = normals @ self.eye
        lit = np.where(facing < 0.0, -1.0, 1.0)[:, None] * normals
        half = (_LIGHT + self.eye) / np.linalg.norm(_LIGHT + self.eye)
        gloss = _GLOSS * np.clip(lit @ half, 0.0, 1.0) ** _SHARPNESS
        light = _DARK + _BRIGHT * (0.5 + 0.5 * (lit @ _LIGHT))
        lights: Array = np.clip(colours * light[:, None] + gloss[:, None], 0.0, 1.0)
        return lights


def _draw_image(view: _View, renderer: Any, artist: Any) -> None:
    """Draw what is seen as an image, several samples a dot, so that edges are smooth."""
    low = np.floor(view.screen[:, :, :2].min((0, 1))).astype(int)
    high = np.ceil(view.screen[:, :, :2].max((0, 1))).astype(int)
    bounds = artist.axes.figure.bbox
    low, high = np.maximum(low, 0), np.minimum(high, [int(bounds.width), int(bounds.height)])
    if (high <= low).any():
        return
    width, height = ((high - low) * _SAMPLES).tolist()
    screen = view.screen.copy()
    screen[:, :, :2] = (screen[:, :, :2] - low) * _SAMPLES
    image, depth = np.zeros((height, width, 4)), np.full((height, width), np.inf)
    for clear in (False, True):
        kept = np.flatnonzero(view.is_clear == clear)
        front = find_front_faces(screen[kept], width, height)
        face = kept[front.face]
        normal = np.einsum("pk,pki->pi", front.weights, view.normals[face])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        at = front.row, front.column
        seen = front.depth < depth[at]
        depth[at] = np.minimum(depth[at], front.depth)
        opacity = np.ones(len(face))
        if clear:
            edge_on = (1.0 - np.abs(normal @ view.eye)) ** 2
            opacity = view.opacity[face] + (1.0 - view.opacity[face]) * _RIM * edge_on
        _blend(
            image, (front.row[seen], front.column[seen]), view.shade(normal, view.colours[face])[seen], opacity[seen]
        )
    dots = image.reshape(height // _SAMPLES, _SAMPLES, width // _SAMPLES, _SAMPLES, 4).mean((1, 3))
    dots[:, :, :3] /= np.maximum(dots[:, :, 3:], 1e-9)
    gc = renderer.new_gc()
    renderer.draw_image(gc, low[0], low[1], np.rint(255.0 * np.clip(dots, 0.0, 1.0)).astype(np.uint8))
    gc.restore()


def _blend(image: Array, at: tuple[Indices, Indices], colours: Array, opacity: Array) -> None:
    """Lay colours over an image (H, W, 4) whose own are multiplied by their opacity."""
    over = np.column_stack([colours * opacity[:, None], opacity])
    image[at] = over + (1.0 - opacity[:, None]) * image[at]


def _paint_polygons(view: _View, renderer: Any, artist: Any) -> None:
    """Paint the faces that are seen as polygons, from the back to the front."""
    from matplotlib.path import Path
    from matplotlib.transforms import IdentityTransform

    scale = _VISIBLE_PIXELS / artist.axes.figure.bbox.width
    size = np.ceil(scale * artist.axes.figure.bbox.size).astype(int).tolist()
    colours = view.shade(_take_mean(view.normals), view.colours)
    for clear in (False, True):
        kept = np.flatnonzero(view.is_clear == clear)
        seen = kept[np.unique(find_front_faces(view.screen[kept] * [scale, scale, 1.0], *size).face)]
        order = seen[np.argsort(-view.screen[seen, :, 2].mean(1), kind="stable")]
        for face in order.tolist():
            gc = renderer.new_gc()
            colour = tuple(colours[face])
            gc.set_foreground(colour)
            gc.set_linewidth(0.0 if clear else _SEAM)
            gc.set_joinstyle("round")
            if clear:
                gc.set_alpha(view.opacity[face])
            renderer.draw_path(gc, Path(view.screen[face, [0, 1, 2, 0], :2], closed=True), IdentityTransform(), colour)
            gc.restore()


def _take_mean(normals: Array) -> Array:
    mean = normals.mean(1)
    unit: Array = mean / np.linalg.norm(mean, axis=1, keepdims=True)
    return unit
