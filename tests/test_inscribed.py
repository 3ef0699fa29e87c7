"""Boxes inside a workspace: proofs of whole boxes, and the largest ones against closed forms and fine grids."""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
import pytest
from regions import whole_region
from shipped import load_shipped

import parakin as pk
from parakin.workspaces.certified.containment import MOST, prove_boxes
from parakin.workspaces.inscribed.largest_box import find_largest_box
from parakin.workspaces.inscribed.mask_boxes import find_blocks, find_largest_boxes

# A disc (a ball) of 100 mm about the first foot: the other legs reach anywhere.
DISC = """
name: disc
title: A disc
source: Made for a test.
motion: tx ty
legs:
  - {kind: length, joints: [d1], foot: [0, 0, 0], platform: [0, 0, 0], range: [LEAST mm, 100 mm]}
  - {kind: length, joints: [d2], foot: [0, -900 mm, 0], platform: [0, 0, 0], range: [1 mm, 9000 mm]}
home: {X: 60 mm, Y: 0 mm}
"""
BALL = """
name: ball
title: A ball
source: Made for a test.
motion: tx ty tz
legs:
  - {kind: length, joints: [d1], foot: [0, 0, 0], platform: [0, 0, 0], range: [0 mm, 100 mm]}
  - {kind: length, joints: [d2], foot: [0, -900 mm, 0], platform: [0, 0, 0], range: [1 mm, 9000 mm]}
  - {kind: length, joints: [d3], foot: [-900 mm, 0, 0], platform: [0, 0, 0], range: [1 mm, 9000 mm]}
home: {X: 10 mm, Y: 0 mm, Z: 0 mm}
"""


@dataclass(frozen=True)
class Verdict:
    """What is proved of one box: it is inside, or ``limit`` is broken at ``pose``, or neither."""

    proved: bool
    pose: tuple[float, ...] | None = None
    limit: str | None = None

    def __bool__(self):
        return self.proved

    @property
    def undecided(self):
        return not self.proved and self.limit is None


def prove_box(region, low, high, most=MOST):
    """One box alone; of an inclusive region a limit is broken where every orientation is proved to break one."""
    bottom, top = np.atleast_2d(np.asarray(low, float), np.asarray(high, float))
    found = prove_boxes(region, bottom, top, most=most)
    if found.proved.all() or found.limit[0] < 0:
        return Verdict(bool(found.proved.all()))
    half = max(1e-6 * float((top - bottom).max()), 1e-9 * float(np.abs(found.positions[0]).max()), 1e-9)
    if not region.every_orientation and not proved_empty(region, found.positions[0], half):
        return Verdict(False)
    pose = region.poses(found.positions, found.orientations)[0]
    return Verdict(False, tuple(pose.tolist()), found.names[int(found.limit[0])])


def proved_empty(region, position, half):
    """Whether no orientation is allowed anywhere about a position."""
    work = region.subdivide(position - half, position + half)
    for _ in range(4):
        if not len(work.open_cells.low) or any(len(part.low) for part in work.decided_cells):
            break
        work.refine(np.arange(len(work.open_cells.low)))
    return not len(work.collect_cells("cell").low)


def machine(tmp_path, text):
    path = tmp_path / "machine.yaml"
    path.write_text(text, encoding="utf-8")
    return pk.load(path)


@pytest.fixture
def disc(tmp_path):
    return whole_region(machine(tmp_path, DISC.replace("LEAST", "0")))


@pytest.fixture
def ball(tmp_path):
    return whole_region(machine(tmp_path, BALL))


def home_of(asked):
    m = asked.machine
    return np.array([m.home[m.axes.index(axis)] for axis in asked.free_axes])


def turns_of(asked, count, rng):
    low, high = (np.array([span[i] for span in asked.swept_axes.values()], float) for i in (0, 1))
    return rng.uniform(low, high, (count, len(low)))


