"""What a page must know of a machine besides its equations, as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array, make_lattice
from ...kinematics.closure_roots import list_step_caps
from ...kinematics.wrist.pole_thresholds import PRINTED, convert_to_freedom
from ...machine import Machine
from ...performance.characteristic_length import choose_characteristic_length
from ...performance.jacobians import list_twist_names
from ...toolpath.posting.range_use import list_ranges
from ..machine.scene import Scene, build_scene
from ..machine.solids import LOOKS
from .mode_traces import list_joints_of_limit

_LATTICE = 25  # samples along each axis
_WIDER = 0.12  # of its length by which a slider goes beyond what is allowed
_FULL = np.pi


def encode_page_machine(machine: Machine) -> dict[str, Any]:
    """Encode a machine for its page: names, units, ranges, limits, modes, and the items of its scene; mm and rad."""
    scene = build_scene(machine)
    low, high = _find_axis_ranges(machine, scene.size)
    margins = machine.margins(machine.home)
    wrist = machine.wrist
    ranges, quantities = list_ranges(machine)
    rates = machine.size_rates
    return {
        "name": machine.name,
        "title": " ".join(machine.spec.title.split()),
        "source": " ".join(machine.spec.source.split()),
        "axes": [
            {"name": name, "unit": unit, "home": float(home), "low": float(a), "high": float(b)}
            for name, unit, home, a, b in zip(machine.axes, machine.axis_units, machine.home, low, high, strict=True)
        ],
        "joints": [
            {
                "name": drive.name,
                "unit": drive.unit,
                "low": _replace_infinite(drive.low),
                "high": _replace_infinite(drive.high),
                "leg": leg,
            }
            for drive, leg in zip(machine.drives, _list_legs(machine), strict=True)
        ],
        "mode": encode_mode(machine.mode),
        "signs": _name_signs(machine),
        "fixed_signs": machine.fixed_signs,
        "limits": [
            {
                "name": limit.name,
                "subject": limit.subject,
                "unit": limit.unit,
                "side": limit.side,
                "bound": limit.bound,
                "joints": [machine.joints.index(name) for name in list_joints_of_limit(machine, limit)],
                "atHome": max(float(margin), 1e-9),
                "span": None if quantity < 0 else ranges[quantity].span,
            }
            for limit, margin, quantity in zip(machine.limit_definitions, margins.tolist(), quantities, strict=True)
        ],
        "sizes": [
            {"name": name, "unit": unit, "nominal": value, "follows": follows}
            for name, unit, value, follows in zip(rates.names, rates.units, rates.nominal, rates.follows, strict=True)
        ],
        "fixedSizes": list(machine.fixed_sizes),
        "wrist": None
        if wrist is None
        else {"first": wrist.first, "second": wrist.second, "free": float(convert_to_freedom(PRINTED))},
        "legJoints": machine.leg_count,
        "redundant": machine.is_redundant,
        "parallelColumns": machine.parallel_block[1],
        "twist": list(list_twist_names(machine)),
        "length": choose_characteristic_length(machine).factor,
        "caps": list_step_caps(machine.structure.coordinates, max(machine.leg_sizes)),
        "tolerance": machine.closure_tolerance,
        **_encode_scene(machine, scene),
    }


def encode_mode(mode: str) -> list[int]:
    """Encode a working mode as 1 and -1."""
    return [1 if sign == "+" else -1 for sign in mode]


def _replace_infinite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _encode_scene(machine: Machine, scene: Scene) -> dict[str, Any]:
    place = scene.workpiece
    tip = place[:, :3].T @ (scene.frames["tool"][:, 3] - place[:, 3])
    return {
        "size": scene.size,
        "box": scene.box.tolist(),
        "normal": None if scene.normal is None else scene.normal.tolist(),
        "tip": tip.tolist(),
        "items": [
            {"kind": item.kind, "name": item.name, "points": len(item.points), "closed": item.closed}
            for item in scene.items
        ],
        "looks": {kind: [look.colour, look.radius] for kind, look in LOOKS.items()},
    }


def _list_legs(machine: Machine) -> list[int]:
    """List the number of each drive's leg; -1 for those of head and table."""
    legs = {drive.name: number for number, leg in enumerate(machine.legs) for drive in leg.drives}
    return [legs.get(name, -1) for name in machine.joints]


def _name_signs(machine: Machine) -> list[str]:
    """Name what each sign of the working mode chooses."""
    names = []
    for leg in machine.legs:
        drives = ", ".join(drive.name for drive in leg.drives)
        names += [
            drives if len(leg.branches) == 1 else f"{drives} ({number})" for number in range(1, len(leg.branches) + 1)
        ]
    return names + ["wrist"] * (len(machine.mode) - len(names))


def _find_axis_ranges(machine: Machine, size: float) -> tuple[Array, Array]:
    """Find ranges (axes,) for sliders: what is allowed at home's orientation, or at home's place, and some more.

    They are looked for on a lattice, and bound nothing else.
    """
    units = np.array(machine.axis_units)
    low, high = machine.home.copy(), machine.home.copy()
    places = np.flatnonzero(units == "mm")
    low[places], high[places] = machine.home[places] - size, machine.home[places] + size
    for _ in range(2):  # the second time on a lattice as small as what the first one found
        lattice = [np.linspace(low[axis], high[axis], _LATTICE) for axis in places]
        poses = np.tile(machine.home, (_LATTICE ** len(places), 1))
        poses[:, places] = make_lattice(lattice)
        allowed = np.vstack([machine.home, poses[machine.check(poses) == 0]])[:, places]
        step = (high[places] - low[places]) / (_LATTICE - 1)
        low[places], high[places] = allowed.min(0) - step, allowed.max(0) + step
    widen = _WIDER * (high - low)
    low[places], high[places] = (low - widen)[places], (high + widen)[places]
    for axis in np.flatnonzero(units == "rad"):
        low[axis], high[axis] = _find_turn_range(machine, int(axis))
    return low, high


def _find_turn_range(machine: Machine, axis: int) -> tuple[float, float]:
    """Find a range, rad, for the slider of a turning axis from home: twice what is allowed, half a turn at most."""
    if machine.direction is not None and axis == machine.direction.c:
        return -_FULL, _FULL
    turns = np.linspace(0.0, _FULL, 181)
    ends = []
    for way in (-1.0, 1.0):
        poses = np.tile(machine.home, (len(turns), 1))
        poses[:, axis] += way * turns
        broken = np.flatnonzero(machine.check(poses))
        ends.append(turns[broken[0]] if len(broken) else _FULL)
    reach = min(_FULL, 2.0 * max(*ends, 0.1))
    return float(machine.home[axis] - reach), float(machine.home[axis] + reach)
