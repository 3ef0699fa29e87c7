"""The command line: exit codes, one line an error, JSON that parses, nothing heavy at import."""

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from shipped import REPRESENTATIVES, load_shipped

import parakin as pk
from parakin.cli import app, main

PART = "UNITS/MM\nFEDRAT/1000,MMPM\nGOTO/0,0,-1650,0,0,1\nGOTO/10,0,-1650\nGOTO/10,20,-1660\n"
LONG = "FEDRAT/1000,MMPM\nGOTO/0,0,-1650,0,0,1\nGOTO/0,0,-2050\n"


@pytest.fixture(scope="module", autouse=True)
def compiled(tmp_path_factory):
    """Compile the kernels before any test, for the command announces it on the stream that the tests read."""
    folder = tmp_path_factory.mktemp("compiled")
    (folder / "part.cls").write_text(PART)
    assert main(["post", str(folder / "part.cls"), "-m", "tricept", "-o", str(folder)]) == 0


@pytest.fixture
def part(tmp_path):
    path = tmp_path / "part.cls"
    path.write_text(PART)
    return path


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def refused(capsys, *arguments):
    """The one line a command refuses its input with."""
    assert main([str(a) for a in arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.endswith("\n")
    assert said.err.count("\n") == 1, said.err
    return said.err.strip()


# post


def test_post(part, out, capsys):
    assert main(["post", str(part), "--machine", "tricept", "-o", str(out)]) == 0
    said = capsys.readouterr().out
    assert sorted(path.name for path in out.iterdir()) == ["part.joints.csv", "part.report.html"]
    assert "3 records and 1 inserted, all within the limits" in said  # beside the pole, where the path begins
    assert said.splitlines()[-1].endswith(str(out / "part.report.html"))
    with (out / "part.joints.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["line"] for row in rows] == ["3", "4", "4", "5"]
    assert float(rows[0]["d1 [mm]"]) == pytest.approx((250**2 + 1200**2) ** 0.5, abs=1e-6)


def test_post_off_limits(part, out, capsys):
    part.write_text(LONG)
    assert main(["post", str(part), "-m", "tricept", "-o", str(out)]) == 3
    assert f"{part}:3: leg d2 would be 1,619.4 mm, limit 1,520" in capsys.readouterr().out
    with (out / "part.joints.csv").open() as file:
        assert [row["broken"] for row in csv.DictReader(file)] == ["", "d1.max"]


def test_post_json(part, out, capsys):
    part.write_text(LONG)
    assert main(["post", str(part), "-m", "tricept", "-o", str(out), "--json", "--parquet"]) == 3
    said = json.loads(capsys.readouterr().out)
    assert said["schema"] == "parakin.post/1"
    assert (said["verdict"], said["records"], said["off_limits"]) == ("off limits", 2, 1)
    assert said["first"]["line"] == 3
    assert said["worst"]["excess"] == pytest.approx((250**2 + 1600**2) ** 0.5 - 1520)
    assert [joint["joint"] for joint in said["joints"]] == ["d1", "d2", "d3", "theta1", "theta2"]
    assert said["joints"][3]["high"] == pytest.approx(360)
    assert set(said["files"]) == {"table", "parquet", "report"}
    assert all(os.path.getsize(path) for path in said["files"].values())  # noqa: PTH202


def test_post_unreachable_json_has_no_nan(part, out, capsys):
    part.write_text("GOTO/2000,0,280,0,0,1\n")
    assert main(["post", str(part), "-m", "linear_delta", "-o", str(out), "--json"]) == 3
    said = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert said["joints"][0]["min"] is None
    assert "can't close" in said["first"]["text"]


def test_post_workpiece_and_sizes(part, out):
    arguments = ["post", str(part), "-m", "tricept", "-o", str(out)]
    assert main([*arguments, "--workpiece", "0,0,-400"]) == 3
    assert main([*arguments, "--workpiece", "Z=-400mm", "--set", "l1=700mm"]) == 0
    assert main([*arguments, "--workpiece=-10,0,0,0,0,90", "--mode", "-"]) == 0


@pytest.mark.parametrize("name", REPRESENTATIVES)
def test_post_on_every_machine(name, part, out, capsys):
    code = main(["post", str(part), "-m", name, "-o", str(out)])
    assert code in (0, 3)
    said = capsys.readouterr()
    assert said.err == "" or said.err.startswith("compiling")
    assert ("all within" in said.out) == (code == 0)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("GOTO/0,0\n", 1),
        ("GOTO/0,0,-1650,0,0,1\nGOTO/1,2,x\n", 2),
        ("GOTO/0,0,-1650,0,0,0\n", 1),
        ("GOTO/0,0,0,0,0,1\nGOTO/1e99,0,0\n", 2),
    ],
)
def test_bad_part(part, out, capsys, text, line):
    part.write_text(text)
    assert refused(capsys, "post", part, "-m", "tricept", "-o", out).startswith(f"{part}:{line}: ")
    assert not out.exists()


def test_bad_files(part, out, tmp_path, capsys):
    assert "No such file" in refused(capsys, "post", tmp_path / "none.cls", "-m", "tricept", "-o", out)
    assert "directory" in refused(capsys, "post", tmp_path, "-m", "tricept", "-o", out)
    part.write_bytes(b"\0\1\2")
    refused(capsys, "post", part, "-m", "tricept", "-o", out)
    part.write_text("")
    refused(capsys, "post", part, "-m", "tricept", "-o", out)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["post", ""], "behind post"), (["post", "a", "-m", ""], "behind -m"), (["show", "a", "-o", ""], "behind -o"),
        (["inverse", "tricept", "--csv="], "for --csv"), ([""], "in front"),
    ],
)  # fmt: skip
def test_empty_words_are_no_names(capsys, words, told):
    assert refused(capsys, *words) == f"parakin: an empty value {told}; expected a file, a name or a value"


