"""Singularities of a whole region: proved to be met, proved to be nowhere, or neither; no grid decides."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from ...algebra import Scalar, Term, absolute, expand_determinant
from ...arrays import Array, Flags, Indices
from ...budget import Budget
from ...errors import PoseError
from ...model.rates import trace_determinant
from ...workspaces.certified.constraints import Constraint
from ...workspaces.certified.orientation_boxes import OrientationBoxes, bound_margin
from ...workspaces.certified.plane_cuts import CLEARED
from ...workspaces.certified.region import Region
from ...workspaces.certified.separation import find_joined_cells
from ...workspaces.certified.subdivision import Cells
from ...workspaces.connected.adjacency import find_adjacent_cells, label_components
from ..search import pick_best_of_blocks
from ..singularities import PARALLEL, has_serial_turns, list_margin_names
from .free_angles import prove_free_angle
from .margin_zeros import prove_sign_change, prove_stretched_leg, search_sign_change

SingularityVerdict = Literal["met", "none", "unproved"]

_ALONG = {1: 1024, 2: 256, 3: 96}  # cells along the longest edge in which a change of sign is looked for
_MOST_COMPARED = 1000  # cells
_PROVING = 0.5  # of the budget, for the proofs that there is none, and of the rest for the region's own cells
_STARTS = 64  # cells from which a zero that is only touched is looked for
_ABOVE = 1e-9  # of a margin's greatest value: what is proved to be no less is above zero
_ZERO = 1e-12  # a margin no greater is zero
_CHANGES = "its margin changes sign on the way to it"
_FEW, _ROUNDS = 30_000, 24  # undecided cells, and rounds, with which a proof that there is none is given up


@dataclass(frozen=True, eq=False)
class RegionSingularity:
    """What is proved of one singularity margin over all positions of a region that the limits allow.

    margin : its name: ``parallel``, ``serial JOINT`` of a leg's joint, ``serial JOINT-JOINT`` of head or table, or
        ``constraint``
    verdict : ``met``, its sign changes among positions that hang together inside; ``none``, it is positive all over;
        ``unproved``, neither is proved, as where it only touches zero
    pose : (axes,) a pose where it is not above zero (where it only touches zero, at most 1 mm beside), of ``met`` alone
    reason : what the verdict rests on, for people; empty for ``none``
    """

    margin: str
    verdict: SingularityVerdict
    pose: Array | None
    reason: str = ""

    def __repr__(self) -> str:
        return f"<parakin singularity {self.margin}: {self.verdict}>"


def judge_singularities(region: Region, budget: Budget | None = None) -> tuple[RegionSingularity, ...]:
    """Judge every singularity margin over a region without swept axes, by intervals.

    The parallel one is judged in all assembly modes, for it is what separates them; the serial ones in the region's.

    A margin is positive all over where no cell of a subdivision can hold an allowed position at which it is not, but
    for cells that are apart from home's component. It changes its sign where cells proved inside hang together, by
    faces, and intervals prove both signs among them. What the budget leaves open is unproved.
    """
    names, budget = list_margin_names(region.machine), budget or Budget()
    extent, whole = region.find_extent(budget), region.include_all_components()
    if extent is None:
        return tuple(RegionSingularity(name, "none", None) for name in names)
    verdicts: list[RegionSingularity] = []
    labelled: dict[Region, _RegionCells] = {}
    for number, name in enumerate(names):
        own = whole if name == PARALLEL else region
        margin, inputs = _trace_margins(own)[number], own.traced_pose.inputs
        if not isinstance(margin, Term):
            verdicts.append(_judge_constant(own, name, float(margin)))
            continue
        positive, negative = Constraint(name, margin, inputs), Constraint(name, 0.0 - margin, inputs)
        left = _list_left_cells(own, negative, extent, budget.take_fraction(_PROVING / (len(names) - number)))
        if len(left.low) and own not in labelled:
            labelled[own] = _label_cells(own, extent, budget.take_fraction(_PROVING))
        if not len(left.low) or _is_clear(positive, left, labelled[own].joined):
            verdicts.append(RegionSingularity(name, "none", None))
        else:
            verdicts.append(_judge_left(own, number, positive, labelled[own], budget))
    return tuple(verdicts)


def _judge_left(
    region: Region, number: int, positive: Constraint, about: _RegionCells, budget: Budget
) -> RegionSingularity:
    """Judge a margin that is not proved to be positive all over: it changes its sign, touches zero, or neither."""
    name, legs = positive.name, len(region.machine.closure_joints)
    pose = _find_sign_change(region, positive, about.inside, about.component)
    starts = about.pick_starts(region, positive)
    if pose is None and positive.is_smooth:
        pose = _pose_at(region, prove_sign_change(region, positive, starts, budget.take_fraction(_PROVING)))
    if pose is not None:
        return RegionSingularity(name, "met", pose, _CHANGES)
    if 1 <= number <= legs:
        margins = _trace_margins(region)[1 : legs + 1]
        position = prove_stretched_leg(region, margins, number - 1, starts, budget.take_fraction(_PROVING))
    elif number == legs + 1 and region.machine.wrist is not None:
        position = prove_free_angle(region, starts)
        if position is not None and not np.isin(about.find_components(position), about.find_home(region)).any():
            position = None
    else:
        position = None
    if position is not None:
        return RegionSingularity(name, "met", _pose_at(region, position), "its margin falls to zero there, to a mm")
    pose = _pose_at(region, search_sign_change(region, positive, starts, about.greatest_edge, budget))
    if pose is not None:
        return RegionSingularity(name, "met", pose, _CHANGES)
    return RegionSingularity(name, "unproved", None, _describe_left(budget))


def _pose_at(region: Region, position: Array | None) -> Array | None:
    """Return the pose (axes,) at a position (d,), None for none."""
    return None if position is None else np.asarray(region.poses(position[None])[0])


def _judge_constant(region: Region, name: str, margin: float) -> RegionSingularity:
    """Judge a margin that has one value at this orientation."""
    if margin > _ZERO:
        return RegionSingularity(name, "none", None)
    pose = region.poses(region.home_position[None])[0]
    return RegionSingularity(name, "met", pose, "its margin is zero at every position of this orientation")


def _describe_left(budget: Budget) -> str:
    open_ends = " in the time given" if budget.is_spent() else ""
    return f"it is neither proved to reach zero nor to stay above it{open_ends}"


def _trace_margins(region: Region) -> list[Scalar]:
    """Trace the margins, each positive at home, in the order of their names; their scale does not matter here."""
    machine, traced = region.machine, region.traced_pose

    def compute_margins(pose: Sequence[Scalar]) -> list[Scalar]:
        with np.errstate(all="ignore"):  # a pose out of reach gives NaN
            rates = machine.trace_rates(pose, machine.trace_inverse(pose, region.mode)[0])
        legs, (height, width) = machine.leg_count, machine.parallel_block
        margins = [trace_determinant([row[:width] for row in rates.a[:height]])]
        margins += [rates.b[row][joint] for row, joint in enumerate(machine.closure_joints)]
        if has_serial_turns(machine):
            margins.append(absolute(expand_determinant([row[legs:] for row in rates.b[legs:]])))
        if machine.constraints:
            with np.errstate(all="ignore"):
                margins.append(expand_determinant(machine.trace_constraint_rates(pose)))
        return margins

    at_home = compute_margins([np.float64(value) for value in machine.home])
    signs = [-1.0 if float(margin) < 0.0 else 1.0 for margin in at_home]
    return [margin * sign for margin, sign in zip(compute_margins(traced.pose), signs, strict=True)]


def _list_left_cells(region: Region, constraint: Constraint, extent: tuple[Array, Array], budget: Budget) -> Cells:
    """List the cells that may hold a position at which a constraint is kept, those inside included."""
    subdivision = region.subdivide(*extent, [constraint])
    for _ in range(_ROUNDS):
        count = len(subdivision.open_cells.low)
        if not count or count > _FEW or any(len(cells.low) for cells in subdivision.decided_cells):
            break
        if budget.is_spent():
            break
        subdivision.refine(np.arange(count), budget)
    return subdivision.collect_cells("gap")


class _RegionCells(NamedTuple):
    """Cells proved inside, the component (N,) of each, joined by faces, and all cells that may be of home's part."""

    inside: Cells
    component: Indices
    joined: Cells

    @property
    def greatest_edge(self) -> float:
        """The greatest edge of the cells inside, mm; 0 for none."""
        return float(self.inside.size.max(initial=0.0))

    def find_components(self, position: Array) -> Indices:
        """Find the components of the cells that hold a position (d,)."""
        holds = ((self.inside.low <= position) & (position <= self.inside.low + self.inside.size)).all(1)
        return self.component[holds]

    def find_home(self, region: Region) -> Indices:
        """Find the components that hold home; all where no cell inside holds it, as in a slice beside it."""
        own = self.find_components(region.home_position)
        return own if len(own) else np.unique(self.component)

    def pick_starts(self, region: Region, positive: Constraint) -> Array:
        """Pick positions (k, d) of home's component at which a margin is above zero, but least or least about there."""
        own = np.isin(self.component, self.find_home(region))
        middle = self.inside.low[own] + 0.5 * self.inside.size[own]
        margin = positive.point_program(middle, middle)[0][:, 0]
        middle, margin = middle[margin > 0.0], margin[margin > 0.0]
        if not len(middle):
            return middle
        least = np.argsort(margin, kind="stable")[:_STARTS]
        return np.asarray(middle[np.union1d(least, pick_best_of_blocks(middle, -margin, _STARTS))])


