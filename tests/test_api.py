"""The Python interface: units in texts, poses by name, mistaken arguments in one line, short reprs, public names."""

from __future__ import annotations

import inspect
import warnings
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.synthesis.designs import Designs, ProvedDesign, UnprovedDesign

PART = "UNITS/MM\nFEDRAT/3000\nGOTO/0,0,0\nGOTO/10,0,0\n"


@pytest.fixture(scope="module")
def tricept():
    return load_shipped("tricept")


@pytest.fixture(scope="module")
def things(tmp_path_factory, tricept):
    """One of each public object, made cheaply."""
    folder = tmp_path_factory.mktemp("api")
    (folder / "a.cls").write_text(PART)
    plane = pk.region(load_shipped("hbg80_2d"))
    found = pk.workspace(plane, gap=0.3)
    path = pk.read_path(folder / "a.cls")
    job = pk.prepare(tricept, path, workpiece=pk.workpiece(Z=-1400))
    (program,) = pk.write_files(folder, {"j.ngc": pk.make_joint_program(job.trajectory)})
    field = pk.sample_field(plane, found.box)
    space = pk.region(load_shipped("orthoglide"))
    orthoglide = load_shipped("orthoglide")
    poses = np.random.default_rng(0).uniform(-50.0, 50.0, (6, 3))
    measured = pk.make_measurements(orthoglide, orthoglide.inverse(poses), poses)
    accuracy = pk.analyse_accuracy(orthoglide, {"feet": "0.1 mm"}, poses)
    hexapod, below = load_shipped("hexapod"), pk.workpiece(Z=-950)
    body = pk.sample_field(space, pk.workspace(space, gap=0.5).box, step=20)
    atlas, swept, travel = pk.atlas(plane, step=50), pk.sweep_drives(plane, 8), tricept.travel(tricept.home, "X")
    comparison = pk.compare([plane.machine, load_shipped("five_bar")], samples=5)
    sides = dict.fromkeys("XYZ", (-10.0, 10.0))
    problem = pk.DesignProblem(orthoglide, {"L": (200.0, 500.0)}, sides, ["L"])

    proved = ProvedDesign(orthoglide, {"L": 250.0}, {"L": 250.0}, sides, {"rho_x": (0.0, 1.0)}, 3)
    unproved = UnprovedDesign({"L": 250.0}, "no time")
    return {
        "Machine": tricept,
        "Region": plane,
        "Workspace": found,
        "ToolPath": path,
        "Job": job,
        "Trajectory": job.trajectory,
        "Posted": job.posted,
        "JointProgram": pk.read_joint_program(program),
        "SampledField": field,
        "CrossSection": pk.find_cross_sections(field)[0],
        "Mesh": pk.make_mesh(body),
        "Components": pk.find_components(plane, cell=20),
        "InscribedBox": pk.find_largest_box(plane),
        "GridWorkspace": pk.sample_grid(plane, 20),
        "PolarWorkspace": pk.sweep_polar(plane, 20),
        "DriveWorkspace": swept,
        "Atlas": atlas,
        "SingularityDistance": pk.find_nearest_singularity(plane, {"X": (-9.0, 9.0)}),
        "Placement": pk.find_placement(tricept, path, {"Z": (-1500, -1400)}),
        "Assemblies": tricept.assemblies(tricept.inverse(tricept.home)),
        "Solution": tricept.forward(tricept.inverse(tricept.home)),
        "Tolerances": pk.Tolerances(),
        "Clearance": pk.Clearance(),
        "Rewind": pk.Rewind(3, 12, "theta1", -1, 20.0),
        "RewoundPath": pk.rewind_path(tricept, path, pk.Clearance(20.0), workpiece=pk.workpiece(Z=-1400)),
        "ToolTurn": pk.choose_tool_turn(hexapod, path, workpiece=below),
        "TurnedJob": pk.prepare_turned(hexapod, path, workpiece=below),
        "Family": pk.family(tricept, ["feet"]),
        "Accuracy": accuracy,
        "WorstCase": pk.bound_worst_case(accuracy, {}),
        "Stiffness": pk.analyse_stiffness(orthoglide, "100 N/um", poses=poses),
        "DriveForces": pk.compute_drive_forces(job.trajectory),
        "Comparison": comparison,
        "Measurements": measured,
        "Calibration": pk.calibrate(orthoglide, measured, ["encoders"]),
        "MeasurementPlan": pk.plan_measurements(orthoglide, 4, ["encoders"]),
        "Noise": pk.Noise(),
        "MeasuringSetup": pk.MeasuringSetup(),
        "DesignProblem": problem,
        "ProvedDesign": proved,
        "UnprovedDesign": unproved,
        "Designs": Designs(problem, (proved,), (unproved,)),
        "Parameter": tricept.parameters[0],
        "SweepPlan": pk.SweepPlan(problem, 10, 8),
        "SweepResult": pk.SweepResult(10, 3, 10, 1e-8, 1e-9, {}),
        "setpoints": job.trajectory.sample(10),
        "cells": found.cells,
        "spec": tricept.spec,
        "drive": tricept.drives[3],
        "leg": tricept.legs[0],
        "travel": travel,
        "end of travel": travel.ahead,
        "extreme": atlas.extremes[0],
        "figures": comparison.columns[0],
        "image": swept.contours[0],
    }


