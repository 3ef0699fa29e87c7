"""``parakin workspace``: numbers against closed forms, JSON, every file, refusals in one line."""

import csv
import json
import subprocess
import sys
from math import pi

import matplotlib.image
import meshio
import numpy as np
import pytest
import trimesh
from regions import whole_region
from shipped import load_shipped

import parakin as pk
from parakin.budget import CLOCK
from parakin.cli import main
from parakin.workspaces.certified.subdivision import Subdivision

BALL = """
title: A hollow ball
source: Sizes were chosen.
sizes: {far: 9000 mm, R: 500 mm}
motion: tx ty tz
legs:
  - {kind: length, joints: [q0], foot: [0, 0, 0], platform: [0, 0, 0], range: [200 mm, R]}
  - {kind: length, joints: [q1], foot: [far, 0, 0], platform: [0, 0, 0], range: [1000 mm, 20000 mm]}
  - {kind: length, joints: [q2], foot: [0, far, 0], platform: [0, 0, 0], range: [1000 mm, 20000 mm]}
home: {X: 300 mm, Y: 0 mm, Z: 0 mm}
"""
VOLUME = 4 / 3 * pi * (500**3 - 200**3)


@pytest.fixture
def ball(tmp_path):
    path = tmp_path / "ball.yaml"
    path.write_text(BALL)
    return str(path)


def told(capsys, *arguments, code=0):
    assert main(["workspace", *map(str, arguments), "--json"]) == code
    return json.loads(capsys.readouterr().out, parse_constant=pytest.fail)