def _label_cells(region: Region, extent: tuple[Array, Array], budget: Budget) -> _RegionCells:
    """Refine a region down to one size of cells, and label those inside."""
    edge = float((extent[1] - extent[0]).max()) / _ALONG[len(extent[0])]
    cells = region.subdivide(*extent).run(1e-12, edge, budget)
    is_slice = any(axis in region.fixed_axes for axis in "XYZ")  # what is apart there may hang together beyond it
    joined = None if is_slice else find_joined_cells(cells, region.home_position)
    inside = cells.take(cells.inside)
    faces = np.zeros((0, 2), np.int64)
    if len(inside.low):
        with suppress(PoseError):  # too many cells: none of them is joined to another
            faces = find_adjacent_cells(inside.low, inside.size)[0]
    component = label_components(len(inside.low), faces) if len(inside.low) else np.zeros(0, np.int64)
    return _RegionCells(inside, component, cells if joined is None else cells.take(joined))


def _is_clear(positive: Constraint, left: Cells, joined: Cells) -> bool:
    """Tell whether a margin is above zero in all cells that may hang together with home, or those left are apart."""
    if _is_apart(left, joined):
        return True
    n, middle = len(joined.low), joined.low + 0.5 * joined.size
    greatest = np.nanmax(np.abs(positive.point_program(middle, middle)[0][:, 0]), initial=0.0)
    above = replace(positive, margin=positive.margin - _ABOVE * greatest)  # bounds are proved to be ≥ 0, not > 0
    none = np.zeros((n, 0))
    boxes = OrientationBoxes(np.arange(n), none, none, none.astype(np.bool_))
    return bool((bound_margin(above, joined.low, joined.size, boxes, every=True).state == CLEARED).all())


def _is_apart(left: Cells, joined: Cells) -> bool:
    """Tell whether no cell touches one of those that may hang together with home."""
    if len(left.low) > _MOST_COMPARED:
        return False
    top = joined.low + joined.size
    pairs = zip(left.low, left.low + left.size, strict=True)
    return not any(((low <= top) & (joined.low <= high)).all(1).any() for low, high in pairs)


def _find_sign_change(region: Region, positive: Constraint, cells: Cells, component: Indices) -> Array | None:
    """Find a pose with a margin proved to be below zero, in the component that holds home or where it changes sign."""
    if not len(cells.low):
        return None
    middle = cells.low + 0.5 * cells.size
    low, high = (end[:, 0] for end in positive.point_program(middle, middle))
    above, below = low > 0.0, high < 0.0
    mixed: Flags = np.isin(component, np.intersect1d(component[above], component[below]))
    position = region.home_position
    at_home = ((cells.low <= position) & (position <= cells.low + cells.size)).all(1)
    if at_home.any():
        mixed &= component == component[int(at_home.argmax())]
    broken = np.flatnonzero(mixed & below)
    if not len(broken):
        return None
    return np.asarray(region.poses(middle[broken[[int(high[broken].argmin())]]])[0])
