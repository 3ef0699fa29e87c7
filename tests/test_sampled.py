"""The sweeping methods: each place against ``Machine.check``, each volume against the certified bracket."""

from itertools import product

import numpy as np
import pytest
from regions import whole_region
from shipped import REPRESENTATIVES, load_shipped

import parakin as pk
from parakin.errors import NoMethodError, PoseError
from parakin.workspaces.sampled.grid import sample_grid
from parakin.workspaces.sampled.polar_sweep import sweep_polar

# A sweep may be off by this share of a layer as thick as its step all over the boundary.
WITHIN = 0.25
DEG = np.pi / 180.0
UPRIGHT = {"at": {"B": 0.0, "C": 0.0}}
SMALL = {"every": {"A": (-0.05, 0.05), "B": (-0.05, 0.05), "C": (0.4, 0.5)}}
# machine, what is asked, step
CONSTANT = [
    ("tricept", UPRIGHT, 80.0),
    ("orthoglide", {}, 20.0),
    ("hbg80_2d", {}, 40.0),
    ("hbg80_3d", {}, 40.0),
    ("lambda6", {}, 80.0),
]
FLAT = [  # star-shaped about the axis, or nearly so
    ("tricept", {"at": {"B": 0.0, "C": 0.0, "Z": -1650.0}}, 80.0),
    ("orthoglide", {"at": {"Z": 0.0}}, 20.0),
    ("hbg80_2d", {}, 40.0),
    ("hbg80_3d", {"at": {"Z": -120.0}}, 40.0),
]
TRANSLATING = ["hbg80_2d", "hbg80_3d", "orthoglide", "linear_delta"]


def agrees(sweep, certified, step):
    """All within the tolerance, and nearer in the mean with steps a quarter as long."""
    volume, errors = certified.volume, []
    for scale in (1.0, 0.25):
        sweeps = [sweep(step * scale * part) for part in (1.0, 0.93, 0.86)]
        for found in sweeps:
            outside = max(volume.inner - found.estimate, found.estimate - volume.outer, 0.0)
            assert outside <= WITHIN * certified.surface * found.step
        errors.append(np.mean([abs(found.estimate - volume.estimate) for found in sweeps]))
    assert errors[1] < errors[0]
    # Not vacuous: the tolerance is a small part of the volume in the end.
    assert WITHIN * certified.surface * found.step < 0.06 * volume.estimate


def places_of(grid, rng, count):
    """Random cells of a grid: their places and numbers."""
    cells = rng.integers(0, grid.broken.size, count)
    index = np.unravel_index(cells, grid.broken.shape)
    return np.stack([x[i] for x, i in zip(grid.coordinates, index, strict=True)], 1), grid.broken[index]


# The dense grid.


@pytest.mark.parametrize("name", REPRESENTATIVES)
def test_a_grid_says_what_check_says(name, rng):
    machine = load_shipped(name)
    turned = {
        axis: value + 0.1
        for axis, value, unit in zip(machine.axes, machine.home, machine.axis_units, strict=True)
        if unit == "rad"
    }
    for at in ({}, turned):
        asked = whole_region(machine, at)
        half = np.where(np.array(machine.axis_units) == "mm", 700.0, 0.0)
        ends = [(machine.home + s * half)[: len(asked.free_axes)] for s in (-1.0, 1.0)]
        grid = sample_grid(asked, 11.0 if len(asked.free_axes) == 3 else 1.0, ends)
        places, broken = places_of(grid, rng, 20_000)
        assert np.array_equal(broken, machine.check(asked.poses(places)))
        assert len(np.unique(broken)) > 3


TURNS = [
    ("lambda6", 35.0, {"every": {"A": (-0.2, 0.2), "B": (-0.1, 0.25)}}),
    ("lambda6", 35.0, {"some": {"A": (-0.2, 0.2), "C": (0.0, 1.0)}}),
    ("tricept", 90.0, {"some": {"B": (0.0, 0.4), "C": (-1.0, 1.0)}}),
    ("orthoglide5_head", 15.0, {"every": {"B": (0.0, 0.5), "C": (-2.0, 2.0)}}),
    ("orthoglide5_table", 15.0, {"some": {"B": (0.0, 0.5), "C": (0.3, 0.3)}}),
    ("hexapod", 45.0, {"every": {"A": (0.0, 0.1), "B": (-0.1, 0.1)}, "without": ["clearance*"]}),
]


