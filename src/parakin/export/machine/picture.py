"""A machine's picture, for the screen or a printed page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...arguments import RowsLike, check_arguments
from ...dynamics.polygon import Points
from ...errors import PoseError
from ...machine import Machine
from ..colours import INK
from ..figure_file import PICTURES, render_figure
from .scene import Scene, build_scene
from .solids import LOOKS, build_solids

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DOTS = 160  # an inch
_LIGHT = np.array([0.35, -0.65, 0.70]) / np.linalg.norm([0.35, -0.65, 0.70])


@check_arguments
def render_machine_picture(machine: Machine, pose: RowsLike | None = None, suffix: str = ".png") -> bytes:
    """Render a picture of the machine at a pose, (axes,) mm and rad, home by default; a planar machine in its plane.

    suffix : ``.png`` for the screen, ``.pdf`` or ``.svg`` for a printed page

    Raises :class:`PoseError` for another one.
    """
    if suffix not in PICTURES:
        raise PoseError(f"suffix: one of {', '.join(PICTURES)} expected, not {suffix}")
    drawn = build_scene(machine, pose)
    title = machine.spec.title or machine.name
    return render_figure(
        (7.2, 7.2), lambda figure: _draw_machine(figure, drawn), lambda figure: _add_title(figure, title), suffix, _DOTS
    )


def _draw_machine(figure: Figure, drawn: Scene) -> None:
    from mpl_toolkits import mplot3d  # noqa: F401  it brings the projection

    axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d")
    _set_view(axes, drawn)
    _add_solids(axes, drawn)
    _add_frames(axes, drawn)
    for name, place in drawn.labels:
        axes.text(*(place + 0.022 * drawn.size), name, color=INK, fontsize=10.5, zorder=1000, parse_math=False)


def _add_title(figure: Figure, title: str) -> None:
    figure.text(0.5, 0.955, title, ha="center", color=INK, fontsize=14, weight="bold", parse_math=False)


def _set_view(axes: Any, drawn: Scene) -> None:
    """Set equal scales, the background, and the view: a planar machine straight on, others from the front right."""
    low, high = drawn.box
    middle, half = (low + high) / 2.0, 0.5 * (high - low) + (0.06 if drawn.normal is None else 0.1) * drawn.size
    for name, m, h in zip("xyz", middle, half, strict=True):
        getattr(axes, f"set_{name}lim")(m - h, m + h)
        axis = getattr(axes, f"{name}axis")
        axis.set_pane_color((0.975, 0.98, 0.985, 1.0))
        axis._axinfo["grid"].update(color="#dfe5ea", linewidth=0.6)
        axis.line.set_color("#b0bec5")
        getattr(axes, f"set_{name}label")(f"{name.upper()} [mm]", color="#607d8b", fontsize=9)
    # The box is drawn with a diagonal of one length; zoom so that what the view shows of it fills the picture.
    seen = max(0.79 * half[0] + 0.62 * half[1], half[2] + 0.2 * half[:2].sum())
    if drawn.normal is not None:
        seen = half.max()
    axes.set_box_aspect(half, zoom=float(0.82 * np.linalg.norm(half) / seen))
    axes.tick_params(labelsize=8, colors="#607d8b")
    axes.zaxis.set_tick_params(pad=7)  # clear of the ticks, which stand slanted
    axes.locator_params(nbins=5)
    if drawn.normal is None:
        axes.set_proj_type("persp", focal_length=1.4)
        axes.view_init(elev=17, azim=-52)
        return
    axes.set_proj_type("ortho")
    across = int(np.abs(drawn.normal).argmax())
    axes.view_init(elev=90 if across == 2 else 0, azim=0 if across == 0 else -90)
    out = getattr(axes, f"{'xyz'[across]}axis")
    out.set_ticks([])
    out.set_label_text("")


def _add_solids(axes: Any, drawn: Scene) -> None:
    """Add all faces in one collection, for only within one are they drawn from the back to the front."""
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    faces, colours = [], []
    for solid in build_solids(drawn, piece=drawn.size / 150.0):
        corners = solid.vertices[solid.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        light = (normals / np.where(lengths > 0.0, lengths, 1.0)) @ _LIGHT
        faces.append(corners)
        colours.append(np.array(to_rgb(LOOKS[solid.kind].colour)) * (0.70 + 0.30 * light[:, None]))
    colour = np.vstack(colours)
    # Edges of the faces' own colour hide the seams that antialiasing leaves.
    axes.add_collection3d(Poly3DCollection(np.vstack(faces), facecolors=colour, edgecolors=colour, linewidths=0.4))


def _add_frames(axes: Any, drawn: Scene) -> None:
    length = 0.085 * drawn.size
    for frame in drawn.frames.values():
        for letter, axis, colour in zip("XYZ", frame[:, :3].T, ("#c62828", "#2e7d32", "#1565c0"), strict=True):
            if drawn.normal is not None and abs(float(axis @ drawn.normal)) > 0.999:
                continue
            ends: Points = np.array([frame[:, 3], frame[:, 3] + length * axis])
            axes.plot(*ends.T, color=colour, linewidth=1.6, zorder=900)
            at = frame[:, 3] + 1.25 * length * axis
            axes.text(*at, letter, color=colour, fontsize=8.5, zorder=900, ha="center", va="center")
