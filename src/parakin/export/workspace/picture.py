"""A workspace's picture: its shaded surface and cross-sections, in the plane its area by what binds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Array
from ...workspaces.sampled.distance_field import SampledField
from ...workspaces.sampled.sampling import SampledWorkspace
from ..colours import FAINT, INK
from ..figure_file import SEAM, render_figure
from ..shaded_bodies import add_bodies
from ..space_axes import GREY, add_space_axes, fit_to_room
from .describe import AnyWorkspace, describe_size, describe_workspace, format_volume
from .meshes import Mesh
from .sweep_curves import CurveGroup

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...workspaces.sampled.cross_sections import CrossSection

_VIEW = {"elev": 22.0, "azim": -56.0}  # from the front right, degrees
_LEGEND = {"frameon": False, "fontsize": 9, "labelcolor": INK, "alignment": "left"}
_IN_SPACE, _IN_PLANE = (12.0, 6.6), (9.6, 7.2)  # inches
_ROOM = (0.01, 0.02, 0.58, 0.82)  # of axes in space
_WIDE = 96  # letters of a heading's line
_FILLED = 0.13  # opacity of a cross-section's inside
# P. Tol's muted scheme, told apart by colour-blind people too.
_COLOURS = ("#88ccee", "#cc6677", "#ddcc77", "#117733", "#332288", "#aa4499", "#44aa99", "#999933", "#882255")
_PIXELS = 2  # along a step of a planar field


def render_space(workspace: AnyWorkspace, mesh: Mesh, slices: Sequence[CrossSection], suffix: str) -> bytes:
    """Render a workspace in space: its shaded surface, coloured by height, and beside it its cross-sections."""
    return _render(workspace, _IN_SPACE, suffix, lambda figure: _draw_space(figure, workspace, mesh, slices))


def render_plane(workspace: AnyWorkspace, field: SampledField, slices: Sequence[CrossSection], suffix: str) -> bytes:
    """Render a workspace in a plane: its area, a colour for each limit where that is nearest."""
    return _render(workspace, _IN_PLANE, suffix, lambda figure: _draw_plane(figure, workspace, field, slices))


def render_curves(
    workspace: SampledWorkspace,
    field: SampledField,
    groups: Sequence[CurveGroup],
    slices: Sequence[CrossSection],
    suffix: str,
) -> bytes:
    """Render the curves of a sweep; a workspace in space with its cross-sections beside them."""
    if len(workspace.axes) == 3:
        return _render(workspace, _IN_SPACE, suffix, lambda figure: _draw_net(figure, workspace, field, groups, slices))
    return _render(workspace, _IN_PLANE, suffix, lambda figure: _draw_flat_net(figure, workspace, groups))


def _render(workspace: AnyWorkspace, inches: tuple[float, float], suffix: str, draw: Callable[[Figure], None]) -> bytes:
    return render_figure(inches, draw, lambda figure: _add_title(figure, workspace), suffix)


def _add_title(figure: Figure, workspace: AnyWorkspace) -> None:
    name = workspace.machine.spec.title or workspace.machine.name
    figure.text(0.025, 0.945, name, color=INK, fontsize=15, weight="bold", parse_math=False)
    what = f"{fill(describe_workspace(workspace), _WIDE)}\n{describe_size(workspace)}"
    figure.text(0.025, 0.905, what, color=GREY, fontsize=10.5, va="top", linespacing=1.5, parse_math=False)


# In space.


def _draw_space(figure: Figure, workspace: AnyWorkspace, mesh: Mesh, slices: Sequence[CrossSection]) -> None:
    from matplotlib import colormaps
    from matplotlib.colors import Normalize

    axis = slices[0].axis if slices else workspace.axes[-1]
    along = workspace.axes.index(str(axis))
    scale = Normalize(mesh.vertices[:, along].min(), mesh.vertices[:, along].max())
    colours: Any = colormaps["viridis"]
    axes = _add_axes(figure, mesh.vertices.min(0), mesh.vertices.max(0), workspace.axes)
    height = mesh.vertices[mesh.faces][:, :, along].mean(1)
    add_bodies(axes, [mesh.make_body(colours(0.12 + 0.8 * scale(height))[:, :3])])
    if slices:
        _draw_sections(figure, slices, lambda value: colours(0.12 + 0.8 * scale(value)))


def _add_axes(figure: Figure, low: Array, high: Array, names: Sequence[str]) -> Any:
    half = 0.54 * (high - low)
    axes = add_space_axes(figure, 0.5 * (low + high), half, names)
    axes.set_proj_type("persp", focal_length=1.6)
    axes.view_init(**_VIEW)
    fit_to_room(axes, half, _ROOM)
    return axes


def _draw_sections(figure: Figure, slices: Sequence[CrossSection], colour: Any) -> None:
    axes: Any = figure.add_axes((0.66, 0.12, 0.315, 0.60))
    for section in slices:
        label = f"{section.axis} = {section.value:,.1f} mm   {format_volume(section.area, 2)}"
        for number, outline in enumerate(section.outlines):
            axes.fill(*outline.T, color=colour(section.value), alpha=_FILLED, linewidth=0.0)
            axes.plot(*outline.T, color=colour(section.value), linewidth=1.6, label="" if number else label)
        if not section.outlines:
            axes.plot([], [], color=colour(section.value), linewidth=1.6, label=label)
    _set_plane(axes, slices[0].plane)
    axes.legend(
        loc="lower left", bbox_to_anchor=(-0.02, 1.02), **_LEGEND, title="cross-sections"
    ).get_title().set_color(INK)


def _set_plane(axes: Any, names: Sequence[str]) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.locator_params(nbins=6)
    axes.set_xlabel(f"{names[0]} [mm]", color=GREY, fontsize=9)
    axes.set_ylabel(f"{names[1]} [mm]", color=GREY, fontsize=9)
    axes.grid(color=FAINT, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8, colors=GREY, length=0)
    for side in axes.spines.values():
        side.set_color("#cfd8dc")


# In a plane.


def _draw_plane(figure: Figure, workspace: AnyWorkspace, field: SampledField, slices: Sequence[CrossSection]) -> None:
    from matplotlib.patches import Patch, PathPatch
    from matplotlib.path import Path

    outlines = [outline for section in slices for outline in section.outlines]
    fine = np.array(field.values.shape) * _PIXELS
    step = field.step / _PIXELS
    near = np.repeat(np.repeat(field.values > -field.step.min(), _PIXELS, 0), _PIXELS, 1)
    low = field.low - 0.5 * field.step
    nearest = field.distance.find_nearest_limits(low + (np.argwhere(near) + 0.5) * step).limit
    count = np.bincount(nearest, minlength=len(workspace.region.limits))
    places, patches = np.full(len(count), -1), []
    for place, number in enumerate(np.argsort(-count, kind="stable")[: int((count > 0).sum())].tolist()):
        colour = _choose_colour(place)
        places[number] = place
        label = f"{workspace.region.limits[number]}   {count[number] / len(nearest):.1%}"
        patches.append(Patch(facecolor=colour, label=label))
    axes: Any = figure.add_axes((0.08, 0.08, 0.60, 0.72))
    edge = Path.make_compound_path(*(Path(outline, closed=True) for outline in outlines))
    shown, lines = (
        np.full(tuple(fine), -1),
        [a + (np.arange(n) + 0.5) * b for a, n, b in zip(low, fine, step, strict=True)],
    )
    shown[near] = places[nearest]
    for place, patch in enumerate(patches):  # the first one lies below all others
        own = shown == place if place else near
        area = axes.contourf(
            *lines, own.T, levels=[0.5, 1.5], colors=[patch.get_facecolor()], antialiased=True, zorder=2
        )
        area.set(edgecolor="face", linewidth=SEAM)
        area.set_clip_path(PathPatch(edge, transform=axes.transData))
    axes.add_patch(PathPatch(edge, facecolor="none", edgecolor=INK, linewidth=1.4, zorder=3))
    _set_plane(axes, workspace.axes)
    axes.legend(handles=patches, loc="upper left", bbox_to_anchor=(1.02, 1.0), **_LEGEND,
                title="nearest limit, share of the area").get_title().set_color(INK)  # fmt: skip


def _choose_colour(place: int) -> tuple[float, float, float, float]:
    """Choose the colour of a limit by its place in the order of their shares; paler once all colours are used."""
    from matplotlib.colors import to_rgb

    pale = 1.0 - 0.45 * (place // len(_COLOURS) % 2)
    red, green, blue = (1.0 - pale * (1.0 - channel) for channel in to_rgb(_COLOURS[place % len(_COLOURS)]))
    return red, green, blue, 1.0


# CurveGroup of a sweep.


def _draw_net(
    figure: Figure,
    workspace: SampledWorkspace,
    field: SampledField,
    groups: Sequence[CurveGroup],
    slices: Sequence[CrossSection],
) -> None:
    from matplotlib import colormaps
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    low, high = field.span
    scale = Normalize(low[2], high[2])
    colours: Any = colormaps["viridis"]
    axes = _add_axes(figure, low, high, workspace.axes)
    for group in groups:
        width = 0.6 if group.fine else 1.3
        tint = [colours(0.12 + 0.8 * scale(line[:, 2].mean())) for line in group.lines]
        axes.add_collection3d(
            Line3DCollection(group.lines, colors=tint, linewidths=width, alpha=0.6 if group.fine else 1.0)
        )
    if slices:
        _draw_sections(figure, slices, lambda value: colours(0.12 + 0.8 * scale(value)))


def _draw_flat_net(figure: Figure, workspace: SampledWorkspace, groups: Sequence[CurveGroup]) -> None:
    from matplotlib import colormaps

    palette: Any = colormaps["tab10"]
    axes: Any = figure.add_axes((0.08, 0.08, 0.60, 0.72))
    for number, group in enumerate(groups):
        for i, line in enumerate(group.lines):
            colour, width = ("#b0bec5", 0.6) if group.fine else (palette(number % 10), 1.7)
            axes.plot(
                *line.T, color=colour, linewidth=width, zorder=2 if group.fine else 3, label="" if i else group.name
            )
    _set_plane(axes, workspace.axes)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), **_LEGEND)
