"""Choose how the drives of a machine are homed: by switches, where that can do no harm, else by absolute encoders."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations, product
from math import pi

import numpy as np

from ....arrays import Array
from ....errors import InputError
from ....kinematics.rotations import collect_turns, compute_rotations
from ....machine import Machine
from ....model.elements import ABSOLUTE, Drive
from ..axis_rates import choose_drive_rates
from ..home_pose import find_home_pose
from .proof import prove_homing
from .starts import HomingStarts, sample_starts
from .walk import HomingWalk, begin_walk, walk_joints

SEARCH = 0.05  # of a joint's speed: towards its switch
_FEW = 50  # starts that are tried before all of them
_MOST_PERMUTED = 3  # legs that are tried in every order and all directions; more only in their own order, all alike


@dataclass(frozen=True)
class JointHoming:
    """How one joint is homed.

    switch : where its home switch trips, mm or rad; None: an absolute encoder, nothing moves
    direction : in which it looks for the switch, 1 or -1
    sequence : joints of one sequence move together, 1 is the first
    """

    switch: float | None
    direction: float = 1.0
    sequence: int = 1


@dataclass(frozen=True)
class HomingPlan:
    """How all joints are homed, and on what that rests.

    starts : from how many poses the legs' homing was followed
    least : the least regularity on the way, a fraction of home's; 1 where nothing moves
    proved : whether it is proved that no start comes to a singularity; where nothing moves nothing is left to prove
    unsafe : None, or the share of the starts from which the best order of switches would do harm
    ambiguous : the share of the starts whose joints the direct problem, asked from home, answers with another pose
    """

    joints: tuple[JointHoming, ...]
    starts: int
    least: float
    proved: bool
    unsafe: float | None
    ambiguous: float


@dataclass(frozen=True)
class _LegOrder:
    """Sequences of legs' joints with their ends."""

    sequences: tuple[dict[int, float], ...]


@lru_cache(maxsize=32)
def find_homing(machine: Machine) -> HomingPlan:
    """Choose directions and order of homing such that it does no harm from any of the sampled starts.

    The orders are tried in turn: all legs together; those of one slot of the legs after those of the other; one leg
    after the other. Of directions that do no harm the one that lifts the tool most is taken. Where none is left, legs
    that say nothing of their homing get absolute encoders, and legs that ask for a switch are refused. So it is with
    more drives than freedoms, for no joint moves by itself.

    Raises :class:`InputError` for switches with which homing can do harm.
    """
    starts = sample_starts(machine)
    looking = [i for i in range(machine.leg_count) if machine.drives[i].homing != ABSOLUTE]
    if machine.is_redundant:
        _refuse_switches(machine, looking)
        looking = []
    choice = _choose_order(machine, starts, looking) if looking else None
    unsafe = _measure_harm(machine, starts, looking) if looking and choice is None else None
    if unsafe is not None and any(machine.drives[i].homing is not None for i in looking):
        raise InputError(
            f"homing: from {100.0 * unsafe:.3g} % of the sampled poses homing by these switches breaks a limit or "
            f"comes to a singularity, in every order tried; expected absolute encoders (homing: {ABSOLUTE})"
        )
    legs = _describe_legs(machine, choice[0] if choice else None)
    joints = (*legs, *_describe_serial_joints(machine, 1 + max((leg.sequence for leg in legs), default=0)))
    least = float(choice[1].least.min()) if choice else 1.0
    sequences = choice[0].sequences if choice else ()
    proved = not choice or (len(sequences) == 1 and prove_homing(machine, sequences[0], _choose_search_speeds(machine)))
    ambiguous = 0.0 if choice else _find_ambiguity(machine, starts)
    return HomingPlan(joints, len(starts.poses), least, proved, unsafe, ambiguous)


def _refuse_switches(machine: Machine, looking: list[int]) -> None:
    """Refuse legs that ask for a switch."""
    for drive in (machine.drives[i] for i in looking):
        if drive.homing is not None:
            raise InputError(
                f"homing: joint {drive.name} can't go to a switch by itself, there are {len(machine.drives)} drives "
                f"for {len(machine.axes)} freedoms; expected an absolute encoder (homing: {ABSOLUTE})"
            )


