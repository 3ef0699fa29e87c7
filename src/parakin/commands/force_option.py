"""The option ``--force``: a force on the tool's tip."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import InputError, PoseError
from .region_options import split_axes

if TYPE_CHECKING:
    from ..arrays import Array
    from ..machine import Machine


def parse_force(machine: Machine, text: str | None) -> Array | None:
    """Parse a force by the machine's translations, ``X=-200N,Z=-1kN``, to (translations,) N."""
    if text is None:
        return None
    import numpy as np

    from ..stiffness.springs import FORCE, parse_stiff

    axes = [axis for axis in machine.axes if axis in "XYZ"]
    result = np.zeros(len(axes))
    for axis, value in split_axes(machine, text, "--force", "X=-200N").items():
        if axis not in axes:
            raise InputError(f"{axis} is no translation, expected {' '.join(axes)}", "--force")
        bare = value.strip()
        try:
            size = parse_stiff(bare.removeprefix("-"), FORCE, axis)
        except PoseError as error:
            raise InputError(str(error), "--force") from None
        result[axes.index(axis)] = -size if bare.startswith("-") else size
    return result
