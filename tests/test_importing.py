"""Machines of other programs: their inverse is that program's own, by the formulas of its source."""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import parakin as pk
from parakin.cli import main

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from stub import Kinematics, Stub

POSES = 10_000
KLIPPER_DELTA = """\
[stepper_a]
step_pin: PF0
position_endstop: 297.05
arm_length: 333.0
[stepper_b]
[stepper_c]
angle: 89.5
arm_length: 333.2  # measured
[printer]
kinematics: delta
max_velocity: 300
delta_radius: 174.75
print_radius: 120
#*# <---------------------- SAVE_CONFIG ---------------------->
#*# [printer]
#*# delta_radius = 174.9
#*# [stepper_a]
#*# angle = 210.2
"""
KLIPPER_ROTARY = """\
[stepper_a]
position_endstop: 252
upper_arm_length: 170.000
lower_arm_length: 320.000
[stepper_b]
angle = 150.4
[stepper_c]
lower_arm_length: 320.5
[printer]
kinematics: rotary_delta
shoulder_radius: 33.900
shoulder_height: 412.900
"""
CONFIG_G = """\
; a linear delta
M669 K3
M665 R131.5 L290.8:290.9:291 B120 H300.2 X0.3 Y-0.2 Z0.1 ; from calibration
M666 X0.5 Y-0.3 Z-0.2 A0 B0.00
M208 Z-0.5 S1
"""
HEXAPOD_HAL = """\
loadrt genhexkins
setp genhexkins.base.0.x -23.5  # the rest stands as in the module
setp genhexkins.platform.3.z [GEOMETRY]STEP
setp genhexkins.spindle-offset 1.25
"""
HEXAPOD_INI = """\
[KINS]
KINEMATICS = genhexkins
[HAL]
HALFILE = LIB:basic_sim.tcl
HALFILE = hexapod.hal
[GEOMETRY]
STEP = 0.5
[TRAJ]
LINEAR_UNITS = inch
[JOINT_0]
MIN_LIMIT = 20.0
MAX_LIMIT = 50.0
MAX_VELOCITY = 10
[JOINT_1]
MIN_LIMIT = 20.0
"""
RDELTA_INI = """\
[KINS]
KINEMATICS = rotarydeltakins
[TRAJ]
LINEAR_UNITS = inch
[JOINT_0]
MIN_LIMIT = -45
MAX_LIMIT = 90
"""
LDELTA_HAL = (
    "loadrt lineardeltakins\nsetp lineardeltakins.R 150\nsetp lineardeltakins.L 300.5\nsetp lineardeltakins.J1off 2\n"
)
TRIPOD_HAL = "setp tripodkins.Bx 10\nsetp tripodkins.Cx 5\nsetp tripodkins.Cy 7.071\n"
PENTAPOD_HAL = "setp pentakins.tool-offset 200\nsetp pentakins.effector.2.r 75\nsetp pentakins.effector.2.z -60\n"
PENTAPOD_INI = (
    "[KINS]\nKINEMATICS = pentakins JOINTS=5\n[HAL]\nHALFILE = pentapod.hal\n[TRAJ]\nLINEAR_UNITS = mm\n"
    + "".join(f"[JOINT_{i}]\nMIN_LIMIT = 400\nMAX_LIMIT = 1100\n" for i in range(5))
)
INCH = 25.4


def invert_towers(poses, towers, rods):
    """delta.py, LinearDeltaKinematics.cpp and lineardeltakins-common.h alike: z + √(L² - (x - tx)² - (y - ty)²)."""
    x, y, z = poses.T
    with np.errstate(invalid="ignore"):
        return np.column_stack([
            z + np.sqrt(rod**2 - (tx - x) ** 2 - (ty - y) ** 2) for (tx, ty), rod in zip(towers, rods, strict=True)
        ])  # fmt: skip


def place_towers(radius, angles):
    return [(radius * np.cos(np.radians(a)), radius * np.sin(np.radians(a))) for a in angles]


def klipper_delta(poses):
    return invert_towers(poses, place_towers(174.9, (210.2, 330.0, 89.5)), (333.0, 333.0, 333.2))


