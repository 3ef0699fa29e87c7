"""Proofs over boxes of poses: bounds against samples, singularities and false claims against real poses."""

import numpy as np
import pytest
from shipped import load_shipped
from test_performance import everyone, twist_jacobians

import parakin as pk
from parakin.budget import Budget
from parakin.performance.certified.bisection import find_undecided_boxes
from parakin.performance.certified.proofs import (
    bracket_extremes,
    make_pose_box,
    prove_amplification,
    prove_no_singularity,
)
from parakin.performance.indices import compute_performance
from parakin.performance.singularities import compute_singularity_margins
from parakin.workspaces.certified.matrix_bounds import MatrixBounds


def cube(m, low, high):
    return make_pose_box(pk.region(m), dict.fromkeys(m.axes, (low, high)))


BOXES = {
    "eclipse": {"X": (-5, 5), "Z": (145, 155), "B": (-0.02, 0.02)},
    "four_struts": {"X": (90, 120), "Y": (-10, 20), "Z": (-1110, -1090), "C": (-0.1, 0.1)},
    "hbg80_2d": {"X": (200, 260), "Y": (190, 230)},
    "hbg80_3d": {"X": (60, 120), "Y": (60, 100), "Z": (-150, -100)},
    "hexapod": {"X": (-20, 30), "Y": (10, 30), "A": (-0.1, 0.1), "C": (0.0, 0.1)},
    "lambda6": {"X": (-20, 30), "Z": (1380, 1420), "B": (-0.1, 0.1), "C": (0.4, 0.6)},
    "linear_delta": {"X": (-40, 40), "Y": (-40, 20), "Z": (260, 300)},
    "orthoglide": {"X": (-60, 40), "Y": (-40, 40), "Z": (-10, 40)},
    "orthoglide5_head": {"X": (-20, 20), "B": (0.3, 0.35), "C": (3.1, 3.2)},  # over the jump at 180°
    "orthoglide5_table": {"Y": (-10, 10), "B": (0.3, 0.33), "C": (-0.03, 0.02)},
    "pentapod": {"Y": (-10, 10), "B": (0.3, 0.33), "C": (-0.03, 0.02)},
    "rrr3": {"X": (-5, 5), "Y": (5, 10), "C": (-0.01, 0.01)},
    "sprint_z3": {"Z": (240, 260), "B": (0.3, 0.33), "C": (-0.03, 0.02)},
    "exechon": {"X": (-320, -280), "Y": (-20, 20), "Z": (-1420, -1400)},
    "triglide_pairs": {"X": (-20, 20), "Y": (-10, 20), "Z": (-560, -540)},
    "tricept": {"X": (-320, -280), "Y": (-20, 20), "Z": (-1620, -1600)},
}


@everyone
def test_bounds_over_boxes_hold_the_rates_at_their_samples(m):
    box = make_pose_box(pk.region(m), BOXES[m.name])
    points = np.random.default_rng(6).uniform(box.low, box.high, (500, len(box.ranges)))
    scale = box.length.factor
    turns = len(m.structure.turns)
    columns = {
        "a": np.array([1.0] * (len(m.axes) - turns) + [1 / scale] * turns),
        "b": np.where(np.array(m.joint_units) == "rad", 1 / scale, 1.0),
    }
    for name, rates in zip("ab", twist_jacobians(m, box.poses(points)), strict=True):
        found = MatrixBounds(getattr(box, name), box.inputs, box.trace)(box.low[None], box.high[None])
        assert found.bounded.all()
        linear = found.middle[0] + np.einsum("nd,dij->nij", points - 0.5 * (box.low + box.high), found.slopes[0])
        size = np.abs(found.middle).max()
        assert (np.abs(rates * columns[name] - linear) <= found.rest[0] + 1e-12 * size).all()
        assert found.rest.max() < 0.3 * size  # and they tell something


@everyone
def test_brackets_hold_the_amplification_of_every_sample(m):
    box = make_pose_box(pk.region(m), BOXES[m.name])
    found = bracket_extremes(box, tolerance=1e-3, boxes=6_000)
    points = np.random.default_rng(6).uniform(box.low, box.high, (5000, len(box.ranges)))
    told = compute_performance(m, box.poses(points))
    least, greatest = found.brackets
    assert told.greatest.max() <= greatest.high
    assert told.least.min() >= least.low
    assert compute_performance(m, greatest.pose).greatest == pytest.approx(greatest.low)
    assert compute_performance(m, least.pose).least == pytest.approx(least.high)
    assert greatest.low >= told.greatest.max() * (1 - 1e-6)
    if m.name != "tricept":
        assert least.closed
        assert greatest.closed
        assert greatest.high <= greatest.low * 1.001
    for bracket in found.brackets:
        inside = [bracket.pose[m.axes.index(axis)] for axis in box.ranges]
        assert (inside >= box.low).all()
        assert (inside <= box.high).all()


@everyone
def test_boxes_are_proved_free_of_singularities(m):
    box = make_pose_box(pk.region(m), BOXES[m.name])
    for kind in ("parallel", "serial"):
        assert prove_no_singularity(box, kind).verdict == "proved"


