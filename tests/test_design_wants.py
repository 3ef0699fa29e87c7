"""Each want of a design against the machine of its numbers, closed forms, and brute force over a grid of designs."""

from itertools import combinations, product

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.performance.indices import compute_performance
from parakin.synthesis.wants import WANTS

CUBE = dict.fromkeys("XYZ", (-100.0, 100.0))
FREE, SHIFT = {"L": (150.0, 500.0)}, {"X Y Z": (-150.0, 150.0)}
GLIDE = load_shipped("orthoglide")
SPRINGS = {"drives": "100 N/um", "struts": {"diameter": "20 mm", "rods": "2"}}
TOLERANCES = {"encoders": "0.01 mm", "rods": "0.02 mm"}


def design(bounds, **more):
    problem = pk.DesignProblem(GLIDE, FREE, more.pop("box", CUBE), ["L"], SHIFT, bounds, fit_strokes=True, **more)
    (best,) = pk.find_designs(problem).front
    for name, bound in bounds.items():
        assert best.values[name] == pytest.approx(bound, rel=1e-7)
        assert best.proved[name] == pytest.approx(bound, rel=2e-6)
    return best


def compute_inverse_jacobian(rod, poses):
    """The Orthoglide's, from its geometry alone: a rod's direction by the part of it along its slide."""
    rows = []
    for axis in range(3):
        across = np.delete(poses, axis, 1)
        along = np.sqrt(rod**2 - (across**2).sum(1))
        direction = np.insert(across, axis, -along, axis=1)
        rows.append(-direction / along[:, None])
    return np.stack(rows, 1)


def find_least_rod(measure, bound):
    """The least rod for which the best place of the cube keeps a bound at a lattice of poses, by bisection."""
    cube = np.array(list(product(np.linspace(-100.0, 100.0, 5), repeat=3)))
    low, high = 242.0, 500.0  # shorter ones don't reach all of a cube in the middle
    while high - low > 0.01:
        rod = 0.5 * (low + high)
        most = rod / 2.0**0.5 - 100.0
        best = minimize_scalar(lambda s, rod=rod: measure(rod, cube + s), bounds=(-0.99 * most, 0.0), method="bounded")
        low, high = (low, rod) if best.fun <= bound else (rod, high)
    return high


def measure_condition(rod, poses):
    return np.linalg.cond(compute_inverse_jacobian(rod, poses)).max()


def measure_deviation(rod, poses):
    """Encoders off by 0.01 mm, rods by 0.02 mm: one moves a slide by its length over the cosine between them."""
    inverse = compute_inverse_jacobian(rod, poses)
    j = np.linalg.inv(inverse)
    by_rod = j * np.linalg.norm(inverse, axis=2)[:, None, :]
    return np.sqrt((((0.01 * j) ** 2 + (0.02 * by_rod) ** 2).sum((1, 2)) / 3.0).max())


@pytest.mark.parametrize(
    ("bounds", "measure"), [({"condition": 5.0}, measure_condition), ({"accuracy": 0.05}, measure_deviation)]
)
def test_brute_force_finds_no_shorter_rod(bounds, measure):
    best = design(bounds, tolerances=TOLERANCES)
    assert best.sizes["L"] == pytest.approx(find_least_rod(measure, *bounds.values()), abs=0.05)


def test_stiffness_of_the_drives_is_amplification():
    """Of the drives' springs k alone the least stiffness is k/σ²."""
    best = design({"stiffness": 1e5 / 9.0}, drives="100 N/um")
    assert best.sizes["L"] == pytest.approx(design({"greatest_amplification": 3.0}).sizes["L"], rel=1e-9)


def test_a_cylinder_lies_between_its_boxes():
    bounds = {"amplification": 3.0}
    said = {"along": "Z", "diameter": 200.0, "X": 0.0, "Y": 0.0, "Z": (-100.0, 100.0)}
    best = design(bounds, box={}, cylinder=said)
    inner = {**dict.fromkeys("XY", (-(5000.0**0.5), 5000.0**0.5)), "Z": (-100.0, 100.0)}
    assert design(bounds, box=inner).sizes["L"] < best.sizes["L"] < design(bounds).sizes["L"] - 10.0
    rng, shift = np.random.default_rng(0), best.sizes["shift X Y Z"]
    radius, angle = 100.0 * np.sqrt(rng.random(20_000)), rng.uniform(0.0, 2.0 * np.pi, 20_000)
    radius[::2] = 100.0
    poses = np.stack([radius * np.cos(angle), radius * np.sin(angle), rng.choice([-100.0, 100.0], 20_000)], 1) + shift
    assert (best.machine.check(poses) == 0).all()
    psi = compute_performance(best.machine, poses)
    assert max(psi.greatest.max(), (1.0 / psi.least).max()) == pytest.approx(3.0, rel=2e-3)
    assert max(psi.greatest.max(), (1.0 / psi.least).max()) <= 3.0 * (1.0 + 1e-6)


