"""The table of what can be wanted of a design: its value over the poses, which way is better, how it is proved."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ..algebra import Scalar, dot
from ..arrays import Array
from ..model.equations import Equations
from ..performance.certified.interval_matrices import PoseBox
from ..performance.certified.quotient_norms import Quotient
from ..units import LENGTH, NUMBER, STIFFNESS, TIME, VOLUME, QuantityKind
from .design_tapes import DesignTapes, TracedQuotient
from .measures import Measures

_UNITS = {NUMBER: "", LENGTH: "mm", STIFFNESS: "N/mm", TIME: "s", VOLUME: "mm³"}
_Margins = Callable[[Equations, Sequence[Scalar], str, float], list[Scalar]]
_Quotients = Callable[[DesignTapes, PoseBox, Mapping[str, Scalar]], list[list[Quotient]]]


@dataclass(frozen=True)
class MarginProof:
    """Proved by margins that are ≥ 0 where a bound is kept, traced from equations, a pose, its mode and the bound."""

    trace: _Margins


@dataclass(frozen=True)
class NormProof:
    """Proved by products of norms, each of which must be no greater than the bound to a power.

    trace : their quotients over a box of poses, for sizes by their names
    """

    trace: _Quotients
    power: float = 1.0


@dataclass(frozen=True)
class Want:
    """What can be bounded, and minimised or maximised.

    kind : of its value
    measure : its values at poses, (S, P, k); the worst of all counts
    proof : by which a bound is proved at every pose; None where limits, the part's job or a volume's bracket are one
    more : whether greater is better
    least : what a bound must exceed
    spread : what counts is how far each column spreads over the poses
    whole : of the machine or the part, so the same at all poses
    bounded : whether it can be bounded; otherwise it can only be an objective
    """

    kind: QuantityKind
    measure: Callable[[Measures], Array]
    proof: MarginProof | NormProof | None
    more: bool = False
    least: float = 0.0
    spread: bool = False
    whole: bool = False
    bounded: bool = True

    @property
    def unit(self) -> str:
        """The unit of its value; none of a number."""
        return _UNITS[self.kind]

    def format_value(self, value: float, digits: str) -> str:
        """Format a value with its unit; ``digits`` is a format."""
        return f"{value:{digits}} {self.unit}".rstrip()

    @property
    def sign(self) -> float:
        """What makes less of it better."""
        return -1.0 if self.more else 1.0


def _bound_feet(equations: Equations, pose: Sequence[Scalar], mode: str, diameter: float) -> list[Scalar]:
    feet = equations.list_feet(pose, mode)
    return [1.0 - dot(foot[:2], foot[:2]) * (4.0 / diameter**2) for foot in feet]


def _bound_distances(equations: Equations, pose: Sequence[Scalar], mode: str, least: float) -> list[Scalar]:
    distances = equations.list_strut_distances(pose, mode)
    return [distance - least for distance in distances]


def _scale_columns(tapes: DesignTapes, box: PoseBox, trace: TracedQuotient, sizes: Mapping[str, Scalar]) -> Quotient:
    a, w = trace(box.pose, sizes)
    return Quotient([[x * k for x, k in zip(row, tapes.scales[0].tolist(), strict=True)] for row in a], w)


def _list_compliance(tapes: DesignTapes, box: PoseBox, sizes: Mapping[str, Scalar]) -> list[list[Quotient]]:
    return [[_scale_columns(tapes, box, tapes.trace_compliance, sizes)._replace(rows=tapes.tip)]]


def _list_error(tapes: DesignTapes, box: PoseBox, sizes: Mapping[str, Scalar]) -> list[list[Quotient]]:
    return [[_scale_columns(tapes, box, tapes.trace_error, sizes)._replace(rows=tapes.tip, norm="frobenius")]]


WANTS: dict[str, Want] = {
    "amplification": Want(
        NUMBER,
        lambda m: m.psi,
        NormProof(lambda _, box, sizes: [[Quotient(box.a, box.b)], [Quotient(box.b, box.a)]]),
        least=1.0,
    ),
    "greatest_amplification": Want(
        NUMBER, lambda m: m.psi[..., :1], NormProof(lambda _, box, sizes: [[Quotient(box.a, box.b)]])
    ),
    "condition": Want(
        NUMBER,
        lambda m: m.psi.prod(-1, keepdims=True),
        NormProof(lambda _, box, sizes: [[Quotient(box.a, box.b), Quotient(box.b, box.a)]]),
        least=1.0,
    ),
    "stiffness": Want(STIFFNESS, lambda m: m.stiffness, NormProof(_list_compliance, -0.5), more=True),
    "accuracy": Want(LENGTH, lambda m: m.deviation, NormProof(_list_error)),
    "clearance": Want(LENGTH, lambda m: m.distances, MarginProof(_bound_distances), more=True),
    "footprint": Want(LENGTH, lambda m: m.feet, MarginProof(_bound_feet)),
    "stroke": Want(LENGTH, lambda m: m.travel, None, spread=True),
    "cycle_time": Want(TIME, lambda m: m.cycle_time, None, whole=True),
    "workspace": Want(VOLUME, lambda m: m.workspace, None, more=True, whole=True, bounded=False),
}

# What follows from the inverse of A, and so tells nothing beyond a singularity.
JACOBIANS = tuple(name for name, want in WANTS.items() if isinstance(want.proof, NormProof))
