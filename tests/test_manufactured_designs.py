"""Designs for all machines within tolerance: against machines that are drawn, the worst corners among them."""

import json
import re
from functools import cache

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.accuracy.tolerances import make_tolerance_family, read_tolerances
from parakin.cli import main
from parakin.synthesis.manufactured import SizeBox
from parakin.synthesis.pose_sets import make_box_set

CUBE = dict.fromkeys("XYZ", (-100.0, 100.0))
WITHIN = {"feet": "0.1 mm", "rods": "0.05 mm"}
BOUND = 3.0
TRICEPT = {"X": (-530.0, 530.0), "Y": (-492.0, 492.0), "Z": (-130.0, 130.0), "B": 0.0, "C": 0.0}


def glide(within):
    return pk.DesignProblem(
        load_shipped("orthoglide"), {"L": (150.0, 500.0)}, CUBE, ["L"], {"X Y Z": (-150.0, 150.0)},
        {"amplification": BOUND}, fit_strokes=True, within=within,
    )  # fmt: skip


def find_best(problem):
    found = pk.find_designs(problem)
    assert not found.unproved
    assert not found.shortfall
    return found.front[0]


@cache
def find_nominal():
    return find_best(glide(None))


class Made:
    """Machines of a design within tolerance: numbers moved by parts -1 to 1 of it."""

    def __init__(self, design, within):
        self.family, _, self.halves, _ = make_tolerance_family(design.machine, read_tolerances(within))
        self.low, self.high = np.array([design.box[axis] for axis in design.machine.axes]).T

    def draw_poses(self, count):
        """Corners of the box, and poses in it."""
        rng = np.random.default_rng(4)
        inside = rng.uniform(self.low, self.high, (count, len(self.low)))
        return np.concatenate([np.where(rng.random(inside.shape) < 0.5, self.low, self.high), inside])

    def draw_moves(self, count):
        rng, k = np.random.default_rng(3), len(self.halves)
        return np.concatenate([rng.choice([-1.0, 1.0], (count, k)), rng.uniform(-1.0, 1.0, (count, k))])

    def measure_amplification(self, moves, poses):
        """The greatest of each machine, (machines,); of three translations it is that of A⁻¹B."""
        a, b, _ = self.family.jacobians(poses, (self.family.nominal + moves * self.halves)[:, None])
        singular = np.linalg.svd(np.linalg.solve(a, b), compute_uv=False)
        return np.maximum(singular[..., 0], 1.0 / singular[..., -1]).max(1)

    def find_worst_move(self, poses):
        """Each number at the end at which the amplification is greater, moved alone."""
        alone = np.eye(len(self.halves))
        return np.sign(self.measure_amplification(alone, poses) - self.measure_amplification(-alone, poses))

    def find_least_margin(self, moves, poses):
        return self.family.margins(poses, (self.family.nominal + moves * self.halves)[:, None]).min()


@pytest.mark.parametrize("within", [WITHIN, {"L": "0.1 mm", "rods": "0.05 mm"}])
def test_every_machine_that_is_made_keeps_the_bounds(within):
    best, nominal = find_best(glide(within)), find_nominal()
    assert best.sizes["L"] > nominal.sizes["L"] + 0.1
    worst, margins = [], []
    for design in (best, nominal):
        made = Made(design, within)
        poses = made.draw_poses(100)
        moves = np.concatenate([made.find_worst_move(poses)[None], made.draw_moves(200)])
        worst.append(made.measure_amplification(moves, poses).max())
        margins.append(made.find_least_margin(moves, poses))
    assert margins[0] >= 0.0 > margins[1]
    assert worst[1] > BOUND * (1.0 + 1e-3)
    assert best.values["amplification"] < worst[0] <= best.proved["amplification"] <= BOUND * (1.0 + 2e-6)
    assert worst[0] > 0.99 * BOUND  # no more is kept in hand than is needed


def test_a_tricept_keeps_its_strokes_whatever_feet_are_made():
    shift, within = {"Y": (-200.0, 200.0), "Z": (-2000.0, -1000.0)}, {"feet": "0.2 mm", "platform": "0.2 mm"}
    problem = pk.DesignProblem(
        load_shipped("tricept"), {"R": (200.0, 500.0)}, TRICEPT, ["footprint"], shift,
        within=within,
    )  # fmt: skip
    best = find_best(problem)
    assert 400.0 + 2.0 * 0.2 < best.proved["footprint"] < 400.0 + 2.0 * 0.2 * np.sqrt(2.0) * 1.2
    made = Made(best, within)
    assert made.find_least_margin(made.draw_moves(100), made.draw_poses(300)) >= 0.0


