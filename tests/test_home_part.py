"""The part that hangs together with home, and what is proved of the singularities of a whole region."""

from __future__ import annotations

import json
import re
from math import pi
from pathlib import Path

import numpy as np
import pytest
from regions import whole_region
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.description import find_machine_file
from parakin.performance.certified.region_singularities import judge_singularities
from parakin.performance.singularities import compute_singularity_margins
from parakin.workspaces.certified.best_orientation import find_best_orientations
from parakin.workspaces.certified.separation import find_joined_cells
from parakin.workspaces.certified.subdivision import Cells
from parakin.workspaces.certified.workspace import measure_elsewhere

# Three struts from one triangle: a ball's part above the base, and its mirror image below.
STRUTS = """\
name: struts
source: Test.
motion: tx ty tz
legs:
  {kind: length, joints: [a, b, c], foot: {circle: 10 mm, at: [0 deg, 120 deg, 240 deg]}, platform: [0, 0, 0],
   range: [LOW mm, 500 mm]}
home: {X: 0 mm, Y: 0 mm, Z: 400 mm}
"""
ROTARY_DELTA = """\
name: rotary_delta
source: Test.
motion: tx ty tz
legs:
  - {kind: crank, joints: [q0], pivot: [100 mm, 0, 0], axis: [0, 1, 0], zero: [1, 0, 0], arm: 200 mm, rod: 400 mm,
     platform: [40 mm, 0, 0], branch: "+", range: [-90 deg, 90 deg]}
  - {kind: crank, joints: [q1], pivot: [-50 mm, 86.6025403784 mm, 0], axis: [-0.866025403784, -0.5, 0],
     zero: [-0.5, 0.866025403784, 0], arm: 200 mm, rod: 400 mm, platform: [-20 mm, 34.6410161514 mm, 0],
     branch: "+", range: [-90 deg, 90 deg]}
  - {kind: crank, joints: [q2], pivot: [-50 mm, -86.6025403784 mm, 0], axis: [0.866025403784, -0.5, 0],
     zero: [-0.5, -0.866025403784, 0], arm: 200 mm, rod: 400 mm, platform: [-20 mm, -34.6410161514 mm, 0],
     branch: "+", range: [-90 deg, 90 deg]}
home: {X: 0 mm, Y: 0 mm, Z: -400 mm}
"""


@pytest.fixture
def load_text(tmp_path):
    def load(text, **replaced):
        for word, value in replaced.items():
            text = text.replace(word, value)
        path = tmp_path / "m.yaml"
        path.write_text(text)
        return pk.load(path)

    return load


@pytest.mark.parametrize("low", ["0", "350"])
def test_the_mirror_image_behind_the_base_is_not_counted(load_text, low):
    """Whether it touches the part of home or not."""
    m = load_text(STRUTS, LOW=low)
    whole, own = pk.workspace(whole_region(m)), pk.workspace(pk.region(m))
    elsewhere = measure_elsewhere(own)
    assert own.volume.inner <= 0.5 * whole.volume.outer
    assert own.volume.outer >= 0.5 * whole.volume.inner
    assert elsewhere.inner <= 0.5 * whole.volume.outer
    assert elsewhere.outer >= 0.5 * whole.volume.inner
    assert own.box[0][2] > -10.0
    assert measure_elsewhere(whole).outer == 0.0
    grid = pk.sample_grid(pk.region(m), 20.0)
    assert grid.estimate == pytest.approx(own.volume.estimate, rel=0.05)
    assert grid.box[0][2] > -10.0
    atlas = pk.atlas(pk.region(m), step=50.0, seconds=None)
    assert (atlas.map.inside.poses[:, 2] > 0.0).all()
    assert pk.find_largest_box(pk.region(m)).low[2] >= 0.0


def test_home_part_and_what_is_elsewhere_are_all_parts_of_swept_orientations():
    """Cones keep the hexapod's platform on one side of its base: there is nothing elsewhere."""
    m, ways = load_shipped("hexapod"), dict.fromkeys("ABC", (-pi / 18.0, pi / 18.0))
    own = pk.workspace(pk.region(m, every=ways), gap=0.1)
    whole = pk.workspace(pk.region(m, every=ways, components="all"), gap=0.1)
    elsewhere = measure_elsewhere(own)
    assert own.volume.inner + elsewhere.inner <= whole.volume.outer
    assert own.volume.outer + elsewhere.outer >= whole.volume.inner


