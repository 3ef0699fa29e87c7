"""Searched designs as machine files, and their Pareto front as a picture."""

from __future__ import annotations

from io import BytesIO

from ..synthesis.designs import Designs
from .colours import FAINT, INK

_COLOUR = "#1565c0"


def format_proved_yaml(designs: Designs, index: int) -> str:
    """Format the machine file of a proved design; comments tell what is proved of it, mm and rad."""
    design = designs.front[index]
    box = ", ".join(f"{axis} {low:.9g} to {high:.9g}" for axis, (low, high) in design.box.items())
    return "\n".join(
        [
            "# A design found by search; that it keeps its limits all over this box of poses is proved by intervals:",
            f"# {box} (mm, rad)",
            *(f"# {name}: {value:.9g}" for name, value in {**design.sizes, **design.values}.items()),
            design.machine.format_yaml(),
        ]
    )


def render_front_png(designs: Designs) -> bytes:
    """Render the Pareto front of two objectives, its designs by their numbers."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    problem = designs.problem
    first, second = problem.minimise
    points = [(design.values[first], design.values[second]) for design in designs.front]
    figure = Figure(figsize=(6.4, 4.8), dpi=150, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.14, 0.13, 0.82, 0.74))
    axes.plot(*zip(*points, strict=True), "o-", color=_COLOUR, markersize=5, linewidth=1.0)
    for number, point in enumerate(points, 1):
        axes.annotate(str(number), point, xytext=(5, 5), textcoords="offset points", color=INK, fontsize=9)
    axes.grid(color=FAINT, linewidth=0.6)
    units = {"amplification": "", "greatest_amplification": ""}
    units |= {parameter.name: f" [{parameter.unit}]" for parameter in problem.family.parameters}
    axes.set_xlabel(first + units.get(first, " [mm]"), color=INK, fontsize=9)
    axes.set_ylabel(second + units.get(second, " [mm]"), color=INK, fontsize=9)
    title = f"{problem.machine.name}: {len(points)} designs, none better than another"
    figure.text(0.03, 0.93, title, color=INK, fontsize=13, weight="bold")
    data = BytesIO()
    canvas.print_png(data)  # type: ignore[no-untyped-call]
    return data.getvalue()