def pace_return(machine: Machine, plan: HomingPlan) -> Array:
    """Pace the joints from their switches to home, so that those of one sequence arrive together: speeds (joints,)."""
    speeds, home = _choose_search_speeds(machine), machine.inverse(find_home_pose(machine))
    for sequence in {joint.sequence for joint in plan.joints}:
        ends = {i: j.switch for i, j in enumerate(plan.joints) if j.sequence == sequence and j.switch is not None}
        if ends:
            speeds = _return_home(ends, home, speeds)[1]
    return speeds


def _choose_search_speeds(machine: Machine) -> Array:
    return SEARCH * np.array([choose_drive_rates(drive)[0] for drive in machine.drives])


def _describe_legs(machine: Machine, order: _LegOrder | None) -> list[JointHoming]:
    result = [JointHoming(None)] * machine.leg_count
    for sequence, ends in enumerate(order.sequences if order else (), 1):
        for joint, end in ends.items():
            drive = machine.drives[joint]
            result[joint] = JointHoming(end, -1.0 if end < 0.5 * (drive.low + drive.high) else 1.0, sequence)
    return result


def _describe_serial_joints(machine: Machine, sequence: int) -> Iterator[JointHoming]:
    """Describe the homing of head and table: after the legs, one after the other; they move no leg.

    A switch on a joint that turns farther than once round can't tell the turn, so such a joint needs an encoder that
    counts turns.
    """
    for drive in machine.drives[machine.leg_count :]:
        turns_on = drive.unit == "rad" and drive.high - drive.low > 2.0 * pi
        if drive.homing == ABSOLUTE or (drive.homing is None and turns_on):
            yield JointHoming(None, 1.0, sequence)
            continue
        switch = drive.low if drive.homing is None else float(drive.homing)
        yield JointHoming(switch, -1.0 if switch < 0.5 * (drive.low + drive.high) else 1.0, sequence)
        sequence += 1


def _choose_order(machine: Machine, starts: HomingStarts, looking: list[int]) -> tuple[_LegOrder, HomingWalk] | None:
    """Choose an order that does no harm, with its walk; None where there is none."""
    few = HomingStarts(starts.poses[:_FEW], starts.joints[:_FEW])
    for orders in _list_orders(machine, looking):
        safe: list[tuple[float, _LegOrder, HomingWalk]] = []
        for order in orders:
            if not _walk_order(machine, few, order)[0].kept.all():
                continue
            walk, searched = _walk_order(machine, starts, order)
            if walk.kept.all():
                safe.append((_measure_lift(machine, starts, searched.poses), order, walk))
        if safe:
            return max(safe, key=lambda choice: choice[0])[1:]
    return None


def _measure_harm(machine: Machine, starts: HomingStarts, looking: list[int]) -> float:
    """Measure the share of the starts from which homing all legs together does harm, in the best directions."""
    orders = next(_list_orders(machine, looking))
    return 1.0 - max(float(_walk_order(machine, starts, order, True)[0].kept.mean()) for order in orders)


def _list_orders(machine: Machine, looking: list[int]) -> Iterator[list[_LegOrder]]:
    """List the orders, the preferred first; those of one list differ only in their directions."""
    slots = _group_by_slot(machine, looking)
    alike = [_choose_ends(machine, slots, signs) for signs in product((-1, 1), repeat=len(slots))]
    yield _order_together(alike)
    if len(slots) > 1:
        yield from (_order_in_turn(alike, turns) for turns in permutations(range(len(slots))))
    legs, few = [[joint] for joint in looking], len(looking) <= _MOST_PERMUTED
    signs_of_legs = product((-1, 1), repeat=len(looking)) if few else [(sign,) * len(looking) for sign in (-1, 1)]
    each = [_choose_ends(machine, legs, signs) for signs in signs_of_legs]
    if few:
        yield _order_together(each)
    own = tuple(range(len(looking)))
    yield from (_order_in_turn(each, turns) for turns in (permutations(own) if few else [own]))


def _order_together(choices: list[list[dict[int, float]]]) -> list[_LegOrder]:
    """Make orders in which all groups move at once, one for each choice of their ends."""
    return _remove_twins([_LegOrder(({i: end for ends in groups for i, end in ends.items()},)) for groups in choices])


