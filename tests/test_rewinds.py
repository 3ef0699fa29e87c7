"""Rewinds: whole turns taken back where it is stated to be clear, and nowhere else."""

import json
from dataclasses import replace

import numpy as np
import pytest
from shipped import load_shipped
from test_working_mode import TURN, axis_of, path_of, spirals

import parakin as pk
from parakin.cli import main
from parakin.toolpath.path import Event
from parakin.toolpath.posting.post import post_path

WRISTS = ["tricept", "orthoglide5_head", "orthoglide5_table"]
DOWN = {"tricept": -60.0, "orthoglide5_head": -15.0, "orthoglide5_table": -15.0}


def winding(machine, turns=4.0, tilt=15.0, count=400, radius=8.0):
    """A cut that winds up a wrist's first joint, with the tool inclined."""
    c = np.linspace(0.0, 360.0 * turns, count)
    ring = radius * np.column_stack([np.cos(np.radians(c)), np.sin(np.radians(c)), 0.0 * c])
    return path_of(machine.home[:3] + [0.0, 0.0, DOWN[machine.name]] + ring, axis_of(tilt, c))


def first_angles(posted):
    return posted.joints[:, posted.machine.wrist.first]


@pytest.mark.parametrize("name", WRISTS)
def test_a_cut_that_winds_up_is_refused_without_a_clearance_and_runs_with_one(name):
    machine = load_shipped(name)
    path = winding(machine)
    refused = pk.prepare(machine, path)
    assert not refused.runs
    assert any("clearance" in note.text for note in refused.posted.path.notes)
    rewound = pk.rewind_path(machine, path, pk.Clearance(retract=5.0))
    job = pk.prepare(machine, rewound.path)
    assert job.runs, (job.posted.first, job.unplanned)
    drive = machine.drives[machine.wrist.first]
    angles = first_angles(job.posted)
    assert drive.low <= angles.min() <= angles.max() <= drive.high
    wound = np.ptp(np.unwrap(first_angles(post_path(machine, path))))
    assert len(rewound.rewinds) >= np.ceil((wound - (drive.high - drive.low)) / TURN)
    assert len(rewound.rewinds) <= np.ceil(wound / TURN)
    assert job.seconds > refused.seconds if refused.seconds else True


@pytest.mark.parametrize("name", WRISTS)
def test_a_rewind_retracts_along_the_axis_turns_there_and_returns(name):
    machine = load_shipped(name)
    path = winding(machine)
    rewound = pk.rewind_path(machine, path, pk.Clearance(retract=5.0))
    posted = post_path(machine, rewound.path)
    at = 0
    for number, rewind in enumerate(rewound.rewinds):
        begin = rewind.record + at  # the records before are moved back by those of the rewinds before
        added = (len(rewound.path) - len(path)) // len(rewound.rewinds)
        new = slice(begin + 1, begin + 1 + added)
        tip, axis = rewound.path.tip[begin], rewound.path.axis[begin]
        np.testing.assert_allclose(rewound.path.tip[new][:-1], np.tile(tip + 5.0 * axis, (added - 1, 1)), atol=1e-9)
        np.testing.assert_allclose(rewound.path.tip[new][-1], tip, atol=1e-9)
        np.testing.assert_allclose(rewound.path.axis[new][[0, -2, -1]], np.tile(axis, (3, 1)), atol=1e-9)
        assert rewound.path.rapid[new][:-1].all()
        assert not rewound.path.rapid[new][-1]  # back into the cut at its feed
        turned = first_angles(posted)[begin + added] - first_angles(posted)[begin]
        assert turned == pytest.approx(rewind.turns * TURN, abs=1e-6)
        assert np.abs(np.diff(first_angles(posted)[begin : begin + added + 1])).max() < np.radians(16.0)
        assert rewind.line == path.line[path.line.tolist().index(rewound.path.line[begin]) + 1]
        assert rewound.path.notes[number].line == rewind.line
        at += added
    assert at == len(rewound.path) - len(path)


@pytest.mark.parametrize("name", ["orthoglide5_table", "orthoglide5_head"])
def test_turns_are_taken_back_above_the_plane_only(name):
    machine = load_shipped(name)
    tip = machine.home[:3] - [0, 0, 15]
    path = spirals([0, 300, 600, 900], [300, 600, 900, 1200], tip=tip)
    assert post_path(machine, path).broken_record_count > 0
    above = pk.rewind_path(machine, path, pk.Clearance(plane=tip[2] + 29.0))
    assert above.rewinds and not any(rewind.retract for rewind in above.rewinds)
    assert pk.prepare(machine, above.path).runs
    for rewind in above.rewinds:
        assert path.rapid[rewind.record]
        assert path.tip[rewind.record, 2] == path.tip[:, 2].max()
    too_high = pk.rewind_path(machine, path, pk.Clearance(plane=tip[2] + 31.0))
    assert not too_high.rewinds
    assert any("no place" in note.text for note in too_high.path.notes)


