"""Searched designs as machine files, and their Pareto front as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..synthesis.designs import Designs
from ..synthesis.wants import WANTS
from .colours import FAINT, INK
from .figure_file import SCREEN, render_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOUR = "#1565c0"


def format_proved_yaml(designs: Designs, index: int) -> str:
    """Format the machine file of a proved design; comments tell what is proved of it, mm and rad."""
    design = designs.front[index]
    box = ", ".join(f"{axis} {low:.9g} to {high:.9g}" for axis, (low, high) in design.box.items())
    others = len(designs.problem.pose_sets) - 1
    more = f" and {others} more sets of poses" if others else ""
    return "\n".join(
        [
            "# A design found by search; that it keeps its limits all over this box of poses is proved by intervals:",
            f"# {box} (mm, rad){more}",
            *(
                f"# of every machine with {name} within {value}"
                for name, value in (designs.problem.within or {}).items()
            ),
            *(f"# {name}: {value:.9g}" for name, value in {**design.sizes, **design.values}.items()),
            *(f"# proved of {name}: {value:.9g}" for name, value in design.proved.items() if value is not None),
            design.machine.format_yaml(),
        ]
    )


def render_front(designs: Designs, suffix: str = SCREEN) -> bytes:
    """Render the Pareto front, each objective against the first one, its designs by their numbers.

    suffix : of the file, ``.png``, ``.pdf`` or ``.svg``
    """
    problem, front = designs.problem, designs.front
    first, *others = problem.objectives
    width = 0.8 + 5.6 * len(others)
    units = {name: f" [{want.unit}]" for name, want in WANTS.items() if want.unit}
    units |= {parameter.name: f" [{parameter.unit}]" for parameter in problem.family.parameters}

    def draw(figure: Figure) -> None:
        for place, second in enumerate(others):
            axes = figure.add_axes(((0.9 + 5.6 * place) / width, 0.13, 4.9 / width, 0.74))
            points = [(design.values[first], design.values[second]) for design in front]
            line = "o-" if len(others) == 1 else "o"
            axes.plot(*zip(*points, strict=True), line, color=_COLOUR, markersize=5, linewidth=1.0)
            for number, point in enumerate(points, 1):
                axes.annotate(str(number), point, xytext=(5, 5), textcoords="offset points", color=INK, fontsize=9)
            axes.grid(color=FAINT, linewidth=0.6)
            axes.set_xlabel(first + units.get(first, ""), color=INK, fontsize=9)
            axes.set_ylabel(second + units.get(second, ""), color=INK, fontsize=9)

    def add_heading(figure: Figure) -> None:
        title = f"{problem.machine.name}: {len(front)} designs, none better than another"
        figure.text(0.2 / width, 0.93, title, color=INK, fontsize=13, weight="bold", parse_math=False)

    return render_figure((width, 4.8), draw, add_heading, suffix)
