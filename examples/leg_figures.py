"""A figure of each leg kind for the reference of machine files: its sizes, the sense of its joints, its branches.

python examples/leg_figures.py [-o FOLDER]

What is drawn is what the model computes: each kind's own inverse and struts, in a vertical plane.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from parakin.algebra import IDENTITY
from parakin.model.elements import Direction, Drive, Point, Size
from parakin.model.legs import Leg
from parakin.model.legs.column import Column
from parakin.model.legs.crank import Crank
from parakin.model.legs.driven_column import DrivenColumn
from parakin.model.legs.lambda_ import Lambda
from parakin.model.legs.length import Length
from parakin.model.legs.ring import Ring
from parakin.model.legs.slider import Slider

BASE, MOVED, OWN, OTHER = "0.55", "#0072b2", "black", "#d55e00"  # readable for colour-blind people
ORIGIN = Point((0.0, 0.0, 0.0))
ALONG, UP = Direction((1.0, 0.0, 0.0)), Direction((0.0, 0.0, 1.0))
AXIS = Direction((0.0, -1.0, 0.0))  # to the reader


def make_drives(*units: str) -> tuple[Drive, ...]:
    return tuple(Drive(f"q{number}", unit) for number, unit in enumerate(units, 1))


def draw_struts(axes: Axes, leg: Leg, point: Point, signs: str, colour: str) -> list[float]:
    """Draw the struts of a leg in a working mode; return its joints."""
    joints = [float(q) for q in leg.inverse(point, signs).joints]
    for start, end in leg.struts(point, joints):
        axes.plot([start[0], end[0]], [start[2], end[2]], color=colour, lw=3, solid_capstyle="round")
        axes.plot(start[0], start[2], "o", color=colour, ms=7)
    return joints


def draw_arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], text: str, colour: str = BASE) -> None:
    axes.annotate(
        "", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.4, "shrinkA": 0, "shrinkB": 0}
    )
    middle = 0.5 * (np.array(start) + end)
    axes.annotate(text, middle, (0, 5), textcoords="offset points", ha="center", color=colour)


def write(axes: Axes, x: float, z: float, text: str, colour: str = OWN, where: str = "left") -> None:
    axes.annotate(
        text, (x, z), (7 if where == "left" else -7, 0), textcoords="offset points", ha=where, va="center", color=colour
    )


def draw_length(axes: Axes, leg: Length, point: Point) -> None:
    draw_struts(axes, leg, point, "", OWN)
    write(axes, 0, 0, "foot")
    write(axes, 150, -165, "q, the length")
    write(axes, point[0], point[2], "platform", MOVED)
    mark_platform(axes, point)


def draw_ring(axes: Axes, leg: Ring, centre: Point) -> None:
    point = leg.place_joint(IDENTITY, centre)
    draw_struts(axes, leg, point, "", OWN)
    axes.plot([330, 330], [-60, -480], color=BASE, lw=1, ls="-.")
    axes.plot([220, 440], [-330, -330], color=MOVED, lw=3)
    axes.plot(point[0], point[2], "o", color=MOVED, ms=7)
    write(axes, 0, 0, "foot")
    write(axes, 110, -165, "q, the length", where="right")
    write(axes, 330, -85, "the tool's axis", BASE)
    draw_arrow(axes, (330, -375), (220, -375), "radius")
    write(axes, 440, -330, "platform, the ring's centre", MOVED)
    mark_platform(axes, centre)


def draw_slider(axes: Axes, leg: Slider, point: Point) -> None:
    axes.plot([-60, 700], [0, 0], color=BASE, lw=1)
    (near,) = draw_struts(axes, leg, point, "-", OWN)
    (far,) = draw_struts(axes, leg, point, "+", OTHER)
    axes.plot(0, 0, "|", color=BASE, ms=16)
    axes.annotate("foot, q = 0", (0, 0), (0, -18), textcoords="offset points", ha="center", color=BASE)
    draw_arrow(axes, (0, 45), (near, 45), "q")
    draw_arrow(axes, (560, 45), (690, 45), "rail")
    write(axes, 0.5 * (near + point[0]) - 20, -150, 'rod, branch "-"', where="right")
    write(axes, 0.5 * (far + point[0]) + 15, -150, 'branch "+"', OTHER)
    write(axes, point[0], point[2], "platform", MOVED)
    mark_platform(axes, point)


def draw_crank(axes: Axes, leg: Crank, point: Point) -> None:
    (own,) = draw_struts(axes, leg, point, "+", OWN)
    (other,) = draw_struts(axes, leg, point, "-", OTHER)
    axes.plot([0, 330], [0, 0], color=BASE, lw=1, ls="--")
    axes.plot(0, 0, "o", color=BASE, ms=10)
    turn = np.linspace(0.0, other, 40)
    axes.plot(90 * np.cos(turn), 90 * np.sin(turn), color=BASE, lw=1.4)
    write(axes, 95 * np.cos(0.5 * other), 95 * np.sin(0.5 * other), "q", BASE)
    write(axes, 330, 0, "zero", BASE)
    axes.annotate(
        "pivot; the axis\npoints to the reader", (0, 0), (-10, -4), textcoords="offset points", ha="right", color=BASE
    )
    for joint, name, colour, shift in ((own, 'branch "+"', OWN, 30), (other, 'branch "-"', OTHER, -45)):
        knee = leg.arm * np.array([np.cos(joint), np.sin(joint)])
        write(axes, *(0.5 * knee - [0, 25]), "arm", colour, where="right")
        write(axes, *(0.5 * (knee + [point[0], point[2]]) + [0, shift]), f"rod, {name}", colour)
    write(axes, point[0], point[2], "platform", MOVED)
    mark_platform(axes, point)


def draw_lambda(axes: Axes, leg: Lambda, point: Point) -> None:
    axes.plot([-60, 860], [0, 0], color=BASE, lw=1)
    axes.plot(0, -110, ".", color="none")  # room for the arrows
    long, short = draw_struts(axes, leg, point, "-+", OWN)
    axes.plot(0, 0, "|", color=BASE, ms=16)
    write(axes, 0, 45, "foot, q = 0", BASE, where="right")
    draw_arrow(axes, (0, -45), (long, -45), "q1")
    draw_arrow(axes, (0, -95), (short, -95), "q2")
    draw_arrow(axes, (720, 30), (850, 30), "rail")
    hinge = leg.struts(point, [long, short])[1][1]
    write(axes, 0.5 * (long + point[0]) - 15, 0.5 * point[2], "long", where="right")
    write(axes, 0.5 * (short + hinge[0]), 0.5 * hinge[2], 'short, branch "-+"')
    write(axes, 0.5 * (hinge[0] + point[0]) + 8, 0.5 * (hinge[2] + point[2]) - 12, "hinge")
    write(axes, point[0], point[2], "platform", MOVED)
    mark_platform(axes, point)


def draw_driven_column(axes: Axes, leg: DrivenColumn, point: Point) -> None:
    draw_column(axes, leg, point)
    low, angle = leg.inverse(point, "-").joints[1:]
    turn = np.linspace(np.pi, np.pi - angle, 30)
    axes.plot([560, 400], [low, low], color=BASE, lw=1, ls="--")
    axes.plot(560 + 130 * np.cos(turn), low + 130 * np.sin(turn), color=BASE, lw=1.4)
    write(axes, 415, low + 45, "q3", BASE, where="right")


def draw_column(axes: Axes, leg: Column, point: Point) -> None:
    """Draw a column with the rail's axis, the slide, and both branches of the link."""
    axes.plot([0, 0], [-40, 740], color=BASE, lw=1, ls="-.")
    axes.plot([560, 560], [0, 720], color=BASE, lw=1)
    low = draw_struts(axes, leg, point, "-", OWN)[1]
    draw_struts(axes, leg, point, "+", OTHER)
    draw_arrow(axes, (0, 0), (560, 0), "radius")
    axes.annotate(
        "the circular rail's axis, Z; q1 turns the carriage about it",
        (0, 760),
        (-10, 0),
        textcoords="offset points",
        color=BASE,
    )
    draw_arrow(axes, (610, 0), (610, low), "")
    write(axes, 610, 0.5 * low, "q2", BASE)
    write(axes, 440, 245, 'rod, branch "-"', where="right")
    write(axes, 440, 545, 'branch "+"', OTHER, where="right")
    write(axes, point[0], point[2], "platform", MOVED, where="right")
    mark_platform(axes, point)


