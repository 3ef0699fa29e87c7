"""Every search ends: in its time, with what is proved by then, and it says so."""

import json
import time

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.budget import Budget
from parakin.cli import main
from parakin.commands.options import OFF_LIMITS
from parakin.errors import PoseError
from parakin.kernels.compiling import njit
from parakin.performance.certified.region_singularities import judge_singularities
from parakin.workspaces.certified.containment import prove_boxes
from parakin.workspaces.inscribed.largest_box import NoBoxError

LATE = 20.0  # s beyond the time given: the step that runs when it is up, on a busy computer
ALL_ROUND = {"A": ("-180 deg", "180 deg"), "B": ("-180 deg", "180 deg"), "C": ("-180 deg", "180 deg")}


def test_a_share_is_of_what_is_left():
    budget = Budget(100.0, 1000)
    budget.used = 400
    step = budget.take_fraction(0.5)
    assert step.boxes == 300
    assert 40.0 < step.seconds_left <= 50.0
    assert not budget.is_spent()
    step.used = 300
    assert step.is_spent()
    assert Budget(None).take_fraction(0.1).seconds_left == float("inf")
    assert Budget(1e-9).take_fraction(1.0).seconds_left == 0.0


def test_compiling_is_no_time_of_a_search():
    budget, began = Budget(100.0), time.monotonic()
    assert njit()(lambda x: np.sqrt(x) + np.sin(x))(4.0) == pytest.approx(2.0 + np.sin(4.0))
    taken = time.monotonic() - began
    assert 100.0 - budget.seconds_left < 0.5 * taken


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan")])
def test_no_time_is_refused(seconds):
    region = pk.region(load_shipped("orthoglide"))
    for ask in (pk.workspace, pk.find_largest_box, pk.find_components, pk.atlas):
        with pytest.raises(PoseError, match="seconds: a time above 0 s expected"):
            ask(region, seconds=seconds)


def test_a_workspace_that_is_out_of_time_holds_its_volume():
    truth = pk.workspace(pk.region(load_shipped("hbg80_2d")), gap=1e-3).volume
    began = time.monotonic()
    hasty = pk.workspace(pk.region(load_shipped("hbg80_2d")), gap=1e-9, seconds=1e-6)
    assert time.monotonic() - began < LATE
    assert hasty.stopped == "time"
    assert hasty.volume.inner <= truth.outer
    assert hasty.volume.outer >= truth.inner


def test_a_step_over_orientations_ends_with_its_budget(monkeypatch):
    region = pk.region(load_shipped("tricept"), some={"B": ("-10 deg", "10 deg")})
    low, high = region.find_extent(Budget(10.0))
    whole, hasty = region.subdivide(low, high), region.subdivide(low, high)
    looks = []
    bound = type(hasty)._bound_leaves
    monkeypatch.setattr(type(hasty), "_bound_leaves", lambda self, *given: looks.append(1) or bound(self, *given))
    spent = Budget(10.0, boxes=0)
    for search, budget in ((whole, None), (hasty, spent)):
        looks.clear()
        search.refine(np.arange(len(search.open_cells.low)), budget)
        assert (len(looks) == 2) == (budget is spent)  # at the leaves once, and at their middles
    outer = [float((cells.outer * cells.size.prod(1)).sum()) for cells in (whole.open_cells, hasty.open_cells)]
    inner = [float((cells.inner * cells.size.prod(1)).sum()) for cells in (whole.open_cells, hasty.open_cells)]
    assert outer[0] <= outer[1] * (1.0 + 1e-9)
    assert inner[1] <= outer[0]


def test_a_box_out_of_time_is_proved_all_the_same():
    region = pk.region(load_shipped("hbg80_2d"))
    began = time.monotonic()
    try:
        box = pk.find_largest_box(region, seconds=0.3)
    except NoBoxError as error:
        assert "in the time given" in str(error)
    else:
        assert box.stopped in ("time", "tolerance")
        samples = np.random.default_rng(0).uniform(box.low, box.high, (1000, 2))
        assert (region.machine.check(region.poses(samples)) == 0).all()
    assert time.monotonic() - began < LATE
    assert pk.find_largest_box(region).stopped == "tolerance"


