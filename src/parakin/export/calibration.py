"""A calibrated machine as a file, and its residuals as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arguments import check_arguments
from ..units import name_display_unit, to_display
from .colours import FAINT, INK
from .figure_file import SCREEN, render_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..calibration.calibration import Calibration

_WAS, _IS = "#b0bec5", "#1565c0"


@check_arguments
def format_calibrated_yaml(calibration: Calibration) -> str:
    """Format the calibrated machine as a machine file; comments tell each number with its standard deviation.

    calibration : of :func:`parakin.calibrate`
    """
    lines = [
        f"# Calibrated from {len(calibration.measured.joints)} measurements; weighed residual {calibration.fit:.3g}, "
        f"{calibration.held_out:.3g} of measurements that the fit did not know.",
        "# Numbers parameter, with their standard deviations:",
    ]
    for parameter in calibration.parameters:
        value, deviation = (
            to_display(number, parameter.unit) for number in (parameter.value, parameter.deviation or 0.0)
        )
        lines.append(f"# {parameter.name}: {value:.9g} +- {deviation:.2g} {name_display_unit(parameter.unit)}")
    if calibration.fixed:
        lines.append(f"# Kept, for others replace them: {' '.join(calibration.fixed)}")
    return "\n".join([*lines, calibration.machine.format_yaml()])


@check_arguments
def render_residuals(calibration: Calibration, suffix: str = SCREEN) -> bytes:
    """Render each measurement's residual before and after the calibration, in the measured number's unit, log scale.

    calibration : of :func:`parakin.calibrate`
    suffix : of the file, ``.png``, ``.pdf`` or ``.svg``
    """
    lengths = sum(axis in "XYZ" for axis in calibration.measured.axes) + (calibration.measured.distances is not None)
    rows = np.arange(1, len(calibration.residuals) + 1)

    def draw(figure: Figure) -> None:
        axes = figure.add_axes((0.09, 0.14, 0.88, 0.68))
        for residuals, colour, label in (
            (calibration.before, _WAS, "before"),
            (calibration.residuals, _IS, "calibrated"),
        ):
            sizes = 1e3 * np.linalg.norm(residuals[:, :lengths], axis=1)
            axes.plot(rows, np.maximum(sizes, 1e-3), "o-", color=colour, markersize=4, linewidth=1.0, label=label)
        axes.axhline(1e3 * calibration.measured.noise.length, color=INK, linewidth=0.8, linestyle=":", label="noise")
        axes.set_yscale("log")
        axes.grid(color=FAINT, linewidth=0.6)
        axes.set_xlabel("measurement", color=INK, fontsize=9)
        axes.set_ylabel("residual length [µm]", color=INK, fontsize=9)
        axes.legend(frameon=False, fontsize=9, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))

    def add_heading(figure: Figure) -> None:
        title = f"{calibration.family.machine.name}: {len(calibration.sizes)} numbers calibrated"
        figure.text(0.03, 0.92, title, color=INK, fontsize=13, weight="bold", parse_math=False)

    return render_figure((9.0, 4.2), draw, add_heading, suffix)