def mark_platform(axes: Axes, point: Point) -> None:
    axes.plot(point[0], point[2], "o", color=MOVED, ms=10, zorder=5)


LEGS: dict[str, tuple[Leg, Point]] = {  # with the platform's joint, of a ring its centre
    leg.kind: (leg, Point(point))
    for leg, point in (
        (Length(make_drives("mm"), ORIGIN, foot=ORIGIN), (260.0, 0.0, -330.0)),
        (Ring(make_drives("mm"), ORIGIN, foot=ORIGIN, radius=Size(110.0)), (330.0, 0.0, -330.0)),
        (Slider(make_drives("mm"), ORIGIN, foot=ORIGIN, rail=ALONG, rod=Size(400.0)), (330.0, 0.0, -300.0)),
        (
            Crank(make_drives("rad"), ORIGIN, pivot=ORIGIN, axis=AXIS, zero=ALONG, arm=Size(220.0), rod=Size(380.0)),
            (330.0, 0.0, 300.0),
        ),
        (
            Lambda(
                make_drives("mm", "mm"), ORIGIN,
                foot=ORIGIN, rail=ALONG, long=Size(560.0), short=Size(330.0), hinge=Size(180.0),
            ),
            (520.0, 0.0, 420.0),
        ),
        (Column(make_drives("rad", "mm"), ORIGIN, radius=Size(560.0), rod=Size(330.0)), (330.0, 0.0, 380.0)),
        (
            DrivenColumn(make_drives("rad", "mm", "rad"), ORIGIN, radius=Size(560.0), rod=Size(330.0)),
            (330.0, 0.0, 380.0),
        ),
    )
}  # fmt: skip
FIGURES: dict[str, Callable[..., None]] = {
    "length": draw_length, "ring": draw_ring, "slider": draw_slider, "crank": draw_crank, "lambda": draw_lambda,
    "column": draw_column, "driven_column": draw_driven_column,
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="draw a figure of each leg kind")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/pictures/legs"))
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    mpl.rcParams.update({"font.size": 10, "svg.hashsalt": "parakin", "svg.fonttype": "none"})
    for kind, draw in FIGURES.items():
        figure, axes = plt.subplots(figsize=(5.6, 3.6), layout="constrained")
        draw(axes, *LEGS[kind])
        axes.set_aspect("equal")
        axes.margins(0.25)
        axes.axis("off")
        figure.savefig(folder / f"{kind}.svg", metadata={"Date": None})
        plt.close(figure)


if __name__ == "__main__":
    main()
