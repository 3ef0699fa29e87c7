"""What the tests of linearising share: tool paths, and deviations from them by dense samples with SciPy's rotations."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from parakin.toolpath.path import ToolPath

DEGREE = math.pi / 180.0
DENSE = 60  # shares of each motion that are looked at


def path_of(tip, axis=None, **others):
    tip = np.atleast_2d(np.asarray(tip, dtype=float))
    n = len(tip)
    axis = np.tile([0.0, 0.0, 1.0], (n, 1)) if axis is None else np.asarray(axis, dtype=float)
    lines = np.arange(10, 10 + n)
    return ToolPath("part.cls", tip, axis, lines, np.zeros(n, bool), np.full(n, 1000.0), np.full(n, np.nan), **others)


def axis_of(b, c):
    b, c = np.broadcast_arrays(b, c)
    return Rotation.from_euler("yz", np.stack([b, c], axis=-1), degrees=True).apply([0.0, 0.0, 1.0])


def programmed(path, record, share):
    """Tips and axes in W at shares (m,) of the motion to a record."""
    s = np.asarray(share)[:, None]
    tip = path.tip[record - 1] * (1.0 - s) + path.tip[record] * s
    if path.turns is not None:
        turns = path.turns[record - 1] * (1.0 - s) + path.turns[record] * s
        return tip, Rotation.from_euler("xyz", turns).apply([0.0, 0.0, 1.0])
    a, b = path.axis[record - 1], path.axis[record]
    normal = np.cross(a, b)
    size = np.linalg.norm(normal)
    vector = normal / size * math.atan2(size, a @ b) if size > 0.0 else normal
    return tip, Rotation.from_rotvec(s * vector).apply(a)


def swept(path, record):
    """How far a motion turns the tool, rad."""
    if path.turns is not None:
        return float(np.abs(path.turns[record] - path.turns[record - 1]).sum())
    return math.atan2(
        np.linalg.norm(np.cross(path.axis[record - 1], path.axis[record])), path.axis[record - 1] @ path.axis[record]
    )


def tools(machine, poses):
    """Tips and axes of poses."""
    columns = {letter: poses[:, i] for i, letter in enumerate(machine.axes)}
    nothing = np.zeros(len(poses))
    tip = np.column_stack([columns[letter] for letter in "XYZ"])
    turns = np.column_stack([columns.get(letter, nothing) for letter in "ABC"])
    return tip, Rotation.from_euler("xyz", turns).apply([0.0, 0.0, 1.0])


def deviations(posted, result, under, chord, angle):
    """Of a result from what was posted, mm and rad, for every motion of the result: the tool against the point of its
    line nearest to the tip; where the tip hardly moves, at the same share."""
    machine, path = posted.machine, posted.path
    rotation, origin = posted.frame[:, :3], posted.frame[:, 3]
    share = np.linspace(0.0, 1.0, DENSE)
    worst = []
    record = result.path.line - path.line[0]  # every record has a line of its own
    for j in range(1, len(record)):
        r = record[j]
        poses = result.poses[j - 1] + share[:, None] * (result.poses[j] - result.poses[j - 1])
        if under == "joints":
            joints = result.joints[j - 1] + share[:, None] * (result.joints[j] - result.joints[j - 1])
            found = machine.forward(joints, near=poses)
            assert np.all(found.converged)
            poses = found.poses
        tip, axis = tools(machine, poses)
        length, turn = np.linalg.norm(path.tip[r] - path.tip[r - 1]), swept(path, r)
        begin, end = (rotation @ path.tip[i] + origin for i in (r - 1, r))
        if length * angle > turn * chord:
            at = np.clip((tip - begin) @ (end - begin) / length**2, 0.0, 1.0)
        else:
            ends = shares(path, result.path, j - 1 if record[j - 1] == r else None, r), shares(path, result.path, j, r)
            at = ends[0] + share * (ends[1] - ends[0])
        p, k = programmed(path, r, at)
        p, k = p @ rotation.T + origin, k @ rotation.T
        worst.append(
            [
                np.linalg.norm(tip - p, axis=1).max(),
                np.arctan2(np.linalg.norm(np.cross(axis, k), axis=1), (axis * k).sum(1)).max(),
            ]
        )
    return np.array(worst).reshape(-1, 2).T


def shares(path, denser_path, j, r):
    """Where on the motion to record r the record j of the denser path stands, by its axis."""
    if j is None:
        return 0.0
    if denser_path.line[j] != (denser_path.line[j + 1] if j + 1 < len(denser_path) else -1):
        return 1.0
    way = path.tip[r] - path.tip[r - 1]
    if way @ way > 1e-12:
        return float((denser_path.tip[j] - path.tip[r - 1]) @ way / (way @ way))
    if path.turns is not None:
        way = path.turns[r] - path.turns[r - 1]
        return float((denser_path.turns[j] - path.turns[r - 1]) @ way / (way @ way))
    a, k = path.axis[r - 1], denser_path.axis[j]
    return math.atan2(np.linalg.norm(np.cross(a, k)), a @ k) / swept(path, r)


UNDER = pytest.mark.parametrize("under", ["pose", "joints"])


def within(posted, result, under, chord, angle):
    tip, axis = deviations(posted, result, under, chord, angle)
    return max(tip.max(initial=0.0) / chord, axis.max(initial=0.0) / angle)
