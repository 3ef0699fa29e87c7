"""An offence as an object for JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...units import name_display_unit, to_display

if TYPE_CHECKING:
    from ...toolpath.posting.posted import Offence


def encode_offence(offence: Offence) -> dict[str, Any]:
    """Encode an offence; ``share`` is 1 at the record, less on the motion to it."""
    return {
        "limit": offence.limit,
        "text": offence.text,
        "record": offence.record,
        "line": offence.line,
        "share": offence.share,
        "begins": offence.begins,
        "value": to_display(offence.value, offence.unit),
        "bound": to_display(offence.bound, offence.unit),
        "excess": to_display(offence.excess, offence.unit),
        "unit": name_display_unit(offence.unit),
        "count": offence.count,
    }
