"""Three rods in a plane, nearly singular everywhere: the pose that the rods come from is among those that are found."""

import numpy as np
import pytest

from parakin.errors import NoMethodError
from parakin.kinematics.planar_rpr import solve_planar_rpr


def turn(points, angle):
    s, c = np.sin(angle), np.cos(angle)
    return points @ np.array([[c, s], [-s, c]])


@pytest.mark.parametrize("shape", [[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]], ids=["equal", "by half a turn", "mirrored"])
def test_a_pose_of_nearly_equal_triangles_is_found(shape):
    draw = np.random.default_rng(3)
    found = 0
    for off in 10.0 ** draw.uniform(-7.0, 1.0, 40):  # mm
        centres = draw.uniform(-300.0, 300.0, (3, 2))
        corners = centres * shape + off * draw.normal(size=(3, 2))
        pose = np.array([*draw.uniform(-200.0, 200.0, 2), 10.0 ** draw.uniform(-9.0, -1.0)])
        if shape[0] < 0.0:
            pose[2] -= np.pi
        radii = np.linalg.norm(pose[:2] + turn(corners, pose[2]) - centres, axis=1)
        try:
            poses = solve_planar_rpr(centres, radii, corners)
        except NoMethodError as error:
            assert "continuum" in str(error) and off < 0.01
            continue
        found += 1
        lengths = [np.linalg.norm(own[:2] + turn(corners, own[2]) - centres, axis=1) for own in poses]
        assert np.abs(np.array(lengths) - radii).max() < 1e-8
        assert np.linalg.norm(poses[:, :2] - pose[:2], axis=1).min() < 1e-2
    assert found > 20
