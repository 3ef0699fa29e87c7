"""The page of searched designs: their Pareto front, each design's machine file, and its machine as one that moves."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from typing import TYPE_CHECKING

from ..arguments import check_arguments
from ..errors import PoseError
from .designs import (
    describe_designs,
    describe_proofs,
    describe_ranges,
    format_proved_yaml,
    list_shown_values,
    list_units,
    name_with_unit,
)
from .page.page import render_machine_page, render_path_page
from .report.cards import make_card, make_fact_table
from .report.figures import PlotTrace, embed_figure, render_page
from .report.packed_pages import render_page_frame
from .report.panels import Panel, stack_panels

if TYPE_CHECKING:
    from ..synthesis.designs import Designs, ProvedDesign

_NUMBERS = ".7g"
_TALL = 260  # px of a diagram
_ROOM = 0.08  # of the values' width, beside the outermost ones
_PATH_NUMBERS = 120_000  # of the parts' paths in all pages together
_COLOUR = "#2f6fb3"


@check_arguments
def render_front_page(designs: Designs) -> str:
    """Render proved designs as one HTML document that needs nothing else.

    The front is drawn with each objective over the first one; a point, or a row of the table, leads to its design: what
    it is worth, its machine file, and the page on which it moves, with the part if there is one. The document takes
    some 0.3 MB and 6 kB a design, and half a MB more where there is a part.

    designs : of :func:`parakin.find_designs`

    Raises :class:`PoseError` where no design is proved.
    """
    if not designs.front:
        raise PoseError("designs: one that is proved expected")
    problem, count = designs.problem, len(designs.front)
    title = f"Designs of {problem.machine.name}"
    left = [_render_front(designs)] if len(problem.objectives) > 1 else []
    left += [_render_table(designs)]
    left += [_render_unproved(designs)] if designs.unproved else []
    pages = [_render_machine(design, _PATH_NUMBERS // count) for design in designs.front]
    choices = "".join(_render_choice(designs, index) for index in range(count))
    right = f"<section class=card>{choices}{render_page_frame(pages, 'The machine of the design')}</section>\n"
    body = [
        f"<header><h1>{escape(title)}</h1><p class=sub>{escape(describe_designs(designs))}</p></header>\n",
        f"<div class=beside><div>{''.join(left)}</div><div>{right}</div></div>\n",
    ]
    return render_page(title, "".join(body))


def _name_design(index: int) -> str:
    return f"design_{index + 1}"


def _render_front(designs: Designs) -> str:
    first, *others = designs.problem.objectives
    units = list_units(designs.problem)
    shown = [list_shown_values(designs, index) for index in range(len(designs.front))]
    numbers = [str(number) for number in range(1, len(shown) + 1)]
    rows = []
    for second in others:
        x, y = ([values[name] for values in shown] for name in (first, second))
        trace: PlotTrace = {
            "type": "scatter",
            "mode": "lines+markers" if len(others) == 1 else "markers",
            "x": x,
            "y": y,
        }
        trace |= {"line": {"color": _COLOUR, "width": 1.4}, "marker": {"size": 9, "color": _COLOUR}, "text": numbers}
        trace["customdata"] = [[f"{a:{_NUMBERS}}", f"{b:{_NUMBERS}}"] for a, b in zip(x, y, strict=True)]
        said = [f"{escape(name)} %{{customdata[{at}]}} {units[name]}" for at, name in enumerate((first, second))]
        trace |= {"hovertemplate": "<br>".join(said), "links": [f"#{_name_design(i)}" for i in range(len(shown))]}
        rows.append([Panel(escape(name_with_unit(second, units)), [trace], _widen(y), ticks="~s")])
    figure, height = stack_panels(rows, name_with_unit(first, units), _TALL)
    figure["layout"]["xaxis"]["range"] = _widen([values[first] for values in shown])
    sub = "No design is better than another in everything. A click, or Enter, shows a point's machine."
    return make_card("The front", embed_figure("front", figure, f"{height}px"), sub)


def _widen(values: list[float]) -> list[float]:
    """Widen the values' ends, so that the outermost points stand within the diagram."""
    low, high = min(values), max(values)
    room = _ROOM * (high - low) or 0.5 * abs(high) or 0.5
    return [low - room, high + room]


def _render_table(designs: Designs) -> str:
    units = list_units(designs.problem)
    shown = [list_shown_values(designs, index) for index in range(len(designs.front))]
    head = "".join(f"<th class=n>{escape(name_with_unit(name, units))}</th>" for name in shown[0])
    body = []
    for index, values in enumerate(shown):
        cells = "".join(f"<td class=n>{value:{_NUMBERS}}</td>" for value in values.values())
        body.append(f'<tr><td><a href="#{_name_design(index)}">{index + 1}</a></td>{cells}</tr>\n')
    return make_card("Designs", f"<div class=wide><table><tr><th></th>{head}</tr>\n{''.join(body)}</table></div>")


def _render_unproved(designs: Designs) -> str:
    lines = []
    for failed in designs.unproved:
        sizes = designs.problem.format_variables(failed.sizes, _NUMBERS)
        lines.append(f"<p>{escape(f'{sizes}: {failed.reason}')}</p>\n")
    return make_card("Found, but not proved", "".join(lines))


def _render_choice(designs: Designs, index: int) -> str:
    """Render what stands above a design's machine: its values, what is proved, its files."""
    design, name, units = designs.front[index], _name_design(index), list_units(designs.problem)
    values = [
        (name_with_unit(key, units), f"{value:{_NUMBERS}}") for key, value in list_shown_values(designs, index).items()
    ]
    proofs = describe_proofs(design, _NUMBERS)
    facts = [*values, ("proved", f"limits and bounds, with {design.boxes:,} boxes{f'; {proofs}' if proofs else ''}")]
    facts += [("drives", describe_ranges(design))]
    text = format_proved_yaml(designs, index)
    file = f"data:text/yaml;base64,{b64encode(text.encode()).decode('ascii')}"
    machine = f'<a download="{name}.yaml" href="{file}">Save the machine file</a>'
    page = f'<a download="{name}.html" data-page={index} href="#{name}">save the page below</a>'
    return (
        f'<div data-choice="{name}"{" hidden" if index else ""}><h2>Design {index + 1}</h2>\n'
        f"<p class=sub>{machine}, {page}</p>\n{make_fact_table(facts)}\n"
        f"<details><summary>The machine file</summary><pre><code>{escape(text)}</code></pre></details></div>\n"
    )


def _render_machine(design: ProvedDesign, numbers: int) -> str:
    """Render the page on which a design moves, with its part if there is one."""
    if design.job is None:
        return render_machine_page(design.machine)
    return render_path_page(design.job.posted, design.job.trajectory, numbers)
