"""Machines side by side: the figures are those that the single commands tell."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.commands.console import format_table
from parakin.performance.indices import compute_performance

PART = "UNITS/MM\nFEDRAT/900,MMPM\nGOTO/0,0,0\nGOTO/40,10,0\nGOTO/40,-30,0\nFINI\n"
NAMES = ["linear_delta", "orthoglide"]
ASKED = ["--tolerance", "feet=0.05mm,encoders=2um", "--drives", "100N/um", "--struts", "diameter=20mm"]
WORDS = [*NAMES, *ASKED, "--samples", "60"]


def test_the_figures_are_those_told_alone(tmp_path, capsys):
    part = tmp_path / "part.apt"
    part.write_text(PART, encoding="utf-8")
    assert main(["compare", *WORDS, "--part", str(part), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [told["name"] for told in answer["machines"]] == NAMES
    for name, told in zip(NAMES, answer["machines"], strict=True):
        machine = load_shipped(name)
        accuracy = pk.analyse_accuracy(machine, {"feet": "0.05 mm", "encoders": "2 um"}, samples=60)
        assert told["tip_error"]["50"] == pytest.approx(accuracy.percentile(50))
        stiffness = pk.analyse_stiffness(machine, "100 N/um", {"diameter": "20 mm"}, accuracy.poses)
        assert told["least_stiffness"]["5"] == pytest.approx(np.percentile(stiffness.least, 5))
        greatest = compute_performance(machine, accuracy.poses).greatest
        assert told["amplification"]["95"] == pytest.approx(np.percentile(greatest, 95))
        volume = pk.workspace(pk.region(machine), gap=0.01).volume
        assert told["workspace"]["inner"] <= volume.outer
        assert volume.inner <= told["workspace"]["outer"]
        assert 5.0 < told["cycle_time"] < 10.0
        assert told["reasons"] == {}


def test_what_a_machine_cannot_do_is_said(tmp_path, capsys, monkeypatch):
    part = tmp_path / "part.apt"
    part.write_text(PART.replace("40,", "400,"), encoding="utf-8")
    page = tmp_path / "compared.html"
    words = ["compare", "orthoglide", "rotary_delta", "-o", str(page)]
    monkeypatch.setenv("COLUMNS", "48")  # too narrow for both, and for one
    assert main([*words, "--drives", "100N/um", "--part", str(part)]) == 0
    said = capsys.readouterr()
    lines = said.out.split("page")[0].splitlines()
    assert max(map(len, lines)) <= 48
    below = lines[lines.index("the part's cycle time") + 1 :][:2]
    assert [line.split()[:2] for line in below] == [["orthoglide", "-"], ["rotary_delta", below[1].split()[1]]]
    text = page.read_text("utf-8")
    assert text.count("data:image/png") == 2
    assert "orthoglide: part: the part runs at none of" in text
    assert "orthoglide: part: the part runs at none of" in said.err
    assert 'rotary_delta: stiffness: drives: hip0: "100N/um"' in said.err
    assert "the part's cycle time" in said.out


def test_a_table_that_is_too_wide_is_turned(monkeypatch):
    header, rows = ("joint", "from", "", "note"), [("d1", "-1", "mm", ""), ("theta", "20", "deg", "turns")]
    monkeypatch.setenv("COLUMNS", "23")
    assert format_table(rows, header, " r") == ("joint  from       note\nd1       -1  mm\ntheta    20  deg  turns")
    monkeypatch.setenv("COLUMNS", "22")
    assert format_table(rows, header, " r") == "d1\n  from  -1  mm\ntheta\n  from  20  deg\n  note  turns"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["orthoglide"], "two machines at least"),
        (["orthoglide", "no_such"], "no_such"),
        ([*NAMES, "--struts", "9N/um"], "struts: the drives' stiffness is missing"),
        ([*NAMES, "--drives", "9"], 'drives: tower_a: "9"'),
        ([*NAMES, "--tolerance", "foot=1mm,encoders=2um"], "--tolerance foot: none of the machines has such a number"),
        ([*NAMES, "--tolerance", "feet"], "expected NAME=VALUE"),
        ([*NAMES, "--samples", "0"], "samples"),
        ([*NAMES, "--part", "none.apt"], "none.apt"),
        ([*NAMES, "-o", "compared.pdf"], '"compared.pdf": expected a file name that ends in .html'),
    ],
)
def test_what_is_mistaken_is_said_in_one_line(words, message, capsys):
    assert main(["compare", *words]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert message in said.err


def test_the_example_runs(tmp_path):
    script = Path(__file__).parents[1] / "examples" / "comparison.py"
    words = [sys.executable, script, "-o", tmp_path, "--samples", "40"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert "hexapod: " in done.stdout
    assert "hexapod" in (tmp_path / "comparison.html").read_text("utf-8")
