"""The Orthoglide's closed form against its published condition, samples of the whole cube, and the shipped machine."""

import json

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.performance.design import DESIGNS, design_orthoglide
from parakin.performance.indices import compute_performance


def test_the_shipped_orthoglide_is_the_design_for_200_mm_and_3():
    found, m = design_orthoglide(200.0, 3.0), load_shipped("orthoglide")
    assert found.rod == pytest.approx(254.264, abs=5e-4)
    assert found.stroke == pytest.approx((61.668, 330.928), abs=5e-4)
    assert found.cube == pytest.approx((-123.336, 76.664), abs=5e-4)
    assert found.proof.verdict == "proved"
    assert m.spec.sizes["L"] == pytest.approx(found.rod, rel=1e-14)
    for drive in m.model.drives:
        assert (drive.low, drive.high) == pytest.approx(found.stroke, rel=1e-14)
    poses = np.random.default_rng(0).uniform(-150, 100, (50, 3))
    assert np.allclose(found.machine.inverse(poses), m.inverse(poses), rtol=1e-12, equal_nan=True)
    assert list(DESIGNS) == ["orthoglide"]


@pytest.mark.parametrize("bound", [1.001, 1.3, 1.8, 2.0, 2.5, 4.0, 10.0, 100.0])
def test_psi_stays_within_its_bounds_and_reaches_them(bound):
    found = design_orthoglide(300.0, bound)
    low, high = found.cube
    m = found.machine
    assert high - low == pytest.approx(300.0)
    corners = np.array(np.meshgrid(*[[low, high]] * 3)).reshape(3, -1).T
    inside = np.random.default_rng(1).uniform(low, high, (20_000, 3))
    poses = np.concatenate([corners, inside])
    told = compute_performance(m, poses)
    assert told.greatest.max() <= bound * (1 + 1e-9)
    assert told.least.min() >= (1 - 1e-9) / bound
    assert (m.check(inside) == 0).all()
    assert (m.margins(corners) > -1e-9 * found.rod).all()
    ends = compute_performance(m, [[low] * 3, [high] * 3])  # one bound at least is reached in both corners
    reached = np.maximum(ends.greatest, 1 / ends.least)
    assert reached == pytest.approx([bound, bound], rel=1e-9)
    assert found.proof.verdict == "proved"
    assert max(found.stroke) - min(found.stroke) >= 300.0


def test_no_lesser_stroke_holds_the_cube():
    found = design_orthoglide(200.0, 3.0)
    low, high = found.cube
    grid = np.linspace(low, high, 61)
    joints = found.machine.inverse(np.stack(np.meshgrid(grid, grid, np.append(grid, 0.0)), -1).reshape(-1, 3))
    assert joints.min() == pytest.approx(found.stroke[0], abs=1e-9)
    assert joints.max() <= found.stroke[1]
    assert found.machine.inverse([high, 0.0, 0.0])[0] == pytest.approx(found.stroke[1], abs=1e-9)


@pytest.mark.parametrize(
    ("cube", "bound"),
    [
        (0, 3),
        (-5, 3),
        (np.nan, 3),
        (np.inf, 3),
        (1e9, 3),
        (200, 1),
        (200, 0.5),
        (200, -3),
        (200, np.nan),
        (200, np.inf),
    ],
)
def test_refusals(cube, bound):
    with pytest.raises(pk.PoseError) as caught:
        design_orthoglide(cube, bound)
    assert "expected" in str(caught.value)


def test_the_command(capsys, tmp_path):
    path = tmp_path / "glide.yaml"
    assert main(["design", "orthoglide", "--cube", "20 cm", "--amplification", "3", "--json", "-o", str(path)]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["schema"] == "parakin.design/1"
    assert said["rod"] == pytest.approx(254.264, abs=5e-4)
    assert said["stroke"] == pytest.approx([61.668, 330.928], abs=5e-4)
    assert np.allclose(said["cube"], [[-123.336] * 3, [76.664] * 3], atol=5e-4)
    assert said["verdict"] == "proved"
    m = pk.load(path)
    assert m.spec.sizes["L"] == said["rod"]
    assert [m.model.drives[0].low, m.model.drives[0].high] == said["stroke"]
    assert compute_performance(m, said["cube"]).greatest == pytest.approx([3.0, 3.0])
    assert main(["design", "orthoglide", "--cube", "200", "--amplification", "3"]) == 0
    out = capsys.readouterr().out
    assert "254.2645 mm" in out
    assert "proved" in out


@pytest.mark.parametrize(
    "arguments",
    [
        ("orthoglide", "--cube", "-5", "--amplification", "3"),
        ("orthoglide", "--cube", "0", "--amplification", "3"),
        ("orthoglide", "--cube", "wide", "--amplification", "3"),
        ("orthoglide", "--cube", "200", "--amplification", "1"),
        ("orthoglide", "--cube", "200", "--amplification", "-2"),
        ("orthoglide", "--cube", "200", "--amplification", "lots"),
        ("orthoglide", "--cube", "200"),
        ("tripod", "--cube", "200", "--amplification", "3"),
        ("orthoglide", "--cube", "200", "--amplification", "3", "-o", "glide.txt"),
    ],
)
def test_bad_input_is_one_line(arguments, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["design", *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert not list(tmp_path.iterdir())
