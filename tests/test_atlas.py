"""The atlas and its command: extremes against samples, isotropic poses, maps."""

import csv
import json

import numpy as np
import pytest
from regions import whole_region
from shipped import load_shipped

import parakin as pk
from parakin.budget import Budget
from parakin.cli import main
from parakin.performance.atlas import map_performance
from parakin.performance.extremes import MEASURES
from parakin.performance.indices import compute_performance


@pytest.mark.parametrize(("name", "count"), [("orthoglide", 2), ("hbg80_3d", 2)])
def test_isotropic_poses_of_the_workspace(name, count):
    m = load_shipped(name)
    found = pk.atlas(whole_region(m), seconds=None)
    assert found.isolated
    assert len(found.isotropic) == count  # home, and its image beyond a parallel singularity
    assert np.abs(found.isotropic - m.home).max(1).min() < 1e-6
    assert (m.check(found.isotropic) == 0).all()
    assert np.allclose(compute_performance(m, found.isotropic).condition, 1.0, atol=1e-8)
    assert found.singular
    assert found.extreme("condition", "least").value == pytest.approx(1.0, abs=1e-9)
    assert found.extreme("condition", "greatest").value == np.inf
    assert found.extreme("parallel", "least").value == pytest.approx(-1.0, abs=1e-9)


@pytest.mark.parametrize("name", ["linear_delta", "hexapod"])
def test_no_sample_of_the_workspace_is_beyond_its_extremes(name):
    m = load_shipped(name)
    found = pk.atlas(pk.region(m), seconds=None)
    assert np.array_equal(found.map.allowed, m.check(found.map.performance.poses) == 0)
    assert not found.singular
    assert len(found.isotropic) == 0
    poses = found.map.inside.poses
    rng = np.random.default_rng(8)
    samples = rng.uniform(poses.min(0) - 50, poses.max(0) + 50, (40_000, len(m.axes)))
    samples[:, 3:] = m.home[3:]
    samples = samples[m.check(samples) == 0]
    assert len(samples) > 4000
    told = compute_performance(m, samples)
    for extreme in found.extremes:
        assert m.check(extreme.pose) == 0
        at = compute_performance(m, extreme.pose)
        names = told.margin_names
        values, value = (
            (getattr(told, extreme.quantity), getattr(at, extreme.quantity))
            if extreme.quantity in MEASURES
            else (told.margins[:, names.index(extreme.quantity)], at.margins[names.index(extreme.quantity)])
        )
        assert extreme.value == pytest.approx(float(value), rel=1e-12)
        if extreme.side == "least":
            assert values.min() >= extreme.value - 1e-9
        else:
            assert values.max() <= extreme.value + 1e-9


def test_an_atlas_of_a_slice_and_questions_that_make_no_sense():
    m = load_shipped("orthoglide")
    flat = pk.atlas(pk.region(m, at={"Z": -50.0}), step=25.0, seconds=None)
    assert flat.map.axes == ("X", "Y")
    assert flat.map.performance.psi.shape == (*flat.map.allowed.shape, 3)
    assert (flat.map.inside.poses[:, 2] == -50.0).all()
    wide = pk.atlas(pk.region(m, at={"Z": -50.0}, without=["*.max"]), step=25.0, seconds=None)
    assert wide.map.allowed.sum() > flat.map.allowed.sum()
    for wrong in ({"step": 0.0}, {"step": 1e-3}, {"length": -1.0}):
        with pytest.raises(pk.PoseError):
            pk.atlas(pk.region(m), **wrong)
    for wrong in ({"at": {"X": 900.0}}, {"mode": "?"}):
        with pytest.raises(pk.PoseError):
            pk.atlas(pk.region(m, **wrong))
    with pytest.raises(pk.PoseError, match="region: an atlas is of one orientation, B must not be swept"):
        pk.atlas(pk.region(load_shipped("orthoglide5_head"), every={"B": (0.0, 0.1)}))


# The command.


def told(capsys, *arguments, code=0):
    assert main(["atlas", *arguments]) == code
    return capsys.readouterr().out