def broken_in(asked, low, high, rng, count=40_000):
    """Poses of a box that are not allowed, from random ones, many of them on its faces."""
    d = len(low)
    u = rng.uniform(size=(count, d))
    u[np.arange(count // 2), rng.integers(0, d, count // 2)] = rng.integers(0, 2, count // 2)
    u[: count // 8] = np.rint(u[: count // 8])
    poses = asked.poses(low + u * (high - low), turns_of(asked, count, rng))
    return poses[asked.machine.check(poses) != 0]


ASKED = {
    "orthoglide": {},
    "hbg80_2d": {},
    "tricept": {"at": {"B": 0.0, "C": 0.0}},
    "hexapod": {"every": {"A": (-0.1, 0.1), "B": (-0.1, 0.1)}},
    "lambda6": {},
}


@pytest.mark.parametrize("name", ASKED)
def test_what_is_proved_holds_and_what_is_broken_is(name):
    m, rng = load_shipped(name), np.random.default_rng(4)
    asked = whole_region(m, **ASKED[name])
    d, home = len(asked.free_axes), home_of(asked)
    size = 0.8 * (np.subtract(*asked.extent[::-1]).clip(0, 2000))
    low = home - rng.uniform(0, 0.5, (150, d)) * size * rng.uniform(0, 1, (150, 1))
    high = home + rng.uniform(0, 0.5, (150, d)) * size * rng.uniform(0, 1, (150, 1))
    found = prove_boxes(asked, low, high)
    assert 5 < found.proved.sum() < 145
    for i in range(150):
        bad = broken_in(asked, low[i], high[i], rng, 1500)
        assert not (found.proved[i] and len(bad))
        if len(bad):
            assert found.limit[i] >= 0
    told = found.limit >= 0
    assert not (told & found.proved).any()
    assert ((found.positions >= low) & (found.positions <= high))[told].all()
    broken = m.check(asked.poses(found.positions[told], found.orientations[told]))
    assert (broken > 0).all()
    margins = m.margins(asked.poses(found.positions[told], found.orientations[told]))
    column = [m.limits.index(found.names[k]) for k in found.limit[told]]
    assert (margins[np.arange(len(column)), column] < 0.0).all()


def test_one_turn_is_enough_of_an_inclusive_region():
    m, rng = load_shipped("hexapod"), np.random.default_rng(5)
    asked = whole_region(m, some={"A": (-0.3, 0.3)})
    half = np.array([270.0, 230.0, 160.0])
    home = home_of(asked)
    assert not prove_box(whole_region(m), home - half, home + half)
    assert prove_box(asked, home - half, home + half)
    places = rng.uniform(home - half, home + half, (4000, 3))
    allowed = np.zeros(len(places), bool)
    for turn in np.linspace(-0.3, 0.3, 61):
        allowed |= m.check(asked.poses(places, np.full((len(places), 1), turn))) == 0
    assert allowed.all()
    verdict = prove_box(asked, home - 4 * half, home + 4 * half)
    assert not verdict.proved
    assert verdict.limit in m.limits
    place = np.array([verdict.pose[:3]])
    for turn in np.linspace(-0.3, 0.3, 61):
        assert m.check(asked.poses(place, np.array([[turn]])))[0] != 0


def test_proofs_go_up_to_the_limit(disc):
    side = 100.0 / sqrt(2.0)
    assert prove_box(disc, [-side + 1e-6] * 2, [side - 1e-6] * 2)
    verdict = prove_box(disc, [-side] * 2, [side, side + 1e-6])
    assert (verdict.proved, verdict.limit) == (False, "d1.max")
    assert np.hypot(*verdict.pose) > 100.0
    assert verdict.pose[1] > side
    assert prove_box(disc, [3.0, 4.0], [3.0, 4.0])
    cut = prove_box(disc, [-side + 1e-6] * 2, [side - 1e-6] * 2, most=2)
    assert cut.undecided
    assert not cut


def test_the_largest_square_and_rectangle_in_a_disc(disc):
    for kind in ({}, {"shape": (1.0, 1.0)}, {"around": (0.0, 0.0)}, {"around": (0.0, 0.0), "shape": (2.0, 2.0)}):
        box = find_largest_box(disc, **kind, tolerance=0.01)
        assert box.proved
        assert 2e4 * (1 - 1e-4) < box.volume <= 2e4
        assert np.abs(box.edges - 100.0 * sqrt(2.0)).max() < 1.0
        assert {stop.limit for stop in box.stops} == {"d1.max"}
    box = find_largest_box(disc, shape=(3.0, 1.0), tolerance=0.01)
    assert np.abs(box.edges - 200.0 / sqrt(10.0) * np.array([3.0, 1.0])).max() < 0.05


def test_a_box_about_a_place_off_the_middle(disc):
    """Of |x| + a ≤ 100 and so on the corner away from the disc's middle decides: (p + a)² + b² = 100²."""
    box = find_largest_box(disc, around=(50.0, 0.0), tolerance=0.001)
    a = np.linspace(1.0, 49.0, 200_001)
    area = 4.0 * a * np.sqrt(100.0**2 - (50.0 + a) ** 2)
    assert box.centre == pytest.approx([50.0, 0.0], abs=1e-9)
    assert box.volume == pytest.approx(area.max(), rel=1e-4)
    assert box.volume < area.max() * (1 + 1e-9)
    free = {stop.face: stop.limit for stop in box.stops}
    assert free["-X"] is None
    assert free["+Y"] == free["-Y"] == "d1.max"


def test_the_largest_box_in_a_ball(ball):
    for kind in ({}, {"shape": (1.0, 1.0, 1.0)}):
        box = find_largest_box(ball, **kind, tolerance=0.01)
        assert 8e6 / (3 * sqrt(3)) * (1 - 2e-4) < box.volume <= 8e6 / (3 * sqrt(3))


def test_a_hole_is_touched_in_the_middle_of_a_face(tmp_path):
    """In a ring from 50 to 100 mm a rectangle touches the hole with the middle of a side."""
    ring = whole_region(machine(tmp_path, DISC.replace("LEAST", "50")))
    half = np.linspace(0.0, 86.0, 200_001)
    best = (2.0 * half * (np.sqrt(100.0**2 - half**2) - 50.0)).max()
    box = find_largest_box(ring, tolerance=0.01)
    assert best * (1 - 1e-3) < box.volume <= best
    assert sorted(stop.limit for stop in box.stops) == ["d1.max", "d1.max", "d1.max", "d1.min"]


@pytest.mark.parametrize("name", ["orthoglide", "hbg80_2d", "tricept", "hexapod"])
def test_no_face_can_move_and_no_place_is_outside(name):
    rng = np.random.default_rng(6)
    asked = whole_region(load_shipped(name), **ASKED[name])
    box = find_largest_box(asked)
    assert not len(broken_in(asked, box.low, box.high, rng, 200_000))
    for axis in range(len(box.low)):
        for end in (0, 1):
            low, high = box.low.copy(), box.high.copy()
            (high if end else low)[axis] += (2 * end - 1) * 0.01 * box.edges.min()
            stop = box.stops[2 * axis + end]
            assert stop.face == "-+"[end] + asked.free_axes[axis]
            verdict = prove_box(asked, low, high)
            assert verdict.limit is not None
            assert asked.machine.check(np.array(verdict.pose)) != 0
            assert asked.machine.check(np.array(stop.pose)) != 0
            assert asked.machine.margins(np.array(stop.pose))[asked.machine.limits.index(stop.limit)] < 0.0


def test_the_cube_that_the_orthoglide_was_designed_for_is_its_largest():
    asked = whole_region(load_shipped("orthoglide"))
    box = find_largest_box(asked, shape=(1, 1, 1), tolerance=1e-3)
    assert box.edges.min() > 200.0 - 2e-3
    assert box.edges.max() <= 200.0 + 1e-9
    strokes = 200.0 / (1 / sqrt(11) + 2 / sqrt(17))  # its corners, from the machine file's own derivation
    assert np.abs(box.low + 2 * strokes / sqrt(17)).max() < 0.01
    assert np.abs(box.high - strokes / sqrt(11)).max() < 0.01
    exact = np.full(3, 1e-7)
    assert prove_box(asked, exact - 2 * strokes / sqrt(17), strokes / sqrt(11) - exact)


@pytest.mark.parametrize("name", ASKED)
def test_what_is_given_is_what_was_proved(name):
    asked = whole_region(load_shipped(name), **ASKED[name])
    d = len(asked.free_axes)
    home = home_of(asked) + 20.0
    for kind in ({"shape": (3.0, 1.0, 2.0)[:d]}, {"around": home}, {"around": home, "shape": (1.0, 2.0, 1.5)[:d]}):
        box = find_largest_box(asked, **kind)
        assert prove_box(asked, box.low, box.high)
        assert box.volume == pytest.approx(np.prod(box.high - box.low))
        if "around" in kind:
            assert np.abs(box.centre - home).max() < 1e-9
        if "shape" in kind:
            assert box.edges / kind["shape"] == pytest.approx(np.full(d, box.edges[0] / kind["shape"][0]))
            grown = 0.5 * (box.edges + 4.0 * box.tolerance)
            assert not prove_box(asked, box.centre - grown, box.centre + grown)


def rectangle_by_histogram(mask):
    """The greatest number of cells of a rectangle in a mask, row by row with a stack."""
    best, height = 0, np.zeros(mask.shape[1], int)
    for row in mask:
        height = np.where(row, height + 1, 0)
        stack: list[tuple[int, int]] = []
        for i, h in enumerate([*height.tolist(), 0]):
            start = i
            while stack and stack[-1][1] >= h:
                start, tall = stack.pop()
                best = max(best, tall * (i - start))
            stack.append((start, h))
    return best


@pytest.mark.parametrize("name", ["hbg80_2d", "linear_delta"])
def test_it_is_as_large_as_the_largest_of_a_fine_grid(name):
    asked = whole_region(load_shipped(name), **ASKED.get(name, {}))
    box = find_largest_box(asked)
    low, high = asked.extent
    n = 400 if len(low) == 2 else 40
    ticks = [np.linspace(a, b, n) for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*ticks, indexing="ij"), -1).reshape(-1, len(low))
    mask = (asked.machine.check(asked.poses(places)) == 0).reshape((n,) * len(low))
    step = float(np.prod((high - low) / (n - 1)))
    if len(low) == 2:
        assert rectangle_by_histogram(mask) * step == pytest.approx(box.volume, rel=0.02)
        return
    best = 0
    for first in range(n):
        layer = np.ones((n, n), bool)
        for last in range(first, n):
            layer &= mask[:, :, last]
            if layer.sum() * (last - first + 1) > best:
                best = max(best, rectangle_by_histogram(layer) * (last - first + 1))
    # Of nodes, not cells: up to a step more along each edge.
    assert best * step < box.volume * np.prod(1 + (high - low) / (n - 1) / box.edges)
    assert best * step > 0.7 * box.volume


def test_boxes_of_a_mask():
    rng = np.random.default_rng(7)
    for shape in ((6, 5, 4), (9, 7, 1), (64, 3, 2)):
        mask = rng.random(shape) < 0.85
        found = find_largest_boxes(mask, 3)
        best = 0
        for k in range(shape[2]):
            layer = np.ones(shape[:2], bool)
            for last in range(k, shape[2]):
                layer &= mask[:, :, last]
                best = max(best, rectangle_by_histogram(layer) * (last - k + 1))
        assert (found[0, 1] - found[0, 0]).prod() == best
        for low, high in found:
            assert mask[tuple(slice(a, b) for a, b in zip(low, high, strict=True))].all()
    assert not len(find_largest_boxes(np.zeros((5, 5, 5), bool), 3))
    block = np.zeros((8, 8), bool)
    block[2:6, 3:5] = True
    assert find_blocks(block, np.array([4, 2]), 2).tolist() == [[[2, 3], [6, 5]]]
    assert not len(find_blocks(block, np.array([4, 3]), 2))
    assert not len(find_blocks(block, np.array([9, 1]), 2))


def test_an_inclusive_region_has_a_larger_box_and_a_line_one_too():
    m = load_shipped("orthoglide5_head")
    line = whole_region(m, at={"Y": 0.0, "Z": -150.0})
    box = find_largest_box(line)
    assert box.axes == ("X",)
    assert box.edges > 50.0
    assert not len(broken_in(line, box.low, box.high, np.random.default_rng(8)))
    for low, high in ((box.low - 1.0, box.low), (box.high, box.high + 1.0)):
        assert prove_box(line, low, high).limit is not None
    hexapod = load_shipped("hexapod")
    plane = {"X": 0.0, "A": 0.0, "B": 0.0}
    fixed, some = whole_region(hexapod, at=plane), whole_region(hexapod, {"X": 0.0, "B": 0.0}, some={"A": (-0.2, 0.2)})
    assert find_largest_box(some, shape=(1, 1)).volume > 1.05 * find_largest_box(fixed, shape=(1, 1)).volume


def test_it_tells_enough_to_run_it_again(disc):
    box = find_largest_box(disc, shape=(2, 1), tolerance=0.5)
    again = {key: box.parameters[key] for key in ("at", "every", "some", "without", "mode")}
    assert box.parameters["machine"] == "disc"
    same = find_largest_box(
        whole_region(disc.machine, **again), **{key: box.parameters[key] for key in ("shape", "around", "tolerance")}
    )
    assert (same.low == box.low).all()
    assert (same.high == box.high).all()


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ({"shape": (1, 1, 1)}, "shape: 2 numbers"),
        ({"shape": (1, -1)}, "above 0"),
        ({"shape": (1, np.inf)}, "above 0"),
        ({"around": (1, 2, 3)}, "around: 2 numbers"),
        ({"around": (99.0, 99.0)}, "breaks d1.max"),
        ({"around": (np.nan, 0.0)}, "around"),
        ({"tolerance": 0.0}, "tolerance"),
    ],
)
def test_what_makes_no_sense_is_refused(disc, kind, said):
    with pytest.raises(pk.PoseError, match=said):
        find_largest_box(disc, **kind)


def test_an_empty_region_and_corners_that_are_none_are_refused(disc):
    with pytest.raises(pk.PoseError, match="empty"):
        find_largest_box(whole_region(load_shipped("tricept"), {"Z": 500.0}))
    with pytest.raises(pk.PoseError, match="empty"):
        find_largest_box(whole_region(load_shipped("hexapod"), every={"A": (-pi / 2, pi / 2)}))
    with pytest.raises(pk.PoseError, match="corner"):
        prove_box(disc, [1.0, 0.0], [0.0, 1.0])
    with pytest.raises(pk.PoseError, match="corner"):
        prove_box(disc, [0.0], [1.0])
