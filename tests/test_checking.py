"""The whole path: what motions break between their records, against dense samples and closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest

import parakin as pk
from parakin.kinematics.wrist import PRINTED
from parakin.machine import Machine
from parakin.performance.singularities import compute_singularity_margins
from parakin.toolpath.checking.check import check_path
from parakin.toolpath.checking.motion_bisection import MotionBisection
from parakin.toolpath.path import ToolPath
from parakin.toolpath.posting.offences import describe_place, judge_path
from parakin.toolpath.posting.posted import Posted

TURN = 2.0 * math.pi
SEEN = 1e-5  # a margin this far below 0 in a dense sample is an offence
everyone = pytest.mark.parametrize("name", sorted(pk.machines()))


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
    pair = posted.machine.model.serial == 2
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
    machine = pk.load(name)
    rng = np.random.default_rng([seed, sorted(pk.machines()).index(name)])
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


# Against dense samples.


@everyone
def test_offences_are_those_of_a_dense_sample(name):
    machine, poses = drawn(name, 120)
    posted = posted_on(machine, poses)
    checked = check_path(posted)
    sampled = Sampled(posted, 800)
    assert checked.checked and not posted.checked
    bisection = MotionBisection(posted)
    ends = (sampled.margins[0] >= 0.0) & (sampled.margins[-1] >= 0.0)
    least = np.where(np.isnan(sampled.margins), -np.inf, sampled.margins).min(0)
    least[~sampled.followed] = np.where(bisection.motions.wrist_limits, np.inf, least[~sampled.followed])
    doubtful = ends & (np.abs(least) < SEEN)
    broken = ends & (least < -SEEN)
    found = {offence.limit: offence for offence in checked.offences}
    at_records = machine.margins(poses, posted.joints, posted.mode) < 0.0
    assert broken.any()
    for limit, part in enumerate(machine.limit_parts):
        count = int(at_records[:, limit].sum() + broken[:, limit].sum())
        unsure = int(doubtful[:, limit].sum())
        told = found[part.name].count if part.name in found else 0
        assert count <= told <= count + unsure, part.name
    # The motions, whatever they break.
    broken_motions = checked.broken_motions[sampled.motion]
    names = [checked.limits[i - 1] if i else "" for i in broken_motions.tolist()]
    off = np.array([n != "" and n not in ("turns", "singularity") for n in names])
    assert not (broken.any(1) & (broken_motions == 0)).any()
    assert not (off & ~broken.any(1) & ~doubtful.any(1)).any()


@everyone
def test_worst_values_and_first_places_are_those_of_a_dense_sample(name):
    machine, poses = drawn(name, 60, seed=1)
    posted = posted_on(machine, poses)
    checked = check_path(posted)
    sampled = Sampled(posted, 400)
    wrist_limits = MotionBisection(posted).motions.wrist_limits
    columns = {limit: i for i, limit in enumerate(machine.limits)}
    margins = np.where(np.isnan(sampled.margins), np.inf, sampled.margins)
    margins[:, ~sampled.followed] = np.where(wrist_limits, np.inf, margins[:, ~sampled.followed])
    records = machine.margins(poses, posted.joints, posted.mode)
    looked = 0
    for offence in checked.offences:
        if offence.limit not in columns or machine.limit_parts[columns[offence.limit]].side == "reach":
            continue
        limit = columns[offence.limit]
        order = np.argsort(margins[:, :, limit].min(0))[:3]
        worst = min([sampled.least(int(column), limit) for column in order] + [float(np.nanmin(records[:, limit]))])
        assert offence.excess == pytest.approx(-worst, rel=1e-6, abs=2e-6 * max(1.0, abs(offence.bound))), offence
        looked += 1
    assert looked
    # The first place, from the first motion that a sample finds off limits.
    first = checked.first
    assert first.limit in columns or first.limit in ("singularity", "turns")
    earliest = []
    for column, motion in enumerate(sampled.motion.tolist()):
        bad = np.flatnonzero((margins[:, column] < -SEEN).any(0))
        if len(bad) and motion <= first.record:
            earliest += [(motion, sampled.begins(column, int(limit)), int(limit)) for limit in bad]
    if records[0].min() < 0.0:
        assert first.record == 0
    elif first.limit in columns:
        motion, share, limit = min(earliest)
        assert (first.record, first.limit) == (motion, machine.limits[limit])
        assert first.begins == pytest.approx(share, abs=1e-5)
        assert first.line == 101 + motion


# Closed forms: a carriage of the linear Delta stands highest where the platform is nearest to its tower.


def delta_chord(y=150.0, half=80.0, high=None):
    """A chord past tower a, at (0, 290) from the platform's middle; its carriage is highest half way."""
    machine = pk.load("linear_delta")
    peak = 280.0 + 80.0 + math.sqrt(700.0**2 - (290.0 - y) ** 2)
    if high is not None:
        machine = ranged(machine, {"tower_a": (700.0, peak + high)})
    poses = [[-half, y, 280.0], [half, y, 280.0]]
    return machine, poses, peak


