"""Certified workspaces: volumes in closed form, poses at random inside and outside, questions that make no sense."""

from __future__ import annotations

from itertools import product
from math import cos, inf, pi, radians, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from regions import whole_region
from shipped import NAMES, REPRESENTATIVES, load_shipped

import parakin as pk

MACHINES = Path(__file__).parent / "machines"
SHIPPED = {name: load_shipped(name) for name in REPRESENTATIVES}


def known(name, **sizes):
    return pk.load(MACHINES / f"{name}.yaml", parameters=sizes)


# Volumes, areas and lengths in closed form.


def ball(r):
    return 4.0 / 3.0 * pi * r**3


def two_balls(a, b, d):
    """Volume common to balls of radii a, b with centres d apart."""
    return pi * (a + b - d) ** 2 * (d * d + 2 * d * (a + b) - 3 * (a - b) ** 2) / (12.0 * d)


def two_discs(a, b, d):
    """Area common to discs of radii a, b with centres d apart."""
    x = (d * d + a * a - b * b) / (2.0 * d)
    return a * a * np.arccos(x / a) + b * b * np.arccos((d - x) / b) - d * sqrt(a * a - x * x)


def sector(turn):
    return turn / 2.0 * (430.0**2 - 300.0**2 + 700.0**2 - 570.0**2)


TURN = radians(7.0)
ANSWERS = {
    "two balls": ("balls", {}, {}, two_balls(400, 350, 300) - 2.0 * ball(1)),
    "a ball": ("balls", {}, {"without": ["d2.*"]}, ball(400) - ball(1)),
    "the other ball": ("balls", {}, {"without": ["d1.*", "d3.max"]}, ball(350) - ball(1)),
    "a shell": ("balls", {"least": "150 mm"}, {"without": ["d2.*"]}, ball(400) - ball(150)),
    "a slice of two balls": (
        "balls",
        {},
        {"at": {"Z": 120.0}},
        two_discs(sqrt(400**2 - 120**2), sqrt(350**2 - 120**2), 300),
    ),
    "another slice": ("balls", {}, {"at": {"X": 250.0}}, pi * (400**2 - 250**2)),
    "a line through two balls": (
        "balls",
        {},
        {"at": {"Y": 50.0, "Z": -90.0}},
        sqrt(400**2 - 10600) + sqrt(350**2 - 10600) - 300,
    ),
    "a line through a shell": (
        "balls",
        {"least": "150 mm"},
        {"at": {"Y": 0.0, "Z": 0.0}, "without": ["d2.*"]},
        2 * (400 - 150),
    ),
    "an oblique box": ("box", {}, {}, 6e6),
    "an oblique box, tilted tool": ("box", {}, {"at": {"B": 0.4, "C": -2.8}}, 6e6),
    "a thin box": ("box", {"c": "4 mm"}, {}, 24e4),
    "between caps": ("caps", {}, {}, pi * 300**2 * 150),
    "a ring's sector": ("sector", {}, {}, sector(radians(340))),
    "a smaller sector": ("sector", {"from": "-30 deg", "to": "12 deg"}, {}, sector(radians(42))),
    "a sector up to the jump": ("sector", {"from": "-4 deg", "to": "180 deg"}, {}, sector(radians(184))),
    "a sector from jump to jump": ("sector", {"from": "-180 deg", "to": "180 deg"}, {}, sector(2 * pi)),
    "a whole ring": ("sector", {}, {"without": ["turn.m*"]}, sector(2 * pi)),
    "a ball's sector": ("cone", {}, {}, 2 / 3 * pi * (500**3 - 200**3) * (1 - cos(radians(40)))),
    "a wide sector": ("cone", {"angle": "130 deg"}, {}, 2 / 3 * pi * (500**3 - 200**3) * (1 - cos(radians(130)))),
    "a polar box": ("swing", {}, {}, (800**3 - 600**3) / 3 * radians(80) * 2 * sin(radians(30))),
    "a polar box without an end": (
        "swing",
        {},
        {"without": ["tz.max"]},
        (800**3 - 0) / 3 * radians(80) * 2 * sin(radians(30)),
    ),
    "a disc": ("arm", {}, {}, pi * (100**2 - 1e-6)),
    "a disc for every turn": (
        "arm",
        {},
        {"every": {"C": (0.5 - TURN, 0.5 + TURN)}},
        two_discs(100, 100, 800 * sin(TURN)),
    ),
    "a disc for some turn": ("arm", {}, {"some": {"C": (0.5 - TURN, 0.5 + TURN)}}, pi * 100**2 + 4 * 400 * 100 * TURN),
    "a disc for every way": ("arm", {"arm": "40 mm"}, {"dexterous": True}, pi * (60**2 - 40.001**2) + pi * 39.999**2),
    "a disc some way": ("arm", {"arm": "40 mm"}, {"some": {"C": (-pi, pi)}}, pi * 140**2),
}


