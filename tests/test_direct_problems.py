"""Direct problems by the thousand, or PARAKIN_DIRECT_PROBLEMS of them: no answer in another mode or on another side."""

import os

import pytest
from direct_problems import try_direct_problems
from shipped import load_shipped
from test_conformance import everyone
from test_forward import allowed

COUNT = int(os.environ.get("PARAKIN_DIRECT_PROBLEMS", "5000"))
CLOSE_REFUSED = 1e-5  # of starts 1 mm and 0.5° off, but for those across a singular line beside an allowed pose


@everyone
def test_no_answer_is_in_another_mode_or_on_another_side(m):
    tally = try_direct_problems(m, COUNT, mode=m.mode)
    assert tally.count == COUNT
    assert tally.other_mode == 0
    assert tally.other_side == 0
    assert tally.open_by < 1e-9
    assert tally.close_refused - tally.close_across <= CLOSE_REFUSED * tally.close
    assert tally.refused < 0.25 * tally.count  # of small machines most starts 600 mm off are beyond reach


@everyone
def test_without_a_mode_only_starts_that_stand_in_another_one_lead_there(m):
    tally = try_direct_problems(m, COUNT)
    assert tally.other_mode <= 1e-4 * COUNT + 1  # and says so
    assert tally.other_side == 0


@pytest.mark.parametrize("name", ["lambda6", "hexapod", "tricept"])
def test_home_finds_all_on_its_side(name):
    machine = load_shipped(name)
    poses = allowed(name)
    on_side = machine.sides(poses) * machine.sides(machine.home[None]) > 0.0
    found = machine.forward(machine.inverse(poses))
    assert found.converged[on_side].all()
