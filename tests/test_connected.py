"""Connected parts: against half discs, and against a flood fill of fine grids of single poses."""

from itertools import combinations
from math import pi, sqrt

import numpy as np
import pytest
from regions import whole_region
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shipped import load_shipped

import parakin as pk
from parakin.algebra import expand_determinant
from parakin.workspaces.certified.subdivision import Subdivision
from parakin.workspaces.connected.adjacency import find_adjacent_cells, label_components
from parakin.workspaces.connected.components import find_components
from parakin.workspaces.inscribed.largest_box import find_largest_box

# Two struts in line with the machine's y axis: singular where x = 0, and nowhere else.
RING = """
name: ring
title: A ring
source: Made for a test.
motion: tx ty
legs:
  - {kind: length, joints: [d1], foot: [0, 0, 0], platform: [0, 0, 0], range: [LEAST mm, 100 mm]}
  - {kind: length, joints: [d2], foot: [0, -900 mm, 0], platform: [0, 0, 0], range: [1 mm, 9000 mm]}
home: {X: 60 mm, Y: 0 mm}
"""


def ring(tmp_path, least, at=None):
    path = tmp_path / "ring.yaml"
    path.write_text(RING.replace("LEAST", str(least)), encoding="utf-8")
    return pk.region(pk.load(path), at)


@pytest.mark.parametrize("least", [0, 50])
def test_struts_in_line_part_a_disc(tmp_path, least):
    asked = ring(tmp_path, least)
    found = find_components(asked, start=(-60.0, 20.0), cell=0.5)
    area = pi * (100.0**2 - least**2) / 2.0
    assert found.at_least == len(found) == 2
    assert sorted(part.sign for part in found.components) == [-1, 1]
    for part in found.components:
        assert part.apart
        assert part.volume.inner <= area <= part.volume.outer
        assert part.volume.outer < 1.03 * part.volume.inner
        assert part.volume.estimate == pytest.approx(area, rel=2e-3)
        assert part.sign * part.position[0] > 0.0
        assert least <= np.hypot(*part.position) <= 100.0
        assert (part.low <= np.array([0.0, -100.0] if part.sign > 0 else [-100.0, -100.0])).all()
        assert (part.high >= np.array([100.0, 100.0] if part.sign > 0 else [0.0, 100.0])).all()
    assert found.undecided < 0.01
    assert found.components[found.start].sign == -1
    assert found.components[find_components(asked, start=(1e-3, 70.0)).start].sign == 1


def test_one_sign_can_have_two_parts(tmp_path):
    asked = ring(tmp_path, 50, at={"X": 10.0})
    found = find_components(asked, start=(10.0, -70.0))
    length = sqrt(100.0**2 - 10.0**2) - sqrt(50.0**2 - 10.0**2)
    assert found.at_least == len(found) == 2
    assert [part.sign for part in found.components] == [1, 1]
    assert all(part.apart for part in found.components)
    for part in found.components:
        assert part.volume.estimate == pytest.approx(length, rel=1e-3)
        assert part.volume.inner <= length <= part.volume.outer
    assert found.components[found.start].position[0] < 0.0


def flooded(asked, n, pad=1.02):
    """Sign and volume of every part of a grid of poses, those of few poses left out: from single poses alone."""
    m = asked.machine
    low, high = asked.extent
    low = np.maximum(low, -2500.0)
    high = np.minimum(high, 2500.0)
    ticks = [np.linspace(a, b, n) for a, b in zip(low * pad, high * pad, strict=True)]
    places = np.stack(np.meshgrid(*ticks, indexing="ij"), -1).reshape(-1, len(low))
    inside = np.flatnonzero(m.check(asked.poses(places)) == 0)
    size = len(m.axes) if m.wrist is None else m.leg_count  # with a wrist only the legs' rows can be singular
    a, _ = m.jacobians(asked.poses(places[inside]))
    home, _ = m.jacobians(m.home)
    det = np.linalg.det(a[:, :size, :size]) * np.sign(np.linalg.det(home[:size, :size]))
    step = float(np.prod([tick[1] - tick[0] for tick in ticks]))
    found = []
    for sign in (1, -1):
        mask = np.zeros(len(places), bool)
        mask[inside[sign * det > 0.0]] = True
        label, count = ndimage.label(mask.reshape((n,) * len(low)))
        sizes = np.bincount(label.reshape(-1))[1 : count + 1]
        found += [(sign, size * step) for size in sizes.tolist() if size >= 20]
    return sorted(found, key=lambda each: -each[1])


