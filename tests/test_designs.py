"""Searched designs against the Orthoglide's closed form, samples of the whole box, and refusals."""

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.performance.design import design_orthoglide
from parakin.performance.indices import compute_performance

CUBE = dict.fromkeys("XYZ", (-100.0, 100.0))
GLIDE = """\
machine: orthoglide
free: {L: [150 mm, 500 mm]}
box: {X: [-100 mm, 100 mm], Y: [-100 mm, 100 mm], Z: [-100 mm, 100 mm]}
shift: {X Y Z: [-150 mm, 150 mm]}
bounds: {amplification: 3}
strokes: fit
minimise: L
"""


def glide(minimise, bound):
    free, shift = {"L": (150.0, 500.0)}, {"X Y Z": (-150.0, 150.0)}
    bounds = {"amplification": bound}
    return pk.DesignProblem(load_shipped("orthoglide"), free, CUBE, minimise, shift, bounds, fit_strokes=True)


def test_the_search_finds_the_closed_form_and_proves_it():
    found, known = pk.find_designs(glide(["L"], 3.0)), design_orthoglide(200.0, 3.0)
    assert not found.unproved
    assert not found.shortfall
    (best,) = found.front
    assert best.sizes["L"] == pytest.approx(known.rod, rel=1e-9)
    assert best.box["X"] == pytest.approx(known.cube, rel=1e-6)
    assert best.values["amplification"] == pytest.approx(3.0, rel=1e-9)
    for ends in best.ranges.values():
        assert ends == pytest.approx(known.stroke, rel=1e-6)
    poses = np.random.default_rng(0).uniform(*best.box["X"], (20_000, 3))
    assert (best.machine.check(poses) == 0).all()
    told = compute_performance(best.machine, poses)
    assert max(told.greatest.max(), 1.0 / told.least.min()) <= 3.0 * (1.0 + 1e-6)


def test_a_tricept_holds_the_box_of_the_figure_with_less_footprint():
    box = {"X": (-530.0, 530.0), "Y": (-492.0, 492.0), "Z": (-130.0, 130.0), "B": 0.0, "C": 0.0}
    shift = {"Y": (-200.0, 200.0), "Z": (-2000.0, -1000.0)}
    problem = pk.DesignProblem(load_shipped("tricept"), {"R": (200.0, 500.0)}, box, ["footprint"], shift)
    (best,) = pk.find_designs(problem).front
    assert best.values["footprint"] == pytest.approx(400.0, rel=1e-6)  # feet on a circle of radius R, at its least
    axes = best.machine.axes
    low, high = np.array([best.box[axis] for axis in axes]).T
    assert high - low == pytest.approx([1060.0, 984.0, 260.0, 0.0, 0.0])
    poses = np.random.default_rng(0).uniform(low, high, (20_000, len(axes)))
    assert (best.machine.check(poses) == 0).all()


@pytest.mark.parametrize("name", ["orthoglide", "hexapod", "tricept", "rotary_delta"])
def test_measures_are_those_of_the_machine(name):
    m = load_shipped(name)
    parameter = m.parameters[0]
    free = {parameter.name: (parameter.value - 1.0, parameter.value + 1.0)}
    home = dict(zip(m.axes, m.home.tolist(), strict=True))
    box = {axis: (home[axis] - 5.0, home[axis] + 9.0) for axis in "XYZ"}
    problem = pk.DesignProblem(m, free, box, ["footprint"])
    points = problem.make_points(0, np.random.default_rng(1).random((20, 3)))
    x = np.array([[parameter.value], [parameter.value + 0.5]])
    measures = problem.measure(x, points)
    for number in range(2):
        own = m.replace_parameters({parameter.name: x[number, 0]})
        poses = problem.place_poses(x[number], points)
        told = compute_performance(own, poses, problem.tapes.length.value)
        assert measures.psi[number, :, 0] == pytest.approx(told.greatest, rel=1e-9)
        assert 1.0 / measures.psi[number, :, 1] == pytest.approx(told.least, rel=1e-9)
        joints = own.inverse(poses)[:, : m.leg_count]
        assert measures.joints[number] == pytest.approx(joints, rel=1e-12)
        margins = own.margins(poses)[:, problem.tapes.counted] * problem.tapes.limit_scales
        assert np.allclose(measures.margins[number], margins, rtol=1e-9, atol=1e-12, equal_nan=True)


