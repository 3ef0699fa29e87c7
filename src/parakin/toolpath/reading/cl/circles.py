"""Arcs of CL files that a centre and an axis give (CIRCLE, MOVARC): which way round they go, and the proof of it.

The hand of a CIRCLE is its dialect's; the motions before and after it, where they join the arc tangentially, prove it
or contradict it. Where the dialect is not known, they alone decide. Errors name no file and no line.
"""

import math
from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ..arcs import ON_CIRCLE
from ..text import refuse
from .dialects import LEFT, RIGHT, UNKNOWN
from .file_frames import Triple

_TANGENT = 0.99  # cosine of the angle to a neighbour that joins the arc tangentially
_SHORTEST = 0.01  # mm: the direction of a shorter neighbour is too rounded to tell
_IN_PLANE = 0.5  # least fraction of a neighbour in the arc's plane; a steeper neighbour proves nothing
_ANGLE = 2e-3  # rad between an angle as stated and as the arc's ends have it
_SAME_STEP = 0.02  # fraction of a step by which the steps between points of one arc may differ
_WIDEST_STEP = math.radians(150)  # between points of one arc


class Circle(NamedTuple):
    """A circle that waits for the GOTO that ends its arc: source line, centre, unit axis and radius in the file's unit.

    hand : RIGHT or LEFT about the axis, UNKNOWN where the neighbours decide
    sweep : the angle of the arc in rad as stated, or None
    revolutions : the number of turns of TIMES, or None
    points : whether GOTO may go on along the arc, as PTC Creo writes several points on one
    firm : whether a header tells the hand; words that only one system writes tell it less surely
    """

    line: int
    centre: Array
    axis: Array
    radius: float
    hand: int
    sweep: float | None = None
    revolutions: float | None = None
    points: bool = False
    firm: bool = True


class OpenArc(NamedTuple):
    """An arc whose hand the motion after it has yet to confirm.

    hand : the hand it was written with
    entry : the hand that the motion before it proves, or UNKNOWN
    begin : its first record
    start, end, axes : its ends in the file's unit and the tool axes there
    rapid, end_line : of its motion
    """

    circle: Circle
    hand: int
    entry: int
    begin: int
    start: Triple
    end: Triple
    axes: tuple[Triple, Triple]
    rapid: bool
    end_line: int


class Arc(NamedTuple):
    """An arc without its ends, in the file's unit; the motion is right-handed about the unit normal (3,).

    line : source line of the points between the ends
    helix : whether the ends may differ in height along the normal
    turns : full turns before the arc's own
    """

    line: int
    centre: list[float]
    normal: Array
    radius: float
    helix: bool
    turns: int = 0


def measure_radius(centre: Array, axis: Array, start: Triple | None) -> float:
    """Measure the radius of a circle that is stated by centre and unit axis alone, from where its arc starts."""
    if start is None:
        refuse("an arc without a position to start from; expected FROM or GOTO before it")
    return float(np.linalg.norm(np.cross(axis, np.array(start) - centre)))


def find_tangent(circle: Circle, point: Triple, hand: int) -> Array:
    """Find the direction (3,) of the motion along a circle at a point; zero at its centre."""
    out = np.array(point) - circle.centre
    tangent = np.cross(hand * circle.axis, out)
    length = float(np.linalg.norm(tangent))
    return tangent / length if length > 0.0 else tangent


def prove_hand(circle: Circle, point: Triple, motion: Array | None, scale: float) -> int:
    """Tell the hand of a circle by a neighbour's motion (3,) at its end; UNKNOWN where that is not tangential.

    scale : mm in the file's unit
    """
    if motion is None:
        return UNKNOWN
    length = float(np.linalg.norm(motion))
    flat = motion - (motion @ circle.axis) * circle.axis
    flat_length = float(np.linalg.norm(flat))
    if not length * scale >= _SHORTEST or flat_length < _IN_PLANE * length:
        return UNKNOWN
    cosine = float(flat @ find_tangent(circle, point, RIGHT)) / flat_length
    return RIGHT if cosine > _TANGENT else LEFT if cosine < -_TANGENT else UNKNOWN


