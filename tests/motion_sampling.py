"""What the tests of checking share: posted paths from poses, and limits along motions by dense samples."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shipped import REPRESENTATIVES, load_shipped

from parakin.kinematics.wrist.pole_thresholds import PRINTED
from parakin.machine import Machine
from parakin.toolpath.path import ToolPath
from parakin.toolpath.posting.offences import judge_path
from parakin.toolpath.posting.posted import Posted

TURN = 2.0 * math.pi
SEEN = 1e-5  # a margin this far below 0 in a dense sample is an offence
everyone = pytest.mark.parametrize("name", REPRESENTATIVES)


def posted_on(machine, poses, mode=None, turns=None):
    """Poses as a posted path; ``turns`` are added to each joint."""
    poses = np.array(poses, dtype=float).reshape(-1, len(machine.axes))
    n = len(poses)
    lines, axis = np.arange(101, 101 + n), np.tile([0.0, 0.0, 1.0], (n, 1))
    path = ToolPath(
        "part.cls", np.zeros((n, 3)), axis, lines, np.zeros(n, bool), np.full(n, 1000.0), np.full(n, np.nan)
    )
    joints = machine.follow(poses, mode, PRINTED) + (0.0 if turns is None else TURN * np.asarray(turns))
    found = judge_path(machine, poses, joints, lines, mode)
    frame = np.eye(3, 4)
    return Posted(
        machine, path, mode or machine.mode, frame, poses, joints,
        found.broken, found.limits, found.offences, found.first, found.worst,
    )  # fmt: skip


def pose(machine, **given):
    """Home with some axes given; degrees."""
    values = dict(zip(machine.axes, machine.home.tolist(), strict=True))
    values |= {axis: value if axis in "XYZ" else math.radians(value) for axis, value in given.items()}
    return [values[axis] for axis in machine.axes]


def ranged(machine, ranges):
    """The machine with other ranges of some joints."""

    def drive(old):
        if old is None or old.name not in ranges:
            return old
        low, high = ranges[old.name]
        return replace(old, low=float(low), high=float(high))

    spec = machine.spec
    legs = tuple(replace(leg, drives=tuple(drive(d) for d in leg.drives)) for leg in spec.legs)
    head, table = (tuple(replace(s, drive=drive(s.drive)) for s in steps) for steps in (spec.head, spec.table))
    return Machine(replace(spec, legs=legs, head=head, table=table))


def modes_of(posted):
    mode = posted.mode
    pair = posted.machine.leg_count == len(posted.machine.joints) - 2
    return [mode, mode[:-1] + ("-" if mode[-1] == "+" else "+")] if pair else [mode]


def nearest(posted, poses, guess):
    """Joints at poses, of both working modes of head and table, nearest to a guess."""
    machine = posted.machine
    angles = np.array([unit == "rad" for unit in machine.joint_units])
    best = np.full(guess.shape, np.nan)
    cost = np.full(len(poses), np.inf)
    for mode in modes_of(posted):
        q = machine.inverse(poses, mode)
        q = np.where(angles, q + TURN * np.round((guess - q) / TURN), q)
        off = ((q - guess)[:, angles] ** 2).sum(1)
        better = off < cost
        best[better], cost[better] = q[better], off[better]
    return best


class Sampled:
    """Margins along motions, step by step from the record before, (shares, motions, limits)."""

    def __init__(self, posted, steps):
        self.posted, machine = posted, posted.machine
        good = np.isfinite(posted.joints).all(1)
        self.motion = np.flatnonzero(good[1:] & good[:-1]) + 1
        self.share = np.linspace(0.0, 1.0, steps + 1)
        guess, joints, margins = posted.joints[self.motion - 1], [], []
        for share in self.share:
            poses = self.poses(share)
            q = nearest(posted, poses, guess)
            guess = np.where(np.isnan(q), guess, q)
            joints.append(q)
            margins.append(machine.margins(poses, q, posted.mode))
        self.joints, self.margins = np.array(joints), np.array(margins)
        off = np.abs(self.joints[-1] - posted.joints[self.motion]).max(1)
        self.followed = off < 1e-6  # the others pass over a pole

    def poses(self, share, motion=None):
        motion = self.motion if motion is None else motion
        start, end = self.posted.poses[motion - 1], self.posted.poses[motion]
        return start + share * (end - start)

    def margin(self, share, column, limit):
        """At any share of the motion in a column, joints nearest to the samples'."""
        i = min(len(self.share) - 1, round(share * (len(self.share) - 1)))
        poses = self.poses(share, self.motion[[column]])
        q = nearest(self.posted, poses, self.joints[i, [column]])
        return float(self.posted.machine.margins(poses, q, self.posted.mode)[0, limit])

    def least(self, column, limit):
        """The least margin on a motion, by golden section about the least sample."""
        i = int(np.nanargmin(self.margins[:, column, limit]))
        low, high = self.share[max(0, i - 1)], self.share[min(len(self.share) - 1, i + 1)]
        ratio = 0.5 * (math.sqrt(5.0) - 1.0)
        for _ in range(60):
            a, b = high - ratio * (high - low), low + ratio * (high - low)
            if self.margin(a, column, limit) < self.margin(b, column, limit):
                high = b
            else:
                low = a
        return min(self.margin(0.5 * (low + high), column, limit), float(self.margins[i, column, limit]))

    def begins(self, column, limit):
        """The share at which a margin first goes below 0, by halving between samples."""
        i = int(np.argmax(~(self.margins[:, column, limit] >= 0.0)))
        if i == 0:
            return 0.0
        low, high = self.share[i - 1], self.share[i]
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.margin(middle, column, limit) >= 0.0 else (low, middle)
        return high


