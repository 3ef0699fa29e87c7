"""The page of a comparison of machines: their pictures and figures side by side, one HTML file."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from typing import TYPE_CHECKING

from ..arguments import check_arguments
from .comparison_table import list_rows
from .machine.picture import render_machine_picture
from .report.cards import make_card
from .report.figures import render_page

if TYPE_CHECKING:
    from ..comparison.comparison import Comparison, MachineFigures


@check_arguments
def render_comparison_page(comparison: Comparison) -> str:
    """Render machines side by side as one HTML document: a column each with its picture, its figures and reasons.

    comparison : of :func:`parakin.compare`
    """
    columns = comparison.columns
    names = " and ".join([", ".join(column.machine.name for column in columns[:-1]), columns[-1].machine.name])
    head = "".join(f"<th class=n>{escape(column.machine.name)}</th>" for column in columns)
    pictures = "".join(f"<td class=n>{_embed_picture(column)}</td>" for column in columns)
    body = [f"<tr><th></th>{head}</tr>\n<tr><td></td>{pictures}</tr>\n"]
    for name, *cells in list_rows(comparison):
        figures = "".join(f"<td class=n>{escape(cell)}</td>" for cell in cells)
        body.append(f"<tr><td class=k>{escape(name)}</td>{figures}</tr>\n")
    cards = [make_card("Side by side", f"<div class=wide><table>{''.join(body)}</table></div>")]
    reasons = [(column.machine.name, *reason) for column in columns for reason in column.reasons.items()]
    if reasons:
        lines = "".join(f"<p>{escape(f'{name}: {what}: {why}')}</p>\n" for name, what, why in reasons)
        cards.append(make_card("What could not be told", lines))
    return render_page(names, "".join([f"<header><h1>{escape(names)}</h1></header>\n", *cards]))


def _embed_picture(column: MachineFigures) -> str:
    """Embed a machine's picture at home."""
    data = b64encode(render_machine_picture(column.machine)).decode()
    return f'<img alt="{escape(column.machine.name)}" width=170 src="data:image/png;base64,{data}">'