def klipper_rotary(poses):
    """kin_rotary_delta.c."""
    columns = []
    for angle, lower in ((30.0, 320.0), (150.4, 320.0), (270.0, 320.5)):
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        x, y, z = poses.T
        across, dx, dy = y * c - x * s, x * c + y * s - 33.9, z - 412.9
        c1, c2 = 0.5 / dy * (dx * dx + dy * dy + 170.0**2 - (lower**2 - across**2)), dx / dy
        scale = c2 * c2 + 1.0
        with np.errstate(invalid="ignore"):
            elbow = c1 * c2 + np.sqrt(scale * 170.0**2 - c1 * c1)
        columns.append(np.arctan2(c1 * scale - c2 * elbow, elbow))
    return np.column_stack(columns)


def reprap_delta(poses):
    """LinearDeltaKinematics.cpp: Recalc and Transform."""
    r, (a, b, c) = 131.5, np.radians([30.0 + 0.3, 30.0 + 0.2, 0.1])
    towers = [(-r * np.cos(a), -r * np.sin(a)), (r * np.cos(b), -r * np.sin(b)), (-r * np.sin(c), r * np.cos(c))]
    return invert_towers(poses, towers, (290.8, 290.9, 291.0))


def genhexkins(poses):
    """genhexkins.c: the length of position + R·a - b, R = Rz·Ry·Rx, in inches."""
    b = np.array(
        [[-23.5, 13.25, 0], [22.95, 13.25, 0], [22.95, 13.25, 0], [0, -26.5, 0], [0, -26.5, 0], [-22.95, 13.25, 0]]
    )
    a = np.array(
        [
            [-1, 11.5, 0],
            [1, 11.5, 0],
            [10.459, -4.884, 0],
            [9.459, -6.616, 0.5],
            [-9.459, -6.616, 0],
            [-10.459, -4.884, 0],
        ]
    )
    a[:, 2] += 1.25
    b[:, 2] += 1.25
    (sa, sb, sc), (ca, cb, cc) = np.sin(poses[:, 3:].T), np.cos(poses[:, 3:].T)
    rows = [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb, cb * sa, cb * ca],
    ]
    turns = np.moveaxis(np.array(rows), 2, 0)
    return INCH * np.linalg.norm(poses[:, None, :3] / INCH + a @ turns.transpose(0, 2, 1) - b, axis=2)


def give_turns_of_pentakins(poses):
    """X Y Z A B of pentakins, R = Ry(B)·Rx(A), for X Y Z B C of the same tool axis."""
    b, c = poses[:, 3:].T
    a = -np.arcsin(np.sin(b) * np.sin(c))
    return np.column_stack([poses[:, :3], a, np.arctan2(np.sin(b) * np.cos(c), np.cos(b))])


def pentakins(poses):
    """pentakins.c: the base in the effector's frame, from there to the ring; one ring and the tool changed, mm."""
    base = np.array([[-418.03, 324.56], [417.96, 324.56], [-418.03, -325.44], [417.96, -325.44], [-0.06, -492.96]])
    base = np.column_stack([base, np.full(5, 895.56 + 200.0)])
    za, ra = np.array([-185.5, -159.5, -60.0, -41.5, -14.0]) + 200.0, np.array([80.32, 80.32, 75.0, 80.32, 80.32])
    (sa, sb), (ca, cb) = (f(give_turns_of_pentakins(poses)[:, 3:].T) for f in (np.sin, np.cos))
    zero = 0.0 * sa
    turns = np.moveaxis(np.array([[cb, sb * sa, sb * ca], [zero, ca, -sa], [-sb, cb * sa, cb * ca]]), 2, 0)
    x, y, z = np.moveaxis(np.einsum("nji,nkj->nki", turns, base - poses[:, None, :3]), 2, 0)
    return np.sqrt((z - za) ** 2 + (np.hypot(x, y) - ra) ** 2)


