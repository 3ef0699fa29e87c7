"""The machine on LinuxCNC's screen: its points agree with the machine's own geometry; the window shows it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import types
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from shipped import CONFIGURED, load_shipped

from parakin.controllers.linuxcnc.hand_box import find_hand_box
from parakin.controllers.linuxcnc.home_pose import find_home_pose
from parakin.controllers.linuxcnc.model_header import list_limit_names
from parakin.controllers.linuxcnc.screen import name_screen
from parakin.export.machine.scene import build_scene

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from ini_file import read_ini
from simulation import make_configuration, simulated, why_not
from stub import inward, outward, world

configured = pytest.mark.parametrize("name", CONFIGURED)
LETTERS = "XYZABCUVW"
SCREENS = ("axis", "gmoccapy")


@pytest.fixture(scope="module")
def screens():
    """The window's programs of the shipped machines, loaded without LinuxCNC."""
    known = {}

    def screen_of(machine):
        if machine.name not in known:
            text = make_configuration(machine)[f"{name_screen(machine)}.py"]
            screen = types.ModuleType(machine.name)
            with pytest.MonkeyPatch.context() as patch:
                patch.setitem(sys.modules, "hal", types.ModuleType("hal"))
                exec(compile(text, f"{machine.name}_screen.py", "exec"), screen.__dict__)
            known[machine.name] = screen
        return known[machine.name]

    return screen_of


def draw_poses(machine, count=50, seed=7):
    """Random allowed poses about home, and their joints."""
    spread = np.where(np.array(machine.axis_units) == "mm", 120.0, np.radians(25.0))
    poses = find_home_pose(machine) + np.random.default_rng(seed).uniform(-1.0, 1.0, (20 * count, len(spread))) * spread
    good = poses[machine.check(poses) == 0][:count]
    assert len(good) >= min(count, 10)
    return good, machine.inverse(good)


def place_items(screen, machine, pose, joints, tool=0.0):
    """The items (kind, points) as the window draws them, and the frame of poses."""
    row = world(machine, pose[None])[0]
    given = [row[LETTERS.index(axis)] for axis in machine.axes]
    points = np.array(screen.place_points(given, outward(machine, joints[None])[0].tolist(), tool)).reshape(-1, 3)
    ends = np.cumsum([0, *[count for _, count, _ in screen.ITEMS]])
    items = [(kind, points[a:b]) for (kind, _, _), a, b in zip(screen.ITEMS, ends[:-1], ends[1:], strict=True)]
    return items, points[ends[-1] :]


@configured
def test_points_are_where_the_machine_places_them(name, screens):
    machine = load_shipped(name)
    screen = screens(machine)
    for pose, joints in zip(*draw_poses(machine), strict=True):
        items, frame = place_items(screen, machine, pose, joints)
        scene = build_scene(machine, pose, joints)
        assert [kind for kind, _ in items] == [item.kind for item in scene.items]
        for (kind, points), item in zip(items, scene.items, strict=True):
            if kind not in ("rail", "base", "table", "axis"):  # these have the size that they have at home
                assert np.abs(points - item.points).max() < 1e-9
        assert np.abs(frame[:3] - scene.workpiece[:, :3]).max() < 1e-12
        assert np.abs(frame[3] - scene.workpiece[:, 3]).max() < 1e-9


@pytest.mark.parametrize("name", ["tricept", "hexapod"])
def test_struts_are_as_long_as_their_joints_say(name, screens):
    machine = load_shipped(name)
    for pose, joints in zip(*draw_poses(machine), strict=True):
        items, _ = place_items(screens(machine), machine, pose, joints)
        lengths = [np.linalg.norm(points[1] - points[0]) for kind, points in items if kind == "telescope"]
        assert lengths == pytest.approx(
            [q for q, j in zip(joints, machine.joints, strict=True) if j[0] in "ds"][: len(lengths)]
        )


