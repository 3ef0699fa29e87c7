"""The figures of the papers on which parakin stands, remade from its own calculations, and the page that shows them.

python examples/gallery.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d.art3d import Line3DCollection

import parakin as pk
from parakin.export.shaded_bodies import add_bodies
from parakin.export.space_axes import fit_to_room, set_space_axes
from parakin.units import name_display_unit, to_display

BLUE, ORANGE, GREEN, GREY = "#1565c0", "#ef6c00", "#2e7d32", "#90a4ae"
WALL = "#5b9bd5"
VIEW: dict[str, Any] = {"elev": 24.0, "azim": -56.0}  # degrees
TILT = np.deg2rad(15.0)
TOTAL = dict.fromkeys("ABC", (-TILT, TILT))


class Page:
    """Figures with their numbers, in the order they are added."""

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}
        self.machine = ""
        self.text = [
            "# Gallery",
            "",
            "The papers' figures, remade by `python examples/gallery.py`. Lengths are mm.",
            "",
        ]

    def paper(self, title: str, machine: str) -> None:
        self.text += [f"## {title}", ""]
        self.machine = machine

    def add(self, name: str, title: str, figure: Figure, numbers: str, machine: str | None = None) -> None:
        """Add a figure with its numbers, and the machine's sizes: which were published and which chosen."""
        canvas, data = FigureCanvasAgg(figure), BytesIO()
        canvas.print_png(data)
        self.files[f"{name}.png"] = data.getvalue()
        self.text += [f"### {title}", "", f"![{title}](gallery/{name}.png)", "", numbers, ""]
        self.text += [sizes(machine or self.machine), ""]


def sizes(name: str) -> str:
    """Tell a machine's sizes and its drives' ranges, and where they come from."""
    machine = pk.load(name)
    lengths = [f"{size} {value:g} mm" for size, value in machine.spec.sizes.items()]
    drives = [
        f"{drive.name} {to_display(drive.low, drive.unit):g} to {to_display(drive.high, drive.unit):g}"
        f" {name_display_unit(drive.unit)}"
        for drive in machine.drives
    ]
    source = " ".join(machine.spec.source.split())
    return f"Sizes of `{name}`: {', '.join([*lengths, *drives])}. {source}"


def plane(width: float = 6.4, height: float = 6.0) -> tuple[Figure, Any]:
    figure = Figure(figsize=(width, height), dpi=110, layout="constrained")
    ax = figure.add_subplot()
    ax.set_aspect("equal")
    ax.grid(color="#e3e8ec", linewidth=0.7)
    ax.set_axisbelow(True)
    ax.set_xlabel("X [mm]", fontsize=8)
    ax.set_ylabel("Y [mm]", fontsize=8)
    ax.tick_params(labelsize=7)
    return figure, ax


def space(count: int = 1, width: float = 7.0, height: float = 6.4) -> tuple[Figure, list[Any]]:
    figure = Figure(figsize=(width, height), dpi=110)
    return figure, [figure.add_subplot(1, count, i + 1, projection="3d", **VIEW) for i in range(count)]


def frame(ax: Any, low: np.ndarray, high: np.ndarray, names: tuple[str, ...]) -> None:
    """Give axes in space equal scales over a box, and the room that there is."""
    set_space_axes(ax, 0.5 * (low + high), 0.5 * (high - low), names)
    spec = ax.get_subplotspec()
    left = spec.colspan.start / spec.get_gridspec().ncols
    fit_to_room(ax, 0.5 * (high - low), (left + 0.01, 0.02, left + 1.0 / spec.get_gridspec().ncols - 0.01, 0.94))


def solid(ax: Any, shapes: list[tuple[pk.Mesh, str, float]]) -> None:
    """Draw surfaces, each in a colour and with an opacity, lit by the normals of the limits that make them."""
    bodies = [shape.make_body(np.broadcast_to(to_rgb(colour), (len(shape.faces), 3)), opacity)
              for shape, colour, opacity in shapes]  # fmt: skip
    add_bodies(ax, bodies)


