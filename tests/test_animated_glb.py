"""An animated glTF, read as the standard says: every body is where the picture of that pose has it."""

import json
import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.export.machine.animated_glb import render_animated_glb
from parakin.export.machine.scene import build_scene
from parakin.export.machine.solids import build_solids

KINDS = {5126: ("<f4", 4), 5125: ("<u4", 4)}
DRAWN_TO_FIT = {"table", "axis", "rail", "base"}  # pictures of one pose draw them as large as they need
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


def read_glb(data):
    """The JSON and all accessors as arrays."""
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert (kind, size % 4) == (b"JSON", 0)
    content = json.loads(data[20 : 20 + size])
    binary_size, kind = struct.unpack_from("<I4s", data, 20 + size)
    assert (kind, 28 + size + binary_size) == (b"BIN\0", len(data))
    binary = data[28 + size :]
    arrays = []
    for accessor in content["accessors"]:
        view, (dtype, width) = content["bufferViews"][accessor["bufferView"]], KINDS[accessor["componentType"]]
        count = accessor["count"] * WIDTHS[accessor["type"]]
        assert view["byteLength"] == count * width
        assert view["byteOffset"] % 4 == 0
        values = np.frombuffer(binary, dtype, count, view["byteOffset"]).reshape(accessor["count"], -1)
        assert accessor["min"] == pytest.approx(values.min(0).tolist())
        assert accessor["max"] == pytest.approx(values.max(0).tolist())
        arrays.append(values)
    return content, arrays


def place_bodies(content, arrays, number):
    """Each node's vertices at a key frame, mm with Z up, and its triangles."""
    moves = {}
    for channel in content["animations"][0]["channels"] if "animations" in content else ():
        sampler = content["animations"][0]["samplers"][channel["sampler"]]
        moves[channel["target"]["node"], channel["target"]["path"]] = arrays[sampler["output"]][number]
    for index, node in enumerate(content["nodes"]):
        primitive = content["meshes"][node["mesh"]]["primitives"][0]
        translation, rotation, scale = (
            np.array(moves.get((index, path), node[path])) for path in ("translation", "rotation", "scale")
        )
        assert np.linalg.norm(rotation) == pytest.approx(1.0, abs=1e-6)
        local = arrays[primitive["attributes"]["POSITION"]] * scale
        placed = Rotation.from_quat(rotation).apply(local) + translation
        yield (
            np.column_stack([placed[:, 0], -placed[:, 2], placed[:, 1]]) * 1000.0,
            arrays[primitive["indices"]].ravel(),
        )


def find_outline(vertices, triangles):
    """What of a mesh stays when a round bar turns about its axis: volume, the corners' middle, poles."""
    corners = vertices[triangles.reshape(-1, 3)]
    volume = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    return np.concatenate([[np.cbrt(abs(volume))], corners.mean((0, 1)), vertices[-2], vertices[-1]])


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_table", "eclipse", "rus6", "rpr3"])
def test_bodies_are_where_the_picture_has_them(name):
    machine = load_shipped(name)
    rng = np.random.default_rng(3)
    size = [30.0 if unit == "mm" else 0.1 for unit in machine.axis_units]
    poses = machine.home + rng.uniform(-1.0, 1.0, (6, len(size))) * size
    poses = poses[machine.check(poses) == 0]
    joints = machine.inverse(poses)
    times = np.linspace(0.0, 1.0, len(poses))
    content, arrays = read_glb(render_animated_glb(machine, times, poses, joints))
    sampler = content["animations"][0]["samplers"][0]
    assert arrays[sampler["input"]].ravel() == pytest.approx(times)
    first_size = build_scene(machine).size
    for number, (pose, q) in enumerate(zip(poses, joints, strict=True)):
        solids = list(build_solids(build_scene(machine, pose, q), first_size))
        bodies = list(place_bodies(content, arrays, number))
        assert len(bodies) == len(solids)
        for solid, (vertices, triangles) in zip(solids, bodies, strict=True):
            assert (triangles == solid.triangles.ravel()).all()
            if solid.kind not in DRAWN_TO_FIT:
                expected = find_outline(solid.vertices, solid.triangles)
                assert find_outline(vertices, triangles) == pytest.approx(expected, abs=2e-3), solid.kind
            elif solid.kind == "table":
                assert vertices[-2:].mean(0) == pytest.approx(solid.vertices[-2:].mean(0), abs=2e-3)
                normals = np.diff(vertices[-2:], axis=0)[0], np.diff(solid.vertices[-2:], axis=0)[0]
                assert np.cross(*normals) == pytest.approx(np.zeros(3), abs=2e-2)


def test_turns_take_the_short_way():
    machine = load_shipped("tricept")
    poses = np.tile(machine.home, (200, 1)) + [0.0, 0.0, 0.0, 0.3, 0.0]
    poses[:, 4] = np.linspace(0.0, 2.0 * np.pi, 200)
    content, arrays = read_glb(render_animated_glb(machine, np.arange(200.0), poses, machine.follow(poses)))
    for channel in content["animations"][0]["channels"]:
        rows = arrays[content["animations"][0]["samplers"][channel["sampler"]]["output"]]
        if channel["target"]["path"] == "rotation":
            assert (np.einsum("ni,ni->n", rows[1:], rows[:-1]) > 0.0).all()


def test_the_command_writes_it(tmp_path, capsys):
    part = tmp_path / "part.apt"
    part.write_text("UNITS/MM\nFEDRAT/900,MMPM\nRAPID\nGOTO/0,0,250\nGOTO/40,10,250\nGOTO/40,-30,250\nFINI\n")
    words = ["post", str(part), "--machine", "linear_delta", "-o", str(tmp_path), "--animation"]
    assert main(words) == 0
    content, arrays = read_glb((tmp_path / "part.glb").read_bytes())
    times = arrays[content["animations"][0]["samplers"][0]["input"]].ravel()
    assert times[-1] == pytest.approx(
        float(f"{pk.prepare(pk.load('linear_delta'), pk.read_path(part)).seconds:.6f}"), rel=1e-6
    )
    import trimesh

    assert len(trimesh.load(tmp_path / "part.glb").geometry) == len(content["meshes"])