def test_a_list_of_poses_with_orientations():
    hexapod = load_shipped("hexapod")
    own = hexapod.parameters[0]
    z = float(hexapod.home[2])
    wanted = [
        {"X": 0.0, "Y": 0.0, "Z": z, "A": (-0.2, 0.2), "B": (-0.2, 0.2)},
        {"X": 100.0, "Y": 0.0, "Z": z, "A": (-0.1, 0.1)},
    ]
    free = {own.name: (own.value - 30.0, own.value + 60.0)}
    (best,) = pk.find_designs(pk.DesignProblem(hexapod, free, {}, ["condition"], fit_strokes=True, poses=wanted)).front
    rng = np.random.default_rng(1)

    def measure(value):
        worst = 0.0
        for axes in wanted:
            ends = [axes.get(axis, 0.0) for axis in hexapod.axes]
            low, high = np.array([(e, e) if isinstance(e, float) else e for e in ends]).T
            poses = np.concatenate([[*product(*zip(low, high, strict=True))], rng.uniform(low, high, (40, 6))])
            machine = hexapod.replace_parameters({own.name: value})
            worst = max(worst, compute_performance(machine, poses).condition.max())
        return worst

    values = np.linspace(*free[own.name], 11)
    assert best.sizes[own.name] == pytest.approx(values[np.argmin([measure(v) for v in values])], abs=9.0)
    assert best.values["condition"] == pytest.approx(measure(best.sizes[own.name]), rel=1e-6)


@pytest.mark.parametrize("name", ["orthoglide", "hexapod", "tricept"])
def test_quantities_are_those_of_the_machine(name):
    machine = load_shipped(name)
    parameter = machine.parameters[0]
    home = dict(zip(machine.axes, machine.home.tolist(), strict=True))
    box = {axis: (home[axis] - 5.0, home[axis] + 9.0) for axis in "XYZ"}
    drives = {"d*": "100 N/um", "theta*": "20 kNm/rad"} if name == "tricept" else "100 N/um"
    tolerances = {"feet": "0.1 mm", "encoders": "0.01 mm"} if name == "hexapod" else {parameter.name: "0.05 mm"}
    more = {"drives": drives, "struts": SPRINGS["struts"], "tolerances": tolerances}
    problem = pk.DesignProblem(machine, {parameter.name: (1.0, 9000.0)}, box, [parameter.name], **more)
    points = problem.make_points(0, np.random.default_rng(1).random((20, 3)))
    x = np.array([[parameter.value + 0.5]])
    measures = problem.measure(x, points)
    own = pk.load(name, parameters={parameter.name: f"{x[0, 0]} mm"}) if parameter.group == "sizes" else None
    own = own or machine.replace_parameters({parameter.name: x[0, 0]})
    poses = problem.place_poses(x[0], points)
    stiffness = pk.analyse_stiffness(own, drives, SPRINGS["struts"], poses)
    assert measures.stiffness[0, :, 0] == pytest.approx(stiffness.least, rel=1e-8)
    accuracy = pk.analyse_accuracy(own, tolerances, poses)
    assert measures.deviation[0, :, 0] == pytest.approx(accuracy.deviations, rel=1e-8)
    told = compute_performance(own, poses, problem.tapes.length.value)
    assert WANTS["condition"].measure(measures)[0, :, 0] == pytest.approx(told.condition, rel=1e-8)


def test_clearance_is_the_distance_of_the_struts():
    """By brute force: points along both struts of each pair that shares no joint."""
    hexapod = load_shipped("hexapod")
    tool = hexapod.parameters[0]
    z = float(hexapod.home[2])
    box = {"X": (-30.0, 30.0), "Y": (-30.0, 30.0), "Z": (z - 20.0, z + 20.0)}
    problem = pk.DesignProblem(hexapod, {tool.name: (90.0, 150.0)}, box, maximise=["clearance"], fit_strokes=True)
    measures = problem.measure(np.array([[tool.value]]), problem.lattice[:7])
    along = np.linspace(0.0, 1.0, 401)[:, None]
    poses = problem.place_poses(np.array([tool.value]), problem.lattice[:7])
    feet, joints = (np.array([getattr(leg, end) for leg in hexapod.legs]) for end in ("foot", "platform"))
    for pose, distances in zip(poses, measures.distances[0], strict=True):
        ends = joints + pose[:3] + [0.0, 0.0, tool.value]
        expected = []
        for one, two in combinations(range(6), 2):
            if min(np.linalg.norm(feet[one] - feet[two]), np.linalg.norm(ends[one] - ends[two])) > 1.0:
                a, b = (feet[i] + along * (ends[i] - feet[i]) for i in (one, two))
                expected.append(np.linalg.norm(a[:, None] - b, axis=2).min())
        assert distances == pytest.approx(expected, abs=0.5)
    (best,) = pk.find_designs(problem).front
    assert best.proved["clearance"] <= best.values["clearance"]
    assert best.proved["clearance"] == pytest.approx(best.values["clearance"], rel=2e-6)


