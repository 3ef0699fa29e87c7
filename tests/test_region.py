"""Regions and workspaces of them: questions that make no sense, that nothing answers, or that are cut short."""

import math

import pytest
from shipped import load_shipped

import parakin as pk

WORK = ("gap", "cell", "seconds")


def of_region(question):
    return {name: value for name, value in question.items() if name not in WORK}


def of_work(question):
    return {name: value for name, value in question.items() if name in WORK}


@pytest.mark.parametrize(
    ("question", "said"),
    [
        ({"every": {"B": (1.0, 0.0)}}, "the range of B is empty"),
        ({"every": {"B": (0.0, math.nan)}}, "the range of B"),
        ({"every": {"X": (0.0, 1.0)}}, "X is no turning axis"),
        ({"every": {"B": (0.0, 1.0)}, "some": {"C": (0.0, 1.0)}}, "one of every, some and dexterous"),
        ({"at": {"B": 0.0}, "every": {"B": (0.0, 1.0)}}, "B is fixed and swept"),
        ({"at": {"Q": 1.0}}, "unknown axis Q"),
        ({"at": {"X": math.inf}}, "X: inf is no place"),
        ({"at": {"X": math.nan}}, "X: nan is no place"),
        ({"at": {"X": 2e6}}, "X: .* is beyond what can be computed"),
        ({"at": {"C": 2e5}}, "C: .* is beyond what can be computed"),
        ({"some": {"C": (0.0, 2e5)}}, "the range of C is beyond what can be computed"),
        ({"some": {"C": (0.0, math.inf)}}, "the range of C is empty"),
        ({"at": {"X": 0.0, "Y": 0.0, "Z": -1650.0}}, "every axis is fixed"),
        ({"without": ["nothing*"]}, "no limit nothing"),
        ({"mode": "++++"}, "mode"),
        ({"gap": 0.0}, "gap"),
        ({"gap": math.nan}, "gap"),
        ({"cell": -1.0}, "cell"),
        ({"cell": math.inf}, "cell"),
        ({"seconds": 0.0}, "seconds"),
        ({"seconds": math.nan}, "seconds"),
    ],
)
def test_what_makes_no_sense_is_refused(question, said):
    with pytest.raises(pk.PoseError, match=said) as error:
        pk.workspace(pk.region(load_shipped("tricept"), **of_region(question)), **of_work(question))
    assert "\n" not in str(error.value)


def test_reach_can_not_be_switched_off():
    with pytest.raises(pk.PoseError, match="the legs don't close"):
        pk.region(load_shipped("orthoglide"), without=["*.reach"])


def test_what_nothing_bounds_is_said():
    with pytest.raises(pk.PoseError, match="do not bound the workspace in"):
        pk.workspace(pk.region(load_shipped("tricept"), without=["d*", "r*"]))


def test_nothing_is_allowed_every_way_and_that_is_proved():
    found = pk.workspace(pk.region(load_shipped("lambda6"), dexterous=True))
    assert found.empty
    assert found.volume.outer == 0.0
    assert found.box is None
    assert found.centroid is None
    assert found.bounded_by == ()


def test_held_out_of_reach_it_is_empty():
    assert pk.workspace(pk.region(load_shipped("orthoglide"), at={"X": 5000.0})).empty


def test_an_interruption_gives_what_there_is():
    machine, calls = load_shipped("orthoglide"), []

    def stop(fraction):
        calls.append(fraction)
        if len(calls) == 3:
            raise KeyboardInterrupt

    found = pk.workspace(pk.region(machine), gap=1e-6, progress=stop)
    assert found.stopped == "interrupted"
    exact = pk.workspace(pk.region(machine), gap=0.003)
    assert found.volume.inner <= exact.volume.outer
    assert exact.volume.inner <= found.volume.outer < math.inf
    assert all(0.0 <= fraction <= 1.0 for fraction in calls)


def test_time_runs_out_with_a_bracket_that_holds():
    machine = load_shipped("tricept")
    found = pk.workspace(pk.region(machine), gap=1e-9, seconds=0.3)
    assert found.stopped == "time"
    exact = pk.workspace(pk.region(machine), gap=0.01)
    assert found.volume.inner <= exact.volume.outer
    assert exact.volume.inner <= found.volume.outer


def test_it_says_what_it_reached():
    machine = load_shipped("orthoglide")
    assert pk.workspace(pk.region(machine)).stopped == "gap"
    by_cells = pk.workspace(pk.region(machine), cell=30.0)
    assert by_cells.stopped == "cell"
    edge = by_cells.cells.take(~by_cells.cells.inside)
    assert edge.size.max() <= 30.0


def test_it_can_be_run_again_from_its_parameters():
    machine = load_shipped("lambda6")
    first = pk.workspace(pk.region(machine, every={"C": (0.4, 0.6)}, without=["gap *"]), gap=0.05)
    given = dict(first.parameters)
    assert given.pop("machine") == machine.name
    for name in ("kind", "places", "method"):
        given.pop(name)
    given["every"] = {axis: tuple(span) for axis, span in given["every"].items()}
    again = pk.workspace(pk.region(machine, **of_region(given)), **of_work(given))
    assert again.volume == first.volume