def test_dir_shows_the_public_names():
    assert dir(pk) == sorted(pk.__all__)
    assert all(hasattr(pk, name) for name in dir(pk))


def test_reprs_are_one_short_line(things):
    for name, thing in things.items():
        assert len(repr(thing)) <= 160, name
        assert "\n" not in repr(thing), name
        assert "array(" not in repr(thing), name


def test_every_public_class_has_its_repr_tried(things):
    classes = {
        name for name in pk.__all__ if inspect.isclass(getattr(pk, name)) and not name.endswith(("Error", "Errors"))
    }
    assert classes <= set(things)


# Units.


def test_texts_carry_their_unit(tricept):
    by_text = pk.region(tricept, at={"B": "30 deg", "Z": "-1.4 m"})
    by_number = pk.region(tricept, at={"B": np.pi / 6, "Z": -1400})
    assert by_text.fixed_axes == pytest.approx(by_number.fixed_axes)
    swept = pk.region(tricept, some={"B": ("0 deg", "40 deg")}).swept_axes["B"]
    assert swept == pytest.approx((0.0, np.deg2rad(40.0)))
    assert pk.workpiece(X="1 in", C="90 deg") == pytest.approx(pk.workpiece(X=25.4, C=np.pi / 2))
    assert tricept.inverse([0, 0, "-1.4 m", "30 deg", 0]) == pytest.approx(tricept.inverse([0, 0, -1400, np.pi / 6, 0]))
    assert by_text.fix({"C": "10 deg"}).fixed_axes["C"] == pytest.approx(np.deg2rad(10.0))


@pytest.mark.parametrize("at", [{"B": "30"}, {"B": "30 mm"}, {"B": "x"}, {"B": None}, {"B": [1.0]}, {"B": True}])
def test_texts_without_the_right_unit_are_refused(tricept, at):
    with pytest.raises(pk.PoseError, match=r"^B: "):
        pk.region(tricept, at=at)


def test_a_bare_angle_beyond_a_turn_warns(tricept):
    calls = [
        lambda: pk.region(tricept, at={"B": 30}),
        lambda: pk.region(tricept, some={"B": (0, 40)}),
        lambda: tricept.inverse([0, 0, -1400, 30, 0]),
        lambda: tricept.check({"B": 30}),
        lambda: tricept.inverse(np.array([0, 0, -1400, 30, 0])),
        lambda: pk.workpiece(C=90),
    ]
    for call in calls:
        with pytest.warns(UserWarning, match=r'rad is more than a turn.* "\d+ deg"') as caught:
            call()
        assert caught[0].filename == __file__


def test_angles_in_range_and_the_packages_own_do_not_warn(tricept, things):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pk.region(tricept, at={"B": 6.28})
        tricept.inverse([0, 0, -1400, 0.1, -6.28])
        tricept.forward(np.array([1200.0, 1200.0, 1200.0, 6.28, 0.0]))
        things["Trajectory"].at([0.0])


# Poses by name.


def test_poses_by_name(tricept):
    named = {"X": 10, "Z": -1400}
    pose = [10, 0, -1400, 0, 0]
    joints = tricept.inverse(named)
    assert np.array_equal(joints, tricept.inverse(pose))
    assert np.array_equal(tricept.inverse({"x": [10, 20], "Z": -1400}), tricept.inverse([pose, [20, *pose[1:]]]))
    assert tricept.check(named) == tricept.check(pose)
    assert np.array_equal(tricept.margins(named), tricept.margins(pose))
    by_joint = dict(zip(tricept.joints, joints.tolist(), strict=True))
    assert np.array_equal(tricept.forward(by_joint, near=named).poses, tricept.forward(joints, near=pose).poses)
    assert len(pk.find_components(pk.region(load_shipped("hbg80_2d")), start={"X": 100, "Y": 100}, cell=20))


