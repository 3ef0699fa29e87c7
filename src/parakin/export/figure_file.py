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
_PRINTED_DOTS = 400  # an inch, of maps, which are an image on the page too


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

    Printed, text is as large as a caption's, and stays text; only maps become images.
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
        figure.savefig(data, format=suffix.removeprefix("."), dpi=_PRINTED_DOTS if printed else dots,
                       bbox_inches="tight" if printed else None, metadata=_drop_date(suffix))  # fmt: skip
    return data.getvalue()


def _fit_to_page(figure: Figure) -> None:
    """Set all text in one size, draw bodies as polygons, and make images of maps, whose seams would show."""
    from matplotlib.contour import QuadContourSet
    from matplotlib.text import Text

    from .shaded_bodies import print_bodies

    for text in figure.findobj(Text):
        text.set_fontsize(_PRINTED_FONT)
    for axes in figure.axes:
        axes.tick_params(labelsize=_PRINTED_FONT)
        if figure.get_figwidth() < _PAGE and hasattr(axes, "get_zlim"):
            axes.locator_params(nbins=3)  # a column has no room for more
    for map_ in figure.findobj(QuadContourSet):
        map_.set_rasterized(True)
    print_bodies(figure)


def _drop_date(suffix: str) -> dict[str, None]:
    """Drop the date of a file, so that the same picture has the same bytes."""
    return {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(suffix, {})