ASKED = {"hbg80_2d": {}, "hbg80_3d": {}, "orthoglide": {}, "tricept": {"at": {"B": 0.0, "C": 0.0}}}


FLOODED = [("hbg80_2d", 900, 2), ("hbg80_3d", 100, 2), ("orthoglide", 100, 2), ("tricept", 100, 1)]


@pytest.mark.parametrize(("name", "n", "parts"), FLOODED)
def test_parts_are_those_of_a_flood_fill(name, n, parts):
    asked = pk.region(load_shipped(name), **ASKED[name])
    found = find_components(asked, start=asked.machine.home)
    expected = flooded(asked, n)
    assert len(found) == found.at_least == len(expected) == parts
    for part, (sign, volume) in zip(found.components, expected, strict=True):
        assert part.sign == sign
        assert part.apart
        assert part.volume.estimate == pytest.approx(volume, rel=0.03)
        assert part.volume.inner < volume * 1.03
        assert part.volume.outer > volume * 0.97
    assert found.components[found.start].sign == 1
    assert found.undecided < 1e-6 * found.components[0].volume.estimate


@pytest.mark.parametrize("name", ["hbg80_2d", "orthoglide"])
def test_a_part_holds_the_place_it_names(name):
    asked = pk.region(load_shipped(name), **ASKED[name])
    first = find_components(asked)
    assert first.start is None
    for number, part in enumerate(first.components):
        pose = asked.poses(part.position[None])[0]
        assert asked.machine.check(pose) == 0
        again = find_components(asked, start=pose)
        assert again.start == number


def test_coarse_cells_never_prove_too_many_parts():
    asked = pk.region(load_shipped("hbg80_3d"))
    truth = find_components(asked).components
    for cell in (120.0, 60.0, 30.0, 15.0):
        found = find_components(asked, cell=cell)
        assert found.at_least <= 2
        largest = found.components[0].volume
        assert largest.inner <= truth[0].volume.outer
        assert largest.outer >= truth[0].volume.inner
        assert sum(part.volume.outer for part in found.components) + found.undecided >= sum(
            p.volume.inner for p in truth
        )


def test_every_turn_counts_and_the_parts_shrink():
    m = load_shipped("hexapod")
    fixed = find_components(pk.region(m), cell=40.0)
    swept = find_components(pk.region(m, every={"A": (-0.2, 0.2), "B": (-0.2, 0.2)}), start=m.home, cell=40.0)
    assert (fixed.at_least, swept.at_least, swept.start) == (1, 1, 0)
    assert swept.components[0].volume.outer < fixed.components[0].volume.inner


def test_the_volumes_of_all_parts_are_the_workspace():
    m = load_shipped("orthoglide")
    whole = pk.workspace(whole_region(m), gap=0.005).volume
    parts = find_components(pk.region(m)).components
    assert sum(part.volume.inner for part in parts) <= whole.outer
    assert sum(part.volume.outer for part in parts) >= whole.inner
    assert sum(part.volume.estimate for part in parts) == pytest.approx(whole.estimate, rel=5e-3)


def test_it_tells_enough_to_run_it_again(tmp_path):
    asked = ring(tmp_path, 50)
    found = find_components(asked, start=(60.0, 0.0), cell=2.0)
    told = found.parameters
    kind = {key: told[key] for key in ("at", "every", "some", "without", "mode")}
    again = find_components(
        pk.region(asked.machine, **kind), **{key: told[key] for key in ("start", "cell", "seconds")}
    )
    assert again.start == found.start
    assert [part.volume for part in again.components] == [part.volume for part in found.components]


@pytest.mark.parametrize(
    ("start", "said"),
    [
        ((200.0, 0.0), "outside the region, d1.max"),
        ((0.0, 70.0), "singularity"),
        ((np.nan, 70.0), "finite"),
        ([(60.0, 0.0)], "one pose"),
        ((60.0, 0.0, 0.0), "start"),
    ],
)
def test_a_start_that_is_none_is_refused(tmp_path, start, said):
    with pytest.raises(pk.PoseError, match=said):
        find_components(ring(tmp_path, 0), start=start)