def edges(low: np.ndarray, high: np.ndarray) -> list[list[np.ndarray]]:
    corners = [np.array(corner) for corner in product(*zip(low, high, strict=True))]
    return [[a, b] for i, a in enumerate(corners) for b in corners[i + 1 :] if np.count_nonzero(a != b) == 1]


def meshed(found: pk.Workspace, step: float) -> pk.Mesh:
    assert found.box is not None
    return pk.make_mesh(pk.sample_field(found.region, found.box, step, seconds=None))


def proved(found: pk.Workspace) -> str:
    v, scale, unit = found.volume, (1e9, "m³") if len(found.axes) == 3 else (1e6, "m²"), found.unit
    factor, big = scale
    return f"certified {v.estimate / factor:.4f} {big}, proved between {v.inner:,.0f} and {v.outer:,.0f} {unit}"


def tricept(page: Page) -> None:
    page.paper("Tricept: FME Transactions 41 (2013)", "tricept")
    found = pk.workspace(pk.region(pk.load("tricept"), at={"B": 0.0, "C": 0.0}))
    boxes: list[tuple[str, pk.InscribedBox, str]] = [
        ("a", pk.find_largest_box(found.region, seconds=None), ORANGE),
        ("b", pk.find_largest_box(found.region, shape=(3.0, 3.0, 1.0), seconds=None), GREEN),
        ("c", pk.find_largest_box(found.region, shape=(1.0, 1.0, 1.0), seconds=None), "#6a1b9a"),
    ]
    figure, (ax,) = space()
    assert found.box is not None
    low, high = found.box
    frame(ax, low, high, found.axes)
    solid(ax, [(meshed(found, 30.0), WALL, 0.22)])
    for (name, box, colour), (x, y) in zip(boxes, ((0, 0), (1, 0), (1, 1)), strict=True):  # corners clear of each other
        for line in edges(box.low, box.high):
            ax.plot(*np.transpose(line), color=colour, linewidth=1.8, zorder=20)
        corner = (box.low, box.high)[x][0], (box.low, box.high)[y][1], box.high[2] + 40.0
        halo = [withStroke(linewidth=3.0, foreground="white")]
        ax.text(*corner, name, color=colour, fontsize=12, weight="bold", ha="center", zorder=30, path_effects=halo)
    sizes = "; ".join(f"{name} {' × '.join(f'{e:,.0f}' for e in box.edges)}" for name, box, _ in boxes)
    page.add(
        "tricept_4",
        "Figure 4: workspace in three-axis machining, B = C = 0, with parallelepipeds inside",
        figure,
        f"{proved(found)}. Boxes proved inside (a the largest found, b of 3:3:1, c a cube): {sizes}. Bounded by "
        + ", ".join(f"{bound.limit} ({bound.fraction:.0%})" for bound in found.bounded_by[:6])
        + ".",
    )


