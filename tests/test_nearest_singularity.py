"""The largest box and sphere without a parallel singularity, against the Orthoglide's closed form and drawn poses."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.machine import Machine
from parakin.performance.singularities import compute_singularity_margins

GLIDE = load_shipped("orthoglide")
NEAREST = GLIDE.parameters[0].value / 6.0**0.5  # X = Y = Z where the rods lie in a plane: √(L² - 2x²) = 2x
WORDS = ["atlas", "orthoglide", "--box", "X=-200:200,Y=-200:200,Z=-200:200", "--grow"]


def draw_inside(found, count):
    rng = np.random.default_rng(0)
    low, high = np.array([found.grown_ranges.get(axis, (v, v)) for axis, v in zip(*name_middle(found), strict=True)]).T
    poses = rng.uniform(low, high, (count, len(low)))
    tips = [i for i, axis in enumerate(found.machine.axes) if axis in "XYZ"]
    off = np.linalg.norm((poses - found.middle)[:, tips], axis=1)
    return poses if found.shape == "box" else poses[off <= found.inner]


def name_middle(found):
    return found.machine.axes, found.middle.tolist()


@pytest.mark.parametrize(("shape", "expected"), [("box", NEAREST / 400.0), ("sphere", 3.0**0.5 * NEAREST)])
def test_as_far_as_the_closed_form(shape, expected):
    found = pk.find_nearest_singularity(pk.region(GLIDE), dict.fromkeys("XYZ", (-400.0, 400.0)), shape, 1e-3)
    assert found.inner <= expected <= found.outer * (1.0 + 1e-9)
    assert found.outer == pytest.approx(found.inner, rel=1.1e-3)
    assert found.ended == found.reason == "singular"
    assert compute_singularity_margins(GLIDE, found.pose)[0] == pytest.approx(0.0, abs=1e-9)
    assert (compute_singularity_margins(GLIDE, draw_inside(found, 5000))[:, 0] > 0.0).all()


@pytest.mark.parametrize("shape", ["box", "sphere"])
def test_six_axes(shape):
    machine = load_shipped("hexapod")
    middle = dict(zip(machine.axes, machine.home.tolist(), strict=True))
    half = dict.fromkeys("XYZ", 300.0) | dict.fromkeys("ABC", np.radians(20.0 if shape == "sphere" else 60.0))
    ranges = {axis: (middle[axis] - by, middle[axis] + by) for axis, by in half.items()}
    found = pk.find_nearest_singularity(pk.region(machine), ranges, shape, 0.3, seconds=20.0)
    assert found.inner >= (0.3 if shape == "box" else 200.0)
    assert (compute_singularity_margins(machine, draw_inside(found, 20_000))[:, 0] > 0.0).all()


def test_the_end_of_reach_ends_it_too():
    arms = load_shipped("five_bar")
    whole, far = (
        pk.find_nearest_singularity(
            pk.region(arms), {axis: (v - by, v + by) for axis, v in zip("XY", arms.home.tolist(), strict=True)}, "box"
        )
        for by in (30.0, 400.0)
    )
    assert (whole.inner, whole.outer, whole.pose, whole.ended) == (1.0, 1.0, None, "box")
    assert far.ended == far.reason == "out of reach"
    assert far.inner < far.outer < 1.0
    assert np.isfinite(arms.inverse(draw_inside(far, 2000))).all()


def test_ranges_of_drives_do_not_end_it():
    """A drive's range of ±10 mm about home ends long before the singularity, and is not asked."""
    spec, home = GLIDE.spec, float(GLIDE.inverse(GLIDE.home)[0])
    about = {"low": home - 10.0, "high": home + 10.0}
    legs = tuple(replace(leg, drives=tuple(replace(d, **about) for d in leg.drives)) for leg in spec.legs)
    own, wide = (
        pk.find_nearest_singularity(pk.region(machine), dict.fromkeys("XYZ", (-400.0, 400.0)))
        for machine in (Machine(replace(spec, legs=legs)), GLIDE)
    )
    assert own.ended == "singular"
    assert (own.inner, own.outer) == (wide.inner, wide.outer)


@pytest.mark.parametrize(
    ("ranges", "way", "ended"),
    [
        ("X=-200:200,Y=-200:200,Z=-200:200", [], "ended by a singularity at "),
        ("X=-9:9,Y=-9:9,Z=-9:9", [], "ended by the given box, all of it"),
        ("X=-200:200,Y=-200:200,Z=-200:200", ["--time", "1e-6"], "ended by the time, not by the machine: "),
    ],
)
def test_the_last_line_says_what_ended_it(ranges, way, ended, capsys):
    assert main(["atlas", "orthoglide", "--box", ranges, "--grow", "box", *way]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith(ended)


def test_the_command(capsys):
    assert main([*WORDS, "sphere"]) == 0
    said = capsys.readouterr().out
    assert "orthoglide: a sphere of 178." in said
    assert "proved" in said
    assert main([*WORDS, "box", "--json"]) == 0
    grown = json.loads(capsys.readouterr().out)["grown"]
    assert 0.99 * NEAREST <= grown["spans"]["X"][1] <= NEAREST
    assert (grown["reason"], grown["ended"]) == ("singular", "singular")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["atlas", "orthoglide", "--grow", "box"], "--grow: it grows within --box, name that"),
        ([*WORDS, "box", "--amplification", "1/3:3"], "--grow: it and --amplification are asked one at a time"),
        (["atlas", "rpr3", "--box", "C=0:9", "--grow", "sphere"], "--box: a range of X, Y or Z expected"),
        (
            ["atlas", "orthoglide", "--box", "X=900:990", "--grow", "box"],
            "--box: the middle of the box is out of reach",
        ),
        ([*WORDS, "cube"], "--grow"),
    ],
)
def test_what_is_mistaken_is_one_line(words, message, capsys):
    assert main(words) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert message in said.err


def test_the_example_runs(tmp_path):
    script = Path(__file__).parents[1] / "examples" / "singularities.py"
    done = subprocess.run([sys.executable, script, "-o", tmp_path], capture_output=True, text=True, check=True)
    assert "ended by what is singular at C 60.00 deg" in done.stdout
    assert (tmp_path / "singularities.png").exists()
