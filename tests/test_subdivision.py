"""The work on cells: slices, machines drawn at random, neighbours, extents, and what stops it."""

from __future__ import annotations

import time
from dataclasses import replace
from math import inf, nan, sqrt

import numpy as np
import pytest
from drawn import FAMILIES, draw, machine_of
from regions import whole_region
from test_workspace import INSIDE, OUTSIDE, SHIPPED, Raster, known, turns_of

import parakin as pk
from parakin import algebra as alg
from parakin.budget import CLOCK
from parakin.errors import PoseError
from parakin.kernels.intervals import IntervalProgram
from parakin.machine import Machine
from parakin.workspaces.certified import subdivision as subdivide
from parakin.workspaces.certified.constraints import Constraint
from parakin.workspaces.certified.total import TotalSubdivision
from parakin.workspaces.certified.workspace import Volume


@pytest.mark.parametrize("name", SHIPPED)
def test_planes_and_lines_through_home(name):
    """Held axes fold what hangs on them alone: also where it is 0, or nothing is left to vary but one axis."""
    m = SHIPPED[name]
    rng = np.random.default_rng(64)
    home = dict(zip(m.axes, m.home.tolist(), strict=True))
    lengths = [axis for axis in m.axes if axis in "XYZ"]
    for free in (lengths[:1], lengths[-1:], lengths[:2]):
        at = {axis: home[axis] + offset for axis in lengths if axis not in free for offset in [rng.choice([0.0, 13.0])]}
        found = pk.workspace(whole_region(m, at=at), gap=0.01)
        assert found.axes == tuple(free)
        assert found.stopped == "gap"
        assert found.volume.inner > 0.0
        assert found.unit == ("mm", "mm²")[len(free) - 1]
        cells = found.cells
        low, high = found.box
        places = rng.uniform(low - 5.0, high + 5.0, (4000, len(free)))
        holds = ((places[:, None] >= cells.low) & (places[:, None] <= cells.low + cells.size)).all(2)
        inside, known = (holds & cells.inside).any(1), (holds & cells.inside).any(1) | ~holds.any(1)
        allowed = m.check(found.region.poses(places)) == 0
        assert np.array_equal(allowed[known], inside[known])
        area = allowed.mean() * np.prod(high - low + 10.0)
        off = 5.0 * np.sqrt(allowed.mean() / 4000) * np.prod(high - low + 10.0)
        assert found.volume.inner - off <= area <= found.volume.outer + off


def limited(m, width, rng):
    """A machine whose drives move about home only."""
    home = dict(zip(m.joints, m.inverse(m.home), strict=True))

    def near(drive):
        wide = width * (0.003 if drive.unit == "rad" else 1.0)
        low, high = home[drive.name] - wide * rng.uniform(0.3, 1.0), home[drive.name] + wide
        return replace(drive, low=max(drive.low, low), high=min(drive.high, high))

    legs = tuple(replace(leg, drives=tuple(near(drive) for drive in leg.drives)) for leg in m.spec.legs)
    return Machine(replace(m.spec, legs=legs))


UNBOUNDED = ("led", "led tripod")  # a passive central leg turns every way: the struts' ranges are not proved to hold it


@pytest.mark.parametrize("family", UNBOUNDED)
def test_what_is_not_proved_to_be_bounded_is_said(family, tmp_path):
    m = limited(machine_of(draw(family, 3)[0], tmp_path), 90.0, np.random.default_rng(3))
    with pytest.raises(pk.PoseError, match="not proved to bound the workspace"):
        pk.workspace(whole_region(m), gap=0.05, seconds=1.0)