def test_bad_machines(part, out, tmp_path, capsys):
    assert 'did you mean "tricept"?' in refused(capsys, "post", part, "-m", "tricpt", "-o", out)
    assert "none.yaml" in refused(capsys, "post", part, "-m", tmp_path / "none.yaml", "-o", out)
    refused(capsys, "post", part, "-m", tmp_path, "-o", out)
    machine = tmp_path / "bad.yaml"
    machine.write_text("name: [\n")
    assert refused(capsys, "show", machine).startswith(f"{machine}:")
    machine.write_text("name: a\nsource: x\nmotion: tx tq\n")
    assert main(["show", str(machine)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert all(line.startswith(f"{machine}:") for line in lines)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--workpiece", "1,2"], "--workpiece: "),
        (["--workpiece", "-1,2"], "--workpiece: "),
        (["--mode", "++"], "--mode '++'"),
        (["--arc-tolerance", "0"], "--arc-tolerance: "),
        (["--arc-tolerance", "nan"], "--arc-tolerance: "),
        (["--arc-tolerance", "x"], "--arc-tolerance"),
        (["--set", "R"], "--set: "),
        (["--set", "R=3"], "--set: "),
        (["--set", "R=3deg"], "--set: "),
        (["--set", "RR=3mm"], "--set: "),
        (["--set", "R=3mm", "--set", "R=4mm"], "--set: "),
        (["--parket"], "--parquet"),
        (["extra"], 'parakin: post takes no more values, got "extra"'),
    ],
)
def test_bad_options(part, out, capsys, options, said):
    assert said in refused(capsys, "post", part, "-m", "tricept", "-o", out, *options)
    assert not out.exists()


