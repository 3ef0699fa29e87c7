"""The cells of a certified workspace as files: CSV and VTU."""

from __future__ import annotations

from io import SEEK_END, BytesIO
from typing import Any

import numpy as np

from ...performance.indices import compute_performance
from ...workspaces.certified.workspace import Workspace
from .vtu import format_vtu


def format_cells_csv(workspace: Workspace) -> bytes:
    """Format a row for each cell: its corners, ``state`` 1 inside and 0 at the boundary, shares proved, the limit."""
    import pyarrow as pa
    import pyarrow.csv

    cells = workspace.cells
    columns: dict[str, Any] = {}
    for end, corner in (("low", cells.low), ("high", cells.low + cells.size)):
        columns |= {f"{axis} {end} [mm]": corner[:, i] for i, axis in enumerate(workspace.axes)}
    names = np.array([*workspace.region.limits, None], dtype=object)
    columns |= {"state": cells.inside.astype(np.int8), "inner": cells.inner, "outer": cells.outer}
    columns["limit"] = pa.array(names[cells.limit], pa.string())
    data = BytesIO(f"{','.join(columns)}\n".encode())
    data.seek(0, SEEK_END)
    pa.csv.write_csv(pa.table(columns), data, pa.csv.WriteOptions(include_header=False, quoting_style="needed"))
    return data.getvalue()


def format_cells_vtu(workspace: Workspace) -> bytes:
    """Format the cells with their fields; the field data has each limit's number, ``limit`` is -1 inside.

    ``condition`` and the amplifications are those at the cell's middle and the middle of the turns swept, angles times
    the ``characteristic_length`` (mm); NaN where the legs can't close there.
    """
    cells, region = workspace.cells, workspace.region
    middle = cells.low + 0.5 * cells.size
    turns = np.array([[0.5 * (low + high) for low, high in region.swept_axes.values()]] * len(middle))
    performance = compute_performance(region.machine, region.poses(middle, turns), mode=region.mode)
    fields: dict[str, Any] = {
        "state": cells.inside.astype(np.int8),
        "inner": cells.inner,
        "outer": cells.outer,
        "limit": cells.limit.astype(np.int32),
        "condition": performance.condition,
        "amplification_least": performance.least,
        "amplification_greatest": performance.greatest,
    }
    field_data: dict[str, float] = {name: number for number, name in enumerate(region.limits)}
    if performance.length.value is not None:
        field_data["characteristic_length"] = performance.length.value
    return format_vtu(cells.low, cells.size, "".join(workspace.axes), fields, field_data)
