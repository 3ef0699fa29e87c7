"""Five axes on a free platform: struts on rings about the tool tell tip and axis, whatever its turn about the axis."""

from functools import partial

import numpy as np
import pytest
from independent import rotation
from shipped import load_shipped
from test_assemblies import distinct, multistart

import parakin as pk
from parakin.cli import main
from parakin.description.machine_file import list_shipped_machines

TEXT = list_shipped_machines()["pentapod"].read_text(encoding="utf-8")


def write(tmp_path, text):
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def draw_poses(machine, count):
    poses = machine.home + np.random.default_rng(8).uniform(-1.0, 1.0, (count, 5)) * [80.0, 80.0, 80.0, 0.3, 3.2]
    poses[:, 3] = np.abs(poses[:, 3])
    return poses


def test_a_ring_joint_does_not_follow_the_platforms_turn_about_its_axis():
    leg = load_shipped("pentapod").legs[2]
    tilted = (rotation("y", 0.3) @ rotation("x", -0.2))[0]
    origin = (30.0, -20.0, 400.0)
    placed = [leg.place_joint((tilted @ rotation("z", turn)[0]).tolist(), origin) for turn in (0.0, 1.0, 3.0)]
    assert np.ptp(np.array(placed), axis=0).max() < 1e-12
    centre, axis = np.array(origin) + tilted @ leg.platform, tilted[:, 2]
    joint = np.array(placed[0])
    assert np.linalg.norm(joint - centre) == pytest.approx(leg.radius, abs=1e-12)
    assert abs((joint - centre) @ axis) < 1e-12
    assert abs(np.cross(axis, np.array(leg.foot) - centre) @ (joint - centre)) < 1e-9  # in the plane of foot and axis


def test_struts_do_not_turn_the_platform_about_the_tool():
    """Each strut's line meets the tool's axis or is parallel to it, so that it has no moment about it."""
    machine = load_shipped("pentapod")
    for pose in draw_poses(machine, 20):
        placed = machine.place_platform(pose, machine.mode)
        rotated, origin = np.array(placed.rotation, float), np.array(placed.origin, float)
        for leg, point in zip(machine.legs, machine.place_leg_joints(placed), strict=True):
            along = np.array(point, float) - leg.foot
            moment = np.cross(np.array(point, float) - origin, along / np.linalg.norm(along))
            assert abs(moment @ rotated[:, 2]) < 1e-10


def test_rates_are_those_of_the_inverse():
    machine = load_shipped("pentapod")
    poses = draw_poses(machine, 200)
    poses[:, 3] += 0.05
    a, b = (np.array(part) for part in machine.jacobians(poses))
    for column, step in enumerate([1e-3, 1e-3, 1e-3, 1e-6, 1e-6]):
        moved = np.zeros(5)
        moved[column] = step
        rates = (machine.inverse(poses + moved) - machine.inverse(poses - moved)) / (2.0 * step)
        expected = np.linalg.solve(b, a[:, :, column, None])[..., 0]
        np.testing.assert_allclose(rates, expected, atol=1e-6)


def test_an_upright_tool_tilts_any_way_on_a_path(tmp_path):
    lines = "".join(f"GOTO/{x},100,200,{i:.6f},{j:.6f},0.98\n" for x, i, j in ((0, 0, 0), (20, 0.19, 0), (40, 0, 0.19)))
    part = tmp_path / "part.cls"
    part.write_text(f"UNITS/MM\nFEDRAT/500\nGOTO/0,100,200,0,0,1\n{lines}GOTO/0,100,200,0,0,1\nFINI\n")
    assert main(["post", str(part), "--machine", "pentapod", "-o", str(tmp_path / "out")]) == 0


def test_a_ring_is_a_parameter_with_its_height_and_radius():
    names = {parameter.name for parameter in load_shipped("pentapod").parameters}
    assert {"legs.strut1.platform.z", "legs.strut1.radius", "legs.strut1.foot.x"} <= names
    assert "legs.strut1.platform.x" not in names  # the ring is about the tool's axis