def decide_hand(arc: OpenArc, leaving: int, *, proved: bool) -> int:
    """Decide the hand of an arc by its dialect and its neighbours; refuse what they contradict or leave open.

    proved : whether another arc of the file proves the dialect's hand: then a short arc may turn back on its neighbours
    """
    proofs = {arc.entry, leaving} - {UNKNOWN}
    hand = arc.circle.hand
    if hand != UNKNOWN:
        turns_back = proved and measure_sweep(arc.circle, arc.start, arc.end, hand) < math.pi
        if -hand in proofs and hand not in proofs and not turns_back:
            side = "right" if hand == RIGHT else "left"
            refuse(
                f"an arc whose way round, {side}-handed about its axis in this dialect, contradicts the motion "
                "that joins it tangentially; expected the axis, or the header, of the other way round"
            )
        return hand
    if len(proofs) != 1:
        refuse("an arc whose way round neither a header tells nor the motions that join it prove; "
               "expected the header of the CAM system that wrote the file")  # fmt: skip
    return proofs.pop()


def measure_sweep(circle: Circle, start: Triple, end: Triple, hand: int) -> float:
    """Measure the angle from start to end about a circle's axis in (0, 2π], rad."""
    a, b = np.array(start) - circle.centre, np.array(end) - circle.centre
    normal = hand * circle.axis
    turn = math.atan2(float(np.cross(a, b) @ normal), float(a @ b - (a @ normal) * (b @ normal)))
    turn %= 2.0 * math.pi
    return turn if turn > 1e-9 else 2.0 * math.pi


def settle_sweep(circle: Circle, start: Triple, end: Triple) -> tuple[int, int]:
    """Settle the hand and the full turns before the arc's own by the stated sweep or number of turns."""
    whole, closed = 2.0 * math.pi, max(_ANGLE, ON_CIRCLE / max(circle.radius, ON_CIRCLE))
    if circle.sweep is not None:
        # the stated angle is the sweep about the axis; older post processors state the axis the other way
        wanted = abs(circle.sweep)
        hands = (RIGHT, LEFT) if circle.sweep > 0.0 else (LEFT, RIGHT)
        for hand in hands:
            turns = round((wanted - measure_sweep(circle, start, end, hand)) / whole)
            if turns >= 0 and abs(measure_sweep(circle, start, end, hand) + turns * whole - wanted) <= closed:
                return hand, turns
        refuse(f"an arc of {math.degrees(circle.sweep):.6g} degrees whose ends are as far apart in neither way round")
    if circle.revolutions is not None and circle.hand != UNKNOWN:
        wanted = circle.revolutions * whole
        turn = measure_sweep(circle, start, end, circle.hand)
        if abs(turn - whole) <= closed or turn <= closed:
            turn = whole
        turns = round((wanted - turn) / whole)
        if turns < 0 or abs(turn + turns * whole - wanted) > closed:
            refuse("TIMES does not tell the turns of an arc that does not end where it begins; expected whole circles")
        return circle.hand, turns
    return circle.hand, 0


def follow_circle(circle: Circle, here: Triple, point: Triple, arc_step: tuple[int, float], scale: float) -> bool:
    """Tell whether a point goes on along the circle of the arc before it; False for a line to it.

    Some systems write several points on an arc. A line to a point of the same circle is told by its other step.

    arc_step : the hand of the arc before, and the angle of its step
    scale : mm in the file's unit
    """
    hand, step = arc_step
    out = np.array(point) - circle.centre
    height = float(out @ circle.axis) - float((np.array(here) - circle.centre) @ circle.axis)
    flat = float(np.linalg.norm(np.cross(circle.axis, out)))
    if math.hypot(flat - circle.radius, height) * scale > ON_CIRCLE:
        return False
    turn = measure_sweep(circle, here, point, hand)
    shorter = min(turn, 2.0 * math.pi - turn)
    if circle.radius * (1.0 - math.cos(0.5 * shorter)) * scale <= ON_CIRCLE:
        return turn <= math.pi
    if abs(turn - step) > _SAME_STEP * step or turn > _WIDEST_STEP:
        refuse(
            f"a point on the circle of line {circle.line} that may end a line or go on along the arc; "
            "expected a CIRCLE or points at equal steps"
        )
    return True