def hbg80(page: Page) -> None:
    page.paper("HBG80: Parallel kinematic machines (about 2000)", "hbg80_2d")
    # Both assemblies count.
    plane_region, space_region = (pk.region(pk.load(f"hbg80_{n}d"), components="all") for n in (2, 3))
    two, three = (
        pk.sweep_drives(plane_region, cells=48, seconds=None),
        pk.sweep_drives(space_region, cells=24, seconds=None),
    )
    # |det J| grows without end where both assemblies meet: sums over few cells are off by more than the proved bounds.
    fine_area = pk.sweep_drives(plane_region, 2400, seconds=None).estimate
    fine_volume = pk.sweep_drives(space_region, 240, seconds=None).estimate
    figure, ax = plane()
    for image in two.contours:
        for number, piece in enumerate(image.pieces):
            label = image.strategy.name if image.side == "home" and not number else None
            style = "-" if image.side == "home" else ":"
            ax.plot(*piece.T, style, linewidth=1.5, label=label, color=None if label else GREY)
    ax.legend(fontsize=7)
    page.add(
        "hbg80_3_1",
        "Figure 3.1: contour of the two-axis machine's workspace, drives at their limits",
        figure,
        f"Each line is one drive that runs while the other stands; dotted, the other assembly. Area of both from "
        f"the drives' side, |det J| over 2,400 parts of each range: {fine_area:,.0f} mm² (over 48 parts "
        f"{two.estimate:,.0f}: det J has no bound where the assemblies meet); "
        f"{proved(pk.workspace(plane_region))}. Home's assembly alone: "
        f"{proved(pk.workspace(pk.region(plane_region.machine)))}.",
    )
    figure, ax = plane()
    for net in two.nets:
        for lines in (net.positions, net.positions.swapaxes(0, 1)):
            for line in lines[::3]:
                ax.plot(*line.T, color=BLUE if net.side == "home" else GREY, linewidth=0.6)
    page.add("hbg80_3_2", "Figure 3.2: workspace of the two-axis machine as a net", figure, "Both drives run.")
    whole = pk.workspace(space_region)
    assert whole.box is not None
    figure, (ax,) = space()
    for image in three.contours:
        colour = BLUE if image.side == "home" else GREY
        ax.add_collection3d(Line3DCollection(image.pieces, colors=colour, linewidths=1.3))
    frame(ax, *whole.box, whole.axes)
    page.add(
        "hbg80_3_3",
        "Figure 3.3: contours of the three-axis machine's workspace",
        figure,
        "One drive runs, two stand at their limits.",
        "hbg80_3d",
    )
    figure, (ax,) = space()
    for net in three.nets:
        colour = BLUE if net.side == "home" else GREY
        for lines in (net.positions, net.positions.swapaxes(0, 1)):
            ax.add_collection3d(Line3DCollection(list(lines[::2]), colors=colour, linewidths=0.5))
    frame(ax, *whole.box, whole.axes)
    page.add(
        "hbg80_3_4",
        "Figure 3.4: shell of the three-axis machine's workspace",
        figure,
        f"Two drives run, one stands. Volume of both assemblies from the drives' side, over 240 parts of each range: "
        f"{fine_volume:,.0f} mm³; {proved(whole)}. Home's assembly alone: "
        f"{proved(pk.workspace(pk.region(space_region.machine)))}.",
        "hbg80_3d",
    )


def lambda6(page: Page) -> None:
    page.paper("Lambda: IJEEC 6 (2022)", "lambda6")
    machine = pk.load("lambda6")
    level = {"A": 0.0, "B": 0.0, "C": 0.0}
    one = pk.sweep_polar(
        pk.region(machine, at={**level, "Z": 1400.0}, components="all"), step=10.0, rays=72, seconds=None
    )
    figure, ax = plane()
    for angle, radius in zip(one.angles, one.radii[0], strict=True):
        ax.plot(*np.outer([np.cos(angle), np.sin(angle)], [0.0, radius]), color=GREY, linewidth=0.5)
    ax.plot(*one.outlines[0].T, "o-", color=BLUE, markersize=2.5, linewidth=1.2)
    page.add(
        "lambda_9",
        "Figure 9: one plane of the workspace, Z = 1400",
        figure,
        f"72 rays, ρ by 10 mm until the first place that is not allowed: {one.estimate:,.0f} mm². "
        "With the sizes chosen the machine is singular all over C = 0, the paper's orientation; its figures are of "
        "what the limits allow there.",
    )
    whole = pk.region(machine, at=level, components="all")
    swept = pk.sweep_polar(whole, step=10.0, planes=50.0, seconds=None)
    figure, (ax,) = space()
    stacked(ax, swept, BLUE)
    page.add(
        "lambda_10",
        "Figure 10: the achievable workspace",
        figure,
        f"Planes 50 mm apart: {swept.estimate:,.0f} mm³. "
        f"Certified, it need not be star-shaped: {proved(pk.workspace(whole))}.",
    )
    cases = [("a) strokes", ("gap *",)), ("b) and least gaps", ("gap *.max",)), ("c) and greatest gaps", ())]
    figure, axes = space(3, 12.0, 4.8)
    numbers = []
    for ax, (title, without) in zip(axes, cases, strict=True):
        found = pk.workspace(pk.region(machine, at=level, without=without, components="all"))
        shape = meshed(found, 12.0)
        frame(ax, np.array([-500.0, -500.0, 800.0]), np.array([500.0, 500.0, 2100.0]), found.axes)
        solid(ax, [(shape, WALL, 1.0)])
        figure.text((len(numbers) + 0.5) / len(cases), 0.94, title, fontsize=10, ha="center")
        numbers.append(f"{title}: {proved(found)}")
    page.add("lambda_11", "Figure 11: the limits, one after the other", figure, "; ".join(numbers) + ".")
    total = pk.workspace(pk.region(machine, every=TOTAL, components="all"), gap=0.05, seconds=None)
    achievable = pk.workspace(pk.region(machine, at=level, components="all"))
    figure, (ax,) = space()
    assert achievable.box is not None
    low, high = achievable.box
    frame(ax, low, high, achievable.axes)
    solid(ax, [(meshed(achievable, 12.0), WALL, 0.22), (meshed(total, 12.0), ORANGE, 1.0)])
    page.add(
        "lambda_13",
        "Figure 13: the total orientation workspace inside the achievable one",
        figure,
        f"A, B and C anywhere in ±15° (the paper's Figure 12 is the flow chart of this): {proved(total)}, that is "
        f"{total.volume.estimate / achievable.volume.estimate:.0%} of the achievable workspace.",
    )


