"""Follow a machine while its drives are homed: joints move by themselves, and the platform goes where they pull it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ....arrays import Array, Flags
from ....machine import Machine
from ..model_header import LEAST_REGULARITY
from .starts import HomingStarts, compute_other_margins, compute_regularity

_STEP = {"mm": 4.0, "rad": np.radians(1.0)}  # of the joint that moves farthest
_MOST_STEPS = 2000
_JUMP = 12.0  # mm that the tip moves for a mm of a joint: farther it has not moved but jumped


@dataclass(frozen=True, eq=False)
class HomingWalk:
    """Where machines stand, and which of them are unharmed.

    poses (n, axes), joints (n, joints)
    kept (n,) : since the start the legs closed on home's side of all singularities, and no limit was broken but the
        ranges of the drives
    least (n,) : the least regularity so far
    """

    poses: Array
    joints: Array
    kept: Flags
    least: Array


def begin_walk(machine: Machine, starts: HomingStarts) -> HomingWalk:
    """Begin at the starts."""
    kept = np.ones(len(starts.poses), bool)
    return HomingWalk(starts.poses, starts.joints, kept, compute_regularity(machine, starts.poses))


def walk_joints(machine: Machine, walk: HomingWalk, ends: dict[int, float], speeds: Array, patient: bool) -> HomingWalk:
    """Move joints to their ends all at once, each at its own speed, and wait until the last one is there.

    ends : joint's index to where it goes, mm and rad
    speeds (joints,) : of every joint
    patient : go on until all are lost, not only until the first one is

    The pose is continued in steps of 4 mm or 1 degree by the direct problem from the pose before, which never leaves
    that pose's side of a singularity; where there is none next to it the machine is lost. Steps are samples: between
    two of them nothing is proved.
    """
    moving = list(ends)
    goals, pace = np.array([ends[i] for i in moving]), speeds[moving]
    way = np.abs(walk.joints[:, moving] - goals)
    steps = np.array([_STEP[machine.joint_units[i]] for i in moving])
    seconds = float((way / pace).max(initial=0.0))
    count = min(_MOST_STEPS, int(np.ceil(seconds * float((pace / steps).max()))))
    begin, enough = walk.joints, np.any if patient else np.all
    for passed in np.linspace(0.0, seconds, count + 1)[1:]:
        if not enough(walk.kept):
            break
        joints = begin.copy()
        joints[:, moving] += np.sign(goals - begin[:, moving]) * np.minimum(way, passed * pace)
        walk = _take_step(machine, walk, joints)
    return walk


def _take_step(machine: Machine, walk: HomingWalk, joints: Array) -> HomingWalk:
    """Continue the poses to joints beside the ones before; only those that are still unharmed are looked at."""
    rows = np.flatnonzero(walk.kept)
    solution = machine.forward(joints[rows], near=walk.poses[rows])
    straight = np.array(machine.axis_units) == "mm"
    moved = np.abs(solution.poses - walk.poses[rows])[:, straight].max(1, initial=0.0)
    legs = slice(0, machine.leg_count)
    most = _JUMP * np.abs(joints[rows, legs] - walk.joints[rows, legs]).max(1, initial=0.0)
    with np.errstate(invalid="ignore"):
        kept = np.asarray(solution.converged) & (moved <= most + 1e-6)
        rows, poses = rows[kept], solution.poses[kept]
        regularity = compute_regularity(machine, poses)
        inside = (compute_other_margins(machine, poses, joints[rows]) >= 0.0).all(1)
    inside &= regularity >= LEAST_REGULARITY
    alive, least, new = np.zeros_like(walk.kept), walk.least.copy(), walk.poses.copy()
    alive[rows[inside]] = True
    least[rows] = np.fmin(least[rows], regularity)
    new[rows] = poses
    return replace(walk, poses=new, joints=joints, kept=alive, least=least)
