"""Fields, meshes, cross-sections and cell files of workspaces, against closed forms and the certified bracket."""

import csv
import re
from io import BytesIO, StringIO
from math import acos, cos, pi, sin, sqrt

import meshio
import numpy as np
import pytest
import trimesh
from regions import whole_region
from shipped import REPRESENTATIVES, load_shipped

import parakin as pk
from parakin.export.workspace.cells import format_cells_csv, format_cells_vtu
from parakin.export.workspace.describe import describe_region, describe_size, format_bracket, format_volume
from parakin.export.workspace.edge_flips import flip_folded_triangles
from parakin.export.workspace.meshes import format_mesh, make_mesh
from parakin.performance.indices import compute_performance
from parakin.workspaces.sampled.cross_sections import compute_signed_area, find_cross_sections
from parakin.workspaces.sampled.distance_field import DistanceField, sample_field

SPACE = [name for name in REPRESENTATIVES if "Z" in load_shipped(name).axes]


def struts(path, motion, legs, home):
    """A machine on struts of variable length: legs (foot, platform, least, greatest), mm."""
    lines = ["title: Struts", "source: Sizes were chosen.", f"motion: {motion}", "legs:"]
    for number, (foot, platform, low, high) in enumerate(legs):
        lines += ["  - kind: length", f"    joints: [q{number}]", f"    range: [{low} mm, {high} mm]"]
        for name, place in (("foot", foot), ("platform", platform)):
            lines.append(f"    {name}: [{', '.join(f'{x} mm' for x in place)}]")
    lines.append(f"home: {{{', '.join(f'{axis}: {value}' for axis, value in home.items())}}}")
    path.write_text("\n".join(lines) + "\n")
    return pk.load(path)


NOWHERE = (0, 0, 0)
LOOSE = ((0, 0, -9000), NOWHERE, 1000, 20000)


@pytest.fixture
def lens(tmp_path):
    """Two balls of radius 500 about (±400, 0, 0)."""
    legs = [((-400, 0, 0), NOWHERE, 10, 500), ((400, 0, 0), NOWHERE, 10, 500), LOOSE]
    return struts(tmp_path / "lens.yaml", "tx ty tz", legs, {"X": "0 mm", "Y": "0 mm", "Z": "0 mm"})


@pytest.fixture
def hollow(tmp_path):
    """A ball of radius 500 without one of radius 200."""
    legs = [(NOWHERE, NOWHERE, 200, 500), LOOSE, ((9000, 0, 0), NOWHERE, 1000, 20000)]
    return struts(tmp_path / "hollow.yaml", "tx ty tz", legs, {"X": "300 mm", "Y": "0 mm", "Z": "0 mm"})


@pytest.fixture
def turning(tmp_path):
    """In the plane: a strut of 200 to 500 from the origin to a point 100 off the platform's middle."""
    far = [((9000, y, 0), NOWHERE, 1000, 20000) for y in (-5000, 5000)]
    legs = [(NOWHERE, (100, 0, 0), 200, 500), *far]
    return struts(tmp_path / "turning.yaml", "tx ty rz", legs, {"X": "300 mm", "Y": "0 mm", "C": "0 deg"})


def overlap(radius, distance):
    """The area that two circles have in common."""
    if distance >= 2.0 * radius:
        return 0.0
    return 2 * radius**2 * acos(distance / (2 * radius)) - distance / 2 * sqrt(4 * radius**2 - distance**2)


def around(machine, gap=0.01, **asked_):
    found = pk.workspace(whole_region(machine, **asked_), gap)
    return found, sample_field(found.region, found.box)


def solid(shape):
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(shape.volume)
    return mesh


# The field.


def test_the_field_of_struts_is_the_distance(lens):
    rng = np.random.default_rng(1)
    places = rng.uniform([-200, -400, -400], [200, 400, 400], (5000, 3))
    gaps = [500.0 - np.linalg.norm(places - [x, 0, 0], axis=1) for x in (-400, 400)]
    distance = DistanceField(whole_region(lens))
    assert np.abs(distance.evaluate(places) - np.minimum(*gaps)).max() < 1e-9
    limits = np.array(distance.region.limits)[distance.find_nearest_limits(places).limit]
    assert (limits == np.where(gaps[0] < gaps[1], "q0.max", "q1.max")).all()