def test_a_chord_bulges_over_a_carriages_end():
    machine, poses, peak = delta_chord(high=-1.0)
    posted = posted_on(machine, poses)
    assert posted.broken_record_count == 0
    checked = check_path(posted)
    assert checked.broken_record_count == 0
    assert checked.broken_motion_count == 1
    assert [offence.limit for offence in checked.offences] == ["tower_a.max"]
    worst = checked.worst
    assert worst.value == pytest.approx(peak, abs=1e-6)
    assert worst.excess == pytest.approx(1.0, abs=1e-6)
    assert worst.share == pytest.approx(0.5, abs=1e-3)
    # 290 - y and x are the legs of a triangle whose root is 1 mm short where it begins.
    begins = 0.5 - math.sqrt(700.0**2 - (peak - 361.0) ** 2 - 140.0**2) / 160.0
    first = checked.first
    assert first.record == 1 and first.line == 102
    assert first.begins == pytest.approx(begins, abs=1e-6)
    at = f"{160.0 * begins - 80.0:.1f}"
    assert (
        describe_place(checked, first)
        == f"part.cls:102: from {100.0 * begins:.0f} % on the way there, X {at} Y 150.0 Z 280.0"
    )
    assert describe_place(checked, worst) == "part.cls:102: 50 % on the way there, X 0.0 Y 150.0 Z 280.0"
    assert describe_place(checked, replace(worst, share=1.0, begins=1.0)) == "part.cls:102"
    assert first.text == f"leg tower_a would be {peak:,.1f} mm, limit {peak - 1.0:,.6f}".rstrip("0")


@pytest.mark.parametrize(("slack", "off"), [(1e-4, 0), (1e-5, 0), (-1e-4, 1), (-1e-5, 1)])
def test_a_limit_just_touched_is_told(slack, off):
    machine, poses, _ = delta_chord(high=slack)
    checked = check_path(posted_on(machine, poses))
    assert (checked.broken_motion_count, checked.broken_record_count) == (off, 0)
    if off:
        assert checked.first.excess == pytest.approx(-slack, rel=0.05)


def test_a_limit_touched_to_the_last_digit_counts_as_kept():
    machine, poses, _ = delta_chord(high=0.0)
    checked = check_path(posted_on(machine, poses))
    assert checked.broken_motion_count == 0
    assert checked.first is None


def test_a_path_along_a_limit_is_kept():
    machine = pk.load("orthoglide")
    edge = machine.inverse([0.0, 0.0, 0.0])[2]
    machine = ranged(machine, {"rho_z": (edge, 2.0 * edge)})
    x = np.linspace(0.0, 0.0, 200)
    z = np.linspace(0.0, 40.0, 200)
    poses = np.column_stack([x, x, z])
    assert check_path(posted_on(machine, np.concatenate([poses, poses[::-1]]))).first is None


