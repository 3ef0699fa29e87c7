"""Dimensional synthesis: a machine's sizes in closed form from the amplification it must keep, and their proof."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

import numpy as np

from ..errors import NoMethodError, PoseError
from ..machine import Machine
from ..model.elements import Direction, Drive, Point, Signs, Size
from ..model.legs.slider import Slider
from ..model.spec import Spec
from ..workspaces.certified.region import FAR, make_region
from .certified.proofs import Proof, make_pose_box, prove_amplification

SMALLEST = 0.001  # mm, of a cube
LEAST, MOST = 1.001, 1e6  # of an amplification: beyond these the numbers have no digits left


@dataclass(frozen=True, eq=False)
class Design:
    """An Orthoglide whose velocity amplification stays within 1/amplification .. amplification all over a cube, mm.

    rod : the length of each parallelogram
    stroke : the ends of the drives' ranges, the same for all three
    cube : the lower and the upper corner's coordinate on each axis
    proof : of the claim on the amplification
    """

    family: str
    edge: float
    amplification: float
    rod: float
    stroke: tuple[float, float]
    cube: tuple[float, float]
    proof: Proof

    @property
    def machine(self) -> Machine:
        return _make_orthoglide(self.rod, self.stroke)


def design_orthoglide(cube: float, amplification: float) -> Design:
    """Design the Orthoglide of Chablat and Wenger (Chemnitz, 2000) for a cube of edge ``cube``, mm, and 1/λ ≤ psi ≤ λ.

    ``amplification`` is λ > 1.

    On the diagonal x = y = z = t, with s = √(L² - 2t²) and v = t/s, psi is 1/(1 + v), twice, and 1/(1 - 2v), so that
    1/λ ≤ psi ≤ λ ends at v = min((1 - 1/λ)/2, λ - 1) above and at v = -min(1 - 1/λ, (λ - 1)/2) below. These are two
    corners of the cube, t = L·v/√(1 + 2v²), which gives L; that psi stays within its bounds all over the cube is proved
    by intervals.

    Raises :class:`PoseError` for invalid numbers, :class:`NoMethodError` if the proof fails.
    """
    if not SMALLEST <= cube <= FAR:
        raise PoseError(f"cube: an edge from {SMALLEST:g} to {FAR:g} mm expected, not {cube:g}")
    if not amplification > 1.0:
        raise PoseError(f"amplification: a bound above 1 expected, not {amplification:.12g}")
    if not LEAST <= amplification <= MOST:
        raise PoseError(f"amplification: a bound from {LEAST:g} to {MOST:g} expected, not {amplification:.12g}")
    lam = amplification
    above, below = min(0.5 * (1.0 - 1.0 / lam), lam - 1.0), -min(1.0 - 1.0 / lam, 0.5 * (lam - 1.0))
    high, low = (v / sqrt(1.0 + 2.0 * v * v) for v in (above, below))  # of a rod of length 1
    rod = cube / (high - low)
    low, high = low * rod, high * rod
    stroke = low + sqrt(rod * rod - 2.0 * max(-low, high) ** 2), high + rod
    machine = _make_orthoglide(rod, stroke)
    proof = _prove_cube(machine, low, high, lam)
    return Design("orthoglide", cube, lam, rod, stroke, (low, high), proof)


def _prove_cube(machine: Machine, low: float, high: float, bound: float) -> Proof:
    box = make_pose_box(make_region(machine), dict.fromkeys(machine.axes, (low, high)))
    proof = prove_amplification(box, 1.0 / bound, bound)
    if proof.verdict != "proved":
        raise NoMethodError(f"amplification {bound:g}: the closed form does not hold all over the cube, {proof.reason}")
    corners = np.array(np.meshgrid(*[[low, high]] * 3)).reshape(3, -1).T
    if (machine.check(corners * (1.0 - 1e-12)) != 0).any():
        raise NoMethodError(f"amplification {bound:g}: the strokes do not hold the whole cube")
    return proof


def _make_orthoglide(rod: float, stroke: tuple[float, float]) -> Machine:
    rails = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    origin = Point((0.0, 0.0, 0.0))
    legs = tuple(
        Slider((Drive(f"rho_{axis}", "mm", *stroke),), origin, origin, Direction(rail), Size(rod), Signs("+"))
        for axis, rail in zip("xyz", rails, strict=True)
    )
    return Machine(Spec("orthoglide", "", "", ("tx", "ty", "tz"), legs, {"X": 0.0, "Y": 0.0, "Z": 0.0}))


DESIGNS: dict[str, Callable[[float, float], Design]] = {"orthoglide": design_orthoglide}