@pytest.mark.parametrize("name", REPRESENTATIVES)
def test_the_field_is_positive_where_the_machine_is_allowed(name):
    machine = load_shipped(name)
    here = whole_region(machine)
    rng = np.random.default_rng(2)
    low, high = pk.workspace(whole_region(machine), gap=0.1).box
    places = rng.uniform(low - 200, high + 200, (20_000, len(low)))
    allowed = machine.check(here.poses(places)) == 0
    assert 0.01 < allowed.mean() < 0.9
    assert ((DistanceField(here).evaluate(places) > 0.0) == allowed).all()


@pytest.mark.parametrize("kind", ["every", "some"])
def test_the_field_over_turns_asks_all_of_them(kind):
    machine = load_shipped("hexapod")
    spans = {"A": (-0.1, 0.1), "B": (-0.05, 0.2)}
    here = whole_region(machine, **{kind: spans})
    distance = DistanceField(here)
    assert len(distance.orientations) == 4 * 4  # 5 deg steps or less, at least three, both ends
    for i, span in enumerate(spans.values()):
        assert (distance.orientations[:, i].min(), distance.orientations[:, i].max()) == pytest.approx(span)
    low, high = pk.workspace(whole_region(machine)).box
    places = np.random.default_rng(3).uniform(low, high, (3000, 3))
    verdicts = [
        machine.check(here.poses(places, np.tile(turn, (len(places), 1)))) == 0 for turn in distance.orientations
    ]
    allowed = np.all(verdicts, 0) if kind == "every" else np.any(verdicts, 0)
    assert 0.02 < allowed.mean() < 0.98
    assert ((distance.evaluate(places) > 0.0) == allowed).all()
    assert ((distance.evaluate(places, enough=5.0) > 0.0) == allowed).all()


def test_a_narrow_range_has_three_turns_and_a_wide_one_is_thinned():
    machine = load_shipped("hexapod")
    assert len(DistanceField(whole_region(machine, every={"A": (0.0, 0.01)})).orientations) == 3
    assert len(DistanceField(whole_region(machine, some={"A": (0.2, 0.2)})).orientations) == 1
    assert len(DistanceField(whole_region(machine, dexterous=True)).orientations) <= 4096


def test_the_grid_covers_a_thin_region(tmp_path):
    legs = [((0, 0, -5000), NOWHERE, 5000, 5002), (NOWHERE, NOWHERE, 1, 200), LOOSE]  # a bowl, 2 thick
    machine = struts(tmp_path / "bowl.yaml", "tx ty tz", legs, {"X": "50 mm", "Y": "0 mm", "Z": "1 mm"})
    whole = sample_field(whole_region(machine), (np.array([-205.0, -205.0, -5.0]), np.array([205.0, 205.0, 3.0])))
    assert whole.step == pytest.approx([410 / 60, 410 / 60, 8 / 16])
    assert solid(make_mesh(whole)).volume == pytest.approx(pi * 200**2 * 2, rel=0.03)


def test_steps_that_make_no_sense(lens):
    found, _ = around(lens)
    for refused in (0.0, -1.0, float("nan"), 0.01):
        with pytest.raises(pk.PoseError, match="step"):
            sample_field(found.region, found.box, refused)


# Meshes.


def test_the_mesh_of_a_lens(lens):
    found, whole = around(lens)
    mesh = solid(make_mesh(whole))
    volume = pi * (4 * 500 + 800) * (2 * 500 - 800) ** 2 / 12
    assert found.volume.inner < volume < found.volume.outer
    assert mesh.volume == pytest.approx(volume, rel=0.002)
    assert mesh.body_count == 1
    # Every vertex is on one of the spheres, and their edge, a circle, is sharp: many are on both, to a tenth of a step.
    gaps = np.stack([500 - np.linalg.norm(mesh.vertices - [x, 0, 0], axis=1) for x in (-400, 400)])
    assert np.abs(gaps.min(0)).max() < 0.02
    assert (gaps.max(0) < 0.1 * whole.step.max()).sum() > 2 * pi * 300 / whole.step.max()
    assert mesh.bounds == pytest.approx(np.array([[-100, -300, -300], [100, 300, 300]]), abs=0.1)


