"""The wrist: two turning joints, their other mode, their pole, and turns counted to the nearest."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shipped import load_shipped

import parakin as pk
from parakin.kinematics import turns
from parakin.kinematics.wrist.pole_crossing import EITHER, OWN
from parakin.kinematics.wrist.pole_thresholds import EXACT, PRINTED
from parakin.kinematics.wrist.pose_angles import find_nearest_direction, flip_direction, flip_rotation

WRISTS = ["tricept", "orthoglide5_head", "orthoglide5_table"]
angles = st.floats(-50.0, 50.0)


@pytest.fixture(params=WRISTS)
def machine(request):
    return pk.load(request.param)


def upright(machine, count=1):
    """Poses at home with the tool along the wrist's first axis."""
    poses = np.tile(machine.home, (count, 1))
    poses[:, 3] = 0.0
    if machine.name == "tricept":  # the central leg carries the axis: below the base's middle it hangs upright
        poses[:, :2] = 0.0
    return poses


def tilted(machine, by):
    poses = upright(machine, len(by))
    poses[:, 3], poses[:, 4] = by, 0.3
    return poses


@pytest.mark.parametrize("name", [name for name in pk.machines() if load_shipped(name).axes != tuple("XYZBC")])
def test_other_machines_have_none(name):
    assert load_shipped(name).wrist is None


def test_both_modes_point_the_tool_the_same_way(machine):
    poses = tilted(machine, np.linspace(0.05, 0.5, 20))
    mode = machine.mode
    other = machine.inverse(poses, machine.wrist.other_mode(mode))
    assert np.abs(other - machine.inverse(poses, mode))[:, machine.wrist.pair].max(1).min() > 0.05
    back = machine.forward(other, near=poses)
    assert back.converged.all()
    turned = back.poses.copy()
    turned[:, 4] = turns.find_nearest_turn(turned[:, 4], poses[:, 4])
    np.testing.assert_allclose(turned, poses, atol=1e-6)
    assert machine.wrist.other_mode(machine.wrist.other_mode(mode)) == mode


def test_freedom_is_the_sine_squared_of_the_angle_off_the_pole(machine):
    if machine.name == "tricept":
        pytest.skip("its pole turns with the pose")
    by = np.array([0.0, 1e-9, 1e-3, 0.4])
    np.testing.assert_allclose(machine.wrist.measure_freedom(tilted(machine, by)), np.sin(by) ** 2, rtol=1e-9)


def test_the_pole_is_where_both_modes_meet(machine):
    wrist, on = machine.wrist, upright(machine)
    assert wrist.find_free(on, EXACT).all()
    assert not wrist.find_free(tilted(machine, np.array([0.01])), PRINTED).any()
    second = [machine.inverse(on, mode)[0, wrist.second] for mode in machine.head_modes(machine.mode)]
    assert second[0] == pytest.approx(second[1], abs=1e-9)


def test_the_first_joint_can_be_given_on_the_pole(machine):
    poses = upright(machine, 5)
    first = np.linspace(-1.0, 1.0, 5)
    joints = machine.wrist.solve_with_first(poses, machine.mode, first)
    np.testing.assert_array_equal(joints[:, machine.wrist.first], first)
    back = machine.forward(joints, near=poses)
    assert back.converged.all()
    np.testing.assert_allclose(back.poses[:, :4], poses[:, :4], atol=1e-6)


def test_a_path_over_the_pole_goes_on_in_the_other_mode(machine):
    poses = tilted(machine, np.linspace(-0.2, 0.2, 41) + 1e-4)
    joints = machine.follow(poses)
    assert np.abs(np.diff(joints[:, machine.wrist.pair], axis=0)).max() < 0.1  # half a turn, were it not for that
    modes = [machine.wrist.has_mode(poses[[row]], joints[[row]], machine.mode)[0] for row in (0, -1)]
    assert modes[0] != modes[1]


def test_the_nearest_joints_are_those_of_the_mode_that_a_guess_is_in(machine):
    poses, wrist = tilted(machine, np.linspace(0.05, 0.4, 20)), machine.wrist
    solutions = [machine.inverse(poses, mode) for mode in machine.head_modes(machine.mode)]
    for number, joints in enumerate(solutions):
        guess = joints + 0.01
        guess[:, wrist.pair] += 4.0 * np.pi
        nearest, modes = wrist.solve_nearest(poses, machine.mode, guess, PRINTED)
        assert (modes == number).all()
        off = np.zeros(joints.shape[1])
        off[wrist.pair] = 4.0 * np.pi
        np.testing.assert_allclose(nearest - joints, np.tile(off, (len(joints), 1)), atol=1e-9)
    known = np.full(len(poses), OWN, np.int8)
    kept, modes = wrist.solve_nearest(poses, machine.mode, solutions[1], PRINTED, known)
    assert (modes == OWN).all()
    np.testing.assert_allclose(turns.wrap_angle((kept - solutions[0])[:, wrist.pair]), 0.0, atol=1e-9)


