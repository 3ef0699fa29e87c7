"""Maps of the tool's stiffness, or of its way under a force, over two axes of the workspace."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arguments import RowsLike, check_arguments
from .figure_file import SCREEN
from .position_map import MapText, render_position_map

if TYPE_CHECKING:
    from ..arrays import Array
    from ..stiffness.stiffness import Stiffness


@check_arguments
def render_stiffness_map(
    stiffness: Stiffness, *, along: RowsLike | None = None, force: RowsLike | None = None, suffix: str = SCREEN
) -> bytes:
    """Render the tip's least stiffness over the first two translations, all else as at home.

    stiffness : whose machine and springs these are; its poses tell how far the map goes
    along : instead the stiffness along this direction, as in :meth:`Stiffness.along`
    force : instead how far the tip gives way to this force, as in :meth:`Stiffness.deflect`
    suffix : of the file, ``.png``, ``.pdf`` or ``.svg``

    Raises :class:`PoseError` for a machine of fewer translations.
    """
    from ..stiffness.stiffness import compute_stiffness

    machine, tip = stiffness.machine, len(stiffness.translations)

    def compute(poses: Array) -> Array:
        own = compute_stiffness(machine, poses, stiffness.springs)
        if force is not None:
            return np.asarray(1e3 * np.linalg.norm(own.deflect(force)[:, :tip], axis=1))
        return 1e-3 * (own.least if along is None else own.along(along))

    if force is not None:
        text = MapText(f"{machine.name}: deflection", "of the tip under the force", "deflection [µm]", "viridis_r")
    else:
        which = "least over all directions" if along is None else f"along {_describe(along)}"
        text = MapText(f"{machine.name}: stiffness", f"of the tip, {which}", "stiffness [N/µm]", "viridis")
    return render_position_map(machine, stiffness.poses, compute, text, suffix)


def _describe(direction: RowsLike) -> str:
    if isinstance(direction, dict):
        return " ".join(f"{axis}={value:g}" if len(direction) > 1 else axis for axis, value in direction.items())
    return ", ".join(f"{value:g}" for value in np.ravel(np.asarray(direction, float)))