def test_a_folded_surface_is_unfolded():
    """Vertices of a sphere that were drawn over an edge: afterwards all triangles look outward again."""
    ball = trimesh.creation.icosphere(4)
    vertices, faces = np.array(ball.vertices), np.array(ball.faces)
    for vertex in (20, 500, 900):
        edge = np.setdiff1d(faces[(faces == vertex).any(1)][0], vertex)  # it ends beyond this edge
        vertices[vertex] += 1.3 * (vertices[edge].mean(0) - vertices[vertex])
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    normals = vertices[faces].mean(1) / np.linalg.norm(vertices[faces].mean(1), axis=1, keepdims=True)

    def count_folded(faces):
        a, b, c = np.moveaxis(vertices[faces], 1, 0)
        return int((np.linalg.det(np.stack([a, b, c], 1)) < 0.0).sum())  # seen from the middle

    assert count_folded(faces) >= 3
    flipped, own = flip_folded_triangles(vertices, faces, normals)
    assert count_folded(flipped) == 0
    assert own.shape == normals.shape
    mesh = trimesh.Trimesh(vertices, flipped, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(ball.volume, rel=1e-3)


def test_few_triangles_of_a_sharp_edge_fold_over():
    found = pk.workspace(whole_region(load_shipped("orthoglide")), gap=0.3)
    shape = make_mesh(sample_field(found.region, found.box, step=8.0))
    areas = np.cross(*(shape.vertices[shape.faces[:, i]] - shape.vertices[shape.faces[:, 0]] for i in (1, 2)))
    assert (np.einsum("fi,fi->f", areas, shape.normals) < 0.0).sum() < 1e-3 * len(shape.faces)  # 5e-3 as it was fitted


def test_the_mesh_has_the_normals_of_the_boundary(lens):
    _, whole = around(lens)
    shape = make_mesh(whole)
    middles = shape.vertices[shape.faces].mean(1)
    away = np.stack([middles - [x, 0, 0] for x in (-400, 400)])
    radii = np.linalg.norm(away, axis=2)
    exact = (away / radii[:, :, None])[radii.argmax(0), np.arange(len(middles))]
    certain = np.abs(radii[0] - radii[1]) > 1.0  # elsewhere either may be the nearest
    assert certain.mean() > 0.95
    assert np.einsum("fi,fi->f", exact, shape.normals)[certain].min() > np.cos(1e-4)


def test_a_cavity_is_no_part_of_the_volume(hollow):
    found, whole = around(hollow)
    mesh = solid(make_mesh(whole))
    volume = 4 / 3 * pi * (500**3 - 200**3)
    assert found.volume.inner < volume < found.volume.outer
    assert mesh.volume == pytest.approx(volume, rel=0.01)
    assert mesh.body_count == 2  # the outer surface and that of the cavity


def test_a_region_in_parts_gives_a_body_each(tmp_path):
    feet = [(round(300 * cos(a), 3), round(300 * sin(a), 3), 0) for a in np.radians([90, 210, 330])]
    legs = [(foot, NOWHERE, 450, 520) for foot in feet]  # above the feet and below them
    home = {"X": "0 mm", "Y": "0 mm", "Z": "380 mm"}
    found = pk.workspace(whole_region(struts(tmp_path / "parts.yaml", "tx ty tz", legs, home)))
    bodies = solid(make_mesh(sample_field(found.region, found.box, step=5.0))).split()
    assert sorted(np.sign(body.centroid[2]) for body in bodies) == [-1, 1]
    assert bodies[0].volume == pytest.approx(bodies[1].volume, rel=0.01)
    assert bodies[0].volume * 2 == pytest.approx(found.volume.estimate, rel=0.02)


@pytest.mark.parametrize("name", SPACE)
def test_every_shipped_machine_has_a_closed_mesh(name):
    found, whole = around(load_shipped(name))
    mesh = solid(make_mesh(whole))
    assert found.volume.inner * 0.99 < mesh.volume < found.volume.outer * 1.01
    low, high = found.box
    assert (mesh.bounds[0] >= low).all()
    assert (mesh.bounds[1] <= high).all()


@pytest.mark.parametrize(
    "name, turns", [("hexapod", {"A": (-0.15, 0.15), "B": (-0.15, 0.15)}), ("lambda6", {"B": (-0.2, 0.2)})]
)
def test_total_orientation_has_a_closed_mesh(name, turns):
    found, whole = around(load_shipped(name), every=turns, gap=0.03)
    mesh = solid(make_mesh(whole))
    assert found.volume.inner * 0.98 < mesh.volume < found.volume.outer * 1.02


def test_a_mesh_is_in_space_only():
    _, whole = around(load_shipped("hbg80_2d"))
    with pytest.raises(pk.PoseError, match="volume"):
        make_mesh(whole)


@pytest.mark.parametrize("kind", [".stl", ".ply", ".glb"])
def test_mesh_files_open_again(lens, kind):
    shape = make_mesh(around(lens)[1])
    data = format_mesh(shape, kind)
    if kind == ".stl":
        assert not data.startswith(b"solid")  # binary
    again = trimesh.load(BytesIO(data), file_type=kind[1:], force="mesh")
    assert again.is_watertight
    assert again.volume == pytest.approx(shape.volume, rel=1e-4)
    assert again.bounds == pytest.approx(np.array([shape.vertices.min(0), shape.vertices.max(0)]), abs=0.01)


# Cross-sections.


def test_cross_sections_of_a_lens(lens):
    _, whole = around(lens)
    heights = [-290.0, -100.0, 0.0, 250.0, 310.0]
    for section, z in zip(find_cross_sections(whole, "Z", heights), heights, strict=True):
        assert (section.axis, section.value, section.plane) == ("Z", z, ("X", "Y"))
        assert section.area == pytest.approx(overlap(sqrt(500**2 - z**2), 800), rel=1e-3, abs=30.0)  # mm², at the tips
        for outline in section.outlines:
            assert (outline[0] == outline[-1]).all()
    across = find_cross_sections(whole, "X", [60.0])[0]
    assert across.plane == ("Y", "Z")
    assert across.area == pytest.approx(pi * (500**2 - 460**2), rel=1e-3)
    assert np.abs(np.linalg.norm(across.outlines[0], axis=1) - sqrt(500**2 - 460**2)).max() < 0.01


def test_sections_are_evenly_spaced_over_what_there_is(lens):
    _, whole = around(lens)
    found = find_cross_sections(whole)
    assert [section.value for section in found] == pytest.approx([-240, -120, 0, 120, 240], abs=10)
    assert all(section.axis == "Z" and len(section.outlines) == 1 for section in found)
    assert len(find_cross_sections(whole, "Y", 3)) == 3


def test_holes_are_no_part_of_the_area(hollow):
    _, whole = around(hollow)
    for section in find_cross_sections(whole, "Z", [0.0, 150.0, 400.0]):
        z = section.value
        hole = 200**2 - z**2
        assert section.area == pytest.approx(pi * (500**2 - z**2 - max(0.0, hole)), rel=1e-3)
        assert len(section.outlines) == 1 + (hole > 0)
        assert compute_signed_area(section.outlines[0]) > 0.0
        assert all(compute_signed_area(outline) < 0.0 for outline in section.outlines[1:])


@pytest.mark.parametrize("name", ["hexapod", "lambda6", "tricept"])
def test_cross_sections_lie_in_the_certified_bracket(name):
    machine = load_shipped(name)
    _, whole = around(machine)
    for section in find_cross_sections(whole, values=3):
        volume = pk.workspace(whole_region(machine, at={"Z": section.value}), gap=0.005).volume
        assert volume.inner * 0.998 < section.area < volume.outer * 1.002


def test_the_outline_of_a_planar_machine_is_its_only_section():
    found, whole = around(load_shipped("hbg80_2d"))
    (section,) = find_cross_sections(whole)
    assert section.axis is section.value is None
    assert found.volume.inner < section.area < found.volume.outer


def test_total_and_inclusive_orientation_of_a_strut(turning):
    every, some = {"every": {"C": (-pi, pi)}}, {"some": {"C": (-pi, pi)}}
    for kind, low, high in ((every, 300, 400), (some, 100, 600)):
        _, whole = around(turning, **kind)
        (section,) = find_cross_sections(sample_field(whole.region, whole.box, turns_step=0.02))
        assert section.area == pytest.approx(pi * (high**2 - low**2), rel=2e-3)
        assert len(section.outlines) == 2


def test_sections_that_make_no_sense(lens):
    _, whole = around(lens)
    with pytest.raises(pk.PoseError, match="A"):
        find_cross_sections(whole, "A")
    found, line = around(lens, at={"X": 0.0, "Y": 0.0})
    assert line.span[0] == pytest.approx([-300], abs=1)
    with pytest.raises(pk.PoseError, match="Z"):
        find_cross_sections(line)
    with pytest.raises(pk.PoseError, match="step"):
        find_cross_sections(whole, step=-1.0)
    assert found.axes == ("Z",)


# Cells.


@pytest.mark.parametrize("at, kind", [({}, "hexahedron"), ({"Z": 50.0}, "quad"), ({"X": 0.0, "Y": 0.0}, "line")])
def test_vtu(lens, tmp_path, at, kind):
    found = pk.workspace(whole_region(lens, at=at))
    (tmp_path / "cells.vtu").write_bytes(format_cells_vtu(found))
    mesh = meshio.read(tmp_path / "cells.vtu")
    (block,) = mesh.cells
    assert (block.type, len(block.data)) == (kind, len(found.cells.low))
    corners = mesh.points[block.data]
    columns = ["XYZ".index(axis) for axis in found.axes]
    assert np.abs(corners.min(1)[:, columns] - found.cells.low).max() < 1e-9
    assert np.abs((corners.max(1) - corners.min(1))[:, columns] - found.cells.size).max() < 1e-9
    if kind == "hexahedron":  # VTK's order of corners: the first three edges at the first corner are right-handed
        edges = corners[:, [1, 3, 4]] - corners[:, :1]
        assert np.linalg.det(edges) == pytest.approx(found.cells.volumes)
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points)  # neighbours share their corners
    data = {name: values[0] for name, values in mesh.cell_data.items()}
    assert (data["state"] == found.cells.inside).all()
    assert data["inner"] @ found.cells.volumes == pytest.approx(found.volume.inner)
    assert data["outer"] @ found.cells.volumes == pytest.approx(found.volume.outer)
    limits = {int(number[0]): name for name, number in mesh.field_data.items()}
    edge = data["limit"] >= 0
    assert (edge == ~found.cells.inside).all()
    assert {limits[i] for i in data["limit"][edge]} <= {"q0.max", "q1.max", "q0.min", "q1.min", "q2.min", "q2.max"}


