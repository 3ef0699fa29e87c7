"""The cells of a certified workspace as files: CSV and VTU."""

from __future__ import annotations

from io import SEEK_END, BytesIO
from typing import Any

import numpy as np

from ...performance.indices import compute_performance
from ...workspaces.certified.workspace import Workspace
from .vtu import vtu


def cells_csv(found: Workspace) -> bytes:
    """A row a cell: its corners, ``state`` 1 inside and 0 at the boundary, shares proved, the limit's name."""
    import pyarrow as pa
    import pyarrow.csv

    cells = found.cells
    columns: dict[str, Any] = {}
    for end, corner in (("low", cells.low), ("high", cells.low + cells.size)):
        columns |= {f"{axis} {end} [mm]": corner[:, i] for i, axis in enumerate(found.axes)}
    names = np.array([*found.region.limits, None], dtype=object)
    columns |= {"state": cells.inside.astype(np.int8), "inner": cells.inner, "outer": cells.outer}
    columns["limit"] = pa.array(names[cells.limit], pa.string())
    data = BytesIO(f"{','.join(columns)}\n".encode())
    data.seek(0, SEEK_END)
    pa.csv.write_csv(pa.table(columns), data, pa.csv.WriteOptions(include_header=False, quoting_style="needed"))
    return data.getvalue()


def cells_vtu(found: Workspace) -> bytes:
    """The cells with their fields; field data tells each limit's number, ``limit`` is -1 inside.

    ``condition`` and the amplifications are those at the cell's middle and the middle of the turns swept, angles times
    the ``characteristic_length`` (mm); NaN where the legs can't close there.
    """
    cells, region = found.cells, found.region
    middle = cells.low + 0.5 * cells.size
    turns = np.array([[0.5 * (low + high) for low, high in region.swept_axes.values()]] * len(middle))
    good = compute_performance(region.machine, region.poses(middle, turns), mode=region.mode)
    fields: dict[str, Any] = {
        "state": cells.inside.astype(np.int8),
        "inner": cells.inner,
        "outer": cells.outer,
        "limit": cells.limit.astype(np.int32),
        "condition": good.condition,
        "amplification_least": good.least,
        "amplification_greatest": good.greatest,
    }
    told: dict[str, float] = {name: number for number, name in enumerate(region.limits)}
    if good.length.value is not None:
        told["characteristic_length"] = good.length.value
    return vtu(cells.low, cells.size, "".join(found.axes), fields, told)