@pytest.mark.parametrize("family", sorted(set(FAMILIES) - set(UNBOUNDED)))
def test_drawn_machines_of_every_structure(family, tmp_path):
    seed = 3
    rng = np.random.default_rng(seed)
    m = limited(machine_of(draw(family, seed)[0], tmp_path), 90.0, rng)
    home = dict(zip(m.axes, m.home.tolist(), strict=True))
    turning = [axis for axis, unit in zip(m.axes, m.axis_units, strict=True) if unit == "rad"]
    span = {axis: (home[axis] - 0.02, home[axis] + 0.05) for axis in turning}
    slow = {"at": {"X": home["X"]}} if len(turning) > 1 else {}
    for kind in ("constant", "every", "some")[: 3 if turning else 1]:
        found = pk.workspace(
            whole_region(m, **{} if kind == "constant" else {kind: span} | slow), gap=0.05, seconds=0.2
        )
        if kind != "every":
            place = np.array([home[axis] for axis in found.axes])
            low, high = found.box
            assert (low <= place).all()
            assert (place <= high).all()
        if found.empty or found.cells.inside.all():
            continue
        raster = Raster(found.cells, 64)
        places = raster.places(rng, 60_000)
        state, turns = raster.states(places), turns_of(found.region, rng, 60_000) if kind != "constant" else None
        allowed = m.check(found.region.poses(places, turns)) == 0
        assert kind == "some" or allowed[state == INSIDE].all()
        assert kind == "every" or not allowed[state == OUTSIDE].any()


@pytest.mark.parametrize("what", ["tricept", "central", "other central", "rolling", "carried"])
def test_what_limits_imply_holds_wherever_they_do(what, tmp_path):
    """Constraints that only help to exclude are broken nowhere that is allowed, and far away they all are."""
    seen = far = 0
    for seed in range(1 if what in SHIPPED else 6):
        rng = np.random.default_rng(seed)
        m = SHIPPED.get(what) or limited(machine_of(draw(what, seed)[0], tmp_path), 200.0, rng)
        home = dict(zip(m.axes, m.home.tolist(), strict=True))
        span = {"B": (home["B"] - 0.3, home["B"] + 0.3), "C": (home["C"] - 3.0, home["C"] + 3.0)}
        asked = whole_region(m, some=span)
        places = m.home[:3] + rng.normal(size=(40_000, 3)) * 10.0 ** rng.uniform(1.0, 3.0, (40_000, 1))
        turns = turns_of(asked, rng, len(places))
        allowed = m.check(asked.poses(places, turns)) == 0
        for constraint in asked.constraints:
            if constraint.implied:
                rows = np.hstack([places, turns])
                assert (constraint.point_program(rows, rows)[1][allowed, 0] >= 0.0).all()
                seen += int(allowed.sum())
                rows[:, :3] *= 1e5 / np.linalg.norm(rows[:, :3], axis=1, keepdims=True)
                far += (constraint.point_program(rows, rows)[1][:, 0] < 0.0).all()
    assert seen > 1000
    assert far or what == "carried"  # of whose machines not all have a table


# How the work is done.


def test_cells_lie_side_by_side_to_the_last_digit():
    """No sliver between neighbours, no overlap: the corners of all parts are exact."""
    found = pk.workspace(whole_region(SHIPPED["orthoglide"]), gap=0.05)
    cells = found.cells
    unit = 2.0**-40
    for corner in (cells.low, cells.size):
        assert np.array_equal(np.round(corner / unit) * unit, corner)
    assert np.array_equal((cells.low + cells.size) - cells.low, cells.size)
    for low, high in ((0.1, 0.7), (-1e6, 1e6), (1234.5678, 1234.5679), (-1e-7, 333.3)):
        work = subdivide_all(np.full(2, low), np.full(2, high), 4)
        corners = [np.unique(np.concatenate([work.low[:, k], (work.low + work.size)[:, k]])) for k in (0, 1)]
        for k in (0, 1):
            assert corners[k][0] <= low
            assert corners[k][-1] >= high
            assert len(corners[k]) == 8 * 2**4 + 1  # a sliver would have two
            assert corners[k][-1] - corners[k][0] <= (high - low) * (1 + 1e-6) + 1e-6 * abs(high)