def _order_in_turn(choices: list[list[dict[int, float]]], turns: tuple[int, ...]) -> list[_LegOrder]:
    """Make orders in which the groups move one after the other, one for each choice of their ends."""
    return _remove_twins([_LegOrder(tuple(groups[i] for i in turns)) for groups in choices])


def _remove_twins(orders: list[_LegOrder]) -> list[_LegOrder]:
    """Leave out orders that come twice, as they do where the switches are given."""
    return [order for i, order in enumerate(orders) if order not in orders[:i]]


def _group_by_slot(machine: Machine, looking: list[int]) -> list[list[int]]:
    """Group joints by their place in a leg, first joints of all legs together."""
    slots: dict[int, list[int]] = {}
    for leg in machine.legs:
        for slot, drive in enumerate(leg.drives):
            joint = machine.joints.index(drive.name)
            if joint in looking:
                slots.setdefault(slot, []).append(joint)
    return [slots[slot] for slot in sorted(slots)]


def _choose_ends(machine: Machine, groups: list[list[int]], signs: tuple[int, ...]) -> list[dict[int, float]]:
    """Choose where each group's joints go: to their switches, else to the ends of their ranges."""

    def find_end(drive: Drive, sign: int) -> float:
        if isinstance(drive.homing, float):
            return drive.homing
        return drive.low if sign < 0 else drive.high

    return [{i: find_end(machine.drives[i], s) for i in group} for group, s in zip(groups, signs, strict=True)]


def _walk_order(
    machine: Machine, starts: HomingStarts, order: _LegOrder, patient: bool = False
) -> tuple[HomingWalk, HomingWalk]:
    """Follow an order from the starts, each sequence to its switches and from there to LinuxCNC's home.

    Return where all are at last, and where the last switches were found. Unless ``patient`` the first harm ends it.
    """
    speeds, home = _choose_search_speeds(machine), machine.inverse(find_home_pose(machine))
    walk = searched = begin_walk(machine, starts)
    for ends in order.sequences:
        searched = walk_joints(machine, walk, ends, speeds, patient)
        walk = walk_joints(machine, searched, *_return_home(ends, home, speeds), patient)
    return walk, searched


def _return_home(ends: dict[int, float], home: Array, speeds: Array) -> tuple[dict[int, float], Array]:
    """Choose where a sequence's joints go from their switches, and speeds with which they arrive together."""
    goals = {joint: float(home[joint]) for joint in ends}
    way = {joint: abs(goals[joint] - end) for joint, end in ends.items()}
    seconds = max(way[joint] / speeds[joint] for joint in ends)
    paced = speeds.copy()
    for joint in ends:
        paced[joint] = way[joint] / seconds if way[joint] > 0.0 and seconds > 0.0 else speeds[joint]
    return goals, paced


def _measure_lift(machine: Machine, starts: HomingStarts, poses: Array) -> float:
    """Measure by how much the tip moves along the tool, away from the work; the mean over the starts, mm."""
    frames = compute_rotations(collect_turns(machine.axes, starts.poses))
    lifted = np.zeros((len(poses), 3))
    for column, name in enumerate(machine.axes):
        if name in "XYZ":
            lifted[:, "XYZ".index(name)] = (poses - starts.poses)[:, column]
    return float((lifted * frames[..., 2]).sum(1).mean())


def _find_ambiguity(machine: Machine, starts: HomingStarts) -> float:
    """Find the share of the starts whose joints alone, asked from home, give another pose."""
    solution = machine.forward(starts.joints, near=machine.home)
    straight = np.array(machine.axis_units) == "mm"
    off = np.abs(solution.poses - starts.poses)[:, straight].max(1, initial=0.0)
    turned = compute_rotations(collect_turns(machine.axes, np.nan_to_num(solution.poses)))
    expected = compute_rotations(collect_turns(machine.axes, starts.poses))
    columns = slice(2, 3) if machine.has_direction else slice(0, 3)
    askew = np.abs(turned - expected)[..., columns].max((1, 2))
    return float(1.0 - (np.asarray(solution.converged) & (off < 1e-3) & (askew < 1e-6)).mean())