def bulging(machine, kind):
    """Two poses, the first allowed, between which the least margin of a kind bulges most, and that margin's column."""
    rng = np.random.default_rng(4)
    half = np.array([150.0, 150.0, 100.0, 0.6, 0.6, 0.9])
    ends = machine.home + rng.uniform(-1.0, 1.0, (2, 10_000, 6)) * half
    columns = [i for i, name in enumerate(machine.limits) if kind in name]
    start, middle, end = (machine.margins(rows)[:, columns] for rows in (ends[0], ends.mean(0), ends[1]))
    bulge = np.minimum(start.min(1), end.min(1)) - middle.min(1)
    row = int(np.where(machine.check(ends[0]) == 0, bulge, 0.0).argmax())
    return ends[:, row], columns[int(middle[row].argmin())]


@pytest.mark.parametrize("kind", [".foot", ".platform", "clearance"])
def test_cones_and_clearances_are_passed_between_two_records(kind):
    machine = pk.load("hexapod")
    ends, column = bulging(machine, kind)
    sampled = Sampled(posted_on(machine, ends), 400)
    least, at_ends = sampled.least(0, column), float(min(sampled.margins[[0, -1], 0, column]))
    part = machine.limit_parts[column]
    assert at_ends - least > (1e-3 if part.unit == "rad" else 0.1)
    shift = 0.5 * (least + at_ends)  # the new bound: half way
    limits, home = machine.spec.limits, machine.spec.home
    if kind == "clearance":
        limits = replace(limits, clearance=limits.clearance + shift, cones=())  # which are about the rods at home
        home = dict(zip(machine.axes, ends[0].tolist(), strict=True))
    else:
        cones = [replace(c, angle=c.angle - shift) if f".{c.at}" == kind else c for c in limits.cones]
        limits = replace(limits, cones=tuple(cones))
    checked = check_path(posted_on(Machine(replace(machine.spec, limits=limits, home=home)), ends))
    found = {offence.limit: offence for offence in checked.offences}[part.name]
    assert found.excess == pytest.approx(shift - least, rel=1e-6)
    assert (found.record, found.count) == (1, 1)
    assert 0.0 < found.share < 1.0


def test_a_leg_that_cannot_close_between_two_records():
    # The platform's joint swings out on its arc, half way it is farthest from its shaft.
    machine = pk.load("lambda6")
    legs = tuple(replace(leg, short=1000.0) for leg in machine.spec.legs)  # so that the long rod is what does not reach
    wide = Machine(replace(machine.spec, legs=legs, limits=replace(machine.spec.limits, gaps=())))
    wide = ranged(wide, dict.fromkeys(machine.joints, (-9e3, 9e3)))
    ends = [pose(wide, X=75.0, C=160.0), pose(wide, X=75.0, C=200.0)]
    posted = posted_on(wide, ends)
    assert posted.broken_record_count == 0
    checked = check_path(posted)
    found = {offence.limit: offence for offence in checked.offences}["l1.reach"]
    assert found.share == pytest.approx(0.5, abs=1e-3)
    assert "can't close" in found.text
    assert found.value == pytest.approx(900.0 + 75.0 + 230.0, rel=1e-9)  # what its rod would have to be
    assert (checked.first.record, checked.broken_record_count, checked.broken_motion_count) == (1, 0, 1)


def test_records_out_of_reach_are_left_to_their_own_offence():
    machine = pk.load("linear_delta")
    poses = [[0.0, 0.0, 280.0], [40.0, 0.0, 280.0], [900.0, 0.0, 280.0], [40.0, 0.0, 280.0], [0.0, 0.0, 280.0]]
    posted = posted_on(machine, poses)
    checked = check_path(posted)
    assert np.isnan(posted.joints[2]).any()
    assert checked.broken_record_count == posted.broken_record_count == 1
    assert checked.broken_motion_count == 0
    assert checked.first.record == 2
    assert checked.first.limit in machine.limits
    # It begins where its leg can't close any more.
    sampled = np.linspace(0.0, 1.0, 20001)
    rows = np.array(poses[1]) + sampled[:, None] * (np.array(poses[2]) - np.array(poses[1]))
    lost = machine.margins(rows)[:, machine.limits.index(checked.first.limit)] < 0.0
    assert checked.first.begins == pytest.approx(sampled[int(np.argmax(lost))], abs=1e-4)