def test_vtu_tells_the_performance_at_the_cells(tmp_path):
    found = pk.workspace(whole_region(load_shipped("orthoglide")), gap=0.1)
    (tmp_path / "cells.vtu").write_bytes(format_cells_vtu(found))
    data = {name: values[0] for name, values in meshio.read(tmp_path / "cells.vtu").cell_data.items()}
    middles = found.cells.low + 0.5 * found.cells.size
    j = [np.linalg.solve(a, b) for a, b in zip(*found.machine.jacobians(middles[found.cells.inside]), strict=True)]
    psi = np.linalg.svd(np.array(j), compute_uv=False)
    inside = found.cells.inside
    assert data["amplification_greatest"][inside] == pytest.approx(psi[:, 0])
    assert data["amplification_least"][inside] == pytest.approx(psi[:, 2])
    assert data["condition"][inside] == pytest.approx(psi[:, 0] / psi[:, 2])
    out = np.isnan(compute_performance(found.machine, middles).condition)
    assert (np.isnan(data["condition"]) == out).all()


def test_csv(lens):
    found = pk.workspace(whole_region(lens))
    rows = list(csv.DictReader(StringIO(format_cells_csv(found).decode())))
    assert len(rows) == len(found.cells.low)
    volume = {"inner": 0.0, "outer": 0.0}
    for row in rows:
        sides = [float(row[f"{axis} high [mm]"]) - float(row[f"{axis} low [mm]"]) for axis in "XYZ"]
        for share in volume:
            volume[share] += float(row[share]) * float(np.prod(sides))
        assert (row["limit"] == "") == (row["state"] == "1")
    assert volume["inner"] == pytest.approx(found.volume.inner, rel=1e-6)
    assert volume["outer"] == pytest.approx(found.volume.outer, rel=1e-6)
    assert {row["limit"] for row in rows} == {"", "q0.max", "q1.max"}