REACH = {"X": 130.0, "Y": 130.0, "Z": 90.0, "A": 0.25, "B": 0.25, "C": 0.9}


def drawn(name, count, seed=0):
    """A machine whose joints have ranges that motions bulge out of, and random poses, long ways apart."""
    machine = load_shipped(name)
    rng = np.random.default_rng([seed, REPRESENTATIVES.index(name)])
    size = 0.4 if name.startswith("ortho") else 1.0
    half = np.array([REACH[axis] * (size if axis in "XYZ" else 1.0) for axis in machine.axes])
    poses = machine.home + rng.uniform(-1.0, 1.0, (count, len(half))) * half
    if machine.axes[3:] == ("B", "C"):
        poses[:, 3] = rng.uniform(0.02, 0.6, count)
        poses[:, 4] = np.cumsum(rng.uniform(-1.0, 1.0, count))
    thick = poses[:-1, None] + np.linspace(0.0, 1.0, 9)[:, None] * np.diff(poses, axis=0)[:, None]
    joints = machine.follow(thick.reshape(-1, len(half)), None, PRINTED).reshape(count - 1, 9, -1)
    home = machine.inverse(machine.home)
    ranges = {}
    for i, joint in enumerate(machine.joints):
        values = joints[:, :, i]
        ends, slack = values[:, [0, -1]], 1e-3 * np.nanmax(np.abs(values))
        # The bound that cuts the seventh greatest bulge in half.
        below, above = np.nan_to_num(ends.min(1) - values.min(1)), np.nan_to_num(values.max(1) - ends.max(1))
        low, high = below.argsort()[-7], above.argsort()[-7]
        ranges[joint] = (
            min(ends.min(1)[low] - 0.5 * below[low], home[i] - slack),
            max(ends.max(1)[high] + 0.5 * above[high], home[i] + slack),
        )
    return ranged(machine, ranges), poses


def dense_path(machine, count):
    u = np.linspace(0.0, 12.0, count)
    rows = np.tile(machine.home, (count, 1))
    for i, axis in enumerate(machine.axes):
        size = 20.0 if axis in "XYZ" else 0.05
        rows[:, i] += size * np.sin(u * (1.0 + 0.3 * i)) + (0.3 if axis == "B" else 0.0)
    return rows
