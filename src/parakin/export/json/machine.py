"""A machine as an object for JSON, ``parakin.machines/1`` and ``parakin.show/1``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any

from ...units import name_display_unit, to_display

if TYPE_CHECKING:
    from ...machine import Machine
    from ...model.elements import Drive

RATES = ("speed", "acceleration", "jerk")
MOTOR = ("counts", "lead", "homing")
LOADS = ("force", "rated", "power", "inertia", "stiffness")
_LOAD_UNITS = {  # N, N, W, kg and N/um of what slides; Nm, Nm, W, kg m² and kNm/rad of what turns
    "mm": (1.0, 1.0, 1e3, 1e-3, 1e3),
    "rad": (1e3, 1e3, 1e3, 1e3, 1e6),
}


def encode_machines(machines: Iterable[Machine]) -> dict[str, Any]:
    """Encode the heads of machines' descriptions."""
    return {"schema": "parakin.machines/1", "machines": [_encode_head(machine) for machine in machines]}


def encode_machine(machine: Machine, files: Mapping[str, str]) -> dict[str, Any]:
    """Encode a whole machine, and the files that were written by their kinds."""
    return {
        "schema": "parakin.show/1",
        **_encode_head(machine),
        **encode_details(machine),
        "parameters": encode_parameters(machine),
        "files": dict(files),
    }


def _encode_head(machine: Machine) -> dict[str, Any]:
    spec = machine.spec
    return {
        "name": spec.name,
        "title": spec.title,
        "family": spec.family,
        "axes": list(machine.axes),
        "joints": list(machine.joints),
        "source": " ".join(spec.source.split()),
    }


def encode_details(machine: Machine) -> dict[str, Any]:
    """Encode working modes, sizes, drives, limits and home."""
    drives = [
        {
            "joint": drive.name,
            "unit": name_display_unit(drive.unit),
            **{key: to_display(getattr(drive, key), drive.unit) for key in ("low", "high", *RATES)},
            **_encode_motor(drive),
            **_encode_loads(drive),
        }
        for drive in machine.drives
    ]
    limits = [
        {
            "name": limit.name,
            "of": limit.subject,
            "side": limit.side,
            "bound": None if limit.side == "reach" else to_display(limit.bound, limit.unit),
            "unit": name_display_unit(limit.unit),
        }
        for limit in machine.limit_definitions
    ]
    home = zip(machine.axes, machine.home.tolist(), machine.axis_units, strict=True)
    return {
        "mode": machine.mode,
        "modes": list(machine.modes),
        "sizes": dict(machine.spec.sizes),
        "drives": drives,
        "limits": limits,
        "home": {axis: to_display(value, unit) for axis, value, unit in home},
    }


def encode_parameters(machine: Machine) -> list[dict[str, Any]]:
    """Encode the numbers of a machine that can be inputs."""
    return [
        {
            "name": own.name,
            "value": to_display(own.value, own.unit),
            "unit": name_display_unit(own.unit),
            "group": own.group,
        }
        for own in machine.parameters
    ]


def _encode_motor(drive: Drive) -> dict[str, Any]:
    """Encode how a controller drives a joint: counts of a motor's turn, the joint's way meanwhile, its home switch."""
    said = {key: getattr(drive, key) for key in MOTOR}
    return {
        key: to_display(value, drive.unit) if isinstance(value, float) and key != "counts" else value
        for key, value in said.items()
    }


def _encode_loads(drive: Drive) -> dict[str, float | None]:
    """Encode what a drive can give, what it adds, and how stiff it is; None for what the file does not say."""
    values = {key: getattr(drive, key) for key in LOADS}
    return {
        key: value / unit if value is not None and isfinite(value) and value > 0.0 else None
        for (key, value), unit in zip(values.items(), _LOAD_UNITS[drive.unit], strict=True)
    }
