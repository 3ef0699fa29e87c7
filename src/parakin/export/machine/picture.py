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
from ..shaded_bodies import ShadedBody, add_bodies, smooth_normals
from ..space_axes import add_space_axes, fit_to_room
from .label_placing import BodyLabel, add_labels
from .scene import Scene, build_scene
from .solids import LOOKS, build_solids

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DOTS = 160  # an inch
_ROOM = (0.02, 0.02, 0.98, 0.93)
_PIECES = 40  # of a bar as long as the machine


@check_arguments
def render_machine_picture(machine: Machine, pose: RowsLike | None = None, suffix: str = ".png") -> bytes:
    """Render a picture of a machine; a planar one is seen in its plane.

    machine : in its default working mode
    pose : (axes,) mm and rad, home by default
    suffix : ``.png`` for the screen, ``.pdf`` or ``.svg`` for a printed page

    Raises :class:`PoseError` for another suffix.
    """
    if suffix not in PICTURES:
        raise PoseError(f"suffix: one of {', '.join(PICTURES)} expected, not {suffix}")
    drawn = build_scene(machine, pose)
    title = machine.spec.title or machine.name
    return render_figure(
        (7.2, 7.2), lambda figure: _draw_machine(figure, drawn), lambda figure: _add_title(figure, title), suffix, _DOTS
    )


def _draw_machine(figure: Figure, drawn: Scene) -> None:
    axes = _add_axes(figure, drawn)
    bodies = _build_bodies(drawn)
    add_bodies(axes, bodies)
    frames = _list_frame_axes(drawn)
    for _, ends, colour in frames:
        axes.plot(*ends.T, color=colour, linewidth=1.6, zorder=900)
    labels = [BodyLabel(letter, ends[1], colour, 8.5) for letter, ends, colour in frames]
    labels += [BodyLabel(name, place, INK, 10.5) for name, place in drawn.labels]
    add_labels(axes, labels, bodies, [ends for _, ends, _ in frames])


def _add_title(figure: Figure, title: str) -> None:
    figure.text(0.5, 0.955, title, ha="center", color=INK, fontsize=14, weight="bold", parse_math=False)


def _add_axes(figure: Figure, drawn: Scene) -> Any:
    """Add axes with the view: a planar machine straight on, others from the front right."""
    low, high = drawn.box
    half = 0.5 * (high - low) + (0.06 if drawn.normal is None else 0.1) * drawn.size
    axes = add_space_axes(figure, (low + high) / 2.0, half, "XYZ")
    if drawn.normal is None:
        axes.set_proj_type("persp", focal_length=1.4)
        axes.view_init(elev=17, azim=-52)
    else:
        axes.set_proj_type("ortho")
        across = int(np.abs(drawn.normal).argmax())
        axes.view_init(elev=90 if across == 2 else 0, azim=0 if across == 0 else -90)
        out = getattr(axes, f"{'xyz'[across]}axis")
        out.set_ticks([])
        out.set_label_text("")
    fit_to_room(axes, half, _ROOM)
    return axes


def _build_bodies(drawn: Scene) -> list[ShadedBody]:
    """Build the bodies of a machine; bars in pieces, for those that are printed are sorted by their faces' middles."""
    from matplotlib.colors import to_rgb

    bodies = []
    for solid in build_solids(drawn, piece=drawn.size / _PIECES):
        corners = solid.vertices[solid.triangles]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lengths = np.linalg.norm(across, axis=1)
        kept = lengths > 0.0
        normals = smooth_normals(solid.vertices, solid.triangles[kept], across[kept] / lengths[kept, None])
        colours = np.broadcast_to(to_rgb(LOOKS[solid.kind].colour), (len(normals), 3))
        bodies.append(ShadedBody(corners[kept], normals, colours))
    return bodies


def _list_frame_axes(drawn: Scene) -> list[tuple[str, Points, str]]:
    """List the axes of the frames that a view shows: letter, both ends (2, 3) mm, colour."""
    length, axes = 0.085 * drawn.size, []
    for frame in drawn.frames.values():
        for letter, axis, colour in zip("XYZ", frame[:, :3].T, ("#c62828", "#2e7d32", "#1565c0"), strict=True):
            if drawn.normal is None or abs(float(axis @ drawn.normal)) <= 0.999:
                axes.append((letter, np.array([frame[:, 3], frame[:, 3] + length * axis]), colour))
    return axes
