"""Offences in one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..toolpath.posting.posted import Offence


def format_offence(place: str, offence: Offence, noun: str) -> str:
    """Format an offence: ``part.cls:214: leg d2 would be 1,533.2 mm, limit 1,520 (the worst of 12 records)``."""
    several = f" (the worst of {offence.count:,} {noun}s)" if offence.count > 1 else ""
    return f"{place}: {offence.text}{several}"