def make_cells(low, size):
    low, size = np.array(low, float), np.array(size, float)
    n = len(low)
    return Cells(low, size, np.ones(n), np.ones(n), np.ones(n), np.full(n, -1), np.zeros(n))


def test_cells_that_do_not_touch_are_apart():
    """Cells of several sizes: those that hang together with the first by a corner, and two that do not."""
    low = [[0, 0], [1, 0], [2, 1], [2.5, 2], [6, 0], [6.5, 0.5]]
    size = [[1, 1], [1, 1], [1, 1], [0.5, 0.5], [0.5, 0.5], [0.5, 0.5]]
    cells = make_cells(low, size)
    assert find_joined_cells(cells, np.array([0.5, 0.5])).tolist() == [True] * 4 + [False] * 2
    assert find_joined_cells(cells, np.array([6.75, 0.75])).tolist() == [False] * 4 + [True] * 2
    assert find_joined_cells(cells, np.array([5.0, 5.0])) is None


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_cells_of_a_region_that_hangs_together_are_never_parted(dimension):
    rng = np.random.default_rng(dimension)
    for _ in range(20):
        steps = rng.integers(-1, 2, (200, dimension))
        low = np.unique(np.cumsum(steps, 0), axis=0)
        cells = make_cells(low, np.ones_like(low))
        assert find_joined_cells(cells, cells.low[0] + 0.5).all()


def test_the_command_names_what_else_there_is(capsys):
    assert main(["workspace", "hbg80_2d"]) == 0
    said = capsys.readouterr().out
    assert "in parts that home can't reach" in said
    assert "--all-parts" in said
    assert main(["workspace", "hbg80_2d", "--json"]) == 0
    own = json.loads(capsys.readouterr().out)
    assert main(["workspace", "hbg80_2d", "--all-parts", "--json"]) == 0
    whole = json.loads(capsys.readouterr().out)
    assert whole["elsewhere"]["outer"] == 0.0
    assert own["volume"]["inner"] + own["elsewhere"]["inner"] <= whole["volume"]["outer"]
    assert own["volume"]["outer"] + own["elsewhere"]["outer"] >= whole["volume"]["inner"]
    assert main(["workspace", "lambda6", "--at", "Z=1400"]) == 0
    assert "besides" not in capsys.readouterr().out


def test_a_drive_sweep_counts_the_same_parts():
    for components in ("home", "all"):
        region = pk.region(load_shipped("hbg80_2d"), components=components)
        volume = pk.workspace(region, gap=0.002).volume
        assert volume.inner * 0.999 <= pk.sweep_drives(region, 2000).estimate <= volume.outer * 1.001


# Singularities.


def test_a_singularity_is_proved_or_said_to_be_unproved():
    verdicts = {
        name: {s.margin: s.verdict for s in judge_singularities(pk.region(load_shipped(name)))}
        for name in ("hexapod", "linear_delta", "orthoglide", "hbg80_2d", "hbg80_3d", "tricept")
    }
    for name in ("orthoglide", "hbg80_2d", "hbg80_3d"):
        assert verdicts[name].pop("parallel") == "met"
    for name in ("hexapod", "linear_delta", "orthoglide", "hbg80_3d"):
        assert set(verdicts[name].values()) == {"none"}
    assert set(verdicts["hbg80_2d"].values()) == {"met"}  # they touch zero where a leg is stretched
    assert verdicts["tricept"]["serial theta1-theta2"] == "met"  # it touches zero on the wrist's pole
    assert verdicts["tricept"]["parallel"] == "none"


def test_a_stretched_leg_is_proved(load_text):
    # The rod of a slide on X is stretched where the tool is as far from the slide's rail as the rod is long.
    plane = load_shipped("hbg80_2d")
    for index, verdict in enumerate(judge_singularities(pk.region(plane))[1:]):
        assert verdict.verdict == "met"
        assert plane.check(verdict.pose) == 0
        assert abs(verdict.pose[1 - index]) == pytest.approx(400.0, abs=1.0)
    text = re.sub("range: .*", "range: [-9 m, 9 m]", find_machine_file("orthoglide").read_text())
    machine = load_text(text)
    length = machine.spec.sizes["L"]
    for axis, verdict in enumerate(judge_singularities(pk.region(machine))[1:]):
        assert verdict.verdict == "met"
        assert machine.check(verdict.pose) == 0
        assert np.linalg.norm(np.delete(verdict.pose, axis)) == pytest.approx(length, abs=1.0)