# Head and table.


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head", "orthoglide5_table"])
def test_turns_counted_over_the_seam(name):
    machine = pk.load(name)
    c = np.arange(0.0, 330.0, 10.0)
    poses = [pose(machine, B=20.0, C=angle) for angle in c]
    joint = list(machine.joints).index("c" if "c" in machine.joints else "theta1")
    turns = np.zeros(len(machine.joints))
    turns[joint] = -round(posted_on(machine, poses).joints[:, joint].mean() / TURN)
    posted = posted_on(machine, poses, turns=turns)
    values = posted.joints[:, joint]
    assert np.ptp(values) > math.radians(300.0)  # over ±180° somewhere
    assert check_path(posted).first is None
    # A range that ends within a motion, and one that holds all.
    name = machine.joints[joint]
    end = 0.5 * (values[20] + values[21])
    others = values.min(), values.max()
    ranges = (others[0] - 0.1, end) if values[-1] > values[0] else (end, others[1] + 0.1)
    checked = check_path(posted_on(ranged(machine, {name: ranges}), poses, turns=turns))
    assert checked.first.record == 21
    assert checked.first.begins == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("name", ["orthoglide5_head", "orthoglide5_table"])
def test_a_pole_is_crossed_without_a_swing(name):
    machine = pk.load(name)
    b = np.array([6.0, 4.0, 1.5, -2.0, -4.0])
    poses = [pose(machine, B=angle, C=40.0) for angle in b]
    posted = posted_on(machine, poses)
    assert np.ptp(posted.joints[:, -2:], axis=0).max() < math.radians(15.0)
    assert check_path(posted).first is None


def test_beside_a_pole_the_swing_is_followed():
    machine = pk.load("orthoglide5_head")
    poses = [pose(machine, B=5.0, C=0.0), pose(machine, B=1e-3, C=20.0), pose(machine, B=1e-3, C=140.0)]
    poses.append(pose(machine, B=5.0, C=160.0))
    assert check_path(posted_on(machine, poses)).first is None
    tight = ranged(machine, {"theta1": (math.radians(-10.0), math.radians(150.0))})
    first = check_path(posted_on(tight, poses)).first
    assert (first.record, first.limit) == (3, "theta1.max")
    assert first.begins == pytest.approx(0.5, abs=1e-6)


def test_upright_throughout():
    machine = pk.load("orthoglide5_head")
    rng = np.random.default_rng(2)
    poses = np.tile(machine.home, (300, 1))
    poses[:, :3] += rng.uniform(-30.0, 30.0, (300, 3))
    assert check_path(posted_on(machine, poses)).first is None
    poses[:, 3] = rng.uniform(0.0, 1.5e-6, 300)  # rounding in the file
    bisection = MotionBisection(posted_on(machine, poses))
    bisection.check_motions(lambda fraction: None)
    assert not bisection.broken_motions.any()
    assert bisection.prover.boxes < 3 * 300


@pytest.mark.parametrize("c", [0.0, 40.0, -115.0])
def test_three_axis_work_on_a_table_at_its_pole(c):
    table = ranged(pk.load("orthoglide5_table"), dict.fromkeys(("rho_x", "rho_y", "rho_z"), (150.0, 290.0)))
    rng = np.random.default_rng(8)
    ends = np.column_stack([rng.uniform(-90.0, 90.0, (200, 3)), np.zeros((200, 2))])
    joints = table.follow(np.vstack([pose(table, X=0.0, B=1e-3, C=c), ends]))[1:]
    posted = replace(posted_on(table, ends), joints=joints)
    posted = replace(posted, broken=np.atleast_1d(table.check(ends, joints)))
    checked = check_path(posted)
    share = np.linspace(0.0, 1.0, 501)[:, None, None]
    dense = (ends[:-1] + share * np.diff(ends, axis=0)).reshape(-1, 5)
    held = table.follow(np.vstack([pose(table, X=0.0, B=1e-3, C=c), dense]))[1:]
    margins = table.margins(dense, held).reshape(501, 199, -1)
    least, at_ends = margins.min(0), margins[[0, -1]].min(0)
    stray = ((at_ends >= 0.0) & (least < -1e-6)).any(1)
    unsure = ((at_ends >= 0.0) & (np.abs(least) <= 1e-3)).any(1)
    assert stray.any() and not stray.all()
    assert checked.broken_motions is not None and "untold" not in {offence.limit for offence in checked.offences}
    assert ((checked.broken_motions[1:] > 0) == stray)[~unsure & np.isfinite(margins).all((0, 2))].all()