def rotarydeltakins(poses):
    """rotarydeltakins-common.h of LinuxCNC 2.9, with its own sizes in inches; degrees there."""
    pfr, tl, sl, fr = 10.0, 10.0, 14.0, 6.0

    def invert(x, y, z):
        a = 0.5 * (x**2 + (y - fr) ** 2 + z**2 + tl**2 - sl**2 - pfr**2) / z
        b = (fr - pfr - y) / z
        with np.errstate(invalid="ignore"):
            knee_y = (pfr + a * b + np.sqrt(tl**2 * (b**2 + 1) - (a - b * pfr) ** 2)) / (b**2 + 1)
        return np.arctan2(b * knee_y - a, knee_y - pfr)

    x, y, z = poses.T / INCH
    columns = []
    for angle in (0.0, -2.0 * np.pi / 3.0, 2.0 * np.pi / 3.0):
        c, s = np.cos(angle), np.sin(angle)
        columns.append(invert(x * c - y * s, x * s + y * c, z))
    return np.column_stack(columns)


def lineardeltakins(poses):
    r, half = 150.0, np.sqrt(3.0) / 2.0
    return invert_towers(poses, [(0.0, r), (-half * r, -0.5 * r), (half * r, -0.5 * r)], (300.5,) * 3) + [0.0, 2.0, 0.0]


def tripodkins(poses):
    feet = INCH * np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [5.0, 7.071, 0.0]])
    return np.linalg.norm(poses[:, None, :] - feet, axis=2)


CASES = {
    "printer.cfg": (KLIPPER_DELTA, klipper_delta),
    "rotary.cfg": (KLIPPER_ROTARY, klipper_rotary),
    "config.g": (CONFIG_G, reprap_delta),
    "hexapod.ini": (HEXAPOD_INI, genhexkins),
    "rdelta.ini": (RDELTA_INI, rotarydeltakins),
    "ldelta.hal": (LDELTA_HAL, lineardeltakins),
    "tripod.hal": (TRIPOD_HAL, tripodkins),
    "pentapod.ini": (PENTAPOD_INI, pentakins),
}


def import_text(tmp_path, name, text, *options):
    (tmp_path / "hexapod.hal").write_text(HEXAPOD_HAL)
    (tmp_path / "pentapod.hal").write_text(PENTAPOD_HAL)
    (tmp_path / name).write_text(text)
    output = tmp_path / f"{name.partition('.')[0]}_machine.yaml"
    units = {"ldelta.hal": ["--units", "mm"], "tripod.hal": ["--units", "inch"]}.get(name, [])
    assert main(["import", str(tmp_path / name), "-o", str(output), *units, *options]) == 0
    return pk.load(output)


@pytest.mark.parametrize("name", CASES)
def test_the_inverse_is_the_programs_own(name, tmp_path):
    text, invert = CASES[name]
    machine = import_text(tmp_path, name, text)
    rng = np.random.default_rng(2)
    spread = np.array([80.0 if unit == "mm" else 0.4 for unit in machine.axis_units])
    poses = machine.home + rng.uniform(-1.0, 1.0, (POSES, len(spread))) * spread
    ours, theirs = machine.inverse(poses), invert(poses)
    assert (np.isnan(ours) == np.isnan(theirs)).all()
    assert np.isfinite(ours).all(1).sum() > POSES // 2
    assert np.nanmax(np.abs(ours - theirs)) < 1e-8
    assert machine.check(machine.home) == 0
    closing, halfway = np.isfinite(theirs).all(1), 0.5 * (machine.home + poses)
    assert machine.forward(theirs[closing][:200], near=halfway[closing][:200]).converged.mean() > 0.9


MODULES = Path("/usr/lib/linuxcnc/modules")