@pytest.mark.parametrize("name", ["orthoglide5_head", "orthoglide5_table", "linear_delta", "lambda6"])
def test_rods_keep_their_length_and_the_tool_its_own(name, screens):
    machine = load_shipped(name)
    seen = []
    for pose, joints in zip(*draw_poses(machine), strict=True):
        items, _ = place_items(screens(machine), machine, pose, joints)
        seen.append([np.linalg.norm(np.diff(p, axis=0), axis=1).sum() for k, p in items if k in ("rod", "arm", "tool")])
    assert np.ptp(seen, axis=0).max() < 1e-9
    if name == "linear_delta":
        assert np.array(seen)[:, :3] == pytest.approx(700.0)


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_table", "hexapod"])
def test_a_longer_tool_leaves_the_machine_where_its_joints_are(name, screens):
    """LinuxCNC's tip of a tool longer by 50 mm is 50 mm along Z above that tip's place."""
    machine = load_shipped(name)
    poses, all_joints = draw_poses(machine, 10)
    for pose, joints in zip(poses, all_joints, strict=True):
        row = world(machine, pose[None])[0]
        a, b, c = np.radians(row[3:6])
        axis = np.array([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)])
        if "A" in machine.axes:
            axis = np.array(
                [
                    np.sin(a) * np.sin(c) + np.cos(a) * np.sin(b) * np.cos(c),
                    -np.sin(a) * np.cos(c) + np.cos(a) * np.sin(b) * np.sin(c),
                    np.cos(a) * np.cos(b),
                ]
            )
        longer = pose.copy()
        longer[:3] += 50.0 * (np.array([0.0, 0.0, 1.0]) - axis)  # its tip lies 50 mm further, plus LinuxCNC's shift
        plain, _ = place_items(screens(machine), machine, pose, joints)
        shifted, _ = place_items(screens(machine), machine, longer, joints, 50.0)
        for (_, one), (_, two) in zip(plain, shifted, strict=True):
            assert np.abs(one - two).max() < 1e-8


@configured
def test_the_hull_is_allowed_inside_and_not_beyond(name, screens):
    machine = load_shipped(name)
    screen, home = screens(machine), find_home_pose(machine)
    columns = [machine.axes.index(axis) for axis in "XYZ" if axis in machine.axes]
    letters = [i for i, axis in enumerate("XYZ") if axis in machine.axes]
    frame = build_scene(machine, home).workpiece
    places = ((np.array(screen.HULL) - frame[:, 3]) @ frame[:, :3])[:, letters]
    steps = places - home[columns]
    steps = steps[np.linalg.norm(steps, axis=1) > 5.0]
    assert len(steps) > 20
    for share in (0.1, 0.5, 0.9, 0.99):
        poses = np.tile(home, (len(steps), 1))
        poses[:, columns] += share * steps
        assert (machine.check(poses) == 0).mean() > 0.99
    poses[:, columns] = home[columns] + 1.02 * steps
    if name in ("tricept", "hexapod", "linear_delta"):  # others end at a singularity somewhere
        assert (machine.check(poses) != 0).mean() > 0.99
    assert {corner for line in screen.HULL_LINES for corner in line} <= set(range(len(screen.HULL)))


@configured
def test_every_limit_has_its_words(name, screens):
    machine = load_shipped(name)
    limits = screens(machine).LIMITS
    assert len(limits) == len(list_limit_names(machine))
    assert len(set(limits)) == len(limits)


def test_limits_in_words(screens):
    assert "leg d1: at most 1,520.0 mm" in screens(load_shipped("tricept")).LIMITS
    assert "foot joint of strut0: at most 35.00°" in screens(load_shipped("hexapod")).LIMITS
    assert "leg tower_a: end of its reach" in screens(load_shipped("linear_delta")).LIMITS


@configured
def test_all_files_of_the_screen_are_python_and_hal(name):
    machine = load_shipped(name)
    files = make_configuration(machine)
    nets = [line for line in files[f"{name}_screen.hal"].splitlines() if line.startswith("net ")]
    pins = {line.split()[-1] for line in nets}
    assert {f"{name}_screen.{axis.lower()}" for axis in machine.axes} <= pins
    assert {f"{name}_screen.joint-{i}" for i in range(len(machine.joints))} <= pins
    own = files[f"{name}.hal"]
    for line in nets:
        words = line.split()
        assert len(words) == 5 or f"net {words[1]} " in own  # a signal that the machine's own file has


def test_a_screen_has_its_own_settings():
    machine = load_shipped("orthoglide")
    for screen in SCREENS:
        files = make_configuration(machine, None, screen)
        display = read_ini(files["orthoglide.ini"])["DISPLAY"]
        assert display["DISPLAY"] == screen
        compile(files[display["USER_COMMAND_FILE"]], screen, "exec")
        assert [name for name in files if name.endswith("_axis.py")] == ["orthoglide_axis.py"] * (screen == "axis")


class Slider:
    """A slider of gmoccapy's."""

    def set_property(self, name, value):
        self.most = {"max": value}[name]

    def get_property(self, name):
        return {"max": self.most}[name]

    def set_value(self, value):
        self.value = value


