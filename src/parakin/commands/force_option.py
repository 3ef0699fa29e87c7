"""The option ``--force``: a force on the tool's tip."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import InputError, quote
from ..units import FORCE, QuantityError, parse_quantity
from .region_options import split_axes

if TYPE_CHECKING:
    from ..arrays import Array
    from ..machine import Machine

_GREATEST = 1e30  # N: its square does not overflow


def parse_force(machine: Machine, text: str | None, option: str = "--force") -> Array | None:
    """Parse a force by the machine's translations, ``X=-200N,Z=-1kN``, to (translations,) N."""
    if text is None:
        return None
    import numpy as np

    axes = [axis for axis in machine.axes if axis in "XYZ"]
    result = np.zeros(len(axes))
    for axis, value in split_axes(machine, text, option, "X=-200N").items():
        if axis not in axes:
            raise InputError(f"{axis} is no translation, expected {' '.join(axes)}", option)
        try:
            size = parse_quantity(value, FORCE)
        except QuantityError as error:
            raise InputError(f"{axis}: {error}", option) from None
        if not abs(size) < _GREATEST:
            raise InputError(f"{axis}: {quote(value)} is out of range", option)
        result[axes.index(axis)] = size
    return result


def parse_cutting_force(machine: Machine, text: str | None, option: str) -> tuple[float, float, float]:
    """Parse a force on the tip wherever it cuts, as :attr:`ToolPath.cutting_force`; zeros where there is none."""
    force = parse_force(machine, text, option)
    along = () if force is None else zip((axis for axis in machine.axes if axis in "XYZ"), force.tolist(), strict=True)
    known = dict(along)
    return known.get("X", 0.0), known.get("Y", 0.0), known.get("Z", 0.0)
