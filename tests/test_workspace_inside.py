"""``parakin workspace``: the box inside and the parts that hang together."""

import json

import numpy as np
import pytest
from shipped import load_shipped

from parakin.cli import main


def told(capsys, *arguments):
    code = main(["workspace", *arguments, "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_a_box_of_given_proportions_is_inside(capsys):
    code, found = told(capsys, "orthoglide", "--shape", "2:1:1")
    assert code == 0
    box = found["box_inside"]
    low, high = np.array(box["low"]), np.array(box["high"])
    assert np.allclose((high - low) / (high - low)[1], [2.0, 1.0, 1.0], rtol=1e-6)
    assert box["volume"] == pytest.approx((high - low).prod())
    places = low + (high - low) * np.random.default_rng(0).random((100_000, 3))
    assert (load_shipped("orthoglide").check(places) == 0).all()


def test_the_largest_box_about_a_place(capsys):
    code, found = told(capsys, "hbg80_2d", "--around", "X=230,Y=230")
    assert code == 0
    box = found["box_inside"]
    assert np.allclose(np.add(box["low"], box["high"]) / 2.0, 230.0)
    _, largest = told(capsys, "hbg80_2d", "--box")
    assert largest["box_inside"]["volume"] > box["volume"]


def test_parts_and_the_one_that_holds_home(capsys):
    code, found = told(capsys, "hbg80_2d", "--start", "X=230,Y=230")
    assert code == 0
    parts = found["parts"]
    assert parts["count"] == parts["at_least"] == 2
    assert parts["each"][parts["holds_start"]]["sign"] == 1
    assert sum(part["volume"]["estimate"] for part in parts["each"]) == pytest.approx(
        found["volume"]["estimate"] + found["elsewhere"]["estimate"], rel=0.02
    )
    assert main(["workspace", "hbg80_2d", "--parts"]) == 0
    assert "2, at least 2 proved to be different" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["hbg80_2d", "--shape", "1:2:3"], "--shape: 2 numbers above 0 expected"),
        (["hbg80_2d", "--shape", "1:x"], '--shape: "1:x": expected proportions'),
        (["hbg80_2d", "--around", "X=0"], "--around: expected X, Y"),
        (["hbg80_2d", "--around", "X=0,Y=9000"], "--around: "),
        (["hbg80_2d", "--start", "X=9000"], "--start: "),
        (["hbg80_2d", "--start", "Q=1"], "--start: unknown axis"),
        (["lambda6", "--dexterous", "--box"], "--box: "),
        (["tricept", "--some", "B=0:5", "--parts"], "--parts: "),
    ],
)
def test_bad_input_is_one_line_with_its_place(arguments, said, capsys):
    assert main(["workspace", *arguments]) == 2
    error = capsys.readouterr().err.strip()
    assert error.startswith(said)
    assert "\n" not in error