def measure_struts(machine, places, lengths, side):
    """How far struts are from closing on the rings' near (1) or far (-1) side, and the axis from length one: (N, 6)."""
    p, u = places[:, None, :3], places[:, None, 3:]
    heights, radii = np.array([(leg.platform[2], leg.radius) for leg in machine.legs]).T
    to_foot = np.array([leg.foot for leg in machine.legs]) - p - heights[:, None] * u
    along = (to_foot * u).sum(2)
    across = np.sqrt(np.maximum((to_foot**2).sum(2) - along**2, 0.0))
    open_by = along**2 + (across - side * radii) ** 2 - lengths**2
    return np.column_stack([open_by / 1e3, 300.0 * ((places[:, 3:] ** 2).sum(1) - 1.0)])


@pytest.mark.parametrize("moved", [0.0, 60.0])
def test_assemblies_are_all_that_newtons_method_finds(moved, tmp_path):
    """The shipped machine, whose feet are in a plane, and one with feet out of it."""
    machine = pk.load(
        write(tmp_path, TEXT.replace("[-418.03 mm, 324.56 mm, top]", f"[-418.03 mm, 324.56 mm, {895.56 + moved} mm]"))
    )
    rng = np.random.default_rng(9)
    for pose in draw_poses(machine, 1):
        lengths = machine.inverse(pose)
        answer = machine.assemblies(lengths)
        assert answer.complete == "all paths accounted for"
        assert len(answer) + answer.untold_count + answer.complex_count == 256  # 2⁸, none at infinity
        assert np.isfinite(answer.radii).all() and answer.radii[:, 0].max() < 1e-3
        assert np.abs(answer.poses - pose).max(1).min() < 1e-8
        np.testing.assert_allclose(machine.inverse(answer.poses), np.tile(lengths, (len(answer), 1)), atol=1e-9)
        b, c = answer.poses[:, 3:].T
        axes = np.column_stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)])
        mine = np.column_stack([answer.poses[:, :3] + 250.0 * axes, axes])
        starts = np.column_stack([rng.uniform(-1500.0, 1500.0, (1500, 3)) + [0, 0, 900.0], rng.normal(size=(1500, 3))])
        starts[:, 3:] /= np.linalg.norm(starts[:, 3:], axis=1)[:, None]
        caps = np.array([150.0, 150.0, 150.0, 0.3, 0.3, 0.3])
        for side in (1.0, -1.0):
            measure = partial(measure_struts, machine, lengths=lengths, side=side)
            found = multistart(measure, starts, caps, steps=40)
            found = distinct(found[np.abs(measure(found)).max(1) < 1e-6], 1e-3)
            if side > 0.0:
                assert len(found) == len(mine)
                assert all(np.abs(found - row).max(1).min() < 1e-3 for row in mine)
            else:
                assert len(found) <= answer.untold_count  # beside those with struts on either side


BAD = [
    (TEXT.replace("tx ty tz ry rx", "tx ty tz rz ry"), "tx ty tz rz ry"),
    (TEXT.replace("tx ty tz ry rx", "tx ty tz rz ry rx"), "6 words"),
    (TEXT.replace("[0, 0, -67.5 mm]", "[1 mm, 0, -67.5 mm]"), "strut2"),
    (TEXT.replace("  - tz: -tool", "  - tx: 5 mm\n  - tz: -tool"), "rings turn about the platform's z"),
    (TEXT.replace(", axis: [0, 0, -1]", ""), "a cone at joints on rings has an axis"),
    (TEXT.replace("kind: ring", "kind: length").replace("  radius: ring\n", ""), "all its legs on rings"),
    (TEXT.replace("radius: ring", "radius: 0 mm"), "radius"),
]


@pytest.mark.parametrize(("text", "told"), BAD, ids=[told for _, told in BAD])
def test_what_is_no_such_machine_is_told_in_a_line(text, told, tmp_path, capsys):
    assert main(["show", str(write(tmp_path, text)), "-o", str(tmp_path / "x.html")]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert len(error.splitlines()) == 1