def subdivide_all(low, high, times):
    """Cells of a box under a constraint that nothing is known of, all halved so often."""
    x, y = alg.Trace().inputs(2)
    work = TotalSubdivision([Constraint("vague", nan, [x, y])], low, high, (np.zeros(0), np.zeros(0)))
    for _ in range(times):
        work.refine(np.arange(len(work.open_cells.low)))
    return work.collect_cells("gap")


def test_the_extent_holds_the_region_and_little_more():
    for name, m in SHIPPED.items():
        low, high = whole_region(m).extent
        box = pk.workspace(whole_region(m), gap=0.02).box
        assert (low <= box[0]).all(), name
        assert (box[1] <= high).all(), name
        assert (high - low < 2.0 * (box[1] - box[0])).all(), name
    low, high = whole_region(
        SHIPPED["tricept"], without=["r?.*"]
    ).extent  # nothing is known on the axis of the first turn
    assert (high - low < 10_000.0).all()


def assert_true_of(found, m):
    """Its cells don't overlap, and places of them are what they say."""
    rng = np.random.default_rng(65)
    cells = found.cells
    places = cells.low[:, None] + cells.size[:, None] * rng.random((len(cells.low), 40, cells.low.shape[1]))
    allowed = m.check(found.region.poses(places.reshape(-1, cells.low.shape[1]))).reshape(len(cells.low), -1) == 0
    assert allowed[cells.inside].all()
    order = rng.permutation(len(cells.low))[:400]
    middle = (cells.low + 0.5 * cells.size)[order]
    assert (((middle[:, None] > cells.low) & (middle[:, None] < cells.low + cells.size)).all(2).sum(1) == 1).all()
    assert 0.0 <= found.volume.inner <= found.volume.estimate <= found.volume.outer


def test_the_work_stops_in_time_with_what_it_has():
    m = SHIPPED["hexapod"]
    exact = pk.workspace(whole_region(m), gap=0.01).volume
    found = pk.workspace(whole_region(m), gap=1e-5, seconds=0.001)
    assert found.stopped == "time"
    assert_true_of(found, m)
    assert found.volume.inner <= exact.outer
    assert found.volume.outer >= exact.inner
    spans = dict.fromkeys("ABC", (-0.1, 0.1))
    for kind, most in (("every", 3.0), ("some", 6.0)):
        start = time.process_time() - CLOCK.compiling  # whatever else runs on the computer
        found = pk.workspace(whole_region(m, **{kind: spans}), gap=1e-4, seconds=1.0)
        assert found.stopped == "time"
        assert time.process_time() - CLOCK.compiling - start < most


def test_what_is_interrupted_keeps_what_it_has():
    m = SHIPPED["orthoglide"]
    exact = pk.workspace(whole_region(m), gap=0.005).volume
    for after in range(4):
        left = [after]

        def stop(done, left=left):
            assert 0.0 <= done <= 1.0
            left[0] -= 1
            if left[0] < 0:
                raise KeyboardInterrupt

        found = pk.workspace(whole_region(m), gap=0.001, progress=stop)
        assert found.stopped == "interrupted"
        assert_true_of(found, m)
        assert found.volume.inner <= exact.outer
        assert found.volume.outer >= exact.inner


def test_an_interrupt_in_the_middle_of_a_round_counts_no_cell_twice(monkeypatch):
    m = SHIPPED["orthoglide"]
    exact = pk.workspace(whole_region(m), gap=0.005).volume
    plain, volumes, left = IntervalProgram.__call__, set(), [0]

    def stop(self, low, high):
        left[0] -= 1
        if left[0] == 0:
            raise KeyboardInterrupt
        return plain(self, low, high)

    monkeypatch.setattr(IntervalProgram, "__call__", stop)
    monkeypatch.setattr(subdivide, "AT_ONCE", 100)
    asked = whole_region(m)
    asked.extent  # noqa: B018  not to be interrupted
    for after in (60, 150, 300, 700, 1100):
        left[0] = after
        found = pk.workspace(asked, gap=1e-4)
        assert left[0] <= 0
        assert found.stopped == "interrupted"
        assert_true_of(found, m)
        assert found.volume.inner <= exact.outer
        assert found.volume.outer >= exact.inner
        volumes.add(found.volume)
    assert len(volumes) > 1
    left[0] = 100_000
    whole = pk.workspace(whole_region(m), gap=0.02)
    left[0] = 100_000 - left[0] - 3  # when the answer is there, and only the box about it is made closer
    found = pk.workspace(whole_region(m), gap=0.02)
    assert left[0] <= 0
    assert found.stopped == "gap"
    assert found.volume.gap <= 0.02
    assert found.volume.outer >= whole.volume.inner
    assert_true_of(found, m)


