"""A drawing as a file: a PNG for the screen, with a heading, or a PDF or SVG for a printed page, without one."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCREEN = ".png"
PICTURES = (SCREEN, ".pdf", ".svg")

_DOTS = 150  # dots an inch
_COLUMN, _PAGE = 3.5, 7.2  # inches: a column of a page, and both
_NARROW = 8.0  # inches on the screen: a figure no wider is printed in a column
_PRINTED_FONT = 7.0  # points
_BORDER = 0.02  # inches, about a printed figure
SEAM = 0.3  # points, by which areas of a map overlap: else a reader's smoothing shows the ground between them


def render_figure(
    inches: tuple[float, float],
    draw: Callable[[Figure], None],
    add_heading: Callable[[Figure], None],
    suffix: str = SCREEN,
    dots: int = _DOTS,
) -> bytes:
    """Render a drawing as a file of a kind, one of :data:`PICTURES`.

    inches : its width and height on the screen; printed it is as wide as a page, or a column if it is narrow
    add_heading : called for the screen only, for a printed figure has a caption
    dots : an inch, on the screen

    Printed, text is as large as a caption's, and stays text; all else is lines and polygons.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    printed = suffix != SCREEN
    scale = (_COLUMN if inches[0] <= _NARROW else _PAGE) / inches[0] if printed else 1.0
    data = BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "parakin", "pdf.fonttype": 42}):
        figure = Figure(figsize=(scale * inches[0], scale * inches[1]), dpi=dots, facecolor="white")
        draw(figure)
        if printed:
            _fit_to_page(figure)
        else:
            add_heading(figure)
        figure.savefig(
            data,
            format=suffix.removeprefix("."),
            dpi=dots,
            bbox_inches="tight" if printed else None,
            pad_inches=_BORDER,
            metadata=_drop_date(suffix),
        )
    return data.getvalue()


def _fit_to_page(figure: Figure) -> None:
    """Set all text in one size, draw bodies as polygons, and let areas of maps overlap, with few corners."""
    from matplotlib.contour import QuadContourSet
    from matplotlib.text import Text

    from .shaded_bodies import print_bodies
    from .space_axes import set_tick_counts

    for text in figure.findobj(Text):
        text.set_fontsize(_PRINTED_FONT)
    for axes in figure.axes:
        axes.tick_params(labelsize=_PRINTED_FONT)
        if figure.get_figwidth() < _PAGE and hasattr(axes, "get_zlim"):
            set_tick_counts(axes, 3)  # a column has no room for more
    _fit_to_width(figure)
    print_bodies(figure)
    figure.draw_without_rendering()  # only then axes have their sizes
    for map_ in figure.findobj(QuadContourSet):
        to_dots = map_.get_transform()
        drawn = [path.transformed(to_dots).cleaned(simplify=True) for path in map_.get_paths()]
        map_.set_paths([path.transformed(to_dots.inverted()) for path in drawn])
        if map_.filled:
            map_.set(edgecolor="face", linewidth=SEAM)


def _fit_to_width(figure: Figure) -> None:
    """Make a figure narrower by what stands beside it, such as the numbers of a scale: text keeps its size."""
    wide, high = figure.get_size_inches()
    figure.draw_without_rendering()
    drawn = figure.get_tightbbox()
    if drawn is not None and drawn.width + 2.0 * _BORDER > wide:
        narrow = 2.0 * wide - drawn.width - 2.0 * _BORDER
        figure.set_size_inches(narrow, high * narrow / wide)


def _drop_date(suffix: str) -> dict[str, None]:
    """Drop the date of a file, so that the same picture has the same bytes."""
    return {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(suffix, {})