def test_a_delta_keeps_clearances_and_cones_whatever_is_made():
    tolerances = {"feet": "0.5 mm", "platform": "0.5 mm", "rods": "0.2 mm"}
    box, missed = {"X": (-120.0, 120.0), "Y": (-120.0, 120.0), "Z": (230.0, 330.0)}, []
    for within in (tolerances, None):
        problem = pk.DesignProblem(
            load_shipped("linear_delta"), {"plate": (20.0, 120.0)}, box, ["plate"], fit_strokes=True, within=within
        )  # fmt: skip
        made = Made(find_best(problem), tolerances)
        moves = (made.family.nominal + made.draw_moves(100) * made.halves)[:, None]
        least = made.family.margins(made.draw_poses(50), moves).min((0, 1))
        missed.append([name for name, margin in zip(problem.machine.limits, least, strict=True) if margin < 0.0])
    assert not missed[0]
    assert "clearance tower_a-tower_b" in missed[1]


@pytest.mark.parametrize("name", ["hexapod", "linear_delta"])
def test_signs_that_are_proved_are_those_of_every_machine(name):
    """The closer proofs of cones and clearances, on parts of a box where one of them ends."""
    m, rng = load_shipped(name), np.random.default_rng(7)
    ends = {axis: ((home - 400.0, home + 400.0) if axis in "XYZ" else (-0.6, 0.6)) for axis, home in
            zip(m.axes, m.home.tolist(), strict=True)}  # fmt: skip
    poses = make_box_set(m, ends, "box")
    size_box = SizeBox(m, {"feet": "0.25 mm", "platform": "0.25 mm"})
    limits = [c for c in size_box.trace_set(poses).build_limits() if c.sign is not None]
    nominal = [c for c in poses.trace(m).build_limits() if c.sign is not None]
    columns = [m.limits.index(c.name) for c in limits]
    low, high = poses.bounds
    drawn = rng.uniform(low, high, (20_000, len(low)))
    near = np.abs(m.margins(drawn)[:, columns] * [1.0 if "clear" in c.name else 300.0 for c in limits]).min(1)
    middle = drawn[near.argsort()[:100]]
    half = 10.0 ** rng.uniform(-5, -1, (100, 1)) * (high - low)
    numbers = [np.tile(end, (len(half), 1)) for end in size_box.bounds]
    boxes = np.hstack([middle - half, numbers[0]]), np.hstack([middle + half, numbers[1]])
    signs = np.stack([c.sign(*boxes).sign for c in limits], 1)
    of_nominal = np.stack([c.sign(middle - half, middle + half).sign for c in nominal], 1)
    known, wrong = size_box.nominal, 0
    for move in rng.choice([-1.0, 1.0], (10, len(known))) * size_box.halves:
        made = m.replace_parameters(dict(zip(size_box.names, (known + move).tolist(), strict=True)))
        margins = made.margins(middle + half * rng.uniform(-1.0, 1.0, half.shape))[:, columns]
        assert not ((signs > 0.0) & (margins < 0.0) | (signs < 0.0) & (margins >= 0.0)).any()
        wrong += np.count_nonzero((of_nominal > 0.0) & (margins < 0.0) | (of_nominal < 0.0) & (margins >= 0.0))
    assert (signs > 0.0).mean() > 0.5
    assert (signs < 0.0).any()
    assert wrong > 0  # the nominal machine's signs are not those of all


def test_more_than_can_be_kept_is_said():
    found = pk.find_designs(glide({"rods": "60 mm"}))
    assert not found.front
    assert re.search(
        r"breaks amplification: .* at most 3 is wanted and \S+ kept in hand for tolerances", found.shortfall
    )


def test_the_command_tells_of_which_machines(capsys, tmp_path):
    path = tmp_path / "made.yaml"
    (tmp_path / "part.apt").write_text("UNITS/MM\nFEDRAT/20000,MMPM\nGOTO/-50,0,0\nGOTO/50,20,0\nFINI\n")
    path.write_text(
        "machine: orthoglide\nfree: {L: [150 mm, 500 mm]}\n"
        "box: {X: [-100 mm, 100 mm], Y: [-100 mm, 100 mm], Z: [-100 mm, 100 mm]}\n"
        "bounds: {amplification: 4}\nwithin: {rods: 0.05 mm}\nstrokes: fit\nminimise: L\npart: part.apt\n"
    )
    assert main(["design", str(path)]) == 0
    said = capsys.readouterr().out
    assert "1 proved of all machines within rods 0.05 mm, the part run on the nominal one" in said
    assert main(["design", str(path), "-o", str(tmp_path / "out"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["within"] == {"rods": "0.05 mm"}
    assert said["designs"][0]["verdict"] == "proved"
    assert "# of every machine with rods within 0.05 mm" in (tmp_path / "out" / "design_1.yaml").read_text()


@pytest.mark.parametrize(
    ("within", "message"),
    [
        ({"foots": "0.1 mm"}, 'within: tolerance foots: unknown "foots"'),
        ({"rods": "0.1"}, 'within: tolerance rods: "0.1" needs a unit'),
        ({"rods": "1 deg"}, "within: tolerance rods: legs.rho_x.rod is a length"),
        ({}, "within: tolerances: at least one expected"),
    ],
)
def test_bad_tolerances_are_refused(within, message):
    with pytest.raises(pk.PoseError) as caught:
        glide(within)
    assert str(caught.value).startswith(message)