def test_a_singularity_beyond_a_gap_is_not_met():
    # A link upright at a radius of 500 mm is singular; its slide's range leaves two rings, on both sides of that.
    machine = pk.load(Path(__file__).parent / "machines" / "sector.yaml")
    assert judge_singularities(pk.region(machine))[0].verdict == "none"


def test_a_sign_change_in_a_corner_of_the_reach_is_proved():
    # The rods of two slides are stretched there; det A is below zero within some tenths of a mm.
    machine = pk.load(Path(__file__).parent / "machines" / "six_vertical_rails.yaml")
    verdict = judge_singularities(pk.region(machine, at={"Z": 0.0}))[0]
    assert verdict.verdict == "met"
    assert machine.check(verdict.pose) == 0
    feet, arms = np.radians([43, 137, 163, 257, 283, 17]), np.radians([72, 108, 192, 228, 312, 348])
    arms = 85.0 * np.array([np.cos(arms), np.sin(arms), 0.0 * arms]).T
    sides = []
    for x, y in (machine.home[:2], verdict.pose[:2]):
        rods = arms + [x, y, 0.0]
        rods[:, :2] -= 260.0 * np.array([np.cos(feet), np.sin(feet)]).T
        rods[:, 2] = np.sqrt(265.0**2 - (rods[:, :2] ** 2).sum(1))
        sides.append(np.linalg.det(np.hstack([rods / 265.0, np.cross(arms, rods) / 265.0 / 85.0])))
    assert sides[0] * sides[1] < -1e-3


@pytest.mark.parametrize(("b", "c"), [(0.0, 0.0), (0.3, 0.7), (0.2, -2.0)])
def test_a_pole_that_a_region_meets_is_proved(b, c):
    # The platform of a Tricept hangs along the line from its centre, the origin, to the wrist: on the pole the tip is
    # on the line through the origin along the tool's axis k.
    m = load_shipped("tricept")
    verdict = judge_singularities(pk.region(m, at={"B": b, "C": c}))[-1]
    assert verdict.verdict == "met"
    k = np.array([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)])
    tip = verdict.pose[:3]
    assert np.linalg.norm(tip - (tip @ k) * k) < 1.0
    assert m.check(verdict.pose) == 0


def test_a_pole_that_is_nowhere_or_everywhere_is_told():
    m = load_shipped("orthoglide5_head")  # its platform does not turn
    assert judge_singularities(pk.region(m))[-1].verdict == "met"
    assert judge_singularities(pk.region(m, at={"B": 0.2, "C": 0.1}))[-1].verdict == "none"


def test_the_verdict_does_not_hang_on_the_step(load_text):
    m = load_text(ROTARY_DELTA)
    verdicts = []
    for step in (100.0, 40.0):
        atlas = pk.atlas(pk.region(m), step=step, seconds=None)
        verdicts.append([(s.margin, s.verdict) for s in atlas.singularities])
        for singularity in atlas.singularities:
            if singularity.verdict == "met":
                margins = compute_singularity_margins(m, singularity.pose)
                most = 0.0 if "changes sign" in singularity.reason else 0.02  # of 1, beside a zero that is only touched
                assert margins[atlas.map.performance.margin_names.index(singularity.margin)] < most
                assert m.check(singularity.pose) == 0
            if singularity.verdict == "none":
                assert atlas.extreme(singularity.margin, "least").value > 0.0
    assert all(verdict == verdicts[0] for verdict in verdicts)


def test_nothing_proved_free_is_singular_in_samples():
    for name in ("hexapod", "linear_delta", "tricept", "orthoglide", "hbg80_3d"):
        region = pk.region(load_shipped(name))
        box, m = pk.workspace(region).box, region.machine
        positions = np.random.default_rng(3).uniform(*box, (20_000, 3))
        poses = region.poses(positions)
        margins = compute_singularity_margins(m, poses[m.check(poses) == 0])
        margins = margins[margins[:, 0] > 0.0]  # home's side
        assert len(margins) > 1000
        for number, singularity in enumerate(judge_singularities(region)):
            if singularity.verdict == "none":
                assert (margins[:, number] > 0.0).all(), (name, singularity)