def test_three_objectives_have_a_front():
    bounds = {"amplification": 3.5}
    problem = pk.DesignProblem(
        GLIDE, FREE, CUBE, ["L", "stroke"], SHIFT, bounds, True, ["stiffness"], drives="100 N/um"
    )
    found = pk.find_designs(problem, count=2, seconds=300.0)  # of the wall, which others may share
    values = np.array([[d.values[name] for name in problem.objectives] for d in found.front]) * [1.0, 1.0, -1.0]
    assert len(values) >= 4
    for one, two in combinations(values, 2):
        assert not (one <= two).all()
        assert not (two <= one).all()
    assert values[:, 0].min() == pytest.approx(design(bounds).sizes["L"], rel=1e-7)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"minimise": ["stiffness"]}, "minimise: of stiffness more is better; it belongs to maximise"),
        ({"maximise": ["footprint"]}, "maximise: of footprint less is better; it belongs to minimise"),
        ({"maximise": ["L"]}, "maximise: each objective once expected"),
        ({"bounds": {"amplification": 3.0, "greatest_amplification": 0.2}}, "bounds: they contradict: amplification"),
        ({"bounds": {"condition": 1.0}}, "bounds: condition: a number above 1 expected"),
        ({"bounds": {"accuracy": 0.1}}, "tolerances: missing"),
        ({"bounds": {"stiffness": 1e4}}, "drives: the machine's file says no stiffness"),
        ({"box": {}}, "box: missing, as are cylinder and poses"),
        ({"cylinder": {"along": "A", "diameter": 1.0}}, "cylinder: along"),
        ({"cylinder": {"along": "Z", "diameter": 1.0, "X": (0.0, 1.0), "Y": 0.0, "Z": 0.0}}, "cylinder: X: the middle"),
        ({"poses": [{"X": 0.0, "Y": 0.0}]}, "poses: Z is missing"),
        ({"minimise": []}, "minimise: missing, as is maximise"),
    ],
)
def test_what_contradicts_itself_is_said(more, said):
    with pytest.raises(pk.PoseError, match=said):
        pk.DesignProblem(GLIDE, FREE, **{"box": CUBE, "minimise": ["L"], **more})


STIFF = """\
machine: orthoglide
free: {L: [150 mm, 500 mm]}
cylinder: {along: Z, diameter: 200 mm, X: 0 mm, Y: 0 mm, Z: [-100 mm, 100 mm]}
poses: [{X: 0 mm, Y: 0 mm, Z: 110 mm}]
shift: {X Y Z: [-150 mm, 150 mm]}
bounds: {condition: 4, accuracy: 0.1 mm, stroke: 250 mm}
strokes: fit
drives: 100 N/um
struts: {diameter: 20 mm, rods: "2"}
tolerances: {encoders: 0.01 mm, rods: 0.02 mm}
maximise: stiffness
"""


def test_the_command_reads_all_of_it(capsys, tmp_path):
    path = tmp_path / "stiff.yaml"
    path.write_text(STIFF)
    assert main(["design", str(path), "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "1 proved, greatest stiffness" in said
    assert "stiffness [N/mm]" in said
    assert "accuracy [mm]" in said
    assert "and 1 more sets of poses" in (tmp_path / "out" / "design_1.yaml").read_text()


def test_the_want_that_no_design_keeps_is_named(capsys, tmp_path):
    path = tmp_path / "stiff.yaml"
    path.write_text(STIFF.replace("accuracy: 0.1 mm", "accuracy: 0.1 um"))
    assert main(["design", str(path)]) == 3
    said = capsys.readouterr().out
    assert "breaks accuracy" in said
    assert " mm where at most 0.0001 mm is wanted" in said


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("along: Z, ", "", ":3:"),
        ("along: Z", "along: W", ":3:"),
        ("X: 0 mm, Y: 0 mm, Z: 110 mm", "X: 0 mm, Z: 110 mm", ":4:"),
        ("condition: 4", "condition: 4 mm", ":6:"),
        ("condition: 4", "clearance: 4 mm, conditoin: 3", ":6:"),
        ("drives: 100 N/um", "drives: 100 mm", ":8:"),
        ("{encoders: 0.01 mm, rods: 0.02 mm}", "0.1 mm", ":10:"),
        ("encoders: 0.01 mm", "encoders: 0.01 deg", ""),
        ("maximise", "minimise", ":11:"),
    ],
)
def test_bad_wants_are_one_line(old, new, line, capsys, tmp_path):
    path = tmp_path / "stiff.yaml"
    path.write_text(STIFF.replace(old, new))
    code = main(["design", str(path)])
    said = capsys.readouterr()
    assert (code, said.out, said.err.count("\n")) == (2, "", 1)
    assert f"stiff.yaml{line}" in said.err
