"""The inside of a workspace as objects for JSON, parts of ``parakin.workspace/1``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...units import to_display

if TYPE_CHECKING:
    from ...workspaces.connected.components import Components
    from ...workspaces.inscribed.largest_box import InscribedBox


def encode_box(box: InscribedBox) -> dict[str, Any]:
    """Encode an inscribed box."""
    return {
        "low": box.low.tolist(),
        "high": box.high.tolist(),
        "volume": box.volume,
        "proved": box.proved,
        "tolerance": box.tolerance,
        "stopped": box.stopped,
        "stops": [{"face": stop.face, "limit": stop.limit} for stop in box.stops],
        "shape": box.parameters["shape"],
        "around": box.parameters["around"],
    }


def encode_components(components: Components) -> dict[str, Any]:
    """Encode the connected components of a region."""
    start, units = components.parameters["start"], components.region.machine.axis_units
    return {
        "count": len(components),
        "at_least": components.at_least,
        "undecided": components.undecided,
        "cell": components.cell,
        "stopped": components.stopped,
        "holds_start": components.start,
        "start": start and [to_display(value, unit) for value, unit in zip(start, units, strict=True)],
        "each": [
            {
                "sign": component.sign,
                "volume": {
                    "inner": component.volume.inner,
                    "estimate": component.volume.estimate,
                    "outer": component.volume.outer,
                },
                "place": component.position.tolist(),
                "box": {"low": component.low.tolist(), "high": component.high.tolist()},
                "apart": component.apart,
            }
            for component in components.components
        ],
    }
