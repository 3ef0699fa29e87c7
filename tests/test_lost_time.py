"""What LinuxCNC is told to take, and why that is much more than the trajectory."""

import json

import numpy as np
import pytest

import parakin as pk
from parakin.cli import main
from parakin.controllers import load_controller
from parakin.toolpath.path import ToolPath


def path_of(tip, axis=None):
    count = len(tip)
    axis = np.tile([0.0, 0.0, 1.0], (count, 1)) if axis is None else axis
    feed = np.full(count, 3000.0)
    return ToolPath("part.cls", np.array(tip, float), axis, np.arange(1, count + 1), np.zeros(count, bool), feed, feed)


def test_no_words_where_the_times_agree():
    machine = pk.load("linear_delta")
    job = pk.prepare(machine, path_of([[0, 0, 280], [60, 0, 280], [60, 60, 280]]))
    told = load_controller("linuxcnc").build_run(job.trajectory)
    assert told.seconds == pk.predict_linuxcnc_seconds(job.trajectory) < 1.5 * job.trajectory.seconds
    assert told.notes == ()


def test_the_line_that_costs_the_time_is_named_with_its_reason():
    machine = pk.load("tricept")
    # Upright and back: C, which moves no joint there, has to turn half round on two millimetres in line 4.
    tilt, begin = np.radians([20, 0, 0, 20]), machine.home[:3] + [150.0, 80.0, 0.0]
    turned = np.radians([0.0, 0.0, 90.0, 90.0])
    axis = np.column_stack([np.sin(tilt) * np.cos(turned), np.sin(tilt) * np.sin(turned), np.cos(tilt)])
    job = pk.prepare(machine, path_of(begin + np.outer([0, 100, 102, 202], [1.0, 0.0, 0.0]), axis))
    told = load_controller("linuxcnc").build_run(job.trajectory)
    if told.seconds <= 1.5 * job.trajectory.seconds:
        assert not told.notes
        return
    assert told.notes[0].line == 3
    assert "C turns" in told.notes[0].text


def test_short_motions_are_explained_in_the_summary_and_in_json(tmp_path, capsys):
    helix = "G21 G90 G17 G54\nG0 X0.003 Y0 Z5\nG1 Z0 F600\nG3 X0.003 Y0 Z-2 I-0.003 J0 P6\nG0 Z20\nM2\n"
    (tmp_path / "helix.ngc").write_text(helix)
    arguments = ["post", str(tmp_path / "helix.ngc"), "-m", "tricept", "--workpiece", "0,0,-1400", "-o", str(tmp_path)]
    assert main([*arguments, "--target", "linuxcnc", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["controller_seconds"] > 1.5 * told["seconds"]
    assert "LinuxCNC takes" in told["notes"][0]["text"] and told["notes"][0]["line"] == 4
    assert main([*arguments, "--target", "linuxcnc"]) == 0
    assert "LinuxCNC takes" in capsys.readouterr().out
    assert main([*arguments, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["controller_seconds"] is None


@pytest.mark.parametrize("name", ["tricept", "hexapod"])
def test_times_are_those_of_the_motions(name):
    machine = pk.load(name)
    job = pk.prepare(machine, path_of(machine.home[:3] + np.array([[0, 0, 0], [30, 0, 0], [30, 30, 0], [0, 0, 0]])))
    assert pk.predict_linuxcnc_seconds(job.trajectory) == pytest.approx(job.trajectory.seconds, rel=0.1)