def test_the_shipped_orthoglide_keeps_its_bounds_in_its_cube():
    m = load_shipped("orthoglide")
    rod = m.spec.sizes["L"]
    low, high = -2 * rod / np.sqrt(17), rod / np.sqrt(11)
    proof = prove_amplification(cube(m, low, high), 1 / 3, 3)
    assert proof.verdict == "proved"
    assert proof.counterexample is None
    assert proof.tolerance == 1e-6
    least, greatest = proof.brackets
    assert greatest.low == pytest.approx(3, rel=1e-9)  # reached in both corners on the diagonal
    assert 3 <= greatest.high <= 3 * (1 + 1e-6)
    assert least.low <= 3 / 7 * (1 + 1e-12)
    assert least.high == pytest.approx(3 / 7, rel=1e-9)


def test_a_false_claim_on_the_amplification_is_refuted_by_a_pose():
    m = load_shipped("orthoglide")
    for low, high, bounds in ((-100, 90, (1 / 3, 3)), (-100, 60, (0.6, 3)), (-123.4, 76, (1 / 3, 2.999))):
        proof = prove_amplification(cube(m, low, high), *bounds)
        assert proof.verdict == "refuted"
        psi = compute_performance(m, proof.counterexample).psi
        assert psi.max() > bounds[1] * (1 + 1e-6) or psi.min() < bounds[0] * (1 - 1e-6)
        assert ((proof.counterexample >= low) & (proof.counterexample <= high)).all()


def test_singularities_are_met():
    m = load_shipped("orthoglide")
    proof = prove_no_singularity(cube(m, -100, 150), "parallel")
    assert proof.verdict == "refuted"
    assert abs(compute_singularity_margins(m, proof.counterexample)[0]) < 1e-12
    proof = prove_amplification(cube(m, -100, 150), 0.1, 100.0)
    assert proof.verdict == "refuted"
    assert compute_performance(m, proof.counterexample).greatest > 1e6
    m = load_shipped("lambda6")
    for box in (make_pose_box(pk.region(m), {"C": (-0.1, 0.3)}), make_pose_box(pk.region(m, at={"C": 0.0}), {})):
        proof = prove_no_singularity(box, "parallel")
        assert proof.verdict == "refuted"
        assert abs(proof.counterexample[5]) < 1e-9
        assert prove_no_singularity(box, "serial").verdict == "proved"
    m = load_shipped("tricept")
    box = make_pose_box(pk.region(m), {"X": (-110, 90), "Y": (-130, 70), "Z": (-1650, -1500)})
    proof = prove_no_singularity(box, "serial")
    assert proof.verdict == "refuted"
    assert np.abs(proof.counterexample[:2]).max() < 1e-5  # the wrist stands straight
    assert prove_no_singularity(box, "parallel").verdict == "proved"


def test_what_is_left_open_is_told_as_a_fraction():
    """Bisection of a square of which all but the least corner, a quarter in each direction, can be decided."""

    def decide(low, high):
        return ~((low < 0.25).all(1)), (high - low).argmax(1)

    left = find_undecided_boxes(decide, np.zeros(2), np.ones(2), Budget(None, 30))
    assert left.fraction == 0.25**2
    assert (left.middle < 0.25).all()
    decided = find_undecided_boxes(lambda low, high: (low[:, 0] >= 0.0, low[:, 0]), np.zeros(2), np.ones(2), Budget())
    assert decided is None


def test_a_box_out_of_reach_is_refuted_and_one_out_of_time_is_left_open():
    m = load_shipped("orthoglide")
    proof = prove_no_singularity(cube(m, -100, 200), "serial")
    assert proof.verdict == "refuted"
    assert "does not reach" in proof.reason
    assert np.isnan(m.inverse(proof.counterexample)).all()
    proof = prove_no_singularity(cube(m, -120, 75), "parallel", boxes=2)
    assert (proof.verdict, proof.undecided) == ("undecided", 1.0)
    assert proof.reason == "left open about there, in 100 % of the box"
    assert proof.counterexample is not None
    proof = prove_amplification(cube(m, -120, 75), 0.4, 2.9999, boxes=10)
    assert proof.verdict == "undecided"
    assert "psi lies between" in proof.reason


def test_boxes_that_are_none():
    m = load_shipped("tricept")
    wrong = [{"Q": (0, 1)}, {"X": (1, 0)}, {"X": (0, np.inf)}]
    for ranges in wrong:
        with pytest.raises(pk.PoseError):
            make_pose_box(pk.region(m), ranges)
    for at in ({"X": 0.0}, {"Y": np.nan}, {"Q": 0.0}):
        with pytest.raises(pk.PoseError):
            make_pose_box(pk.region(m, at=at), {"X": (0, 1)})
    box = make_pose_box(pk.region(m), {"X": (0, 1)})
    for bounds in ((-1, 2), (2, 1), (0, np.inf)):
        with pytest.raises(pk.PoseError):
            prove_amplification(box, *bounds)
