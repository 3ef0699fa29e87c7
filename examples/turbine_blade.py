"""A five-axis finishing pass over a turbine blade, written as CATIA APT and as a Siemens NX CLSF.

The part is the aerofoil of a free-standing turbine blade, 190 mm of span, lying in its fixture with the suction
side up. The workpiece frame W has its origin where the stacking line meets the platform, X along the span from the
hub (X = 0, the platform's face) to the tip, Y from the leading to the trailing edge, and Z up. The sections are
cambered NACA-like aerofoils whose chord, camber and thickness fall toward the tip; they twist by 28 degrees about
a stacking line that leans and sweeps, and thicken toward the platform in a curvature-continuous fillet.

A ball mill of 10 mm finishes the suction side in one-way passes along the span, from the fillet to the tip, side by
side from the leading to the trailing edge. (The edges' own radii are left to another operation, as usual.) The axis
leads the surface by 7 degrees in the feed (on the fillet it follows but a part of the slope) and is tilted
sideways, back toward the vertical where the surface is steep: it stays 9 to 27 degrees off Z and turns smoothly.
The frame in the files puts the blade under a Tricept-like machine, some 1660 mm below its base.

    python turbine_blade.py [-o FOLDER] [--records N] [--feed F] [--upright]

writes turbine_blade.aptsource and turbine_blade.cls: one tool path, two dialects. Lengths are in millimetres. A CL
point is the tool's tip; its i, j, k point from the tip into the holder. With --upright the tool stays along Z, as a
machine of three axes has it, and --feed is the feed in the cut.
"""

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np

# The blade: (hub, tip) pairs, linear along the span; angles in degrees, camber and thickness in chords
SPAN = 190.0
CHORD = (88.0, 62.0)
CAMBER = (0.150, 0.080)
THICKNESS = (0.165, 0.085)
TURN = (-2.0, 26.0)  # about X: the leading edge down at the hub, up at the tip
STACK_AT = (0.43, 0.70)  # the stacking line: along the chord, and in heights of the camber
LEAN, SWEEP = -6.0, -12.0  # Z and Y of the stacking line at the tip
FILLET_LENGTH, FILLET_HEIGHT = 18.0, 6.0

# The operation
BALL = 5.0
TOOL = 150.0  # from the spindle's nose to its tip, the own tool of the machines that run it
START, END = 5.5, SPAN  # along the span; nearer to the platform the ball would touch it
EDGES = (0.055, 0.975)  # along the chord
LEAD, TILT = np.radians(7.0), np.radians(-3.0)  # in the feed; sideways, toward the leading edge
EASE = 0.55  # share of the surface's sideways slope that the tilt takes back
FILLET_EASE = 0.75  # share of the fillet's slope that the axis does not follow
STEP_RATIO = 1.3  # step from pass to pass, in steps along a pass
ARC, ARC_POINTS = 4.0, 8  # approach and retract: quarter circles
CLEARANCE, PLUNGE, TRAVERSE_POINTS = 65.0, 8.0, 6  # the links: height in W, end of the rapid, points on the way
SPINDLE, FEEDS = 18000.0, {"approach": 1000.0, "cut": 2500.0, "retract": 4000.0}

# W in the machine frame: turned about Z by 16.26 degrees, whose cosine and sine are these, exactly
FRAME_AXES = np.array([[0.96, -0.28, 0.0], [0.28, 0.96, 0.0], [0.0, 0.0, 1.0]])  # columns: X, Y, Z of W
FRAME_ORIGIN = np.array([-20.0, -45.0, -1660.0])


class ToolPath(NamedTuple):
    """Tool tips and axes in W, one a row, and the kind of each motion: rapid, approach, cut or retract."""

    tip: np.ndarray
    axis: np.ndarray
    kind: list[str]


def section(x, camber, thickness, extra):
    """The suction side of a unit-chord aerofoil at x along the chord, thickened by `extra` chords."""
    height = 4 * camber * x * (1 - x) * (1.25 - 0.5 * x)
    slope = 4 * camber * (1.25 - 3.5 * x + 1.5 * x**2)
    half = 5 * thickness * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    cos = 1 / np.sqrt(1 + slope**2)
    return x - (half + extra) * slope * cos, height + (half + extra) * cos


