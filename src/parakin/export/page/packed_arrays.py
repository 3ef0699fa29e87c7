"""Arrays as texts of a page's data: little-endian numbers in base64."""

from __future__ import annotations

from base64 import b64encode

import numpy as np

from ...arrays import Array, Indices


def pack_array(values: Array | Indices, kind: str) -> str:
    """Pack an array as numbers of a NumPy kind, such as ``<f4``."""
    return b64encode(np.ascontiguousarray(values, kind).tobytes()).decode("ascii")