def stacked(ax: Any, swept: pk.PolarWorkspace, colour: str) -> None:
    lines = swept.outlines
    ax.add_collection3d(Line3DCollection(lines, colors=colour, linewidths=1.0))
    points = np.concatenate(lines)
    frame(ax, points.min(0), points.max(0), swept.axes)


def orthoglide(page: Page) -> None:
    page.paper("Orthoglide: Chablat and Wenger, Chemnitz (2000)", "orthoglide")
    found = pk.workspace(pk.region(pk.load("orthoglide"), components="all"), cell=14.0, seconds=None)
    cells = found.cells
    assert found.box is not None
    figure, (ax,) = space()
    frame(ax, *found.box, found.axes)
    solid(ax, [(meshed(found, 4.0), WALL, 1.0)])
    page.add(
        "orthoglide_3",
        "Figure 3: Cartesian workspace",
        figure,
        "The paper draws the blocks of an octree; this is the surface on which the least limit is zero. "
        f"{int(cells.inside.sum()):,} cells proved inside, {int((~cells.inside).sum()):,} at the boundary, the "
        f"smallest {cells.size.min():.1f} mm. {proved(found)}. The thin end is in the other assembly mode.",
    )
    figure, ax = plane()
    field = pk.sample_field(found.region, found.box, 4.0, seconds=None)
    (cut,) = pk.find_cross_sections(field, "Z", [0.0], seconds=None)
    for outline in cut.outlines:
        ax.fill(*outline.T, facecolor="#bbdefb", edgecolor=BLUE, linewidth=1.5)
    cube = np.array([[-123.336, -123.336], [76.664, 76.664]])
    ax.plot(
        *np.array([cube[0], [cube[1, 0], cube[0, 1]], cube[1], [cube[0, 0], cube[1, 1]], cube[0]]).T, "--", color=ORANGE
    )
    page.add(
        "orthoglide_4",
        "Figure 4: cross-section at Z = 0",
        figure,
        f"{cut.area:,.0f} mm²; dashed, the cube of 200 mm for which it was designed.",
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    folder = parser.parse_args().output
    page = Page()
    for paper in (tricept, hbg80, lambda6, orthoglide):
        paper(page)
        print(f"{paper.__name__} done", flush=True)
    (folder / "gallery").mkdir(parents=True, exist_ok=True)
    for name, data in page.files.items():
        (folder / "gallery" / name).write_bytes(data)
    written = folder / "gallery.md"
    written.write_text("\n".join(page.text).rstrip() + "\n", encoding="utf-8")
    print(written)


if __name__ == "__main__":
    main()