@pytest.mark.skipif(not (MODULES.exists() and shutil.which("gcc")), reason="no modules of LinuxCNC, or no gcc")
@pytest.mark.parametrize("name", ["genhexkins", "lineardeltakins", "pentakins", "rotarydeltakins", "tripodkins"])
def test_the_inverse_is_that_of_linuxcncs_own_module(name, tmp_path):
    """Modules with their own sizes, in mm; called as LinuxCNC calls them."""
    machine = import_text(tmp_path, "own.hal", f"loadrt {name}\n", "--units", "mm")
    width = {"genhexkins": 6, "pentakins": 5}.get(name, 9)
    kinematics = Kinematics(Stub(tmp_path).library, MODULES / f"{name}.so", width)
    rng = np.random.default_rng(4)
    spread = np.array([0.1 * np.abs(machine.home).max() if unit == "mm" else 0.3 for unit in machine.axis_units])
    poses = machine.home + rng.uniform(-1.0, 1.0, (POSES, len(spread))) * spread
    given = np.zeros((POSES, 9))
    theirs = give_turns_of_pentakins(poses) if name == "pentakins" else poses
    given[:, : len(spread)] = np.where(np.array(machine.axis_units) == "mm", theirs, np.degrees(theirs))
    joints, codes = kinematics.inverse(given, np.zeros((POSES, kinematics.width)))
    theirs = joints[:, : len(machine.joints)]
    if name == "rotarydeltakins":
        theirs = np.radians(theirs)
    assert np.abs(machine.inverse(poses) - theirs)[codes == 0].max() < 1e-9
    assert (codes == 0).mean() > 0.9


def test_limits_are_the_configurations(tmp_path):
    machine = import_text(tmp_path, "hexapod.ini", HEXAPOD_INI)
    first, second = machine.drives[:2]
    assert (first.low, first.high, first.speed) == pytest.approx((508.0, 1270.0, 254.0))
    assert second.low == pytest.approx(508.0)
    assert second.high > 5000.0  # none is given
    delta = import_text(tmp_path, "printer.cfg", KLIPPER_DELTA)
    assert delta.drives[0].high == pytest.approx(297.05 + np.sqrt(333.0**2 - 174.9**2))
    reprap = import_text(tmp_path, "config.g", CONFIG_G)
    assert reprap.drives[1].high == pytest.approx(300.2 + np.sqrt(290.9**2 - 131.5**2) - 0.3)
    assert reprap.drives[0].low == pytest.approx(-0.5 + np.sqrt(290.8**2 - 251.5**2))
    arms = import_text(tmp_path, "rotary.cfg", KLIPPER_ROTARY)
    assert arms.drives[0].high == pytest.approx(klipper_rotary(np.array([[0.0, 0.0, 252.0]]))[0, 0])


def test_files_that_a_configuration_reads(tmp_path, capsys):
    """What M500 has saved counts as the firmware reads it, and so does what a printer.cfg includes."""
    (tmp_path / "config-override.g").write_text("m665 r131.5 l290.8:290.9:291 x.3 Y-0.2 Z0.1\n; M665 R1\n")
    (tmp_path / "bed.g").write_text('M117 "M665 R2" M665 H300.2 M208 X-120:120 Z-0.5:300\n')
    config = 'M665 L200 R100 B120 H250\nM501\nM98 P"/sys/bed.g"\nM98 P"0:/macros/none.g"\n'
    machine = import_text(tmp_path, "config.g", config)
    assert "not there, so not read: macros/none.g" in capsys.readouterr().out
    poses = machine.home + np.random.default_rng(0).uniform(-60.0, 60.0, (1000, 3))
    assert np.abs(machine.inverse(poses) - reprap_delta(poses)).max() < 1e-8
    assert machine.drives[1].high == pytest.approx(300.2 + np.sqrt(290.9**2 - 131.5**2))
    assert machine.drives[0].low == pytest.approx(-0.5 + np.sqrt(290.8**2 - 251.5**2))
    lines = KLIPPER_DELTA.splitlines(keepends=True)
    (tmp_path / "towers.cfg").write_text("".join(lines[:8]))
    printer = import_text(tmp_path, "printer.cfg", "".join(["[include tow*.cfg]\n[include gone.cfg]\n", *lines[8:]]))
    poses = printer.home + np.random.default_rng(0).uniform(-60.0, 60.0, (1000, 3))
    assert np.abs(printer.inverse(poses) - klipper_delta(poses)).max() < 1e-8