@pytest.mark.parametrize("what", ANSWERS)
@pytest.mark.parametrize("aim", [{"gap": 0.5}, {"gap": 0.02}, {"cell": 13.0}], ids=str)
def test_the_bracket_holds_the_exact_volume(what, aim):
    name, sizes, question, exact = ANSWERS[what]
    found = pk.workspace(whole_region(known(name, **sizes), **question), **aim, seconds=2.0)
    volume = found.volume
    assert volume.inner <= exact <= volume.outer
    assert volume.inner <= volume.estimate <= volume.outer
    if "gap" in aim and found.stopped == "gap":
        assert volume.gap <= aim["gap"]
        assert abs(volume.estimate - exact) <= 0.5 * aim["gap"] * exact
    if found.stopped == "cell":
        assert found.cells.size[~found.cells.inside].max() <= aim["cell"] * (1 + 1e-9)


def test_a_planar_machine_against_a_grid():
    """The 3-RPR, its margins' least and greatest values over turns found on arcs, its areas by places on a grid."""
    m = known("rpr3")
    low, high, step, reach = 200.0, 650.0, 3.0, 100.0
    angles = np.radians([90, 210, 330])
    feet = 500.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    x = np.arange(-330.0, 330.0, step) + 0.5 * step
    places = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 1, 2)
    off = step / sqrt(2.0)  # to the cell's corners
    turns = np.linspace(0.1, 0.6, 41)
    between = reach * 0.5 * (turns[1] - turns[0])  # what a turn halfway between two changes at most
    margins = np.full((len(places), len(turns)), inf)
    for foot, angle in zip(feet, angles, strict=True):
        ends = reach * np.column_stack([np.cos(angle + turns), np.sin(angle + turns)])
        length = np.linalg.norm(places + ends - foot, axis=2)
        margins = np.minimum(margins, np.minimum(length - low, high - length))
    every, some = margins.min(1), margins.max(1)
    span = {"C": (0.1, 0.6)}
    for found, surely, perhaps in (
        (pk.workspace(whole_region(m, every=span), gap=0.003), every >= off + between, every >= -off),
        (pk.workspace(whole_region(m, some=span), gap=0.01), some >= off, some >= -off - between),
        (pk.workspace(whole_region(m, at={"C": 0.1}), gap=0.003), margins[:, 0] >= off, margins[:, 0] >= -off),
    ):
        assert found.stopped == "gap"
        least, most = surely.sum() * step**2, perhaps.sum() * step**2
        assert found.volume.inner <= most
        assert found.volume.outer >= least
        assert abs(found.volume.estimate - 0.5 * (least + most)) < 0.5 * (most - least) + 0.01 * most


# Cells on a raster, to look a great many places up.

OUTSIDE, EDGE, INSIDE = 0, 1, 2


