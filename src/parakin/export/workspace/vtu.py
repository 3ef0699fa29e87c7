"""Boxes with fields on them as a VTK unstructured grid (.vtu), which ParaView and meshio read."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array, Indices

Numbers = NDArray[np.generic]

_TYPES = {1: 3, 2: 9, 3: 12}  # line, quad, hexahedron: every reader knows these, VTK's own pixel and voxel few do
_QUAD = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
_ENDS = {1: [(0.0,), (1.0,)], 2: list(_QUAD), 3: [(*end, z) for z in (0.0, 1.0) for end in _QUAD]}
_CHUNK = 1 << 15  # bytes packed together


def format_vtu(
    low: Array, size: Array, axes: str, cells: Mapping[str, Numbers], field_data: Mapping[str, float]
) -> bytes:
    """Format boxes with their fields as one file.

    Parameters
    ----------
    low, size : (N, d) lower corners and edges, mm; N > 0
    axes : the d letters of X, Y and Z that they have; the others are 0
    cells : fields, one number for each box
    field_data : one number for each name
    """
    d = len(axes)
    points, corners = _collect_corners(low, size)
    places = np.zeros((len(points), 3))
    places[:, ["XYZ".index(axis) for axis in axes]] = points
    offsets = np.arange(1, len(low) + 1, dtype=np.int64) * 2**d
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkZLibDataCompressor">',
        "<UnstructuredGrid>",
        "<FieldData>",
        *(_format_array(name, np.array([number], np.float64), tuples=1) for name, number in field_data.items()),
        "</FieldData>",
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(low)}">',
        "<Points>",
        _format_array("Points", places, components=3),
        "</Points>",
        "<Cells>",
        _format_array("connectivity", corners.astype(np.int64)),
        _format_array("offsets", offsets),
        _format_array("types", np.full(len(low), _TYPES[d], np.uint8)),
        "</Cells>",
        "<CellData>",
        *(_format_array(name, values) for name, values in cells.items()),
        "</CellData>",
        "</Piece>",
        "</UnstructuredGrid>",
        "</VTKFile>",
    ]
    return "\n".join(lines).encode()


def _collect_corners(low: Array, size: Array) -> tuple[Array, Indices]:
    """Collect the corners of all boxes, each once, (P, d), and the indices of every box's corners, (N, 2^d)."""
    d = low.shape[1]
    every = (low[:, None] + np.array(_ENDS[d]) * size[:, None]).reshape(-1, d)
    key = np.zeros(len(every), np.int64)
    for axis, edge in enumerate(size.min(0).tolist()):
        # Rounding makes several corners of one, which differ in the last digit; boxes are many digits wide.
        levels, rank = np.unique(np.rint((every[:, axis] - low[:, axis].min()) / (edge / 8.0)), return_inverse=True)
        key = key * len(levels) + rank
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    return every[first], which.reshape(len(low), -1)


def _format_array(name: str, values: Numbers, components: int = 0, tuples: int = 0) -> str:
    kind = f"{'Float' if values.dtype.kind == 'f' else 'UInt' if values.dtype.kind == 'u' else 'Int'}"
    shape = f' NumberOfComponents="{components}"' * (components > 0) + f' NumberOfTuples="{tuples}"' * (tuples > 0)
    data = values.astype(values.dtype.newbyteorder("<")).tobytes()
    chunks = [data[i : i + _CHUNK] for i in range(0, len(data), _CHUNK)]
    packed = [zlib.compress(chunk, 1) for chunk in chunks]
    header = np.array([len(chunks), _CHUNK, len(chunks[-1]) % _CHUNK, *map(len, packed)], "<u8").tobytes()
    text = (b64encode(header) + b64encode(b"".join(packed))).decode()
    name = name.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
    width = 8 * values.dtype.itemsize
    return f'<DataArray type="{kind}{width}" Name="{name}"{shape} format="binary">{text}</DataArray>'
