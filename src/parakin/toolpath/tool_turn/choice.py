"""Choose the turn of the tool about its own axis along a whole path: the most margin, and then the least time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...arguments import check_arguments, check_positive
from ...arrays import Array, Flags, Indices, Progress
from ...errors import PoseError
from ...kinematics.turns import TURN
from ...machine import Machine
from ..path import Note, ToolPath
from ..posting.frames import compose_frames
from ..posting.post import post_path
from ..posting.range_use import measure_range_use
from ..posting.tool_lengths import fit_tool_lengths
from ..programmed_path import ProgrammedPath
from ..timing.drive_limits import DriveLimits
from .lattice import Lattice, build_lattice
from .lattice_search import StepCosts, find_quickest_way, find_widest_margin
from .stations import Stations, place_stations
from .turned_path import TurnCurve, turn_path

_KEPT = 0.95  # of the greatest least margin: what is kept of it for the sake of time
_SAME = 0.99  # of the margin with C as at home: as much is no less, for the records are not the lattice's stations
_STEEPEST = 3  # turns of the lattice from station to station
_TURN_WEIGHT = 0.01  # s: see StepCosts
_ROUNDS = 100  # of smoothing: over some seven stations


@dataclass(frozen=True, eq=False)
class ToolTurn:
    """The turn of the tool about its own axis, chosen along a path.

    path : the path with its turns A, B, C, and records inserted where these need them; to be posted at the same
        workpiece, in the same mode
    low, high : rad, the range of the machine's C
    margin, home_margin : the least margin at the records, over half its limit's range, with it, and with C as at home
    """

    path: ToolPath
    low: float
    high: float
    margin: float
    home_margin: float

    def __repr__(self) -> str:
        low, high = np.degrees([self.low, self.high])
        return (
            f"<parakin tool turn: C {low:.6g} to {high:.6g} deg, margin {self.margin:.4g}, as at home "
            f"{self.home_margin:.4g}>"
        )


@check_arguments
def choose_tool_turn(
    machine: Machine,
    path: ToolPath,
    *,
    workpiece: Array | None = None,
    mode: str | None = None,
    lean: float = 1e-5,
    progress: Progress | None = None,
) -> ToolTurn | None:
    """Choose the turn of the tool about its own axis along a path, by dynamic programming.

    None where it finds none that keeps the limits and leaves as much margin, or tool axes turn to their opposites.

    Of all turns that change evenly, those are found whose least margin is greatest. Of those that keep 95 % of
    it, and no less than C as at home does, one is taken that takes the joints the least time. Nothing in it is random:
    the same path gives the same turns.

    Parameters
    ----------
    machine, path, workpiece, mode : as for :func:`parakin.prepare`
    lean : rad that even turns from record to record may turn the tool off the programmed axis and the chosen turn
    progress : called now and then with the fraction done, 0 to 1

    Raises :class:`PoseError` where the turn is not free: the machine does not turn three ways, or has a wrist, or the
    path gives A, B and C itself.
    """
    check_positive("lean", lean, "rad")
    refusal = find_refusal(machine, path)
    if refusal:
        raise PoseError(f"turn: {refusal}")
    report = progress or (lambda fraction: None)
    path = fit_tool_lengths(machine, path, workpiece=workpiece)
    if len(path) < 2 or ProgrammedPath(path).find_opposite(np.arange(1, len(path))).any():
        return None
    at_home = post_path(machine, path, workpiece=workpiece, mode=mode)
    frame = compose_frames(workpiece, path.frame)
    stations = place_stations(path)
    tip, axis = ProgrammedPath(path, frame).interpolate(stations.motion, stations.share)
    lattice = build_lattice(machine, tip, axis, at_home.mode, lambda fraction: report(0.7 * fraction))
    values = _search_lattice(machine, path, stations, lattice)
    report(0.8)
    if values is None:
        return None
    curve = TurnCurve(values)

    def find_c(motion: Indices, share: Array) -> Array:
        return curve.evaluate(stations.locate(motion, share))

    turned = turn_path(machine, path, frame, find_c, lean)
    posted = post_path(machine, turned, workpiece=workpiece, mode=at_home.mode)
    margin, home_margin = (float(measure_range_use(one)[1].min()) for one in (posted, at_home))
    report(1.0)
    if posted.broken_record_count or margin < _SAME * home_margin:
        return None
    c = posted.poses[:, machine.turning_columns[-1]]
    low, high = float(c.min()), float(c.max())
    ends = "from {:.1f} to {:.1f}°".format(*np.degrees([low, high]))
    note = Note(0, f"the turn about the tool's axis is chosen along the path, C {ends} in the machine")
    return ToolTurn(replace(turned, notes=(*turned.notes, note)), low, high, margin, home_margin)


def find_refusal(machine: Machine, path: ToolPath) -> str:
    """Find why the turn about the tool's axis is not free; empty where it is."""
    if len(machine.turning_columns) < 3:
        return f"{machine.name} does not turn the tool three ways, so none is free"
    if machine.wrist is not None:
        return f"{machine.name} has a wrist, whose turns are not chosen"
    if path.turns is not None:
        return "the program gives A, B and C itself, so none is free"
    return ""


def _search_lattice(machine: Machine, path: ToolPath, stations: Stations, lattice: Lattice) -> Array | None:
    """Search the lattice for the machine's C at the stations (m,), smooth; None where no way keeps the limits."""
    widest = find_widest_margin(lattice.margins, _STEEPEST)
    if not widest >= 0.0:
        return None
    level = max(_KEPT * widest, min(widest, float(lattice.margins[:, lattice.home].min())))
    usable = lattice.margins >= level
    speed = DriveLimits.of(machine).speed
    whole_turns = np.zeros(len(speed))
    whole_turns[machine.turning_joints] = TURN / speed[machine.turning_joints]
    seconds = np.diff(stations.interpolate(_sum_feed_seconds(path)))
    costs = StepCosts(seconds, lattice.joints / speed, whole_turns, _TURN_WEIGHT)
    way = find_quickest_way(usable, costs, _STEEPEST)
    return _smooth_way(lattice, usable, way)


def _sum_feed_seconds(path: ToolPath) -> Array:
    """Sum the time (n,) that the feeds take up to each record; rapid motions take none."""
    length, _ = ProgrammedPath(path).measure_motions(np.arange(1, len(path)))
    feed = np.where(path.rapid[1:] | ~(path.feed[1:] > 0.0), np.inf, path.feed[1:] / 60.0)
    return np.concatenate([[0.0], np.cumsum(length / feed)])


def _smooth_way(lattice: Lattice, usable: Flags, way: Indices) -> Array:
    """Smooth a way (m,) of turns among the usable ones about it, by diffusion; return C, rad."""
    rows = np.arange(len(way))
    lowest, highest = way.copy(), way.copy()
    for _ in range(len(lattice.turns)):
        below, above = np.maximum(lowest - 1, 0), np.minimum(highest + 1, len(lattice.turns) - 1)
        lowest = np.where(usable[rows, below], below, lowest)
        highest = np.where(usable[rows, above], above, highest)
    values = lattice.turns[way]
    for _ in range(_ROUNDS):
        padded = np.concatenate([values[:1], values, values[-1:]])
        values = 0.25 * padded[:-2] + 0.5 * values + 0.25 * padded[2:]
        values = np.clip(values, lattice.turns[lowest], lattice.turns[highest])
    return values
