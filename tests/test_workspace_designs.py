"""Designs with the largest workspace, against other sizes' proved volumes and machines of their own."""

import sys
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.export.designs import list_shown_values
from parakin.synthesis.design_tapes import DesignTapes
from parakin.synthesis.pose_sets import make_box_set
from parakin.synthesis.workspace_gauge import WorkspaceGauge

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from largest_workspace import make_problem

DELTA = {"X": (-20.0, 20.0), "Y": (-20.0, 20.0), "Z": (270.0, 290.0)}
TILTS = {"A": (-0.35, 0.35), "B": (-0.35, 0.35), "C": (0.17, 0.87)}


def bound_volume(machine):
    return pk.workspace(pk.region(machine), gap=0.03).volume


def test_no_tower_has_a_larger_workspace():
    machine = load_shipped("linear_delta")
    found = pk.find_designs(pk.DesignProblem(machine, {"tower": (250.0, 450.0)}, DELTA, maximise=["workspace"]))
    (best,) = found.front
    assert list_shown_values(found, 0)["workspace"] == pytest.approx(1e-6 * best.values["workspace"])  # litres
    volume = bound_volume(best.machine)
    assert volume.inner <= best.values["workspace"] * (1.0 + 1e-9) <= volume.outer
    assert best.proved["workspace"] == best.values["workspace"]
    others = [bound_volume(machine.replace_parameters({"tower": tower})) for tower in (250.0, 450.0)]
    assert best.values["workspace"] > 0.97 * max(other.outer for other in others)
    assert min(other.outer for other in others) < 0.8 * best.values["workspace"]


def test_the_estimate_counts_what_machines_of_those_sizes_allow():
    machine = load_shipped("lambda6")
    tapes = DesignTapes(machine, ["c", "r"], False, None, None, None)
    poses = make_box_set(machine, {"X": (-50.0, 50.0), "Y": (-50.0, 50.0), "Z": (1350.0, 1450.0), **TILTS}, "box")
    gauge = WorkspaceGauge(tapes, poses)
    sizes = np.array([[1200.0, 300.0], [1300.0, 450.0]])
    told = gauge.estimate(sizes, np.tile(machine.home, (2, 1)))
    rng, tilts = np.random.default_rng(0), np.array(list(TILTS.values()))
    low, high = np.array([-900.0, -900.0, 0.0]), np.array([900.0, 900.0, 3000.0])
    for (c, r), estimate in zip(sizes, told, strict=True):
        made, positions = machine.replace_parameters({"c": c, "r": r}), rng.uniform(low, high, (30_000, 3))
        for _ in range(30):
            turns = np.where(rng.random((len(positions), 3)) < 0.5, tilts[:, 0], tilts[:, 1])
            positions = positions[made.check(np.hstack([positions, turns])) == 0]
        assert estimate == pytest.approx(np.prod(high - low) * len(positions) / 30_000, rel=0.1)


def test_no_drawn_lambda_is_larger_than_the_examples():
    problem = make_problem()
    best = dict(zip("Dcur", (150.0, 1261.0, 818.4, 500.0), strict=True))  # as examples/largest_workspace.py finds it
    nominal = {parameter.name: parameter.value for parameter in problem.machine.parameters}
    names, (low, high) = problem.family.names, problem.ranges.T
    drawn = np.random.default_rng(0).uniform(low, high, (24, len(names)))
    sizes = np.vstack([[[own[name] for name in names] for own in (best, nominal)], drawn])
    middle = problem.place_poses(drawn[0], problem.middle)
    largest, shipped, *others = problem.gauge.estimate(sizes, np.repeat(middle, len(sizes), 0))
    assert largest == pytest.approx(0.45e9, rel=0.05)  # by 60,000 positions drawn
    assert shipped == pytest.approx(0.14e9, rel=0.05)
    assert max(others) < largest


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fit_strokes": True}, "fit_strokes: the drives' ranges are fitted, workspace needs the machine's own"),
        ({"bounds": {"workspace": 1e6}}, "bounds: workspace has none; it can be an objective"),
        ({"maximise": (), "minimise": ["workspace"]}, "minimise: of workspace more is better; it belongs to maximise"),
    ],
)
def test_what_makes_no_sense_is_said(changes, message):
    given = {"box": DELTA, "maximise": ["workspace"], **changes}
    with pytest.raises(pk.PoseError) as caught:
        pk.DesignProblem(load_shipped("linear_delta"), {"tower": (250.0, 450.0)}, **given)
    assert str(caught.value) == message