def refused(capsys, *arguments):
    """The one line with which a command refuses its input."""
    assert main(["workspace", *map(str, arguments)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1, said.err
    return said.err.strip()


def test_the_account_for_people(ball, capsys):
    assert main(["workspace", ball, "--all-parts"]) == 0
    said = capsys.readouterr().out
    lines = dict(line.split(None, 1) for line in said.splitlines() if line[:1].isalpha() and "  " in line)
    low, high = (float(word.replace(",", "")) for word in lines["proved"].split(" mm³")[0].split(" to "))
    assert low < VOLUME < high < low * 1.011
    assert "litres" in lines["volume"]
    assert "as asked for" in lines["gap"]
    assert float(lines["q0.max"].split("%")[0]) == pytest.approx(100 * 500**2 / (500**2 + 200**2), abs=1.5)
    assert "q0.min" in lines
    assert "q1.max" not in lines


def test_json(ball, capsys):
    said = told(capsys, ball, "--all-parts", "--gap", "0.02")
    assert list(said) == [
        "schema", "machine", "kind", "axes", "unit", "volume", "gap", "stopped", "empty", "box", "centroid",
        "bounded_by", "surface", "cells", "slices", "elsewhere", "parameters", "files",
    ]  # fmt: skip
    assert (said["schema"], said["machine"], said["kind"]) == ("parakin.workspace/1", "ball", "constant")
    assert (said["axes"], said["unit"], said["stopped"], said["empty"]) == (["X", "Y", "Z"], "mm³", "gap", False)
    volume = said["volume"]
    assert volume["inner"] < VOLUME < volume["outer"]
    assert said["gap"] == pytest.approx((volume["outer"] - volume["inner"]) / volume["estimate"])
    assert said["gap"] <= 0.02
    assert said["centroid"] == pytest.approx([0, 0, 0], abs=1)
    assert said["surface"] == pytest.approx(4 * pi * (500**2 + 200**2), rel=0.05)
    assert (np.abs(said["box"]["low"]) >= 500).all()
    assert sum(bound["share"] for bound in said["bounded_by"]) == pytest.approx(1)
    assert {bound["limit"] for bound in said["bounded_by"]} == {"q0.min", "q0.max"}
    assert min(said["cells"].values()) > 100
    assert said["parameters"]["gap"] == 0.02
    assert said["files"] == {}
    assert len(said["slices"]) == 5
    for section in said["slices"]:
        z = section["value"]
        hole = max(0.0, 200**2 - z**2)
        assert section["area"] == pytest.approx(pi * (500**2 - z**2 - hole), rel=2e-3)
        assert len(section["outlines"]) == 1 + (hole > 0)
        points = np.array(section["outlines"][0])
        assert np.hypot(*points.T) == pytest.approx(np.full(len(points), (500**2 - z**2) ** 0.5), abs=0.02)


def test_parameters_are_enough_to_run_it_again(capsys):
    first = told(
        capsys, "hexapod", "--at", "C=30,Z=-900mm", "--every", "A=-10:0.1rad", "--without", "strut0.m*", "--gap", 0.05
    )
    given = first["parameters"]
    assert first["kind"] == "total"
    assert (given["at"]["C"], given["at"]["B"], given["at"]["Z"]) == pytest.approx((30, 0, -900))
    assert given["every"]["A"] == pytest.approx([-10, np.degrees(0.1)])
    assert given["without"] == ["strut0.min", "strut0.max"]
    again = pk.workspace(
        whole_region(
            load_shipped("hexapod"),
            at={axis: np.radians(v) if axis in "ABC" else v for axis, v in given["at"].items()},
            every={axis: tuple(np.radians(span)) for axis, span in given["every"].items()},
            without=given["without"],
            mode=given["mode"],
        ),
        gap=given["gap"],
    )
    assert again.volume.inner == pytest.approx(first["volume"]["inner"])
    assert again.volume.outer == pytest.approx(first["volume"]["outer"])


def test_sizes_can_be_set(ball, capsys):
    said = told(capsys, ball, "--all-parts", "--set", "R=400mm")
    assert said["volume"]["inner"] < 4 / 3 * pi * (400**3 - 200**3) < said["volume"]["outer"]
    assert said["parameters"]["set"] == ["R=400mm"]


def test_every_file_opens_again(ball, tmp_path, capsys):
    folder = tmp_path / "out"
    kinds = ["stl", "ply", "glb", "vtu", "csv", "png", "json"]
    options = [word for kind in kinds for word in ("-o", str(folder / f"shape.{kind}"))]
    said = told(capsys, ball, "--all-parts", "--gap", "0.05", *options)
    assert said["files"] == {kind: str(folder / f"shape.{kind}") for kind in kinds}
    assert sorted(path.name for path in folder.iterdir()) == sorted(f"shape.{kind}" for kind in kinds)
    for kind in ("stl", "ply", "glb"):
        mesh = trimesh.load(folder / f"shape.{kind}", force="mesh")
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(VOLUME, rel=0.01)
    cells = meshio.read(folder / "shape.vtu")
    assert len(cells.cells[0].data) == said["cells"]["inside"] + said["cells"]["boundary"]
    with (folder / "shape.csv").open() as file:
        assert sum(row["state"] == "1" for row in csv.DictReader(file)) == said["cells"]["inside"]
    image = matplotlib.image.imread(folder / "shape.png")
    assert image.shape[0] > 600
    assert len(np.unique(image.reshape(-1, image.shape[2]), axis=0)) > 1000  # a shaded shell, no blank page
    assert json.loads((folder / "shape.json").read_text()) == said


def test_the_step_makes_the_mesh(ball, tmp_path):
    sizes = []
    for step in ("60", "3cm"):
        assert main(["workspace", ball, "--all-parts", "--step", step, "-o", str(tmp_path / "s.stl")]) == 0
        sizes.append(len(trimesh.load(tmp_path / "s.stl").faces))
    assert 3 < sizes[1] / sizes[0] < 5


def test_a_planar_machine(tmp_path, capsys):
    said = told(capsys, "hbg80_2d", "-o", tmp_path / "a.png", "-o", tmp_path / "a.vtu", "-o", tmp_path / "a.csv")
    assert (said["axes"], said["unit"]) == (["X", "Y"], "mm²")
    (section,) = said["slices"]
    assert section["axis"] is section["value"] is None
    assert said["volume"]["inner"] < section["area"] < said["volume"]["outer"]
    assert meshio.read(tmp_path / "a.vtu").cells[0].type == "quad"
    assert matplotlib.image.imread(tmp_path / "a.png").ndim == 3
    assert "only" not in refused(capsys, "hbg80_2d", "-o", "a.stl")
    assert "a mesh needs a volume" in refused(capsys, "hbg80_2d", "-o", "a.stl")


def test_a_line(ball, tmp_path, capsys):
    said = told(capsys, ball, "--all-parts", "--at", "X=0,Y=0", "-o", tmp_path / "a.vtu")
    assert said["unit"] == "mm"
    assert said["volume"]["inner"] < 600 < said["volume"]["outer"]
    assert said["slices"] == []
    assert "area" in refused(capsys, ball, "--at", "X=0,Y=0", "-o", "a.png")


def test_nothing_at_all(ball, tmp_path, capsys):
    assert main(["workspace", ball, "--all-parts", "--at", "Z=2000"]) == 0
    assert "empty: no pose is allowed, proved" in capsys.readouterr().out
    names = [str(tmp_path / f"e.{kind}") for kind in ("vtu", "png", "csv")]
    options = [word for name in names for word in ("-o", name)]
    assert main(["workspace", ball, "--all-parts", "--at", "Z=2000", *options, "--json"]) == 3
    said = capsys.readouterr()
    content = json.loads(said.out)
    assert content["empty"] is True
    assert content["box"] is content["centroid"] is None
    assert content["volume"] == {"inner": 0, "estimate": 0, "outer": 0}
    assert content["files"] == {"csv": names[2]}
    assert said.err.count("not written, the workspace is empty") == 2
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith("e.")] == ["e.csv"]


def test_interrupted_it_gives_what_it_has(ball, capsys, monkeypatch):
    decide, calls = Subdivision._choose_parents, []

    def stopped(self, *arguments):
        calls.append(1)
        if len(calls) > 5:
            raise KeyboardInterrupt
        return decide(self, *arguments)

    monkeypatch.setattr(Subdivision, "_choose_parents", stopped)
    said = told(capsys, ball, "--all-parts", "--gap", "1e-6", "--time", "1e6", code=130)
    assert said["stopped"] == "interrupted"
    assert 0 < said["volume"]["inner"] < VOLUME < said["volume"]["outer"]
    assert len(said["slices"]) == 5


def test_the_time_is_kept(capsys):
    began = CLOCK.read()
    said = told(capsys, "hexapod", "--some", "A=-30:30,B=-30:30", "--at", "Z=-900", "--gap", "1e-5", "--time", "1")
    assert said["stopped"] == "time"
    assert CLOCK.read() - began < 15


@pytest.mark.parametrize("method", ["grid", "polar", "drives"])
def test_other_methods(method, tmp_path, capsys):
    proved = pk.workspace(pk.region(load_shipped("hbg80_3d"))).volume.estimate
    said = told(capsys, "hbg80_3d", "--method", method, "-o", tmp_path / "a.png", "-o", tmp_path / "a.stl")
    assert said["volume"]["inner"] is said["volume"]["outer"] is said["gap"] is None
    assert said["volume"]["estimate"] == pytest.approx(proved, rel=0.1 if method == "polar" else 0.01)
    assert said["parameters"]["method"] == method
    assert (said["note"] == "") == (method == "grid")
    assert ("curves" in said) == (method != "grid")
    assert trimesh.load(tmp_path / "a.stl").is_watertight
    assert matplotlib.image.imread(tmp_path / "a.png").std() > 0.02
    assert main(["workspace", "hbg80_2d", "--method", method, "-o", str(tmp_path / "b.png")]) == 0
    assert "nothing is proved" in capsys.readouterr().out


def test_curves_of_the_sweeps(capsys):
    machine = load_shipped("hbg80_2d")
    for method in ("polar", "drives"):
        said = told(capsys, "hbg80_2d", "--method", method)
        points = np.vstack([line for group in said["curves"] for line in group["lines"]])
        margins = machine.margins(points)  # rounded to 0.01 mm they are still about allowed
        assert len(points) > 70
        assert np.nanmin(margins / np.maximum(1.0, np.nanmax(margins, axis=0))) > -0.02


@pytest.mark.parametrize(
    "options, part",
    [
        (["--at", "Q=3"], '--at: unknown axis "Q"'),
        (["--at", "B"], "--at"),
        (["--at", "B=1,B=2"], "--at: B is given twice"),
        (["--at", "B=10mm"], "--at: B"),
        (["--at", "X=0,Y=0,Z=-1400"], "--at: every axis is fixed"),
        (["--every", "B=3"], "--every: B: expected a range"),
        (["--every", "B=10:-10"], '--every: B: "10:-10" is empty'),
        (["--some", "X=0:10"], "--some: X is no turning axis"),
        (["--at", "B=0", "--every", "B=0:5"], "B is fixed and swept"),
        (["--every", "B=0:5", "--some", "C=0:5"], "--some: goes without --every"),
        (["--without", "nothing*"], "--without: no limit nothing*"),
        (["--without", "d?.max"], "do not bound"),
        (["--mode", "+++"], "--mode"),
        (["--method", "magic"], "--method"),
        (["--method", "grid", "--gap", "0.1"], "--gap: --method grid has none"),
        (["--method", "grid", "-o", "a.vtu"], '--output: "a.vtu"'),
        (["--method", "drives"], "tricept: no sweep of the drives"),
        (["--method", "drives", "--without", "d1.max"], "--method: drives sweeps the whole workspace"),
        (["--method", "grid", "--step", "0.01"], "step: 0.01 mm"),
        (["--gap", "0"], "--gap"),
        (["--gap", "nan"], "--gap"),
        (["--time", "-1"], "--time"),
        (["--cell", "-3"], "--cell"),
        (["--cell", "3deg"], "--cell"),
        (["--step", "0"], "--step"),
        (["--step", "0.01", "-o", "a.stl"], "step: 0.01 mm makes"),
        (["-o", "a.obj"], '"a.obj": expected a file name that ends in .stl, .ply, .glb, .vtu, .csv, .png, .pdf, .svg'),
        (["-o", "a.stl", "-o", "b.stl"], '"b.stl": a second .stl'),
        (["--set", "R=3"], "--set"),
    ],
)
def test_bad_input_is_refused_in_one_line(options, part, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert part in refused(capsys, "tricept", *options)
    assert not list(tmp_path.iterdir())


def test_nothing_heavy_is_imported_for_help():
    code = (
        "import sys; from parakin.cli import main\n"
        "try: main(['workspace', '--help'])\n"
        "except SystemExit: pass\n"
        "print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "--dexterous" in done.stdout
    assert not {"numpy", "numba", "scipy", "trimesh", "skimage", "matplotlib", "pyarrow"} & set(done.stderr.split())
