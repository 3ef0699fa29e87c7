"""A machine at a pose as a mesh of all its parts: STL in mm, GLB in metres with Y up, as glTF has it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array
from ...dynamics.multibody import METRE
from ...machine import Machine
from .scene import build_scene
from .solids import LOOKS, build_solids

Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # Z up to Y up


def render_stl(machine: Machine, pose: Array | None = None) -> bytes:
    """Render all parts of a machine at a pose, home by default, as binary STL in mm."""
    from trimesh import Trimesh
    from trimesh.util import concatenate

    meshes = [Trimesh(s.vertices, s.triangles, process=False) for s in build_solids(build_scene(machine, pose))]
    return bytes(concatenate(meshes).export(file_type="stl"))


def render_glb(machine: Machine, pose: Array | None = None) -> bytes:
    """Render a machine at a pose, home by default, as binary glTF with a coloured mesh for each part."""
    from trimesh import Scene, Trimesh
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    scene = Scene()
    for number, solid in enumerate(build_solids(build_scene(machine, pose))):
        material = PBRMaterial(**format_material(solid.kind)["pbrMetallicRoughness"])
        vertices = solid.vertices @ Y_UP.T * METRE
        visual = TextureVisuals(material=material)
        scene.add_geometry(
            Trimesh(vertices, solid.triangles, process=False, visual=visual), geom_name=f"{solid.name} {number}"
        )
    return bytes(scene.export(file_type="glb"))


def format_material(kind: str) -> dict[str, Any]:
    """Format the material of a kind of solid as glTF has it."""
    colour = [int(LOOKS[kind].colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    look = {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.1, "roughnessFactor": 0.7}
    return {"name": kind, "pbrMetallicRoughness": look}