def test_boxes_out_of_time_are_undecided():
    region = pk.region(load_shipped("hbg80_2d"))
    budget = Budget(1e-9)
    low = region.machine.home[:2] - 1.0
    found = prove_boxes(region, [low], [low + 2.0], budget=budget)
    assert not found.proved.any()
    assert (found.limit == -1).all()
    assert prove_boxes(region, [low], [low + 2.0]).proved.all()


def test_singularities_out_of_time_are_unproved():
    verdicts = judge_singularities(pk.region(load_shipped("hexapod")), Budget(1e-6))
    assert {verdict.verdict for verdict in verdicts} <= {"unproved", "none"}
    assert any("in the time given" in verdict.reason for verdict in verdicts)


def test_an_extent_out_of_time_is_larger_and_not_kept():
    region = pk.region(load_shipped("hexapod"), some=ALL_ROUND)
    began = time.monotonic()
    hasty = region.find_extent(Budget(1e-9))
    assert time.monotonic() - began < LATE
    low, high = region.find_extent()
    assert (hasty[0] <= low).all()
    assert (hasty[1] >= high).all()
    assert (hasty[1] - hasty[0] > high - low).any()


def test_the_command_ends_and_tells_what_is_proved(capsys):
    began = time.monotonic()
    assert main(["workspace", "hbg80_2d", "--time", "0.001", "--gap", "1e-9", "--parts", "--json"]) == 0
    assert time.monotonic() - began < 5 * LATE
    told = json.loads(capsys.readouterr().out)
    assert told["stopped"] == "time"
    assert told["volume"]["inner"] <= told["volume"]["outer"]


def test_a_box_that_is_not_found_does_not_hide_the_volume(capsys):
    assert main(["workspace", "orthoglide", "--box", "--time", "0.0001"]) == 3
    told = capsys.readouterr().out
    assert "volume" in told
    assert "box inside  no box in the region could be proved to be inside in the time given" in told


def test_sampling_that_does_not_end_in_its_time_is_refused(capsys):
    region = pk.region(load_shipped("hexapod"), every=ALL_ROUND)
    began = time.monotonic()
    for sample in (pk.sample_grid, pk.sweep_polar):
        with pytest.raises(PoseError, match="the time is up before all places are sampled"):
            sample(region, 1.0 if sample is pk.sweep_polar else 5.0, seconds=1e-6)
    with pytest.raises(PoseError, match="the time is up"):
        pk.sweep_drives(pk.region(load_shipped("hbg80_2d")), seconds=1e-6)
    assert time.monotonic() - began < 3 * LATE
    assert main(["workspace", "hbg80_2d", "--method", "grid", "--time", "1e-6"]) == 2
    assert capsys.readouterr().err.startswith("--time: the time is up")


def test_what_can_not_be_answered_is_refused_before_the_work(capsys):
    for option in ("--parts", "--start", "--around", "--shape"):
        value = {"--start": "X=0", "--around": "X=0", "--shape": "a:b"}.get(option)
        began = time.monotonic()
        swept = ["--some", "A=-180:180,B=-90:90,C=-180:180"]
        code = main(["workspace", "lambda6", *swept, option, *([value] if value else [])])
        assert code == 2
        assert capsys.readouterr().err.startswith(f"{option}: ")
        assert time.monotonic() - began < LATE


def test_drawing_ends_in_its_time_and_says_so(tmp_path, capsys):
    picture = tmp_path / "o.png"
    began = time.monotonic()
    given = ["--some", "A=-180:180,B=-90:90,C=-180:180", "--time", "1", "-o", str(picture)]
    assert main(["workspace", "hexapod", *given]) == OFF_LIMITS
    assert time.monotonic() - began < 10 * LATE
    said = capsys.readouterr()
    assert "proved" in said.out
    assert f"{picture}: not written, seconds: the time is up" in said.err
    assert not picture.exists()


def test_a_grid_of_the_atlas_that_is_not_done_is_refused():
    region = pk.region(load_shipped("lambda6"))
    region.find_extent()
    with pytest.raises(pk.PoseError, match="the time is up"):
        pk.atlas(region, step=20.0, seconds=0.01)
