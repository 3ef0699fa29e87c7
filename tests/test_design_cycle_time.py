"""A part's cycle time as a want of designs, against the jobs of machines of other sizes."""

import re

import numpy as np
import pytest
from shipped import load_shipped
from test_front_page import unpack_pages

import parakin as pk
from parakin.cli import main
from parakin.synthesis.part_timing import PartTimer

PART = """\
UNITS/MM
RAPID
GOTO/-50,-50,-50
RAPID
GOTO/50,-50,-50
RAPID
GOTO/50,50,-20
FEDRAT/20000,MMPM
GOTO/-50,50,20
RAPID
GOTO/50,-50,50
FINI
"""
DELTA = load_shipped("linear_delta")
PLACE = pk.workpiece(Z=float(DELTA.home[2]))
BOX = {"X": (-40.0, 40.0), "Y": (-40.0, 40.0), "Z": (250.0, 300.0)}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    file = tmp_path_factory.mktemp("part") / "part.apt"
    file.write_text(PART)
    return pk.read_path(file)


def measure_job(path, **sizes):
    job = pk.prepare(DELTA.replace_parameters(sizes), path, workpiece=PLACE)
    return job.seconds if job.runs else np.inf


def test_no_tower_runs_the_part_sooner(path):
    free = {"tower": (300.0, 420.0)}
    found = pk.find_designs(pk.DesignProblem(DELTA, free, BOX, ["cycle_time"], path=path, workpiece=PLACE))
    (best,) = found.front
    assert best.job.runs
    (page,) = unpack_pages(pk.render_front_page(found))
    assert "<title>part.apt on Linear Delta" in page
    assert best.values["cycle_time"] == best.proved["cycle_time"] == best.job.seconds
    others = [measure_job(path, tower=tower) for tower in np.linspace(*free["tower"], 4)]
    assert best.values["cycle_time"] < min(others) * (1.0 + 1e-3)
    assert min(others) < 0.92 * max(others)


def test_a_bound_is_one_of_the_job_not_of_the_estimate(path):
    free, bound = {"rod": (660.0, 740.0)}, measure_job(path, rod=700.0)
    problem = pk.DesignProblem(
        DELTA, free, BOX, ["rod"], bounds={"cycle_time": bound}, path=path, workpiece=PLACE, fit_strokes=True
    )
    (best,) = pk.find_designs(problem).front
    assert best.sizes["rod"] == pytest.approx(700.0, abs=10.0)
    assert best.values["cycle_time"] <= bound * (1.0 + 1e-6)
    for (low, high), column in zip(best.ranges.values(), best.job.posted.joints.T, strict=True):
        assert low <= column.min() <= column.max() <= high


def test_too_short_a_time_is_the_want_that_no_design_keeps(path):
    """Designs that are out of reach are no nearer, however short the time is."""
    free, shift, bounds = {"rod": (650.0, 800.0)}, {"Z": (-400.0, 400.0)}, {"cycle_time": 1e-3}
    problem = pk.DesignProblem(DELTA, free, BOX, ["rod"], shift, bounds, path=path, workpiece=PLACE)
    said = pk.find_designs(problem, seconds=10.0).shortfall
    assert re.search(r"breaks cycle_time: 0\.\d+ s where at most 0.001 s is wanted", said)


def test_a_part_moves_with_the_poses(path):
    machine = load_shipped("orthoglide5_table")
    family = pk.family(machine, free=[machine.parameters[0].name])
    home = dict(zip(machine.axes, machine.home.tolist(), strict=True))
    shift = np.array([{"X": 20.0, "Z": 10.0}.get(axis, 0.0) for axis in machine.axes])
    still = np.zeros_like(shift)
    low, high = (
        PartTimer(family, path, pk.workpiece(X=x, Z=home["Z"] + z), own)
        for x, z, own in ((0.0, -30.0, shift), (20.0, -20.0, still))
    )
    seconds = high.estimate_seconds(still[None], family.nominal[None])
    assert low.estimate_seconds(shift[None], family.nominal[None]) == pytest.approx(seconds, rel=1e-9)
    assert seconds[0] == pytest.approx(low.prepare_job(machine, shift).seconds, rel=1e-9)


def test_estimates_of_other_sizes_are_near_their_jobs(path, monkeypatch):
    """Also where stretches alone are timed."""
    family, towers = pk.family(DELTA, free=["tower"]), np.array([310.0, 410.0])
    jobs = [measure_job(path, tower=tower) for tower in towers]
    assert jobs[0] < 0.92 * jobs[1]
    for rows in (2400, 24):
        monkeypatch.setattr("parakin.synthesis.part_timing._ROWS", rows)
        timer = PartTimer(family, path, PLACE, np.zeros(3))
        assert timer.estimate_seconds(np.zeros((2, 3)), towers[:, None]) == pytest.approx(jobs, rel=0.01)


PROBLEM = """\
machine: orthoglide
free: {L: [215 mm, 290 mm]}
box: {X: [-40 mm, 40 mm], Y: [-40 mm, 40 mm], Z: [-40 mm, 40 mm]}
bounds: {cycle_time: 9 s}
part: part.apt
workpiece: {X: 1 mm, C: 90 deg}
minimise: L
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("9 s", "9 mm", "problem.yaml:4: cycle_time"),
        ("9 s", "-1 s", "problem.yaml:4: bounds: cycle_time: a number above 0 expected"),
        ("part: part.apt\nworkpiece: {X: 1 mm, C: 90 deg}\n", "", "problem.yaml:1: part: missing, cycle_time needs it"),
        ("part: part.apt\n", "", "problem.yaml:1: part: missing, cycle_time needs it"),
        ("part.apt", "none.apt", "problem.yaml:5: part: "),
        ("part.apt", "[part.apt]", "problem.yaml:5: part: a word expected"),
        ("part.apt", "point.apt", "problem.yaml:5: part: its tool path has a single point"),
        ("part.apt", "broken.apt", "broken.apt:2: "),
        ("C: 90 deg", "C: 90 mm", "problem.yaml:6: C: "),
        ("C: 90 deg", "U: 90 deg", "problem.yaml:6: unknown key"),
        ("orthoglide", "eclipse_overactuated", "problem.yaml:"),
        (PROBLEM, "", "problem.yaml:1: empty, expected a design problem"),
    ],
)
def test_what_is_mistaken_is_one_line(old, new, said, capsys, tmp_path):
    for name, text in (("part", PART), ("point", "UNITS/MM\nGOTO/0,0,0\nFINI\n"), ("broken", "UNITS/MM\nGOTO/0,0\n")):
        (tmp_path / f"{name}.apt").write_text(text)
    (tmp_path / "problem.yaml").write_text(PROBLEM.replace(old, new))
    assert main(["design", str(tmp_path / "problem.yaml")]) == 2
    told = capsys.readouterr()
    assert (told.out, told.err.count("\n")) == ("", 1)
    assert said in told.err