def test_rapid_motions_are_better_places_than_cuts():
    machine = load_shipped("orthoglide5_table")
    path = spirals([0, 300, 600, 900], [300, 600, 900, 1200], tip=machine.home[:3] - [0, 0, 15])
    rewound = pk.rewind_path(machine, path, pk.Clearance(retract=5.0))
    assert rewound.rewinds
    assert all(path.rapid[rewind.record] and path.rapid[rewind.record + 1] for rewind in rewound.rewinds)


def test_what_the_machine_cannot_retract_is_left_and_said():
    machine = load_shipped("orthoglide5_table")
    path = winding(machine)
    rewound = pk.rewind_path(machine, path, pk.Clearance(retract=5000.0))
    assert not rewound.rewinds and len(rewound.path) == len(path)
    assert any("no place" in note.text for note in rewound.path.notes)
    assert not pk.prepare(machine, rewound.path).runs


def test_a_path_within_the_range_is_left_alone():
    machine = load_shipped("tricept")
    path = winding(machine, turns=1.0)
    rewound = pk.rewind_path(machine, path, pk.Clearance(retract=5.0))
    assert not rewound.rewinds and not rewound.path.notes
    np.testing.assert_array_equal(rewound.path.tip, path.tip)


def test_events_keep_their_motions():
    machine = load_shipped("tricept")
    path = winding(machine)
    events = tuple(Event(record, int(path.line[record]), f"M{record}") for record in range(0, len(path), 7))
    path = replace(path, events=events)
    rewound = pk.rewind_path(machine, path, pk.Clearance(retract=5.0)).path
    for before, after in zip(path.events, rewound.events, strict=True):
        np.testing.assert_array_equal(path.tip[before.record], rewound.tip[after.record])
        assert path.line[before.record] == rewound.line[after.record]


def test_programmed_turns_go_on_from_a_rewind():
    machine = load_shipped("orthoglide5_table")
    c = np.linspace(0.0, 4.0 * TURN, 200)
    turns = np.column_stack([0.0 * c, np.full(200, np.radians(15.0)), c])
    path = path_of(machine.home[:3] - [0, 0, 15], axis_of(15.0, np.degrees(c)), turns=turns)
    rewound = pk.rewind_path(machine, path, pk.Clearance(retract=5.0))
    assert rewound.rewinds
    assert np.abs(np.diff(rewound.path.turns[:, 2])).max() < np.radians(20.0)
    assert pk.prepare(machine, rewound.path).runs


@pytest.mark.parametrize("clearance", [pk.Clearance(0.0), pk.Clearance(-1.0), pk.Clearance(None, np.nan)])
def test_what_is_no_clearance(clearance):
    machine = load_shipped("tricept")
    with pytest.raises(pk.PoseError, match=r"retract|plane"):
        pk.rewind_path(machine, winding(machine), clearance)


def test_the_command_rewinds(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    c = np.radians(np.linspace(0.0, 1440.0, 300))
    x, y, upward = np.cos(c), np.sin(c), 0.9375**0.5
    rows = np.column_stack([8 * x, 8 * y, 0 * c, 0.25 * x, 0.25 * y, 0 * c + upward])
    lines = ["GOTO/" + ",".join(f"{value:.7f}" for value in row) for row in rows]
    (tmp_path / "wind.apt").write_text("UNITS/MM\nMULTAX/ON\nFEDRAT/900,MMPM\n" + "\n".join(lines) + "\nFINI\n")
    arguments = [
        "post",
        "wind.apt",
        "--machine",
        "tricept",
        "--workpiece",
        "0,0,-1600",
        "--target",
        "linuxcnc",
        "--json",
    ]
    assert main(arguments) == 3
    assert json.loads(capsys.readouterr().out)["rewinds"] == []
    assert main([*arguments, "--rewind", "10"]) == 0
    rewinds = json.loads(capsys.readouterr().out)["rewinds"]
    assert rewinds and {"line", "joint", "turns", "retract"} == set(rewinds[0])
    assert rewinds[0]["retract"] == 10.0 and rewinds[0]["joint"] == "theta1"
    for option, value in [("--rewind", "0"), ("--rewind", "nan"), ("--clearance", "inf")]:
        assert main([*arguments, option, value]) == 2
        assert option in capsys.readouterr().err


@pytest.mark.parametrize("name", WRISTS)
def test_turns_within_tolerance_of_the_pole_need_no_rewind(name):
    """Four turns of an axis that is 1e-5 rad off the first turning axis: held beside it, the joint stands still."""
    machine = load_shipped(name)
    path = winding(machine, tilt=np.degrees(1e-5), count=80, radius=1e-3)
    assert np.ptp(np.unwrap(first_angles(post_path(machine, path)))) > 3.0 * TURN
    rewound = pk.rewind_path(machine, path, pk.Clearance(retract=5.0))
    assert rewound.rewinds == ()
    job = pk.prepare(machine, rewound.path)
    assert job.runs, (job.posted.first, job.unplanned)
    assert np.ptp(first_angles(job.posted)) < np.radians(1.0)
    assert not any("clearance" in note.text for note in job.posted.path.notes)
