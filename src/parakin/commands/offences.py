"""Offences in one line, and for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .console import rim, rim_unit

if TYPE_CHECKING:
    from ..toolpath.posting.posted import Offence


def offence_line(place: str, offence: Offence, what: str) -> str:
    """``part.cls:214: leg d2 would be 1,533.2 mm, limit 1,520 (the worst of 12 records)``."""
    several = f" (the worst of {offence.count:,} {what}s)" if offence.count > 1 else ""
    return f"{place}: {offence.text}{several}"


def offence_json(offence: Offence | None) -> dict[str, Any] | None:
    """mm and degrees; ``share`` is 1 at the record, less on the motion to it."""
    if offence is None:
        return None
    return {
        "limit": offence.limit,
        "text": offence.text,
        "record": offence.record,
        "line": offence.line,
        "share": offence.share,
        "begins": offence.begins,
        "value": rim(offence.value, offence.unit),
        "bound": rim(offence.bound, offence.unit),
        "excess": rim(offence.excess, offence.unit),
        "unit": rim_unit(offence.unit),
        "count": offence.count,
    }