def test_folder_that_cant_be_written(part, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert "can't be written" in refused(capsys, "post", part, "-m", "tricept", "-o", tmp_path / "file" / "below")
    (tmp_path / "part.joints.csv").mkdir()
    refused(capsys, "post", part, "-m", "tricept", "-o", tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "part.cls", "part.joints.csv"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_folder_without_permission(part, tmp_path, capsys):
    (tmp_path / "locked").mkdir(mode=0o500)
    assert "Permission denied" in refused(capsys, "post", part, "-m", "tricept", "-o", tmp_path / "locked")


def test_unknown_command(capsys):
    assert 'Did you mean "post"?' in refused(capsys, "pots")


# machines, show


def test_machines(capsys):
    assert main(["machines"]) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in pk.machines())
    assert max(len(line) for line in said.splitlines()) <= 80
    families = [paragraph.splitlines() for paragraph in said.strip().split("\n\n")]
    assert [lines[0] for lines in families] == sorted({load_shipped(name).spec.family for name in pk.machines()})
    of = {line.split()[0]: lines[0] for lines in families for line in lines[2:]}
    assert of["hexaglide"] == of["linear_delta"] == "rods on straight slides"
    assert of["tricept"] == of["g500"] == "struts of variable length on fixed feet"
    assert main(["machines", "--json"]) == 0
    assert [machine["name"] for machine in json.loads(capsys.readouterr().out)["machines"]] == pk.machines()


@pytest.mark.parametrize("name", pk.machines())
def test_show(name, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["show", name]) == 0
    said = capsys.readouterr().out
    assert all(joint in said for joint in load_shipped(name).joints)
    assert said.splitlines()[-1] == f"-o {name}.html writes the page on which it moves"
    assert main(["show", name, "--json"]) == 0
    assert not list(tmp_path.iterdir())
    told = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert told["name"] == name
    assert main(["show", name, "--parameters"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    listed = [(parameter["name"], parameter["unit"], parameter["group"]) for parameter in told["parameters"]]
    assert listed == [(first, unit, group) for first, _, unit, group in lines]
    assert [first for first, *_ in listed] == [parameter.name for parameter in load_shipped(name).parameters]


@pytest.mark.parametrize(("answer", "written"), [("y", ["rpr3.html"]), ("", []), ("no", [])])
def test_show_asks_at_a_terminal(answer, written, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for stream in (sys.stdin, sys.stdout):
        monkeypatch.setattr(stream, "isatty", lambda: True)
    monkeypatch.setattr("builtins.input", lambda question: answer if "rpr3.html" in question else pytest.fail(question))
    assert main(["show", "rpr3"]) == 0
    assert [path.name for path in tmp_path.iterdir()] == written
    assert ("page rpr3.html" in capsys.readouterr().out) == bool(written)


def test_show_how_a_joint_is_driven(tmp_path, capsys):
    text = (Path(pk.__file__).parent / "machines" / "tricept.yaml").read_text(encoding="utf-8")
    keys = "joints: [d1, d2, d3]\n  counts: 10000\n  lead: 10 mm\n  homing: absolute"
    (tmp_path / "driven.yaml").write_text(text.replace("joints: [d1, d2, d3]", keys), encoding="utf-8")
    assert main(["show", str(tmp_path / "driven.yaml"), "-o", str(tmp_path / "picture.html")]) == 0
    (row,) = [line.split() for line in capsys.readouterr().out.splitlines() if line.startswith("d2 ")]
    assert row == ["d2", "934", "1,520", "mm", "500", "5,000", "250,000", "10,000", "10", "absolute"]
    assert main(["show", str(tmp_path / "driven.yaml"), "--json"]) == 0
    drives = json.loads(capsys.readouterr().out)["drives"]
    assert [[drives[i][key] for key in ("counts", "lead", "homing")] for i in (0, 4)] == [
        [10000.0, 10.0, "absolute"],
        [None, None, None],
    ]


def test_show_yaml(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["show", "tricept", "--yaml", "--set", "R=360mm"]) == 0
    (tmp_path / "mine.yaml").write_text(capsys.readouterr().out, encoding="utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.yaml"]
    here = load_shipped("tricept").home
    assert (pk.load("mine.yaml").inverse(here) == pk.load("tricept", parameters={"R": "360 mm"}).inverse(here)).all()
    assert "--yaml" in refused(capsys, "show", "tricept", "--yaml", "--json")


def test_a_file_is_printed_with_other_sizes(tmp_path, capsys):
    path = tmp_path / "own.yaml"
    path.write_text((Path(pk.__file__).parent / "machines" / "orthoglide.yaml").read_text(encoding="utf-8"))
    assert main(["show", str(path), "--file", "--set", "cube=150mm + 70mm", "--set", "L=-1 * (0 mm - 280 mm)"]) == 0
    said, text = capsys.readouterr().out, path.read_text()
    told = text.replace("cube: 200 mm\n", "cube: 150mm + 70mm\n")
    assert said == told.replace("L: cube / (1 / sqrt(11) + 2 / sqrt(17)) ", 'L: "-1 * (0 mm - 280 mm)" ')
    path.write_text(said)
    assert pk.load(path).spec.sizes == {"cube": 220.0, "L": 280.0}


def test_show_picture(tmp_path, capsys):
    for suffix, start in (("html", b"<!doctype html"), ("png", b"\x89PNG")):
        target = tmp_path / f"picture.{suffix}"
        assert main(["show", "tricept", "-o", str(target)]) == 0
        assert capsys.readouterr().out.splitlines()[-1].endswith(str(target))
        assert target.read_bytes()[:14].lower().startswith(start.lower())
    assert ".html, .png, .pdf, .svg" in refused(capsys, "show", "tricept", "-o", tmp_path / "picture.jpg")


# inverse, forward


def test_inverse_and_forward(capsys):
    assert main(["inverse", "tricept", "-10", "20", "-1600", "10", "30", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert row["pose"] == pytest.approx({"X": -10, "Y": 20, "Z": -1600, "B": 10, "C": 30})
    joints = [f"{name}={value:.12f}" for name, value in row["joints"].items()]
    assert main(["forward", "tricept", *joints, "--json"]) == 0
    (back,) = json.loads(capsys.readouterr().out)["rows"]
    assert back["pose"] == pytest.approx(row["pose"], abs=1e-6)
    assert main(["forward", "tricept", *joints, "--near", "-10,20,-1600,10,30"]) == 0


def test_inverse_by_name_and_in_text(capsys):
    assert main(["inverse", "tricept", "z=-1650"]) == 0
    said = capsys.readouterr().out
    assert f"{(250**2 + 1200**2) ** 0.5:,.6f}" in said
    assert "-0.0000" not in said


def test_inverse_off_limits_and_out_of_reach(capsys):
    assert main(["inverse", "tricept", "Z=-2050"]) == 3
    assert "pose: leg d1 would be 1,619.4 mm, limit 1,520" in capsys.readouterr().err
    assert main(["inverse", "linear_delta", "X=1000", "--json"]) == 3
    said = capsys.readouterr()
    (row,) = json.loads(said.out)["rows"]
    assert row["broken"].endswith(".reach")
    assert row["joints"]["tower_a"] is None
    assert "can't close" in said.err


def test_forward_without_a_pose(capsys):
    assert main(["forward", "hexapod", "strut0=100"]) == 3
    assert (
        "no pose found, on the way from the start to the joints the legs come to a parallel singularity"
        in capsys.readouterr().err
    )


def test_forward_of_several_rows(tmp_path, capsys):
    rows = tmp_path / "rows.csv"
    rows.write_text("d1,d2,d3,theta1,theta2\n1,2000,2000,0,0\n1300,1300,1300,0,0\n1600,1600,1600,0,0\n")
    assert main(["forward", "tricept", "--csv", str(rows), "--json"]) == 3
    said = capsys.readouterr()
    result = json.loads(said.out, parse_constant=pytest.fail)
    assert [row["broken"] for row in result["rows"]] == ["not converged", None, "d1.max"]
    assert result["rows"][0]["pose"]["X"] is None
    assert [bool(row["reason"]) for row in result["rows"]] == [True, False, False]
    assert [(offence["record"], offence["line"]) for offence in result["offences"]] == [(2, 4)] * 3
    assert f"{rows}:2: no pose found" in said.err


def test_csv_both_ways(tmp_path, capsys):
    poses, joints, back = (tmp_path / name for name in ("poses.csv", "joints.csv", "back.csv"))
    poses.write_text("note,c,B,Z [mm],Y,X [in]\na,30,10,-1600,20,1\n\nb,0,0,-1650,0,0\n")
    assert main(["inverse", "tricept", "--csv", str(poses), "-o", str(joints)]) == 0
    assert main(["forward", "tricept", "--csv", str(joints), "-o", str(back)]) == 0
    capsys.readouterr()
    with back.open() as file:
        first, second = csv.DictReader(file)
    assert [float(first[n]) for n in ("X [mm]", "Y [mm]", "Z [mm]")] == pytest.approx([25.4, 20, -1600], abs=1e-4)
    assert float(first["C [deg]"]) == pytest.approx(30, abs=1e-5)
    assert float(second["Z [mm]"]) == pytest.approx(-1650, abs=1e-5)
    poses.write_text("0,0,-1650,0,0\n0,0,-2050,0,0\n")
    assert main(["inverse", "tricept", "--csv", str(poses)]) == 3
    said = capsys.readouterr()
    assert [row["broken"] for row in csv.DictReader(said.out.splitlines())] == ["", "d1.max"]
    assert f"{poses}:2: leg d1" in said.err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("X,Y,Z,B,C\n0,0,-1650,0,0\n0,0,x,0,0\n", ':3: Z: "x", expected a number'),
        ("0,0,-1650,0,0\n0,0,,0,0\n", ":2: Z: nothing"),
        ("0,0,-1650,0\n", ":1: 4 values, expected 5"),
        ("0,0,-1650,0,0\n1,2\n", ":2: 2 values"),
        ("X,Y,Z,B\n0,0,-1650,0\n", ":1: no column C"),
        ("X,Y,Z,B,C,X\n", ":1: column"),
        ("X [deg],Y,Z,B,C\n0,0,0,0,0\n", ":1: column X: unit"),
        ("0,0,nan,0,0\n", ":1: Z: "),
        ("0,0,inf,0,0\n", ":1: Z: "),
        ("", ": no rows"),
        ("\ufeffX,Y,Z,B,C\n", ": no rows"),
        ("\0\n", ":1: "),
    ],
)
def test_bad_csv(tmp_path, capsys, text, said):
    rows = tmp_path / "rows.csv"
    rows.write_text(text)
    assert refused(capsys, "inverse", "tricept", "--csv", rows).startswith(f"{rows}{said}")


@pytest.mark.parametrize("values", ["", "1 2", "X=1 2", "Q=1", "X=1 x=2", "X=a", "X=1deg", "1 2 3 4 nan", "--csb x"])
def test_bad_values(capsys, values):
    refused(capsys, "inverse", "tricept", *values.split())


def test_unreadable_csv(tmp_path, capsys):
    assert "cannot be read" in refused(capsys, "inverse", "tricept", "--csv", tmp_path)
    (tmp_path / "latin").write_bytes("X,Y,Z,B,C\n\xe9".encode("latin-1"))
    assert "UTF-8" in refused(capsys, "inverse", "tricept", "--csv", tmp_path / "latin")
    assert "expected one of them" in refused(capsys, "inverse", "tricept", "1", "--csv", tmp_path)


# The process


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, **options)


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from parakin.cli import main; assert main(['--help']) == 0; "
        "heavy = {'numpy', 'numba', 'pydantic', 'pyarrow', 'matplotlib', 'ruamel'}; "
        "print(heavy & set(sys.modules), file=sys.stderr)"
    )
    done = run(sys.executable, "-c", code)
    assert done.returncode == 0
    assert done.stderr.strip() == "set()"
    assert "post" in done.stdout


def test_process_exit_codes(part, out):
    module = [sys.executable, "-m", "parakin.cli"]
    assert run(*module, "--version").stdout.strip() == pk.__version__
    done = run(*module, "show", "tricpt")
    assert (done.returncode, done.stdout) == (2, "")
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(os.name != "posix", reason="needs a POSIX shell")
def test_broken_pipe_is_quiet():
    done = run("sh", "-c", f"'{sys.executable}' -m parakin.cli machines | true")
    assert done.stderr == ""


def test_interruption(monkeypatch, part, out, capsys):
    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("parakin.toolpath.posting.post.judge_path", interrupted)
    assert main(["post", str(part), "-m", "tricept", "-o", str(out)]) == 130
    assert "Traceback" not in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes_machines_files_and_parts(tmp_path):
    """By the script as it is installed, with the words split as bash splits them."""
    shell = tmp_path / "bin" / "parakin"
    shell.parent.mkdir()
    shell.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m parakin "$@"\n')
    shell.chmod(0o755)
    (tmp_path / "complete").write_text(app.generate_completion(shell="bash"))
    (tmp_path / "work" / "sub").mkdir(parents=True)
    for name in ("trio.yaml", "trial.cls", "sub/own.yml"):
        (tmp_path / "work" / name).touch()
    asked = {
        "show tri": "tricept tricept_805 triglide triglide_pairs trio.yaml",
        "compare tricept ./tri": "./trio.yaml",
        "page tria": "trial.cls",
        "export sub": "sub/own.yml",
        "post trial.cls --machine = tricept_": "tricept_805",
        "linuxcnc ''": " ".join([*pk.machines(), "sub/own.yml", "trio.yaml"]),
    }
    steps = "".join(
        f'COMP_WORDS=(parakin {words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _parakin; echo "${{COMPREPLY[*]}}"\n'
        for words in asked
    )
    done = run("bash", "-c", f'. ../complete\n{steps}', cwd=tmp_path / "work",
               env={**os.environ, "PATH": f"{shell.parent}:{os.environ['PATH']}"})  # fmt: skip
    assert done.stdout.splitlines() == list(asked.values())


def test_a_page_of_a_part_asks_for_its_machine(part, capsys):
    assert "needs the machine that it is for; expected --machine" in refused(capsys, "page", part)


def test_a_negative_value_that_is_taken_for_an_option_is_told_how_to_write(capsys):
    assert "A negative value is written --cell=-5mm" in refused(capsys, "workspace", "tricept", "--cell", "-5mm")
    assert "--cell: " in refused(capsys, "workspace", "tricept", "--cell=-5mm")