def surface(u, v, fillet=1.0):
    """The suction side at u mm along the span and v along the chord; `fillet` scales the fillet's height."""
    share = u / SPAN
    chord, camber, thickness, turn = (a + (b - a) * share for a, b in (CHORD, CAMBER, THICKNESS, TURN))
    rise = np.where(u.real < FILLET_LENGTH, fillet * FILLET_HEIGHT * (1 - u / FILLET_LENGTH) ** 3, 0.0)
    along, up = section(v, camber, thickness, rise / chord)
    along, up = chord * (along - STACK_AT[0]), chord * (up - STACK_AT[1] * camber)
    cos, sin = np.cos(np.radians(1) * turn), np.sin(np.radians(1) * turn)
    y = cos * along + sin * up + SWEEP * share**2
    z = cos * up - sin * along + LEAN * share**2
    return np.stack(np.broadcast_arrays(u, y, z), axis=-1)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def tangent_and_normal(u, v, fillet=1.0):
    """The unit tangent along the span and the outward unit normal, by complex steps: exact to rounding."""
    tiny = 1e-30
    along = surface(u + 1j * tiny, v + 0j, fillet).imag / tiny
    across = surface(u + 0j, v + 1j * tiny, fillet).imag / tiny
    return unit(along), unit(np.cross(along, across))


def even(parameter, points, count):
    """`count` parameters that stand at equal distances along the curve of `points`."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.interp(np.linspace(0.0, length[-1], count), length, parameter)


def pass_grid(records):
    """Span and chord parameters, a row a pass: even steps along each, and even steps across the widest section."""
    fine_v, fine_u = np.linspace(*EDGES, 4001), np.linspace(START, END, 4001)
    width = np.linalg.norm(np.diff(surface(np.full_like(fine_v, START), fine_v), axis=0), axis=1).sum()
    passes = max(4, round(np.sqrt(records * width / (STEP_RATIO * (END - START)))))
    linked = 2 * ARC_POINTS + TRAVERSE_POINTS + 3  # the records of a pass's approach, retract and link
    count = max(10, round(records / passes) - linked)
    v = even(fine_v, surface(np.full_like(fine_v, START), fine_v), passes)
    u = np.array([even(fine_u, surface(fine_u, np.full_like(fine_u, one)), count) for one in v])
    return u, np.repeat(v[:, None], count, axis=1)


def posture(u, v):
    """The tool axis: lead in the feed, tilt sideways, from the normals of a blade with a flatter fillet."""
    feed, normal = tangent_and_normal(u, v, 1.0 - FILLET_EASE)
    side = np.cross(normal, feed)
    level = unit(np.cross([0.0, 0.0, 1.0], feed))  # horizontal, across the feed
    slope = np.arcsin(np.sum(normal * level, axis=-1))[..., None]
    tilt = TILT - EASE * slope
    return np.cos(tilt) * (np.cos(LEAD) * normal + np.sin(LEAD) * feed) + np.sin(tilt) * side


def quarter(tip, feed, normal):
    """A quarter circle that leaves the pass tangentially at `tip` in the direction `feed`, without that point."""
    angle = np.linspace(0.0, np.pi / 2, ARC_POINTS + 1)[1:, None]
    return tip + ARC * (np.sin(angle) * feed + (1 - np.cos(angle)) * normal)


def above(tip, axis):
    """The point at the clearance height over `tip`, drawn back along the axis."""
    return tip + axis * (CLEARANCE - tip[2]) / axis[2]


def traverse(start, end, axis0, axis1):
    """Even points from `start` (excluded) to `end`, with the axis turning evenly from axis0 to axis1."""
    share = np.linspace(0.0, 1.0, TRAVERSE_POINTS + 1)[1:, None]
    angle = np.arctan2(np.linalg.norm(np.cross(axis0, axis1)), axis0 @ axis1)
    turned = np.sin((1 - share) * angle) * axis0 + np.sin(share * angle) * axis1 if angle else axis0 + 0 * share
    return start + share * (end - start), unit(turned)


def tool_path(records, upright=False):
    """The whole path: every pass with its approach and retract, and the rapids from each to the next."""
    u, v = pass_grid(records)
    feed, normal = tangent_and_normal(u, v)
    axis = np.broadcast_to([0.0, 0.0, 1.0], normal.shape) if upright else posture(u, v)
    tip = surface(u, v) + BALL * (normal - axis)
    tips, axes, kinds = [], [], []

    def add(kind, points, directions):
        points = np.atleast_2d(points)
        tips.append(points)
        axes.append(np.broadcast_to(directions, points.shape))
        kinds.extend([kind] * len(points))

    for i in range(len(u)):
        first, last = axis[i, 0], axis[i, -1]
        entry = quarter(tip[i, 0], -feed[i, 0], normal[i, 0])[::-1]
        leave = quarter(tip[i, -1], feed[i, -1], normal[i, -1])
        over = above(entry[0], first)
        if i == 0:
            add("rapid", over, first)
        else:
            add("rapid", *traverse(tips[-1][-1], over, axes[-1][-1], first))
        add("rapid", entry[0] + PLUNGE * first, first)
        add("approach", entry, first)
        add("cut", tip[i], axis[i])
        add("retract", leave, last)
        add("rapid", leave[-1] + PLUNGE * last, last)
        add("rapid", above(leave[-1], last), last)
    return ToolPath(np.concatenate(tips), np.concatenate(axes), kinds)


def motions(path, feeds, rapid, feed, point):
    """The lines of the motions, in the words of a dialect; a feed is written when it changes."""
    lines, current = [], None
    for kind, tip, axis in zip(path.kind, path.tip.tolist(), path.axis.tolist(), strict=True):
        if kind == "rapid":
            lines.append(rapid)
        elif kind != current:
            lines.append(feed.format(feeds[kind]))
        current = kind
        lines.append(point(tip, axis))
    return lines


def apt_lines(path, feeds=FEEDS):
    """CATIA's APT: the frame as a 3x4 matrix after $$*CATIA0, the axis with every point."""
    axes = "three" if (path.axis[:, 2] == 1.0).all() else "five"
    matrix = np.column_stack([FRAME_AXES, FRAME_ORIGIN])
    head = [
        "$$ -----------------------------------------------------------------",
        f"$$     Turbine blade, suction side, {axes}-axis finishing",
        "$$     W in the machine frame: turned by 16.26 deg about Z, origin at",
        "$$     X {:.3f}, Y {:.3f}, Z {:.3f}".format(*FRAME_ORIGIN),
        "$$ -----------------------------------------------------------------",
        "$$*CATIA0",
        "$$ Manufacturing Program.1",
        *("$$ " + " ".join(f"{value:z12.5f}" for value in row) for row in matrix),
        "PARTNO TURBINE BLADE",
        "UNITS/MM",
        "PPRINT OPERATION NAME : Tool Change.1",
        f"CUTTER/ {2 * BALL:.6f}, {BALL:.6f}, 0.000000, {BALL:.6f},$",
        " 0.000000, 0.000000, 80.000000",
        "LOADTL/1",
        "PPRINT OPERATION NAME : Suction side, along the span",
        "MULTAX/ON",
        f"SPINDL/{SPINDLE:.4f},RPM,CLW",
        "COOLNT/ON",
    ]

    def point(tip, axis):
        return "GOTO  /{:z11.5f},{:z11.5f},{:z11.5f},{:z9.6f},{:z9.6f},{:z9.6f}".format(*tip, *axis)

    tail = ["COOLNT/OFF", "MULTAX/OFF", "SPINDL/OFF", "FINI"]
    return head + motions(path, feeds, "RAPID", "FEDRAT/{:.4f},MMPM", point) + tail


