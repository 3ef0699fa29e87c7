"""Direct problems drawn by the thousand: answers in another working mode, or on another side, than was asked for."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from geometry import Description
from test_conformance import poses_about

from parakin.kinematics.solution import ON_ANOTHER_SIDE, REASONS, SINGULAR_WAY

BATCH = 100_000
OFFSETS = [(0.0, 0.0), (1.0, 0.5), (10.0, 3.0), (50.0, 10.0), (200.0, 30.0), (600.0, 80.0)]  # mm and degrees


@dataclass
class Tally:
    """What became of direct problems: how many there were, had no answer, or had one that may not be."""

    count: int = 0
    refused: int = 0
    other_mode: int = 0
    other_side: int = 0
    close: int = 0  # problems with a start 1 mm and 0.5° off at most
    close_refused: int = 0
    close_across: int = 0  # of these, with a start that lies on another side by its own determinant, and said so
    open_by: float = 0.0  # mm, the greatest distance by which a leg of an answer fails to close, by the second model
    causes: Counter[str] = field(default_factory=Counter)  # why those close by were refused, but for those across


def draw_poses(machine, count, rng):
    """Allowed poses, (count, axes), as the direct problem writes them."""
    rows = []
    while sum(map(len, rows)) < count:
        poses = poses_about(machine, 4 * BATCH, seed=int(rng.integers(1 << 31)))
        if machine.axes == tuple("XYZBC"):
            poses[:, 3] = np.abs(poses[:, 3])
        rows.append(poses[machine.check(poses) == 0])
    return np.concatenate(rows)[:count]


def move_off(machine, poses, rng):
    """Starts at all distances from poses, from none to far away; and which of them are 1 mm and 0.5° off at most."""
    which = rng.integers(len(OFFSETS), size=len(poses))
    mm = np.array(machine.axis_units) == "mm"
    way = rng.normal(size=poses.shape)
    for columns, column in ((mm, 0), (~mm, 1)):
        if columns.any():
            size = np.array(OFFSETS)[which, column] * (np.pi / 180.0 if column else 1.0)
            way[:, columns] *= (size / np.linalg.norm(way[:, columns], axis=1))[:, None]
    return poses + way, which < 2


def measure_mode_error(machine, poses, joints):
    """By how much the legs' joints differ from those of the inverse, mm or rad; head and table in either mode."""
    turning = np.array(machine.joint_units) == "rad"
    modes = machine.head_modes(machine.mode) if machine.structure.branches else (machine.mode,)
    errors = []
    for mode in modes:
        off = np.abs(machine.inverse(poses, mode) - joints)
        off[:, turning] = np.abs((off[:, turning] + np.pi) % (2.0 * np.pi) - np.pi)
        errors.append(off[:, : machine.leg_count].max(1))
    return np.fmin.reduce(errors)


def measure_sides(machine, poses):
    """The determinant of the twist's matrix at poses with their own joints, rows scaled: it knows no angles.

    A tall one has a volume, whose sign tells nothing.
    """
    a = machine.twist_rates(poses, machine.inverse(poses))[0]
    a = a / np.where(np.arange(a.shape[2]) < 3, 1.0, 200.0)
    with np.errstate(all="ignore"):
        scaled = a / np.linalg.norm(a, axis=2, keepdims=True)
        if scaled.shape[1] > scaled.shape[2]:
            return np.sqrt(np.linalg.det(scaled.swapaxes(1, 2) @ scaled))
        return np.linalg.det(scaled)


def try_direct_problems(machine, count, seed=0, **options):
    """Solve ``count`` direct problems of random allowed poses from starts at random distances."""
    rng, tally, description = np.random.default_rng(seed), Tally(), Description.of(machine.spec)
    for begin in range(0, count, BATCH):
        poses = draw_poses(machine, min(BATCH, count - begin), rng)
        joints = machine.inverse(poses)
        starts, close = move_off(machine, poses, rng)
        found = machine.forward(joints, near=starts, **options)
        done = found.converged
        tally.count += len(poses)
        tally.refused += int((~done).sum())
        tally.close += int(close.sum())
        lost = close & ~done
        tally.close_refused += int(lost.sum())
        across = measure_sides(machine, poses[lost]) * measure_sides(machine, starts[lost]) < 0.0
        across &= np.isin(found.why[lost], (ON_ANOTHER_SIDE, SINGULAR_WAY))
        tally.close_across += int(across.sum())
        tally.causes.update(REASONS[why] for why in found.why[lost][~across])
        assert (found.why[~done] > 0).all()
        misses = description.misses(found.poses[done], joints[done])[0]
        tally.open_by = max(tally.open_by, float(misses.max(initial=0.0)))
        error = measure_mode_error(machine, found.poses[done], joints[done])
        in_mode = error < 1e-5
        tally.other_mode += int((~in_mode).sum())
        turned = measure_sides(machine, found.poses[done][in_mode]) * measure_sides(machine, starts[done][in_mode])
        tally.other_side += int((turned < 0.0).sum())
    return tally