def test_the_command_says_what_is_proved(capsys):
    assert main(["atlas", "orthoglide", "--step", "50"]) == 0
    said = capsys.readouterr().out
    assert "singular: parallel, proved" in said
    assert "not singular: serial rho_x, serial rho_y, serial rho_z, proved" in said
    assert main(["atlas", "hbg80_2d", "--step", "50"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"singular: serial Xhbg, proved: at X -?\d+\.\d+, Y 399\.\d+; its margin falls to zero", said)
    assert main(["atlas", "linear_delta", "--step", "50", "--json"]) == 0
    region = json.loads(capsys.readouterr().out)["region"]
    assert region["singular"] == []
    assert {s["verdict"] for s in region["singularities"].values()} == {"none"}


def test_a_swept_region_of_home_has_its_assembly_mode(load_text):
    m = load_shipped("hexapod")
    swept = pk.workspace(pk.region(m, every={"A": (-0.1, 0.1)}), gap=0.1, seconds=20)
    whole = pk.workspace(whole_region(m, every={"A": (-0.1, 0.1)}), gap=0.1, seconds=20)
    assert swept.volume.inner <= whole.volume.outer
    assert swept.volume.outer >= 0.9 * whole.volume.inner
    assert 0.0 < swept.volume.inner < 4.0 / 3.0 * pi * 1e9


# Inclusive regions.


@pytest.mark.parametrize("name", ["orthoglide5_table", "tricept"])
def test_an_inclusive_region_with_wide_ranges_has_a_bracket_and_an_honest_estimate(name):
    """A table that turns all round bounds the workpiece's positions; wide bounds are no estimate."""
    region = pk.region(load_shipped(name), some={"B": ("0 deg", "50 deg"), "C": (-pi, pi)})
    found = pk.workspace(region, seconds=3.0)
    volume, box = found.volume, found.box
    positions = np.random.default_rng(1).uniform(*box, (1500, 3))
    allowed = (find_best_orientations(region, positions)[1] >= 0.0).all(1)
    size = float(np.prod(box[1] - box[0]))
    error = 4.0 * size * np.sqrt(allowed.mean() / len(positions))
    assert volume.inner <= size * allowed.mean() + error
    assert volume.outer >= size * allowed.mean() - error
    assert abs(volume.estimate - size * allowed.mean()) <= error + 0.3 * volume.estimate  # it ends by time


def test_a_vague_estimate_is_said_to_be_one(capsys):
    assert main(["workspace", "tricept", "--some", "B=0:40,C=-180:180", "--time", "1"]) == 0
    assert "a guess from samples" in capsys.readouterr().out


PLANAR = """
name: planar
source: a test's own
motion: {motion}
legs:
  - {{kind: length, joints: [d1], foot: {feet[0]}, platform: {corners[0]}, range: [10 mm, 2 m]}}
  - {{kind: length, joints: [d2], foot: {feet[1]}, platform: {corners[1]}, range: [10 mm, 2 m]}}
  - {{kind: length, joints: [d3], foot: {feet[2]}, platform: {corners[2]}, range: [10 mm, 2 m]}}
home: {{{home}}}
"""


def test_a_single_turn_is_swept_all_round_about_any_axis(load_text):
    feet, corners = [(0, 0), (900, 0), (450, 780)], [(0, 0), (100, 0), (50, 90)]

    def write(points, axes):
        """Write points whose two coordinates are along two of the axes."""
        return [
            "[{}]".format(", ".join(f"{dict(zip(axes, p, strict=True)).get(a, 0)} mm" for a in "xyz")) for p in points
        ]

    volumes = []
    # right-handed pairs: about Z from X to Y, about Y from Z to X
    for motion, axes, home in (
        ("tx ty rz", "xy", "X: 400 mm, Y: 200 mm, C: 20 deg"),
        ("tz tx ry", "zx", "Z: 400 mm, X: 200 mm, B: 20 deg"),
    ):
        text = PLANAR.format(motion=motion, feet=write(feet, axes), corners=write(corners, axes), home=home)
        machine = load_text(text)
        (ends,) = machine.orientation_ranges.values()
        assert ends == (-np.pi, np.pi)
        volumes.append(pk.workspace(pk.region(machine, dexterous=True, components="all"), gap=0.05).volume)
    assert volumes[0].inner <= volumes[1].outer
    assert volumes[1].inner <= volumes[0].outer