def test_home_is_within_the_axes_limits(tmp_path):
    """LinuxCNC's own pentapod: its feet are on a wall, so that nothing works over the middle of them."""
    feet = [(-418, -140), (418, -140), (0, -310), (418, 510), (-418, 510)]
    rings = [87.0, 114.5, 140.5, 232.5, 258.5]
    hal = "".join(
        f"setp pentakins.base.{i}.x {x}\nsetp pentakins.base.{i}.y 500\nsetp pentakins.base.{i}.z {z}\n"
        f"setp pentakins.effector.{i}.z {rings[i]}\n"
        for i, (x, z) in enumerate(feet)
    )
    limits = "".join(f"[AXIS_{axis}]\nMIN_LIMIT = -250\nMAX_LIMIT = 250\n" for axis in "XYZ")
    (tmp_path / "wall.hal").write_text(hal)
    machine = import_text(tmp_path, "wall.ini", PENTAPOD_INI.replace("pentapod.hal", "wall.hal") + limits)
    assert np.abs(machine.home[:3]).max() < 250.0
    for (x, z), ring, joint in zip(feet, rings, machine.inverse(machine.home), strict=True):
        away = np.array([x, 500.0, z]) - machine.home[:3]
        assert joint == pytest.approx(np.hypot(away[2] - ring, np.hypot(away[0], away[1]) - 80.32))


def test_command_says_what_it_did(tmp_path, capsys):
    import_text(tmp_path, "config.g", CONFIG_G, "--json")
    answer = json.loads(capsys.readouterr().out)
    assert (answer["schema"], answer["program"]) == ("parakin.import/1", "RepRapFirmware")


BAD = [
    ("a.cfg", "[printer]\nkinematics: corexy\n", "corexy"),
    ("a.cfg", KLIPPER_DELTA.replace("arm_length: 333.0", "arm_length: 100"), ":4:"),
    ("a.cfg", "[printer]\nkinematics: delta\ndelta_radius: x\n", ":3:"),
    ("a.cfg", "[printer]\nkinematics: delta\ndelta_radius: 100\n", "[stepper_a] has no arm_length"),
    ("config.g", "M669 K5\n", "K5"),
    ("config.g", CONFIG_G.replace("B0.00", "B0.5"), ":4:"),
    ("config.g", "M665 L1:2 R0.5\n", ":1:"),
    ("config.g", "M665 L100 R200\n", "longer"),
    ("config.g", "M669 K3\nM665 R{global.r}\n", ":2:"),
    ("config.g", "M665 R100 L200 H-500\n", "stroke"),
    ("config.g", "M501\n", "not there: config-override.g"),
    ("config.g", 'M98 P"../x.g"\n', ":1:"),
    ("a.cfg", "[include a.cfg]\n[printer]\n", "a.cfg:1: include"),
    ("a.cfg", "[include **x]\n[printer]\n", ":1:"),
    ("a.cfg", "[include gone.cfg]\n[printer]\n", "not there: gone.cfg"),
    ("a.ini", "[KINS]\nKINEMATICS = trivkins\n", "trivkins"),
    ("a.hal", TRIPOD_HAL, "--units"),
    ("a.ini", HEXAPOD_INI.replace("STEP = 0.5", ""), "hexapod.hal:3"),
    ("a.ini", HEXAPOD_INI.replace("= inch", "= furlong"), "furlong"),
    ("a.txt", "hello\n", "expected"),
    ("pentapod.hal", PENTAPOD_HAL.replace("r 75", "r 0"), "effector.2.r"),
    ("a.cfg", "\0", "configuration"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "told"), BAD)
def test_bad_configurations(name, text, told, tmp_path, capsys):
    (tmp_path / "hexapod.hal").write_text(HEXAPOD_HAL)
    (tmp_path / name).write_text(text)
    options = ["--units", "mm"] if name == "pentapod.hal" else []
    assert main(["import", str(tmp_path / name), "-o", str(tmp_path / "out.yaml"), *options]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out.yaml").exists()


def test_missing_file(tmp_path, capsys):
    assert main(["import", str(tmp_path / "none.ini")]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_the_rotary_delta_has_the_joints_of_linuxcnc():
    machine = pk.load("rotary_delta")
    poses = machine.home + np.random.default_rng(1).uniform(-100.0, 100.0, (2000, 3))
    poses = poses[machine.check(poses) == 0]
    assert len(poses) > 100
    np.testing.assert_allclose(machine.inverse(poses), rotarydeltakins(poses), atol=1e-12)
