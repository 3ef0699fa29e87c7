"""Triangles in pixels against each pixel's own look at every triangle, and what is drawn by them."""

from io import BytesIO

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.transforms import Bbox

from parakin.export.machine.label_placing import BodyLabel, add_labels
from parakin.export.rasterising import find_front_faces
from parakin.export.shaded_bodies import ShadedBody, add_bodies, project, smooth_normals

RED, BLUE = (0.8, 0.1, 0.1), (0.1, 0.1, 0.8)


def test_the_front_is_what_a_ray_meets_first():
    rng = np.random.default_rng(1)
    corners = rng.uniform([-5, -5, 0], [25, 20, 1], (40, 3, 3))
    corners[7, 2] = 0.5 * (corners[7, 0] + corners[7, 1])  # on its edge: it covers nothing
    front = find_front_faces(corners, 20, 15)
    found = {(r, c): (f, z) for r, c, f, z in zip(front.row, front.column, front.face, front.depth, strict=True)}
    for row in range(15):
        for column in range(20):
            met = []
            for number, triangle in enumerate(corners):
                matrix = np.vstack([triangle[:, :2].T, np.ones(3)])
                if abs(np.linalg.det(matrix)) < 1e-9:
                    continue
                weights = np.linalg.solve(matrix, [column + 0.5, row + 0.5, 1.0])
                if (weights >= 0.0).all():
                    met.append((weights @ triangle[:, 2], number))
            assert ((row, column) in found) == bool(met)
            if met:
                depth, number = min(met)
                assert found[row, column] == (number, pytest.approx(depth))


def make_square(z, half, colour, opacity=1.0):
    """A square that faces up."""
    corners = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])[[[0, 1, 2], [0, 2, 3]]]
    normals = np.broadcast_to([0.0, 0.0, 1.0], (2, 3, 3))
    return ShadedBody(corners, normals, np.tile(colour, (2, 1)), opacity)


def make_axes_from_above():
    axes = Figure(figsize=(2, 2), dpi=100).add_axes((0, 0, 1, 1), projection="3d", elev=90, azim=-90, proj_type="ortho")
    axes.set(xlim=(-2, 2), ylim=(-2, 2), zlim=(-2, 2))
    axes.set_axis_off()
    return axes


def look_from_above(x, *bodies):
    """The colour at a place of the X axis."""
    axes = make_axes_from_above()
    add_bodies(axes, bodies)
    data = BytesIO()
    axes.figure.savefig(data, format="png")
    data.seek(0)
    column, row = project(axes, np.array([[x, 0.1, 0.0]]))[0, :2].astype(int)
    return imread(data)[::-1][row, column, :3]


def test_what_is_in_front_hides_what_is_behind():
    bodies = make_square(1.0, 0.5, RED), make_square(0.0, 1.0, BLUE)
    front, behind, beside = (look_from_above(x, *bodies) for x in (0.3, 0.8, 1.2))
    assert front[0] > 2.0 * front[2]
    assert behind[2] > 2.0 * behind[0]
    assert (beside == 1.0).all()
    through = look_from_above(0.3, bodies[0]._replace(opacity=0.5), bodies[1])
    assert min(through[0], through[2]) > 0.2  # both are seen


def test_normals_are_smooth_over_a_bend_and_not_over_an_edge():
    for bend, is_smooth in ((20.0, True), (60.0, False)):
        far = [0.0, -np.cos(np.radians(bend)), -np.sin(np.radians(bend))]
        vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], far])
        faces = np.array([[0, 1, 2], [0, 3, 1]])
        a, b, c = (vertices[corner] for corner in faces.T)
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        corners = smooth_normals(vertices, faces, normals)
        assert (np.abs(corners[0, 0] - corners[1, 0]).max() < 1e-12) == is_smooth
        assert corners[0, 2] == pytest.approx(normals[0])


def test_labels_keep_off_bodies_and_off_each_other():
    axes, body = make_axes_from_above(), make_square(0.0, 0.3, RED)
    labels = [BodyLabel(text, np.zeros(3), "black", 7.0) for text in ("first", "second", "third")]
    add_labels(axes, labels, [body], [])
    axes.figure.savefig(BytesIO(), format="png")
    ends = project(axes, body.corners.reshape(-1, 3))[:, :2]
    taken = [Bbox([ends.min(0), ends.max(0)])]
    for text in axes.texts:
        box = text.get_window_extent()
        assert axes.bbox.x0 <= box.x0 < box.x1 <= axes.bbox.x1
        assert not any(box.overlaps(other) for other in taken)
        taken.append(box)
    assert len(taken) == 4