def test_joints_that_are_whole_turns_off():
    machine = pk.load("orthoglide5_head")
    poses = [pose(machine, B=30.0, C=angle) for angle in (0.0, 20.0, 150.0, 160.0)]
    assert check_path(posted_on(machine, poses)).first is None
    turns = np.zeros((4, 5))
    turns[2:, 3] = -1.0
    checked = check_path(posted_on(machine, poses, turns=turns))
    assert [offence.limit for offence in checked.offences] == ["turns"]
    assert (checked.first.record, checked.broken_motion_count, checked.limits[-1]) == (2, 1, "turns")
    assert checked.limits[checked.broken_motions[2] - 1] == "turns"
    assert checked.first.value == pytest.approx(math.radians(130.0), abs=1e-9)
    text = "joint theta1 would turn by 130.0° from the record before, not by -230.0°"
    assert checked.first.text == text


def test_a_motion_of_whole_turns():
    machine = pk.load("orthoglide5_head")
    poses = [pose(machine, B=30.0, C=angle) for angle in (0.0, -360.0, -350.0)]
    back = np.zeros((3, 5))
    back[1:, 3] = -1.0
    assert check_path(posted_on(machine, poses, turns=back)).first is None
    first = check_path(posted_on(machine, poses)).first
    assert (first.limit, first.record) == ("turns", 1)
    assert first.value == pytest.approx(-TURN, abs=1e-9)


def test_records_that_change_the_working_mode_far_from_the_pole():
    # The tip at (300, 0, -1600): the tool stands along the central leg at B = 10.6°, C = 180°; a motion at B = 21°
    # from C = 95° to 265° goes round that pole, while following the records alone leads across it.
    machine = pk.load("tricept")
    ends = np.array([pose(machine, X=300.0, Z=-1600.0, B=21.0, C=c) for c in (95.0, 265.0)])
    checked = check_path(posted_on(machine, ends))
    assert [offence.limit for offence in checked.offences] == ["turns"]
    assert checked.broken_motion_count == 1
    assert "at once" in checked.first.text
    dense = posted_on(machine, ends[0] + np.linspace(0.0, 1.0, 400)[:, None] * (ends[1] - ends[0]))
    assert check_path(dense).first is None


# Singularities.


def test_a_parallel_singularity_is_found_where_the_rods_are_parallel():
    # Equal rods of l: along (l² - y²)^½, y and x, (l² - x²)^½; parallel on the circle x² + y² = l².
    machine = pk.load("hbg80_2d")
    wide = ranged(machine, dict.fromkeys(machine.joints, (-9e3, 9e3)))
    rod = 400.0
    posted = posted_on(wide, [[200.0, 200.0], [300.0, 300.0], [310.0, 300.0], [250.0, 200.0]])
    assert posted.broken_record_count == 0
    checked = check_path(posted)
    assert [offence.limit for offence in checked.offences] == ["singularity"]
    first = checked.first
    assert (first.record, first.count, checked.broken_motion_count) == (1, 2, 2)
    assert 200.0 + 100.0 * first.begins == pytest.approx(rod / math.sqrt(2.0), abs=0.05)
    assert first.text == "the machine would pass a parallel singularity"
    assert check_path(posted_on(wide, [[200.0, 200.0], [282.0, 282.0], [200.0, 200.0]])).first is None


