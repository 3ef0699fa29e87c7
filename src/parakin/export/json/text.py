"""Format objects as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any


def format_json(content: Mapping[str, Any]) -> str:
    """Format an object as JSON, indented; numbers that are not finite become null."""
    return json.dumps(_replace_nonfinite(content), indent=2, allow_nan=False)


def _replace_nonfinite(content: Any) -> Any:
    if isinstance(content, float):
        return content if math.isfinite(content) else None
    if isinstance(content, Mapping):
        return {key: _replace_nonfinite(value) for key, value in content.items()}
    if isinstance(content, Sequence) and not isinstance(content, str):
        return [_replace_nonfinite(value) for value in content]
    return content