class Raster:
    """What is proved of each voxel of a box that holds all cells, and a bit more; cells finer than voxels are edges."""

    def __init__(self, cells, most=160):
        low, high = cells.low.min(0), (cells.low + cells.size).max(0)
        size = cells.size.min(0)
        while ((high - low) / size > most).any():
            size = 2.0 * size
        corner = cells.low[(cells.size >= 0.99 * size).all(1).argmax()]  # of a cell no finer: it lies on the lattice
        low = corner - np.ceil((corner - low) / size - 1e-6) * size
        anchor = cells.size[:, 0].argmax()
        assert (size <= cells.size[anchor]).all()  # else cells may lie across voxels
        self.size = size
        self.low = cells.low[anchor] - size * (np.ceil((cells.low[anchor] - low) / size - 1e-6) + 3.0)
        shape = np.ceil((high - self.low) / size - 1e-6).astype(int) + 3
        self.state = np.zeros(shape, np.int8)
        self.cell = np.full(shape, -1)
        first = np.floor((cells.low - self.low) / size + 1e-6).astype(int)
        width = np.maximum(1, np.round(cells.size / size).astype(int))
        order = np.lexsort([cells.size[:, 0] < 0.99 * size[0]])  # the finer ones last
        states = np.where(cells.inside & (cells.size[:, 0] > 0.99 * size[0]), INSIDE, EDGE)
        for extra in np.unique(width[:, 0]):
            block = np.stack(np.meshgrid(*[np.arange(extra)] * len(shape), indexing="ij"), -1).reshape(-1, len(shape))
            which = order[width[order, 0] == extra]
            at = tuple((first[which, None] + block).reshape(-1, len(shape)).T)
            self.state[at] = np.repeat(states[which], len(block))
            self.cell[at] = np.repeat(which, len(block))

    def places(self, rng, count):
        """Some anywhere, the others near an edge."""
        d = self.state.ndim
        edges = np.argwhere(self.state == EDGE)
        near = edges[rng.integers(0, len(edges), count // 2)] + rng.uniform(-1.0, 2.0, (count // 2, d))
        anywhere = rng.random((count - count // 2, d)) * self.state.shape
        return self.low + self.size * np.concatenate([near, anywhere])

    def states(self, places):
        """OUTSIDE, EDGE or INSIDE for every place."""
        index = ((places - self.low) / self.size).astype(int)
        return self.state[tuple(index.T)]


def turns_of(asked, rng, count):
    """Turns of a region, many at the ends of their ranges."""
    low, high = (np.array([span[i] for span in asked.swept_axes.values()]) for i in (0, 1))
    share = rng.random((count, len(low)))
    share = np.where(rng.random(share.shape) < 0.2, np.round(share), share)
    return low + (high - low) * share


def swept(m, kind, wide):
    """A question with a range for each turning axis; where an angle jumps a part of the wrist does, too."""
    turning = [axis for axis, unit in zip(m.axes, m.axis_units, strict=True) if unit == "rad"]
    home = dict(zip(m.axes, m.home.tolist(), strict=True))
    span = {axis: (home[axis] - wide, home[axis] + wide) for axis in turning}
    if turning == ["B", "C"]:
        span = {"B": (0.1, 0.1 + wide), "C": (pi - wide, pi + wide)}
    slow = m.name in ("hexapod", "tricept")
    return {kind: span, **({"at": {"Z": home["Z"]}} if slow else {})}


@pytest.mark.parametrize("name", SHIPPED)
def test_two_million_places_are_what_their_cells_say(name):
    m = SHIPPED[name]
    rng = np.random.default_rng(61)
    side = {2: 1000, 3: 100}[len(whole_region(m).free_axes)]
    extent = whole_region(m).extent
    found = pk.workspace(whole_region(m), cell=float((extent[1] - extent[0]).max()) / side)
    assert found.stopped == "cell"
    raster = Raster(found.cells, 2 * side)
    seen = np.zeros(3, int)
    for _ in range(2):
        places = raster.places(rng, 1_000_000)
        state = raster.states(places)
        known = state != EDGE
        allowed = m.check(found.region.poses(places[known])) == 0
        assert np.array_equal(allowed, state[known] == INSIDE)
        seen += np.bincount(state, minlength=3)
    assert seen.min() > 1e5


@pytest.mark.parametrize("kind", ["every", "some"])
@pytest.mark.parametrize("name", [name for name, m in SHIPPED.items() if len(m.axes) > 3])
def test_places_and_turns_at_random_are_what_their_cells_say(name, kind):
    """Inside, every turn is allowed (or one is found); outside, none is (or one that is not is found)."""
    m = SHIPPED[name]
    rng = np.random.default_rng(62)
    found = pk.workspace(whole_region(m, **swept(m, kind, 0.08)), gap=0.15, seconds=2.0)
    asked, raster = found.region, Raster(found.cells, 64)
    seen = np.zeros(3, int)
    for _ in range(3):
        places = raster.places(rng, 100_000)
        state = raster.states(places)
        allowed = m.check(asked.poses(places, turns_of(asked, rng, len(places)))) == 0
        if kind == "every":
            assert allowed[state == INSIDE].all()
        else:
            assert not allowed[state == OUTSIDE].any()
        seen += np.bincount(state, minlength=3)
    assert seen[[OUTSIDE, EDGE]].min() > 1e4
    # What one turn can't refute, a search for the best one does.
    worth = INSIDE if kind == "some" else OUTSIDE
    places = raster.places(rng, 40_000)
    places = places[raster.states(places) == worth][:400]
    if not len(places):  # in so short a time nothing was proved
        return
    best = best_margin(m, asked, places, rng, 1.0 if kind == "some" else -1.0)
    assert (best > -1e-6).all() if kind == "some" else (best < 1e-6).all()


def least_margin(m, poses):
    """The least of all margins by their bounds' own units; -inf where the legs can't close."""
    margins = m.margins(poses)
    return np.where(np.isnan(margins), -inf, margins).min(-1)


def best_margin(m, asked, places, rng, sign, rounds=12, each=48):
    """Of every place the least margin for the turn where it is greatest (sign 1) or least (-1), by a search."""
    low, high = (np.array([span[i] for span in asked.swept_axes.values()]) for i in (0, 1))
    n, s = len(places), len(low)
    best, turn = np.full(n, -inf), np.tile(0.5 * (low + high), (n, 1))
    for number in range(rounds):
        width = (high - low) * 0.6**number
        tried = np.clip(turn[:, None] + width * rng.uniform(-1, 1, (n, each, s)), low, high)
        tried[:, 0] = turn
        if not number:  # the ends, where a margin that rises or falls is greatest or least
            tried[:, 1 : 1 + 2**s] = np.where(np.array(list(product((True, False), repeat=s))), low, high)
        poses = asked.poses(np.repeat(places, each, 0), tried.reshape(-1, s))
        value = sign * least_margin(m, poses).reshape(n, each)
        which = value.argmax(1)
        best = np.maximum(best, value[np.arange(n), which])
        turn = tried[np.arange(n), which]
    return sign * best


@pytest.mark.parametrize("name", SHIPPED)
def test_the_shares_of_cells_are_between_inner_and_outer(name):
    m = SHIPPED[name]
    rng = np.random.default_rng(63)
    draws = 1000
    for kind in ("constant", "every", "some")[
        : 3 if name in ("hexapod", "lambda6", "orthoglide5_table", "tricept") else 1
    ]:
        question = {} if kind == "constant" else swept(m, kind, 0.05)
        aim = {"gap": 0.05, "seconds": 60.0} if kind == "constant" else {"gap": 0.3, "seconds": 2.0}
        found = pk.workspace(whole_region(m, **question), **aim)
        cells = found.cells.take(~found.cells.inside)
        cells = cells.take(rng.permutation(len(cells.low))[:150])
        d = cells.low.shape[1]
        places = cells.low[:, None] + cells.size[:, None] * rng.random((len(cells.low), draws, d))
        places = places.reshape(-1, d)
        turns = turns_of(found.region, rng, len(places)) if question else None
        share = (m.check(found.region.poses(places, turns)) == 0).reshape(-1, draws).mean(1)
        off = 5.0 * np.sqrt(share * (1.0 - share) / draws) + 5.0 / draws
        if kind != "some":  # one turn each: of places where every turn is allowed none is missed
            assert (share >= cells.inner - off).all()
        if kind != "every":
            assert (share <= cells.outer + off).all()
        if kind == "constant":
            assert ((share > 0.0) & (share < 1.0)).sum() > 50
            assert np.abs(share - cells.estimate).mean() < 0.25
        assert (cells.inner <= cells.estimate).all()
        assert (cells.estimate <= cells.outer).all()


@pytest.mark.parametrize("name", NAMES)
def test_the_bracket_of_every_machine_holds_the_volume_of_places_at_random(name):
    """Rods of rus6 and hexaglide are nearly parallel: no interval tells which points of them are nearest."""
    m, rng, count = load_shipped(name), np.random.default_rng(64), 20_000
    found = pk.workspace(pk.region(m), gap=0.4, seconds=120.0)
    assert found.stopped == "gap"
    low, high = found.box
    poses = found.region.poses(rng.uniform(low, high, (count, len(low))))
    allowed = m.check(poses) == 0
    if not m.is_redundant:
        allowed &= np.sign(m.sides(poses)) == np.sign(m.sides(m.home[None]))
    share, box = allowed.mean(), np.prod(high - low)
    off = 5.0 * np.sqrt(share * (1.0 - share) / count) * box
    assert found.volume.inner - off < share * box < found.volume.outer + found.apart.outer + off
    inside = found.cells.take(found.cells.inside)
    places = inside.low + rng.random(inside.low.shape) * inside.size
    assert len(places) > 20
    assert not m.check(found.region.poses(places)).any()
