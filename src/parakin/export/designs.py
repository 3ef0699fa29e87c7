"""Searched designs as machine files and as text, and their Pareto front as a picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..synthesis.designs import Designs, ProvedDesign
from ..synthesis.problem import DesignProblem
from ..synthesis.wants import WANTS
from ..units import name_display_unit, to_display
from .colours import BLUE, FAINT, INK
from .figure_file import SCREEN, render_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN = {"mm³": ("litres", 1e-6)}  # units that are shown for others
_ALIKE = 2e-6  # relative: what is proved to that is what was found


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


def list_units(problem: DesignProblem) -> dict[str, str]:
    """List the units in which free numbers, shifts and quantities are shown; an empty text for those of a number."""
    units = {name: _SHOWN.get(want.unit, (want.unit, 1.0))[0] for name, want in WANTS.items()}
    units |= {f"shift {key}": "mm" for key in problem.shift}
    return units | {parameter.name: name_display_unit(parameter.unit) for parameter in problem.family.parameters}


def name_with_unit(name: str, units: Mapping[str, str]) -> str:
    """Name a column with its unit in brackets."""
    return f"{name} [{units[name]}]" if units[name] else name


def list_shown_values(designs: Designs, index: int) -> dict[str, float]:
    """List a design's free numbers, then its other values, each in its unit of :func:`list_units`."""
    own = {parameter.name: parameter.unit for parameter in designs.problem.family.parameters}
    design = designs.front[index]
    sizes = {name: float(to_display(value, own.get(name, "mm"))) for name, value in design.sizes.items()}
    scales = {name: _SHOWN.get(want.unit, (want.unit, 1.0))[1] for name, want in WANTS.items()}
    return {**sizes, **{name: value * scales[name] for name, value in design.values.items() if name not in sizes}}


def describe_proofs(design: ProvedDesign, digits: str) -> str:
    """Say of which quantities less is proved than what was found where they were looked at; ``digits`` is a format."""
    said = []
    for name, worst in design.proved.items():
        value = design.values[name]
        if worst is None:
            said.append(f"{name} is sampled only")
        elif abs(worst - value) > _ALIKE * abs(value):
            said.append(f"{name} proved to be {'above' if worst < value else 'below'} {worst:{digits}}")
    return ", ".join(said)


def describe_ranges(design: ProvedDesign) -> str:
    """Describe the ranges of the legs' drives, in the units of their joints."""
    units = dict(zip(design.machine.joints, design.machine.joint_units, strict=True))
    return ", ".join(
        f"{name} {to_display(ends[0], units[name]):.4f} to {to_display(ends[1], units[name]):.4f} "
        f"{name_display_unit(units[name])}"
        for name, ends in design.ranges.items()
    )


def describe_designs(designs: Designs) -> str:
    """Describe how many designs of which machine are proved, of which machines, and what is best of them."""
    problem = designs.problem
    ways = (("least", problem.minimise), ("greatest", problem.maximise))
    best = ", ".join(f"{way} {' and '.join(names)}" for way, names in ways if names)
    own = ", ".join(f"{name} {value}" for name, value in (problem.within or {}).items())
    nominal = ", the part run on the nominal one" if problem.path is not None else ""
    nominal += ", the workspace that of the nominal one" if problem.gauge is not None else ""
    made = f" of all machines within {own}{nominal}" if own else ""
    return f"{problem.machine.name}: {len(designs.front)} proved{made}, {best}"


def render_front(designs: Designs, suffix: str = SCREEN) -> bytes:
    """Render the Pareto front, each objective against the first one, its designs by their numbers.

    suffix : of the file, ``.png``, ``.pdf`` or ``.svg``
    """
    problem, front = designs.problem, designs.front
    first, *others = problem.objectives
    width = 0.8 + 5.6 * len(others)
    units = list_units(problem)
    shown = [list_shown_values(designs, index) for index in range(len(front))]

    def draw(figure: Figure) -> None:
        for place, second in enumerate(others):
            axes = figure.add_axes(((0.9 + 5.6 * place) / width, 0.13, 4.9 / width, 0.74))
            points = [(values[first], values[second]) for values in shown]
            line = "o-" if len(others) == 1 else "o"
            axes.plot(*zip(*points, strict=True), line, color=BLUE, markersize=5, linewidth=1.0)
            for number, point in enumerate(points, 1):
                axes.annotate(str(number), point, xytext=(5, 5), textcoords="offset points", color=INK, fontsize=9)
            axes.grid(color=FAINT, linewidth=0.6)
            axes.set_xlabel(name_with_unit(first, units), color=INK, fontsize=9)
            axes.set_ylabel(name_with_unit(second, units), color=INK, fontsize=9)

    def add_heading(figure: Figure) -> None:
        title = f"{problem.machine.name}: {len(front)} designs, none better than another"
        figure.text(0.2 / width, 0.93, title, color=INK, fontsize=13, weight="bold", parse_math=False)

    return render_figure((width, 4.8), draw, add_heading, suffix)
