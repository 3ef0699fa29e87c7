"""What a path's set-up is, in words: where the part's zero lies in the machine, and how long the tools are."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ...arrays import Array
from ...kinematics.rotations import TURNS
from ..path import ToolPath
from .frames import find_frame_angles
from .posted import Posted
from .tool_lengths import describe_tool, find_cutter_length

_SAME = 1e-6  # mm: lengths that are shown as the same
_MOST = 50  # tools that are told


def describe_setup(posted: Posted) -> list[str]:
    """Describe where the part's zero lies and how long the tools are, in lines for people."""
    return [f"part zero at {describe_frame(posted.frame)} in the machine", *describe_tools(posted.path)]


def describe_frame(frame: Array) -> str:
    """Describe a frame (3, 4) by its origin in mm, and by the angles of R = Rz(C)·Ry(B)·Rx(A) where it is turned."""
    words = [f"{letter} {float(value):.6g}" for letter, value in zip("XYZ", frame[:, 3] + 0.0, strict=True)]
    degrees = [round(math.degrees(angle), 9) + 0.0 for angle in find_frame_angles(frame)]
    if any(degrees):
        words += [f"{letter} {value:.6g}°" for letter, value in zip(TURNS, degrees, strict=True)]
    return " ".join(words)


def describe_tools(path: ToolPath) -> list[str]:
    """Describe the tools that a fitted path is for, a line each."""
    own = path.fitted_length
    if own is None:
        return []
    lines = list(_describe_lengths(path, own))
    more = [f"and {len(lines) - _MOST} more tools"] if len(lines) > _MOST else []
    if path.extension is not None:
        more.append(f"X, Y and Z are where the tip of the machine's own tool, {own:g} mm, would be")
    return [*lines[:_MOST], *more]


def _describe_lengths(path: ToolPath, own: float) -> Iterator[str]:
    for use in path.tools:
        since = f" from line {use.line} on" if use.record > 0 and use.line else ""
        whose = "the machine's own length" if abs(use.length - own) <= _SAME else f"the machine's own is {own:g}"
        cutter = find_cutter_length(use)
        of_it = f", {cutter:.6g} mm of it the file's cutter" if cutter < use.length - _SAME else ""
        yield f"{describe_tool(use)}{since}: {use.length:.6g} mm from the spindle's nose to its tip, {whose}{of_it}"