def test_what_makes_no_sense_is_refused(tmp_path):
    m = load_shipped("hexapod")
    with pytest.raises(pk.PoseError, match="some"):
        find_components(pk.region(m, some={"A": (-0.1, 0.1)}))
    with pytest.raises(pk.PoseError, match=r"A is 0\.2, but fixed at 0 here"):
        find_components(pk.region(m), start=[0, 0, m.home[2], 0.2, 0, 0])
    with pytest.raises(pk.PoseError, match="beyond its range"):
        find_components(pk.region(m, every={"A": (-0.1, 0.1)}), start=[0, 0, m.home[2], 0.2, 0, 0])
    with pytest.raises(pk.PoseError, match="cell"):
        find_components(ring(tmp_path, 0), cell=-1.0)
    with pytest.raises(pk.PoseError, match="too fine"):
        find_components(ring(tmp_path, 0), cell=0.01)
    with pytest.raises(pk.PoseError, match="empty"):
        find_components(pk.region(load_shipped("tricept"), {"Z": 500.0}))


def test_the_determinant_is_numpys():
    rng = np.random.default_rng(1)
    for n in range(1, 7):
        matrix = rng.uniform(-1, 1, (n, n))
        assert expand_determinant(matrix.tolist()) == pytest.approx(np.linalg.det(matrix), abs=1e-12)
    assert expand_determinant([[0.0, 2.0], [3.0, 0.0]]) == -6.0


@pytest.mark.parametrize("d", [1, 2, 3])
def test_cells_that_touch(d):
    rng = np.random.default_rng(d)
    cells = [(np.zeros(d, int) + 16 * np.array(i), 16) for i in np.ndindex(*(2,) * d)]
    for _ in range(12):  # random cells are halved, some parts are dropped
        low, size = cells.pop(int(rng.integers(len(cells))))
        if size > 1:
            parts = [(low + size // 2 * np.array(i), size // 2) for i in np.ndindex(*(2,) * d)]
            cells += [part for part in parts if rng.random() < 0.8]
    low, size = np.array([c[0] for c in cells]), np.array([c[1] for c in cells])[:, None].repeat(d, 1)
    faces, points = find_adjacent_cells(0.37 * low - 5.0, 0.37 * size)
    expected: tuple[set, set] = (set(), set())
    for a, b in combinations(range(len(cells)), 2):
        common = np.minimum(low[a] + size[a], low[b] + size[b]) - np.maximum(low[a], low[b])
        if (common >= 0).all():
            expected[1].add((a, b))
            if (common == 0).sum() == 1:
                expected[0].add((a, b))
    assert set(map(tuple, faces.tolist())) == expected[0]
    assert set(map(tuple, points.tolist())) == expected[1]
    graph = coo_array((np.ones(len(faces)), faces.T), shape=(len(cells),) * 2)
    count, label = connected_components(graph, directed=False)
    own = label_components(len(cells), faces)
    assert own.max() + 1 == count
    assert len(set(zip(label.tolist(), own.tolist(), strict=True))) == count


def test_a_machine_that_is_singular_everywhere_has_no_parts(tmp_path):
    path = tmp_path / "ring.yaml"
    path.write_text(RING.replace("[0, -900 mm, 0]", "[0, 0, 0]").replace("LEAST", "50"), encoding="utf-8")
    asked = pk.region(pk.load(path))
    found = find_components(asked, cell=2.0)
    assert (len(found), found.at_least, found.undecided) == (0, 0, 0.0)
    with pytest.raises(pk.PoseError, match="singularity"):
        find_components(asked, start=(60.0, 0.0))


def test_a_break_gives_no_half_answer(tmp_path, monkeypatch):
    asked = ring(tmp_path, 50)

    def broken(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(Subdivision, "refine", broken)
    with pytest.raises(KeyboardInterrupt):
        find_components(asked)
    with pytest.raises(KeyboardInterrupt):
        find_largest_box(asked)
