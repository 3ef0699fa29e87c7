"""A machine in motion as binary glTF: each solid is a node that moves, turns and stretches (glTF 2.0, animations)."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Array, Indices, Progress
from ...dynamics.multibody import METRE
from ...errors import PoseError
from ...machine import Machine
from .posed_mesh import Y_UP, format_material
from .scene import build_scene, trace_scene
from .solids import Solid, build_solids

if TYPE_CHECKING:
    from ...toolpath.timing.trajectory import Trajectory

_FRAME_RATE, _MOST_FRAMES = 25.0, 1000  # Hz; a long path has fewer a second
_FLOAT, _INDEX = 5126, 5125  # component types of glTF
_VERTICES, _INDICES = 34962, 34963  # targets of buffer views
_JSON, _BINARY = b"JSON", b"BIN\0"


def render_animated_glb(
    machine: Machine, times: Array, poses: Array, joints: Array, progress: Progress | None = None
) -> bytes:
    """Render a machine that moves through poses as binary glTF, in metres with Y up.

    times : (n,) s, growing; poses : (n, axes) and joints : (n, joints) there, mm and rad

    Bodies are those of the picture at home. Between two times positions are interpolated, turns on the shortest way.
    Raises :class:`PoseError` where the machine can't be drawn.
    """
    home = build_scene(machine)
    size, frames = home.size, list[list[Solid]]()
    for number, (pose, q) in enumerate(zip(poses, joints, strict=True)):
        points, _ = trace_scene(machine, pose.tolist(), q.tolist())
        placed = [replace(item, points=row.astype(float)) for item, row in zip(home.items, points, strict=True)]
        if not all(np.isfinite(item.points).all() for item in placed):
            raise PoseError(f"poses: the machine can't be drawn at {times[number]:g} s, for it is out of reach")
        frames.append(list(build_solids(replace(home, items=tuple(placed)), size)))
        if progress:
            progress((number + 1) / len(poses))
    glb = _GlbWriter()
    for moves in zip(*frames, strict=True):
        glb.add_body(moves, times)
    return glb.format()


def render_path_glb(trajectory: Trajectory, progress: Progress | None = None) -> bytes:
    """Render the machine of a trajectory as it moves along it, in its own time; see :func:`render_animated_glb`."""
    count = int(min(_MOST_FRAMES, np.ceil(_FRAME_RATE * trajectory.seconds))) + 1
    points = trajectory.at(np.linspace(0.0, trajectory.seconds, count))
    return render_animated_glb(trajectory.posted.machine, points.times, points.poses, points.joints, progress)


def find_frame(vertices: Array) -> tuple[Array, Array, float]:
    """Find the frame of a solid: its origin (3,), rotation (3, 3), and length along the third axis, by its vertices.

    The last two vertices of every solid are its poles, the third axis goes from one to the other; the first vertex is
    across it.
    """
    origin, along = vertices[-2], vertices[-1] - vertices[-2]
    length = float(np.linalg.norm(along))
    third = along / length
    across = vertices[0] - origin
    first = across - (across @ third) * third
    first /= np.linalg.norm(first)
    return origin, np.column_stack([first, np.cross(third, first), third]), length


class _GlbWriter:
    """Collects nodes, meshes and their motion."""

    def __init__(self) -> None:
        self._binary = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._materials: dict[str, int] = {}
        self._nodes: list[dict[str, Any]] = []
        self._meshes: list[dict[str, Any]] = []
        self._samplers: list[dict[str, Any]] = []
        self._channels: list[dict[str, Any]] = []
        self._times: int | None = None

    def add_body(self, moves: Sequence[Solid], times: Array) -> None:
        """Add one solid by what it is at each time."""
        located = [find_frame(solid.vertices @ Y_UP.T * METRE) for solid in moves]
        origin, rotation, length = located[0]
        local = (moves[0].vertices @ Y_UP.T * METRE - origin) @ rotation
        mesh = {
            "primitives": [{
                "attributes": {"POSITION": self._add_array(local, "VEC3", _VERTICES)},
                "indices": self._add_array(moves[0].triangles.ravel(), "SCALAR", _INDICES),
                "material": self._find_material(moves[0].kind),
            }]
        }  # fmt: skip
        node, name = len(self._nodes), f"{moves[0].name} {moves[0].kind} {len(self._nodes)}"
        motion = {
            "translation": np.array([o for o, _, _ in located]),
            "rotation": join_quaternions(np.array([compute_quaternion(r) for _, r, _ in located])),
            "scale": np.array([[1.0, 1.0, stretched / length] for _, _, stretched in located]),
        }
        self._meshes.append(mesh)
        self._nodes.append({"name": name, "mesh": node, **{path: row[0].tolist() for path, row in motion.items()}})
        for path, rows in motion.items():
            if len(rows) > 1 and np.ptp(rows, axis=0).max() > 0.0:
                self._add_channel(node, path, rows, times)

    def _add_channel(self, node: int, path: str, rows: Array, times: Array) -> None:
        if self._times is None:
            self._times = self._add_array(times, "SCALAR")
        output = self._add_array(rows, f"VEC{rows.shape[1]}")
        self._channels.append({"sampler": len(self._samplers), "target": {"node": node, "path": path}})
        self._samplers.append({"input": self._times, "output": output, "interpolation": "LINEAR"})

    def _add_array(self, values: Array | Indices, kind: str, target: int | None = None) -> int:
        """Add an array to the buffer; return its accessor's number."""
        packed = values.astype("<u4" if target == _INDICES else "<f4")
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": packed.nbytes}
        self._views.append(view | ({"target": target} if target else {}))
        self._binary += packed.tobytes()  # four bytes a number, so all stay aligned
        rows = packed.reshape(len(packed), -1)
        self._accessors.append({
            "bufferView": len(self._views) - 1,
            "componentType": _INDEX if target == _INDICES else _FLOAT,
            "count": len(packed),
            "type": kind,
            "min": rows.min(0).tolist(),
            "max": rows.max(0).tolist(),
        })  # fmt: skip
        return len(self._accessors) - 1

    def _find_material(self, kind: str) -> int:
        return self._materials.setdefault(kind, len(self._materials))

    def format(self) -> bytes:
        """Format the file."""
        content: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "parakin"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self._nodes)))}],
            "nodes": self._nodes,
            "meshes": self._meshes,
            "materials": [format_material(kind) for kind in self._materials],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._binary)}],
        }
        if self._channels:
            content["animations"] = [{"name": "path", "samplers": self._samplers, "channels": self._channels}]
        text = json.dumps(content, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = [(_JSON, text), (_BINARY, bytes(self._binary))]
        body = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def compute_quaternion(rotation: Array) -> Array:
    """Compute the unit quaternion (x, y, z, w) of a rotation (3, 3)."""
    from scipy.spatial.transform import Rotation

    quaternion: Array = Rotation.from_matrix(rotation).as_quat()
    return quaternion


def join_quaternions(quaternions: Array) -> Array:
    """Choose the signs of quaternions (n, 4) so that each is nearer to the one before than its opposite."""
    flips = (quaternions[1:] * quaternions[:-1]).sum(1) < 0.0
    signs = np.where(np.concatenate([[False], np.logical_xor.accumulate(flips)]), -1.0, 1.0)
    return quaternions * signs[:, None]