@pytest.mark.parametrize(
    "bad",
    [{}, {"Q": 1}, {"X": 1, "x": 2}, {"X": "a"}, {"X": None}, {"X": [1, 2], "Y": [1, 2, 3]}, {"X": {"Y": 1}}, {1: 1}],
)
def test_bad_names_are_told_in_one_line(tricept, bad):
    with pytest.raises(pk.PoseError) as caught:
        tricept.inverse(bad)
    assert "\n" not in str(caught.value)


# Mistaken arguments.

NONSENSE = (
    *(None, "", "tricept", "\x1b", b"x", -1, 0, 1, 1e400, float("nan"), -float("inf"), 10**400, 1j, True),
    *([], [None], [[1.0], [1.0, 2.0]], (1,), (1, 2), {}, {"X": float("nan")}, {"Q": 1}, {1: 1}, {"X": (1, 2, 3)}),
    *({"X": ("a", "b")}, {"B": (3.0, 1.0)}, set(), object(), len, int, ValueError("x"), np.float64("nan")),
    *(np.zeros(0), np.zeros(3), np.zeros((2, 3)), np.array(["a"]), np.array(None)),
    *(Fraction(1, 3), Decimal(1), 5e-324, 2**63, "\ud800", "a" * 10_000, np.full(5, 1e308), np.zeros((0, 5))),
    *(np.full((1, 5), np.nan), np.ma.masked_array(np.ones(5), mask=[1, 0, 0, 0, 0])),
)