@pytest.mark.parametrize(("name", "step", "asked"), TURNS, ids=lambda value: value if isinstance(value, str) else "")
def test_with_turns_a_grid_looks_at_every_combination(name, step, asked, rng):
    machine = load_shipped(name)
    question = whole_region(machine, **asked)
    ends = [machine.home[:3] - 12.0 * step, machine.home[:3] + 12.0 * step]
    grid = sample_grid(question, step, ends, turns_step=8.0 * DEG)
    places, broken = places_of(grid, rng, 4000)
    samples = []
    for low, high in question.swept_axes.values():
        parts = int(np.ceil((high - low) / (8.0 * DEG)))
        samples.append([low + (high - low) * i / max(parts, 1) for i in range(parts + 1)])
    counted = [machine.limits.index(limit) for limit in question.limits]
    allowed = []
    for turn in product(*samples):
        margins = machine.margins(question.poses(places, np.tile(turn, (len(places), 1))))[:, counted]
        allowed.append((margins >= 0.0).all(1))
    combined = np.all(allowed, axis=0) if "every" in asked else np.any(allowed, axis=0)
    assert np.array_equal(broken == 0, combined)
    assert 0.02 < combined.mean() < 0.98
    assert not np.array_equal(combined, allowed[len(allowed) // 2])  # the turns matter


@pytest.mark.parametrize(("name", "asked", "step"), CONSTANT, ids=[case[0] for case in CONSTANT])
def test_a_grid_finds_the_certified_volume(name, asked, step):
    machine = load_shipped(name)
    agrees(
        lambda h: sample_grid(whole_region(machine, **asked), h),
        pk.workspace(whole_region(machine, **asked), gap=0.004),
        step,
    )


@pytest.fixture(scope="module")
def total():
    return pk.workspace(whole_region(load_shipped("lambda6"), **SMALL), gap=0.03)


def test_a_grid_finds_the_certified_total_orientation_workspace(total):
    asked = whole_region(load_shipped("lambda6"), **SMALL)
    agrees(lambda h: sample_grid(asked, h), total, 80.0)


def test_what_follows_from_a_grid_is_what_follows_from_the_proof():
    machine = load_shipped("tricept")
    certified = pk.workspace(whole_region(machine, **UPRIGHT), gap=0.01)
    grid = sample_grid(whole_region(machine, **UPRIGHT), 20.0)
    low, high = grid.box
    assert (low + 0.5 * grid.step >= certified.box[0]).all() and (high - 0.5 * grid.step <= certified.box[1]).all()
    assert np.abs(grid.centroid - certified.centroid).max() < 2.0
    proved = {bound.limit: bound.fraction for bound in certified.bounded_by}
    shares = {bound.limit: bound.fraction for bound in grid.bounded_by}
    assert sum(shares.values()) == pytest.approx(1.0)
    assert all(abs(shares.get(limit, 0.0) - share) < 0.04 for limit, share in proved.items())
    assert max(proved.values()) > 0.1
    # The three legs stand alike about the axis, so what the first one bounds lies opposite to the leg, on X = 0.
    middles = {bound.limit: bound.middle for bound in grid.bounded_by}
    assert abs(middles["d1.max"][0]) < 1.0 and middles["d1.max"][1] < -100.0
    assert np.hypot(*middles["d2.max"][:2]) == pytest.approx(-middles["d1.max"][1], rel=0.1)


def test_a_box_cuts_a_part_out_of_the_same_lattice():
    asked = whole_region(load_shipped("orthoglide"))
    low, high = (-103.0, 0.0, -50.0), (200.0, 52.4, 400.0)
    whole, part = sample_grid(asked, 5.0), sample_grid(asked, 5.0, (low, high))
    kept = [(x >= a) & (x <= b) for x, a, b in zip(whole.coordinates, low, high, strict=True)]
    within = (whole.broken == 0)[np.ix_(*kept)]
    assert (part.broken == 0).sum() == within.sum() > 1000
    assert part.coordinates[0][0] == -102.5 and part.coordinates[1][-1] == 47.5
    assert (part.box[0] >= (-105.0, 0.0, -50.0)).all() and part.box[1][1] == 50.0
    # Where the box cuts, the region goes on: nothing bounds it there.
    assert sum(bound.fraction for bound in part.bounded_by) == pytest.approx(1.0)
    assert all(bound.middle[1] < 50.0 for bound in part.bounded_by)


def test_a_line_and_single_cells_are_grids_too():
    machine = load_shipped("orthoglide")
    line = sample_grid(whole_region(machine, {"X": 0.0, "Y": 0.0}), 0.01)
    certified = pk.workspace(whole_region(machine, {"X": 0.0, "Y": 0.0}), gap=1e-4).volume
    assert line.unit == "mm" and certified.inner - 0.02 <= line.estimate <= certified.outer + 0.02
    thin = sample_grid(whole_region(machine), 5.0, ([0.0, 0.0, -250.0], [5.0, 5.0, 250.0]))
    assert thin.broken.shape == (1, 1, 100)
    flat = sample_grid(whole_region(machine), 5.0, ([-250.0, 0.0, 0.0], [250.0, 5.0, 5.0]))
    assert flat.broken.shape == (100, 1, 1)
    assert thin.estimate == flat.estimate > 0.0


def test_a_sweep_can_be_run_again_from_its_parameters():
    machine = load_shipped("lambda6")
    asked = whole_region(machine, some={"C": (0.2, 0.7)}, without=["gap*"])
    grid = sample_grid(asked, 60.0, turns_step=0.1)
    p = grid.parameters
    same = whole_region(machine, p["at"], p["every"], p["some"], without=p["without"], mode=p["mode"])
    again = sample_grid(same, p["step"], p["box"], p["turns_step"])
    assert p["method"] == "grid" and again.estimate == grid.estimate > 0.0
    assert np.array_equal(again.broken, grid.broken)


def test_progress_comes_to_its_end():
    seen = []
    sample_grid(whole_region(load_shipped("lambda6"), every={"C": (0.4, 0.5)}), 8.0, progress=seen.append)
    assert len(seen) > 1 and seen == sorted(seen) and seen[-1] == 1.0


def test_an_empty_region_is_an_empty_grid():
    for at in ({"Z": 5000.0, "B": 0.0, "C": 0.0}, {"Z": -1650.0, "B": 3.0, "C": 0.0}):
        grid = sample_grid(whole_region(load_shipped("tricept"), at), 10.0)
        assert grid.empty and grid.estimate == 0.0 and grid.box is None and grid.centroid is None
        assert grid.bounded_by == ()


# The polar sweep.


@pytest.mark.parametrize(("name", "asked", "step"), FLAT, ids=[case[0] for case in FLAT])
def test_rays_find_the_certified_area(name, asked, step):
    machine = load_shipped(name)
    certified = pk.workspace(whole_region(machine, **asked), gap=0.002)
    agrees(lambda h: sweep_polar(whole_region(machine, **asked), h, rays=720), certified, step)


def test_rays_find_the_certified_volume_of_what_is_star_shaped():
    machine = load_shipped("lambda6")
    certified = pk.workspace(whole_region(machine), gap=0.004)
    agrees(lambda h: sweep_polar(whole_region(machine), h, rays=180), certified, 80.0)


def test_rays_find_the_certified_total_orientation_workspace(total):
    asked = whole_region(load_shipped("lambda6"), **SMALL)
    agrees(lambda h: sweep_polar(asked, h, rays=120), total, 80.0)


@pytest.mark.parametrize(("name", "asked"), [("tricept", UPRIGHT), ("orthoglide", {}), ("hbg80_3d", {})])
def test_a_ray_ends_at_the_first_place_not_allowed(name, asked, rng):
    machine = load_shipped(name)
    question = whole_region(machine, **asked)
    found = sweep_polar(question, 7.0, planes=31.0, rays=40)
    assert 0.0 < np.isnan(found.radii).mean() < 1.0
    for plane, ray in zip(rng.integers(0, len(found.heights), 60), rng.integers(0, len(found.angles), 60), strict=True):
        radius = found.radii[plane, ray]
        steps = 0 if np.isnan(radius) else round(radius / 7.0) + 1
        angle = 2.0 * np.pi * ray / 40
        along = 7.0 * np.arange(steps + 1)
        places = np.column_stack([
            machine.home[0] + along * np.cos(angle),
            machine.home[1] + along * np.sin(angle),
            np.full(steps + 1, found.heights[plane]),
        ])  # fmt: skip
        broken = machine.check(question.poses(places))
        assert not broken[:-1].any() and broken[-1] == found.broken[plane, ray] > 0
    # It sees no more than there is, and says what it can't see.
    assert found.estimate < pk.workspace(whole_region(machine, **asked), gap=0.05).volume.outer
    assert "not seen" in found.note


def test_outlines_are_closed_and_of_the_planes_that_hold_the_axis():
    machine = load_shipped("orthoglide")
    found = sweep_polar(whole_region(machine), 5.0, planes=40.0, rays=36, axis=(-20.0, 10.0))
    held = ~np.isnan(found.radii).any(1)
    assert len(found.outlines) == held.sum() > 2
    for line, height, radii in zip(found.outlines, found.heights[held], found.radii[held], strict=True):
        assert np.array_equal(line[0], line[-1]) and np.all(line[:, 2] == height)
        assert np.hypot(line[:-1, 0] + 20.0, line[:-1, 1] - 10.0) == pytest.approx(radii)
        assert not machine.check(line).any()
        # The sectors end half a step beyond the places that the line joins.
        x, y = line[:-1, 0], line[:-1, 1]
        shoelace = 0.5 * abs(np.sum(x * line[1:, 1] - y * line[1:, 0]))
        area = found.areas[np.flatnonzero(found.heights == height)[0]]
        assert 1.02 < area / shoelace < 1.08


def test_a_polar_sweep_is_of_two_or_three_places():
    flat = sweep_polar(whole_region(load_shipped("hbg80_2d")), 10.0)
    assert flat.heights is None and flat.radii.shape == (1, 72) and flat.outlines[0].shape == (73, 2)
    with pytest.raises(PoseError, match="needs a plane"):
        sweep_polar(whole_region(load_shipped("hbg80_2d"), {"X": 200.0}), 10.0)


# The sweep of the drives.


@pytest.mark.parametrize("name", TRANSLATING)
def test_drives_find_the_certified_volume(name):
    machine = load_shipped(name)
    certified = pk.workspace(whole_region(machine), gap=0.004)
    widest = max(drive.high - drive.low for drive in machine.model.drives)
    agrees(lambda h: pk.sweep_drives(whole_region(machine), round(widest / h)), certified, widest / 12)


def test_a_contour_of_the_planar_machine_is_the_circle_it_must_be():
    machine = load_shipped("hbg80_2d")
    found = pk.sweep_drives(whole_region(machine), 50)
    names = {image.strategy.name for image in found.contours}
    assert names == {
        f"{run} runs, {stand} at {end}" for run, stand in (("Xhbg", "Yhbg"), ("Yhbg", "Xhbg")) for end in ("min", "max")
    }
    assert {image.strategy.name for image in found.nets} == {"Xhbg and Yhbg run"}
    for image in found.contours:
        ((drive, end),) = image.strategy.stands
        at = {"min": -400.0, "max": 200.0}[end]
        centre = [at, 0.0] if drive == "Xhbg" else [0.0, at]
        for piece in image.pieces:
            assert np.hypot(*(piece - centre).T) == pytest.approx(400.0, abs=1e-9)
        there = ~np.isnan(image.positions).any(-1)
        # A thousandth beyond that limit nothing is allowed.
        joints = image.joints[there]
        assert machine.inverse(image.positions[there]) == pytest.approx(joints, abs=1e-6)
        beyond = machine.forward(
            joints + np.where(np.array(machine.joints) == drive, -1 if end == "min" else 1, 0) * 1e-3,
            near=image.positions[there],
        )
        known = beyond.converged & np.isfinite(machine.inverse(beyond.poses)).all(1)
        assert (known | beyond.in_other_mode).any() and machine.check(beyond.poses[known]).all()


def test_the_net_of_the_shell_lies_on_spheres_and_is_the_boundary():
    machine = load_shipped("hbg80_3d")
    found = pk.sweep_drives(whole_region(machine), 24)
    assert len({image.strategy.name for image in found.contours}) == 12
    assert len({image.strategy.name for image in found.nets}) == 6
    assert {image.side for image in found.nets} == {"home", "other"}
    inward = 0
    for image in found.nets:
        assert image.positions.shape == (25, 25, 3)
        ((drive, end),) = image.strategy.stands
        index, at = machine.joints.index(drive), {"min": -750.0, "max": -350.0}[end]
        places = image.positions[~np.isnan(image.positions).any(-1)]
        point = places + [-80.0, -80.0, 120.0]  # where the mean rods meet
        slider = np.zeros(3)
        slider[index] = -at if drive == "Zhbg" else at
        assert np.linalg.norm(point - slider, axis=1) == pytest.approx(600.0, abs=1e-8)
        assert np.abs(machine.inverse(places)[:, index] - at).max() < 1e-6
        # The drive's limit bounds: on one side of the net it is broken, on the other some places are allowed.
        away = (point - slider) / 600.0
        codes = [machine.check(places + shift * away) for shift in (-1e-3, 1e-3)]
        assert ((codes[0] > 0) | (codes[1] > 0)).all()
        inward += int(((codes[0] == 0) | (codes[1] == 0)).sum())
    assert inward > 1000


def test_a_drive_stands_at_its_limit_though_rounding_says_otherwise():
    machine = load_shipped("orthoglide")
    image = next(
        i
        for i in pk.sweep_drives(whole_region(machine), 8).nets
        if i.strategy.name == "rho_x and rho_y run, rho_z at max"
    )
    assert np.isfinite(image.positions).any()
    assert (machine.check(image.positions[np.isfinite(image.positions).all(-1)]) > 0).any()


@pytest.mark.parametrize(
    ("name", "why"), [("tricept", "tool turns"), ("hexapod", "tool turns"), ("orthoglide5_table", "tool turns")]
)
def test_other_machines_have_no_sweep_of_the_drives(name, why):
    with pytest.raises(NoMethodError, match=f"{name}.*{why}"):
        pk.sweep_drives(whole_region(load_shipped(name)))


# Bad input.


def test_bad_numbers_are_refused_in_one_line():
    tricept, lambda6 = (
        whole_region(load_shipped("tricept")),
        whole_region(load_shipped("lambda6"), every={"C": (0.4, 0.5)}),
    )
    flat = load_shipped("hbg80_2d")
    for step in (0.0, -1.0, np.nan, np.inf):
        for sweep in (sample_grid, sweep_polar):
            with pytest.raises(PoseError, match=r"^step: a number above 0 mm expected"):
                sweep(tricept, step)
    with pytest.raises(PoseError, match=r"^step: 0\.1 mm makes .* cells, at most 500,000,000 go; from .* mm on$"):
        sample_grid(tricept, 0.1)
    with pytest.raises(PoseError, match=r"^step: 1e-05 mm makes .* steps of a ray"):
        sweep_polar(tricept, 1e-5, planes=100.0)
    with pytest.raises(PoseError, match=r"^planes: .* planes of 72 rays"):
        sweep_polar(tricept, 1.0, planes=1e-4)
    with pytest.raises(PoseError, match=r"^planes: a number above 0 mm expected, not 0"):
        sweep_polar(tricept, 1.0, planes=0.0)
    with pytest.raises(PoseError, match=r"^turns_step: a number above 0 rad expected, not -1"):
        sample_grid(lambda6, 50.0, turns_step=-1.0)
    with pytest.raises(PoseError, match=r"^turns_step: .* turns, at most"):
        sample_grid(lambda6, 50.0, turns_step=1e-9)
    with pytest.raises(PoseError, match=r"^rays: at least 3"):
        sweep_polar(tricept, 10.0, rays=2)
    for axis in ((0.0,), (0.0, np.nan), 0.0):
        with pytest.raises(PoseError, match=r"^axis: "):
            sweep_polar(tricept, 10.0, axis=axis)
    for box in (([0.0, 0.0], [1.0, 1.0]), ([0.0] * 3, [1.0, 1.0, -1.0]), ([0.0] * 3, [1.0, 1.0, np.inf])):
        with pytest.raises(PoseError, match=r"^box: a lower and an upper corner expected, each of X Y Z in mm"):
            sample_grid(tricept, 1.0, box)
    for cells in (0, -3, 40_000):
        with pytest.raises(PoseError, match=r"^cells: 1 to 31622 parts of each drive expected"):
            pk.sweep_drives(whole_region(flat), cells)
    for question in ({"at": {"X": 200.0}}, {"without": ["*.max"]}):
        with pytest.raises(PoseError, match=r"^region: a sweep of the drives takes the whole workspace"):
            pk.sweep_drives(whole_region(flat, **question))


@pytest.fixture
def rng():
    return np.random.default_rng(11)