class Gmoccapy:
    """What gmoccapy, which runs its settings within a method of its own, has for them."""

    def __init__(self, files, name, preferred=""):
        ini = read_ini(files[f"{name}.ini"])
        self.prefs = SimpleNamespace(getpref=lambda name, default, kind: preferred)
        self.get_ini_info = SimpleNamespace(inifile=SimpleNamespace(find=lambda section, key: ini[section].get(key)))
        self.opened = []
        self.command = SimpleNamespace(program_open=self.opened.append)
        self.widgets = SimpleNamespace(spc_lin_jog_vel=Slider(), spc_ang_jog_vel=Slider())
        exec(files[f"{name}_gmoccapy.py"], {"os": os, "CONFIGPATH": "/cnc"}, {"self": self})


@pytest.mark.parametrize(("preferred", "opened"), [("", ["/cnc/orthoglide.ngc"]), ("/other.ngc", [])])
def test_gmoccapy_opens_the_inis_program_unless_it_prefers_another(preferred, opened):
    files = make_configuration(load_shipped("orthoglide"), None, "gmoccapy")
    assert Gmoccapy(files, "orthoglide", preferred).opened == opened


def test_gmoccapys_sliders_for_jogs_end_at_the_speeds_by_hand():
    machine = load_shipped("tricept")
    files, box = make_configuration(machine, None, "gmoccapy"), find_hand_box(machine)
    screen, (x, c) = Gmoccapy(files, "tricept"), 60.0 * box.speed[[0, 4]]
    assert screen.widgets.spc_lin_jog_vel.most == screen.jog_rate_max == pytest.approx(x)  # mm/min
    assert screen.widgets.spc_lin_jog_vel.value == pytest.approx(0.25 * x)
    assert screen.widgets.spc_ang_jog_vel.most == pytest.approx(np.degrees(c))  # deg/min
    assert screen.widgets.spc_ang_jog_vel.value == pytest.approx(0.25 * np.degrees(c))


def why_no_screen():
    missing = [tool for tool in ("Xvfb", "xdotool", "import", "convert") if not shutil.which(tool)]
    return f"there is no {missing[0]}" if missing else why_not()


def test_it_is_seen_under_linuxcnc():
    if why_no_screen():
        pytest.skip(why_no_screen())
    machine = load_shipped("tricept")
    with simulated(machine) as simulation:
        seen = simulation.show(
            [
                ["switch_on"],
                ["home"],
                ["wait", 1.0],
                ["window", "home.png"],
                ["pins"],
                ["mdi", "G1 X60 Y40 F6000"],
                ["wait", 1.0],
                ["window", "moved.png"],
            ]
        )
        assert not seen["said"]
        ini = read_ini(make_configuration(machine)["tricept.ini"])
        assert seen["most speed"] == float(ini["TRAJ"]["MAX_LINEAR_VELOCITY"])  # no program is slowed by the screen
        pins, screen = seen["pins"], name_screen(machine)
        joints = [float(pins[f"{screen}.joint-{i}"]) for i in range(5)]
        home = find_home_pose(machine)
        assert inward(machine, np.array([joints]))[0] == pytest.approx(machine.inverse(home), abs=1e-3)
        assert float(pins[f"{screen}.z"]) == pytest.approx(home[2], abs=1e-3)
        colours = []
        for name in ("home.png", "moved.png"):
            done = subprocess.run(
                ["convert", str(simulation.folder / name), "-crop", "600x760+0+0", "-format", "%k %#", "info:"],
                capture_output=True,
                text=True,
                check=True,
            )
            colours.append(done.stdout.split())
        assert all(int(count) > 500 for count, _ in colours)  # it is a picture
        assert colours[0][1] != colours[1][1]  # and it moves


def test_without_a_display_the_machine_runs(tmp_path):
    """The other runs of LinuxCNC have no display; here the window's program says so and waits."""
    if not Path("/usr/bin/python3").exists():
        pytest.skip("there is no Python of the system's own")
    machine = load_shipped("orthoglide")
    file = tmp_path / "screen.py"
    file.write_text(make_configuration(machine)["orthoglide_screen.py"], encoding="utf-8")
    (tmp_path / "hal.py").write_text(
        "HAL_FLOAT = HAL_BIT = HAL_U32 = HAL_IN = 0\n"
        "class component:\n"
        "    def __init__(self, name): pass\n"
        "    def newpin(self, *given): pass\n"
        "    def ready(self): print('ready', flush=True)\n",
        encoding="utf-8",
    )
    with subprocess.Popen(
        ["/usr/bin/python3", str(file)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={"PATH": "/usr/bin"},
    ) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            assert "no window" in process.stderr.readline()
            assert process.poll() is None
        finally:
            process.terminate()
        process.wait(timeout=10)
