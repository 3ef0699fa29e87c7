"""The whole path: what motions break between their records, against dense samples and closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from motion_sampling import SEEN, Sampled, dense_path, drawn, everyone, pose, posted_on, ranged
from shipped import load_shipped

from parakin.machine import Machine
from parakin.toolpath.checking.check import check_path
from parakin.toolpath.checking.motion_bisection import MotionBisection
from parakin.toolpath.posting.offence_texts import describe_place

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
    for limit, part in enumerate(machine.limit_definitions):
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
    of_turning_legs = [limit.unit == "rad" and limit.subject.startswith("leg ") for limit in machine.limit_definitions]
    turning = wrist_limits | np.array(of_turning_legs)  # where these can't be followed they go round either way
    margins[:, ~sampled.followed] = np.where(turning, np.inf, margins[:, ~sampled.followed])
    records = machine.margins(poses, posted.joints, posted.mode)
    looked = 0
    for offence in checked.offences:
        if offence.limit not in columns or machine.limit_definitions[columns[offence.limit]].side == "reach":
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
    machine = load_shipped("linear_delta")
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
    machine = load_shipped("orthoglide")
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
    machine = load_shipped("hexapod")
    ends, column = bulging(machine, kind)
    sampled = Sampled(posted_on(machine, ends), 400)
    least, at_ends = sampled.least(0, column), float(min(sampled.margins[[0, -1], 0, column]))
    part = machine.limit_definitions[column]
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
    machine = load_shipped("lambda6")
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
    machine = load_shipped("linear_delta")
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


# Cost and corner cases.


@everyone
def test_a_dense_path_well_inside_is_proved_with_few_boxes(name):
    machine = load_shipped(name)
    count = 20_000
    bisection = MotionBisection(posted_on(machine, dense_path(machine, count)))
    bisection.check_motions(lambda fraction: None)
    assert not bisection.broken_motions.any()
    assert bisection.prover.boxes < count / 30
    assert bisection.motions.computed_points < count / 30


def test_what_takes_too_long_is_told(monkeypatch):
    machine, poses = load_shipped("linear_delta"), np.array([[-70.0, 130.0, 270.0], [80.0, 160.0, 280.0]])
    rows = poses[0] + np.linspace(0.0, 1.0, 10_001)[:, None] * (poses[1] - poses[0])
    machine = ranged(machine, {"tower_a": (700.0, machine.inverse(rows)[:, 0].max() + 1e-4)})
    assert check_path(posted_on(machine, poses)).first is None
    monkeypatch.setattr("parakin.toolpath.checking.motion_bisection.MOST_CUTS", 0)
    checked = check_path(posted_on(machine, poses))
    assert [offence.limit for offence in checked.offences] == ["untold"]
    longest = machine.inverse(poses)[:, 0].max()
    text = f"whether this motion keeps all limits can't be told: leg tower_a is {longest:,.2f} mm, limit "
    assert checked.first.text.startswith(text)
    assert (checked.first.record, checked.broken_motion_count) == (1, 1)


@pytest.mark.parametrize("count", [0, 1])
def test_paths_without_motions(count):
    machine = load_shipped("tricept")
    said = []
    checked = check_path(posted_on(machine, np.tile(machine.home, (count, 1))), said.append)
    assert checked.checked and checked.first is None and checked.offences == ()
    assert len(checked.broken_motions) == count
    assert said[-1] == 1.0


def test_a_single_record_off_limits_keeps_its_offence():
    machine = load_shipped("linear_delta")
    posted = posted_on(machine, [[0.0, 0.0, 700.0]])
    checked = check_path(posted)
    assert checked.first.text == posted.first.text
    assert describe_place(checked, checked.first) == "part.cls:101"
    assert check_path(checked) is checked


def test_progress_and_records_that_repeat():
    machine = load_shipped("orthoglide5_table")
    poses = np.repeat(dense_path(machine, 500), 2, axis=0)
    said = []
    assert check_path(posted_on(machine, poses), said.append).first is None
    assert said == sorted(said) and said[-1] == 1.0