def nx_lines(path, feeds=FEEDS):
    """Siemens NX: the frame as MSYS/ (origin, X, Y), the axis only where it changes."""
    msys = [f"{value:.4f}" for value in FRAME_ORIGIN] + [f"{value:.7f}" for value in FRAME_AXES[:, :2].T.ravel()]
    head = [
        "$$ Turbine blade, suction side; MSYS is turned by 16.26 deg about the machine's Z",
        "TOOL PATH/SUCTION_SIDE_FINISH,TOOL,BALL_MILL_D10",
        f"TLDATA/MILL,{2 * BALL:.4f},{BALL:.4f},{TOOL:.4f},0.0000,0.0000",
        "MSYS/" + ",".join(msys),
        "$$ centerline data",
        "PAINT/PATH",
        "PAINT/SPEED,10",
        "LOAD/TOOL,1,ADJUST,1",
        f"SPINDL/RPM,{SPINDLE:.0f},CLW",
        "PAINT/COLOR,31",
    ]
    last = [""]

    def point(tip, axis):
        direction = ",{:z.7f},{:z.7f},{:z.7f}".format(*axis)
        shown = "" if direction == last[0] else direction
        last[0] = direction
        return "GOTO/{:z.4f},{:z.4f},{:z.4f}".format(*tip) + shown

    tail = ["PAINT/SPEED,10", "PAINT/TOOL,NOMORE", "END-OF-PATH"]
    return head + motions(path, feeds, "RAPID", "FEDRAT/MMPM,{:.4f}", point) + tail


def main():
    parser = argparse.ArgumentParser(description="Write a turbine blade's finishing pass in two CL dialects.")
    here = Path(__file__).resolve().parent
    parser.add_argument("-o", "--output", type=Path, default=here, metavar="FOLDER", help="default: beside the script")
    parser.add_argument("--records", type=int, default=36000, metavar="N", help="about so many GOTO (default: 36000)")
    parser.add_argument("--feed", type=float, default=FEEDS["cut"], metavar="F", help="mm/min (default: 2500)")
    parser.add_argument("--upright", action="store_true", help="keep the tool along Z, for a machine of three axes")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    path = tool_path(options.records, options.upright)
    feeds = FEEDS | {"cut": options.feed}
    files = {"turbine_blade.aptsource": apt_lines(path, feeds), "turbine_blade.cls": nx_lines(path, feeds)}
    for name, lines in files.items():
        file = options.output / name
        file.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")
        print(f"{file}: {len(path.kind)} GOTO, {path.kind.count('rapid')} of them rapid")


if __name__ == "__main__":
    main()