def test_the_command_at_a_pose(capsys):
    said = json.loads(told(capsys, "tricept", "--pose", "X=100,Z=-1500,B=10", "--json"))
    assert said["schema"] == "parakin.atlas/1"
    m = load_shipped("tricept")
    found = compute_performance(m, [100, 0, -1500, np.radians(10), 0])
    pose = said["pose"]
    assert pose["pose"] == pytest.approx({"X": 100, "Y": 0, "Z": -1500, "B": 10, "C": 0})
    assert pose["condition"] == pytest.approx(float(found.condition))
    assert [axis["psi"] for axis in pose["ellipsoid"]] == pytest.approx(found.psi.tolist())
    assert pose["length"]["value"] == pytest.approx(150)
    assert pose["margins"]["parallel"] == pytest.approx(float(found.margins[0]))
    assert said["region"] is None
    text = told(capsys, "tricept", "--pose", "X=100,Z=-1500,B=10")
    assert "characteristic length 150 mm" in text
    said = json.loads(told(capsys, "linear_delta", "--pose", "X=5000", "--json", code=3))
    assert said["verdict"] == "off limits"
    assert said["pose"]["condition"] is None


def test_the_command_over_the_workspace(capsys, tmp_path):
    said = json.loads(told(capsys, "orthoglide", "--json", "-o", str(tmp_path), "--step", "10", "--slice", "Z=-20"))
    assert said["region"]["isotropic"][0]["pose"] == pytest.approx({"X": 0, "Y": 0, "Z": 0}, abs=1e-6)
    assert said["region"]["singular"] == ["parallel"]
    assert said["region"]["step"] == 10
    table, picture = tmp_path / "orthoglide.atlas.csv", tmp_path / "orthoglide.atlas.Z-20.png"
    assert sorted(said["files"].values()) == sorted([str(table), str(picture)])
    assert picture.read_bytes().startswith(b"\x89PNG")
    with table.open() as file:
        rows = list(csv.DictReader(file))
    m = load_shipped("orthoglide")
    poses = np.array([[float(row[f"{axis} [mm]"]) for axis in m.axes] for row in rows])
    assert (poses[:, 2] == -20).all()
    assert np.array_equal([row["allowed"] == "1" for row in rows], m.check(poses) == 0)
    values = np.array([float(row["condition number"]) for row in rows])
    assert np.allclose(values, compute_performance(m, poses).condition, rtol=1e-8)


def test_the_command_proves_and_refutes(capsys):
    box = "X=-100:70,Y=-100:70,Z=-100:70"
    said = json.loads(told(capsys, "orthoglide", "--box", box, "--amplification", "1/3:3", "--json"))
    assert [claim["verdict"] for claim in said["box"]["claims"]] == ["proved"] * 3
    assert said["box"]["psi"]["greatest"]["high"] < 3
    assert "proved" in told(capsys, "orthoglide", "--box", box)
    said = json.loads(told(capsys, "orthoglide", "--box", box, "--amplification", "1/2:2", "--json", code=3))
    assert said["verdict"] == "refuted"
    pose = said["box"]["claims"][2]["counterexample"]
    assert compute_performance(load_shipped("orthoglide"), list(pose.values())).greatest > 2
    assert "refuted" in told(capsys, "orthoglide", "--box", box, "--amplification", "1/2:2", code=3)


@pytest.mark.parametrize(
    "arguments",
    [
        ("nothing",),
        ("orthoglide", "--box", "X=1"),
        ("orthoglide", "--box", "Q=1:2"),
        ("orthoglide", "--box", "X=3:2"),
        ("orthoglide", "--box", "X=1:2", "--at", "X=0"),
        ("orthoglide", "--amplification", "1:2"),
        ("orthoglide", "--box", "X=1:2", "--amplification", "3"),
        ("orthoglide", "--box", "X=1:2", "--amplification", "3:1"),
        ("orthoglide", "--box", "X=1:2", "--amplification", "a:b"),
        ("orthoglide", "--pose", "X=1,X=2"),
        ("orthoglide", "--pose", "1,2"),
        ("orthoglide", "--step", "0"),
        ("orthoglide", "--step", "0.001"),
        ("orthoglide", "--length", "-3"),
        ("orthoglide", "--slice", "Z=0"),
        ("orthoglide", "--slice", "Z=0", "--slice", "Z=0", "-o", "maps"),
        ("orthoglide", "--slice", "X=0", "--slice", "Z=0", "-o", "map.png"),
        ("orthoglide", "--slice", "Z=500", "-o", "map.png"),
        ("orthoglide", "--at", "X=900"),
        ("orthoglide", "-o", "map.bmp"),
        ("orthoglide", "--mode", "?"),
    ],
)
def test_bad_input_is_one_line(arguments, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["atlas", *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_map_whose_outline_is_not_found_in_time_is_refused():
    with pytest.raises(pk.PoseError, match="time is up"):
        map_performance(pk.region(load_shipped("linear_delta"), at={"Z": 280.0}), budget=Budget(1e-6))