def test_on_the_pole_the_nearest_joints_have_the_guess_s_first(machine):
    poses = upright(machine, 5)
    guess = machine.inverse(poses)
    guess[:, machine.wrist.first] = np.linspace(-1.0, 1.0, 5)
    joints, modes = machine.wrist.solve_nearest(poses, machine.mode, guess, PRINTED)
    assert (modes == EITHER).all()
    np.testing.assert_array_equal(joints[:, machine.wrist.first], guess[:, machine.wrist.first])
    assert machine.wrist.measure_blur(poses, machine.mode, joints)[:, machine.wrist.first].min() > 1e6


def test_beside_a_table_s_pole_the_legs_are_as_vague_as_the_turn_of_the_part():
    """The part is 40 mm off the table's axis: joints were taken to jump by roundings of its turn."""
    machine = load_shipped("orthoglide5_table")
    lean, c = 8e-6, np.linspace(0.1, 3.0, 40)
    poses = np.column_stack([np.tile([30.0, -26.0, 4.0], (40, 1)), np.full(40, lean), c])
    joints = machine.inverse(poses)
    blur = machine.wrist.measure_blur(poses, machine.mode, joints)
    turned = poses.copy()
    turned[:, 4] += 1e-6  # of C turns the part by as much, and legs by what its lever makes of it
    lever = np.abs(machine.inverse(turned) - joints)[:, :3] / 1e-6
    vague = (blur[:, :3] - np.maximum(1.0, np.abs(joints[:, :3]))) / blur[:, 4:]
    assert lever.max() > 20.0
    np.testing.assert_allclose(vague, lever, rtol=0.01, atol=0.1)


@given(angles, angles)
def test_the_nearest_turn(angle, near):
    nearest = turns.find_nearest_turn(np.array([angle]), np.array([near]))[0]
    assert abs(nearest - near) <= np.pi + 1e-9
    assert (nearest - angle) / (2.0 * np.pi) == pytest.approx(round((nearest - angle) / (2.0 * np.pi)), abs=1e-9)


def test_unwound_angles_keep_what_does_not_exist():
    walk = np.linspace(0.0, 20.0, 50)
    wound = turns.wrap_angle(walk)
    wound[7] = np.nan
    unwound = turns.unwind_angles(wound)
    assert np.isnan(unwound[7])
    np.testing.assert_allclose(np.delete(unwound, 7), np.delete(walk, 7), atol=1e-12)


def test_free_angles_are_their_neighbours():
    free = np.array([True, False, True, True, False, True])
    np.testing.assert_array_equal(turns.fill_free(np.array([9.0, 1.0, 9.0, 9.0, 2.0, 9.0]), free), [1, 1, 1, 1, 2, 2])


def rotation(turns):
    (sa, sb, sc), (ca, cb, cc) = np.sin(turns), np.cos(turns)
    a = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
    b = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    c = np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]])
    return c @ b @ a


@given(angles, angles, angles)
def test_the_other_turns_are_of_the_same_rotation(a, b, c):
    other = flip_rotation(np.array([[a, b, c]]))[0]
    np.testing.assert_allclose(rotation(other), rotation(np.array([a, b, c])), atol=1e-12)


@given(angles, angles)
def test_the_other_direction_is_the_same(b, c):
    other_c, other_b = flip_direction(np.array([c]), np.array([b]))[0]
    np.testing.assert_allclose(
        rotation(np.array([0.0, other_b, other_c]))[:, 2], rotation(np.array([0.0, b, c]))[:, 2], atol=1e-12
    )


def test_the_nearest_direction_points_along_the_axis():
    rng = np.random.default_rng(5)
    axis = rng.normal(size=(200, 3))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    near = rng.uniform(-6.0, 6.0, (200, 3)) * [0, 1, 1]
    turns = find_nearest_direction(axis, near)
    np.testing.assert_allclose([rotation(row)[:, 2] for row in turns], axis, atol=1e-12)
    assert (turns[:, 0] == 0.0).all()
    assert np.abs(turns[:, 2] - near[:, 2]).max() <= np.pi + 1e-9