def test_the_footprint_of_the_hexapod_is_its_feet():
    m = load_shipped("hexapod")
    box = {**CUBE, "Z": tuple(m.home[2] + [0, 1])}
    problem = pk.DesignProblem(m, {m.parameters[0].name: (1.0, 2000.0)}, box, ["footprint"])
    feet = problem.measure(np.array([[m.parameters[0].value]]), problem.middle).feet
    assert feet[0, 0] == pytest.approx([2.0 * np.hypot(*leg.foot[:2]) for leg in m.legs])


def test_what_cannot_be_is_said_with_the_want():
    found = pk.find_designs(glide(["L"], 1.3))  # the closed form asks for a rod of 763 mm
    assert design_orthoglide(200.0, 1.3).rod > 500.0
    assert not found.front
    assert "breaks amplification" in found.shortfall


def test_a_design_without_a_proof_is_no_winner():
    found = pk.find_designs(glide(["L"], 3.0), seconds=1e-3)
    assert not found.front
    assert found.unproved or found.shortfall


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("L: [", "rod: [", ":2:"),
        ("[150 mm, 500 mm]", "[500 mm, 150 mm]", ":2:"),
        ("[150 mm, 500 mm]", "[150 mm, 150 mm]", ":2:"),
        ("[150 mm, 500 mm]", "[1 mm, 1e7 mm]", ":2: free: L: 1 to 1e+07 is out of range"),
        ("Y: [-100 mm", "Y: [-1e300 mm", ":3: box: Y: -1e+300 to 100 is out of range"),
        ("orthoglide", "orthoglid", ":1:"),
        ("Y: [-100 mm, 100 mm], ", "", ":3:"),
        ("Y: [-100 mm", "Y: [-100 deg", ":3:"),
        ("X Y Z:", "X X:", ":4:"),
        ("X Y Z:", "W:", ""),
        ("amplification: 3", "amplification: 0.5", ""),
        ("amplification: 3", "stiffness: 3", ":5:"),
        ("strokes: fit", "strokes: fat", ":6:"),
        ("strokes: fit\nminimise: L", "strokes: keep\nminimise: stroke", ":6: strokes: the drives' ranges are"),
        ("minimise: L", "minimise: [L, L]", ":7:"),
        ("minimise: L", "minimise: volume", ":7:"),
        ("minimise: L", "", ":1:"),
        (GLIDE, "- 1", ":1:"),
        ("machine: orthoglide", "machine: ../elsewhere/own.yaml", ":1: machine"),
        ("machine: orthoglide", "machine: /etc/passwd", ":1: machine"),
        ("minimise: L", "part: ../elsewhere/part.apt\nminimise: L", ":7: part"),
    ],
)
def test_bad_problems_are_one_line(old, new, line, capsys, tmp_path):
    path = tmp_path / "beside" / "glide.yaml"
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "own.yaml").write_text("name: private\n")
    (tmp_path / "elsewhere" / "part.apt").write_text("PRIVATE\n")
    path.parent.mkdir()
    assert old in GLIDE
    path.write_text(GLIDE.replace(old, new))
    assert main(["design", str(path)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert f"glide.yaml{line}" in said.err


@pytest.mark.parametrize("more", [["--cube", "200"], ["-o", "out.yaml"], ["--time", "0"], ["--count", "0"]])
def test_bad_options_are_one_line(more, capsys, tmp_path):
    path = tmp_path / "glide.yaml"
    path.write_text(GLIDE)
    assert main(["design", str(path), *more]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