def cheap_calls(things):
    """Each public function with arguments that are right and cost little."""
    m, plane, trajectory = things["Machine"], things["Region"], things["Trajectory"]
    pose, path, delta = m.home.tolist(), things["ToolPath"], load_shipped("linear_delta")
    return [
        (pk.load, {"name": "tricept", "parameters": {"R": 350.0}}),
        (pk.region, {"machine": m, "at": {"B": 0.1}, "every": {}, "some": {}, "dexterous": False, "mode": "+"}),
        (pk.region, {"machine": m, "without": ["d1.*"]}),
        (pk.workspace, {"region": plane, "gap": 0.3, "cell": None, "seconds": 0.2}),
        (pk.atlas, {"region": plane, "step": 100.0, "length": None}),
        (pk.find_components, {"region": plane, "start": [100.0, 100.0], "cell": 40.0, "seconds": 0.2}),
        (pk.find_largest_box, {"region": plane, "shape": [1, 1], "around": [100.0, 100.0], "tolerance": 5.0}),
        (pk.sample_grid, {"region": plane, "step": 50.0, "box": ([0, 0], [10, 10]), "turns_step": 1.0}),
        (pk.sweep_polar, {"region": plane, "step": 50.0, "planes": 50.0, "rays": 8, "axis": [0, 0], "turns_step": 1.0}),
        (pk.sweep_drives, {"region": plane, "cells": 4}),
        (pk.sample_field, {"region": plane, "box": things["Workspace"].box, "step": 50.0, "turns_step": 1.0}),
        (pk.find_cross_sections, {"field": things["SampledField"], "axis": "X", "values": 2, "step": 50.0}),
        (pk.make_mesh, {"field": things["SampledField"]}),
        (pk.workpiece, {"X": 1, "C": 0.1}),
        (pk.read_path, {"path": "/nonexistent", "arc_tolerance": 0.1, "workpiece": None, "frame": "file"}),
        (pk.prepare, {"machine": m, "path": path, "workpiece": None, "mode": "+", "interpolation": "pose"}),
        (pk.prepare, {"machine": m, "path": path, "tolerances": pk.Tolerances(), "corners": "stop"}),
        (pk.find_placement, {"machine": m, "path": path, "bounds": {"Z": (-1400.0, -1400.0)}, "mode": "+"}),
        (pk.make_joint_program, {"trajectory": trajectory, "forced": None}),
        (pk.make_linuxcnc_program, {"trajectory": trajectory, "forced": None}),
        (pk.make_linuxcnc_configuration, {"machine": delta}),
        (pk.read_joint_program, {"path": "/nonexistent"}),
        (pk.render_machine_page, {"machine": m, "pose": pose}),
        (pk.render_path_page, {"posted": things["Posted"], "trajectory": trajectory}),
        (pk.render_report, {"posted": things["Posted"], "trajectory": trajectory, "unplanned": "", "waits": 0.0}),
        (pk.write_files, {"folder": "/proc/nothing", "files": {"a": b""}}),
        (m.inverse, {"poses": pose, "mode": "+", "out": None}),
        (m.forward, {"joints": m.inverse(m.home), "near": pose, "method": None}),
        (m.follow, {"poses": [pose], "mode": "+", "free_below": 0.1}),
        (m.sides, {"poses": [pose]}),
        (m.head_modes, {"mode": "+"}),
        (m.place_platform, {"pose": pose, "mode": "+", "joints": m.inverse(m.home)}),
        (m.twist_rates, {"poses": [pose], "joints": [m.inverse(m.home)], "whole": True}),
        (delta.common_points, {"joints": [delta.inverse([0, 0, 0])], "side": 1.0}),
        (m.assemblies, {"joints": m.inverse(m.home)}),
        (m.jacobians, {"poses": pose, "mode": "+"}),
        (m.margins, {"poses": pose, "joints": m.inverse(m.home), "mode": "+"}),
        (m.check, {"poses": pose, "joints": None, "mode": "+"}),
        (plane.fix, {"values": {"X": 1.0}}),
        (trajectory.at, {"times": [0.0]}),
        (trajectory.sample, {"rate": 10.0}),
    ]  # fmt: skip


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_mistaken_arguments_are_refused_in_one_line(things, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for function, arguments in cheap_calls(things):
        for name in arguments:
            for value in NONSENSE:
                try:
                    function(**{**arguments, name: value})
                except pk.ParakinError as error:
                    assert len(str(error).splitlines()) == 1, (function, name, value)
                    assert str(error).isprintable(), (function, name, value)
                    assert len(str(error)) < 700, (function, name, value)
                except Exception as error:
                    raise AssertionError(f"{function.__name__}({name}={value!r})") from error


def test_every_public_function_refuses_what_it_does_not_know():
    for name in dir(pk):
        function = getattr(pk, name)
        if inspect.isfunction(function):
            needed = [p.name for p in inspect.signature(function).parameters.values() if p.default is p.empty]
            if needed and name != "load":
                with pytest.raises(pk.ParakinError) as caught:
                    function(**{argument: object() for argument in needed})
                assert len(str(caught.value).splitlines()) == 1, name


@pytest.mark.parametrize("kind", [pk.Machine, pk.Family, pk.DesignProblem, pk.SweepPlan])
@pytest.mark.parametrize("value", [5, None, "x", [1, 2], {}])
def test_a_public_class_refuses_what_it_does_not_know(kind, value):
    needed = [p for p in inspect.signature(kind).parameters.values() if p.default is p.empty]
    with pytest.raises(pk.PoseError, match=rf"^{needed[0].name}: an? .* expected, not "):
        kind(*[value] * len(needed))


def test_what_is_masked_is_no_number(tricept):
    poses = np.ma.masked_array([tricept.home, tricept.home], mask=[[False] * 5, [False, True, False, False, False]])
    assert np.isfinite(tricept.inverse(poses)).all(1).tolist() == [True, False]
    assert (tricept.check(poses) != 0).tolist() == [False, True]


def test_a_number_that_is_none_is_refused(things):
    for function, arguments in cheap_calls(things):
        for name, value in arguments.items():
            if isinstance(value, float):
                with pytest.raises(pk.ParakinError):
                    function(**{**arguments, name: float("nan")})


@pytest.mark.parametrize("tip", [0, -1, float("nan"), float("inf"), None, "x"])
def test_an_invalid_tolerance_is_an_error_not_a_job_without_a_plan(things, tip):
    for tolerances in (pk.Tolerances(tip, 0.001), pk.Tolerances(0.01, tip)):
        with pytest.raises(pk.PoseError, match=r"tolerances\.(tip|axis)"):
            pk.prepare(things["Machine"], things["ToolPath"], tolerances=tolerances)


def test_a_rate_that_would_fill_the_memory(things):
    with pytest.raises(pk.PoseError, match="setpoints"):
        things["Trajectory"].sample(1e12)
