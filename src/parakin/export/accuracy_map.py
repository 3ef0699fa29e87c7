"""A map of the tip's error over two axes of the workspace."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..arguments import check_arguments
from .figure_file import SCREEN
from .position_map import MapText, render_position_map

if TYPE_CHECKING:
    from ..accuracy.accuracy import Accuracy
    from ..arrays import Array


@check_arguments
def render_accuracy_map(accuracy: Accuracy, suffix: str = SCREEN) -> bytes:
    """Render the tip's root mean square error over the first two translations, all else as at home.

    accuracy : whose machine and tolerances these are; its poses tell how far the map goes
    suffix : of the file, ``.png``, ``.pdf`` or ``.svg``

    Raises :class:`PoseError` for a machine of fewer translations.
    """
    from ..accuracy.accuracy import analyse_accuracy

    machine, tolerances = accuracy.machine, accuracy.tolerances.tolerances
    stated = [(t.name, f"{t.value!r} {t.unit}") for t in tolerances]

    def compute(poses: Array) -> Array:
        return 1e3 * analyse_accuracy(machine, stated, poses).deviations

    shown = ", ".join(f"{t.name} ±{t.value:.6g} {t.unit}" for t in tolerances)
    text = MapText(f"{machine.name}: accuracy", shown, "tip's error, root mean square [µm]", "viridis_r")
    return render_position_map(machine, accuracy.poses, compute, text, suffix)