def test_a_gap_out_of_reach_ends_at_the_numbers_resolution():
    found = pk.workspace(whole_region(known("balls"), at={"Y": 50.0, "Z": -90.0}), gap=1e-15, seconds=None)
    assert found.stopped == "resolution"
    exact = sqrt(400**2 - 10600) + sqrt(350**2 - 10600) - 300
    assert found.volume.inner <= exact <= found.volume.outer
    assert found.volume.gap < 1e-7


# Questions with no answer, or an empty one.


def test_regions_proved_empty():
    for name, question in (
        ("lambda6", {"dexterous": True}),
        ("hexapod", {"dexterous": True}),
        ("hexapod", {"at": {"Z": 5000.0}}),
        ("hexapod", {"at": {"Z": 9e5}}),
        ("orthoglide", {"at": {"X": 400.0}}),
        ("orthoglide", {"at": {"X": 400.0, "Y": -400.0}}),
        ("tricept", {"at": {"X": 0.0, "Y": 0.0, "B": 3.0}}),
        ("orthoglide5_head", {"at": {"B": 2.0}}),
        ("orthoglide5_head", {"every": {"B": (0.0, 2.0)}}),
    ):
        m = SHIPPED[name]
        found = pk.workspace(whole_region(m, **question), seconds=20.0)
        assert found.empty, (name, question)
        assert found.stopped == "gap"
        assert found.volume == Volume(0.0, 0.0, 0.0)
        assert found.volume.gap == 0.0
        assert found.box is None
        assert found.centroid is None
        assert found.bounded_by == ()
        assert whole_region(m, **question).extent is None


def test_what_nothing_bounds_is_refused():
    m = known("balls")
    legs = tuple(replace(leg, drives=tuple(replace(d, low=-inf, high=inf) for d in leg.drives)) for leg in m.spec.legs)
    free = Machine(replace(m.spec, legs=legs))
    assert not free.limits
    for question in ({}, {"at": {"X": 3.0}}, {"at": {"X": 3.0, "Y": 1.0}}):
        with pytest.raises(PoseError, match=r"do not bound the workspace in [XYZ]"):
            pk.workspace(whole_region(free, **question))
    with pytest.raises(PoseError, match="do not bound the workspace in"):
        pk.workspace(whole_region(m, without=["*"]))
    with pytest.raises(PoseError, match="not proved to bound the workspace in Z"):
        pk.workspace(whole_region(SHIPPED["linear_delta"], without=["*"]))
    with pytest.raises(PoseError, match="do not bound the workspace in Z"):
        pk.workspace(whole_region(SHIPPED["linear_delta"], at={"X": 0.0, "Y": 0.0}, without=["tower*"]))


def test_legs_must_reach_whatever_is_switched_off():
    with pytest.raises(PoseError, match="can't be switched off"):
        pk.workspace(whole_region(SHIPPED["lambda6"], without=["l1.reach"]))
    found = pk.workspace(whole_region(SHIPPED["hbg80_2d"], without=["*"]), gap=0.02)
    assert set(found.region.limits) == {"Xhbg.reach", "Yhbg.reach"}
    assert found.volume.inner <= 4 * 400.0**2 <= found.volume.outer  # the common square of two strips