def test_parallel_singularities_are_those_of_a_dense_sample():
    machine = pk.load("lambda6")  # singular about C = 0
    rng = np.random.default_rng(8)
    half = np.array([60.0, 60.0, 60.0, 0.2, 0.2, 0.5])
    poses = machine.home + rng.uniform(-1.0, 1.0, (80, 6)) * half - [0, 0, 0, 0, 0, 0.4]
    posted = posted_on(machine, poses)
    checked = check_path(posted)
    share = np.linspace(0.0, 1.0, 400)[:, None, None]
    margin = compute_singularity_margins(machine, poses[:-1] + share * np.diff(poses, axis=0))[:, :, 0]
    crossed = margin.min(0) * margin.max(0) < 0.0
    near = ~crossed & (np.abs(margin).min(0) < 1e-3)
    offence = {offence.limit: offence for offence in checked.offences}["singularity"]
    assert 5 < crossed.sum() < 60
    assert crossed.sum() <= offence.count <= crossed.sum() + near.sum()
    first = int(np.flatnonzero(crossed | near)[0])
    if crossed[first]:
        assert offence.record == first + 1
        place = float(share[int(np.argmax(margin[:, first] * margin[0, first] < 0.0)), 0, 0])
        assert offence.begins == pytest.approx(place, abs=5e-3)


# Cost and corner cases.


def dense_path(machine, count):
    u = np.linspace(0.0, 12.0, count)
    rows = np.tile(machine.home, (count, 1))
    for i, axis in enumerate(machine.axes):
        size = 20.0 if axis in "XYZ" else 0.05
        rows[:, i] += size * np.sin(u * (1.0 + 0.3 * i)) + (0.3 if axis == "B" else 0.0)
    return rows


@everyone
def test_a_dense_path_well_inside_is_proved_with_few_boxes(name):
    machine = pk.load(name)
    count = 20_000
    bisection = MotionBisection(posted_on(machine, dense_path(machine, count)))
    bisection.check_motions(lambda fraction: None)
    assert not bisection.broken_motions.any()
    assert bisection.prover.boxes < count / 30
    assert bisection.motions.computed_points < count / 30


def test_what_takes_too_long_is_told(monkeypatch):
    machine, poses = pk.load("linear_delta"), np.array([[-70.0, 130.0, 270.0], [80.0, 160.0, 280.0]])
    rows = poses[0] + np.linspace(0.0, 1.0, 10_001)[:, None] * (poses[1] - poses[0])
    machine = ranged(machine, {"tower_a": (700.0, machine.inverse(rows)[:, 0].max() + 1e-4)})
    assert check_path(posted_on(machine, poses)).first is None
    monkeypatch.setattr("parakin.toolpath.checking.motion_bisection.MOST_CUTS", 0)
    checked = check_path(posted_on(machine, poses))
    assert [offence.limit for offence in checked.offences] == ["untold"]
    assert checked.first.text == "whether this motion keeps all limits can't be told"
    assert (checked.first.record, checked.broken_motion_count) == (1, 1)


@pytest.mark.parametrize("count", [0, 1])
def test_paths_without_motions(count):
    machine = pk.load("tricept")
    said = []
    checked = check_path(posted_on(machine, np.tile(machine.home, (count, 1))), said.append)
    assert checked.checked and checked.first is None and checked.offences == ()
    assert len(checked.broken_motions) == count
    assert said[-1] == 1.0


def test_a_single_record_off_limits_keeps_its_offence():
    machine = pk.load("linear_delta")
    posted = posted_on(machine, [[0.0, 0.0, 700.0]])
    checked = check_path(posted)
    assert checked.first.text == posted.first.text
    assert describe_place(checked, checked.first) == "part.cls:101"
    assert check_path(checked) is checked


def test_progress_and_records_that_repeat():
    machine = pk.load("orthoglide5_table")
    poses = np.repeat(dense_path(machine, 500), 2, axis=0)
    said = []
    assert check_path(posted_on(machine, poses), said.append).first is None
    assert said == sorted(said) and said[-1] == 1.0