# Words.


def test_amounts_are_readable():
    assert format_volume(19_901_970.0, 3) == "19.9 litres"
    assert format_volume(1.797e9, 3) == "1.80 m³"
    assert format_volume(223_515.0, 2) == "2,235 cm²"
    assert format_volume(0.25, 2) == "0.25 mm²"
    assert format_volume(598.2, 1) == "598 mm"


def test_the_bracket_is_rounded_outward(lens):
    volume = pk.workspace(whole_region(lens)).volume
    low, high = (float(word) for word in format_bracket(volume, 3).split() if word[0].isdigit())
    assert format_bracket(volume, 3).endswith(" litres")
    assert low * 1e6 <= volume.inner < volume.outer <= high * 1e6
    assert high - low < 1.1 * (volume.outer - volume.inner) / 1e6 + 0.2


def test_a_caption_says_that_nothing_is_proved(lens):
    early = pk.workspace(whole_region(lens), seconds=1e-9)
    assert early.volume.inner == 0.0
    assert re.fullmatch(r"(.* by samples, )?no place proved, at most [\d,.]+ (m³|litres)", describe_size(early))


def test_what_was_asked_is_said():
    machine = load_shipped("hexapod")
    here = whole_region(machine, at={"C": pi / 6, "Z": -900.0}, every={"A": (-0.1, 0.1)}, without=["strut0.*"])
    words = describe_region(here)
    assert words.startswith("total orientation, A -5.73° to 5.73°, Z = -900 mm, B = 0°, C = 30°")
    assert "without strut0.min strut0.max" in words
    assert describe_region(whole_region(machine, without=["*.max"])).endswith("without 6 of the limits")
