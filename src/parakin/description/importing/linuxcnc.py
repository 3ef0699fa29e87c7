"""LinuxCNC's HAL and ini files of genhexkins, pentakins, tripodkins, lineardeltakins and rotarydeltakins."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf, radians
from pathlib import Path

from ...errors import InputError, quote
from ...model.elements import Drive, Point, Size
from ...model.legs.length import Length
from ...model.legs.ring import Ring
from ...units import INCH
from .configuration_text import check_beside, read_configuration
from .deltas import ArmSizes, build_arm, build_tower
from .foreign_machine import ForeignMachine

_LIBRARY = Path("/usr/share/linuxcnc/hallib")
_UNITS = {"mm": 1.0, "metric": 1.0, "cm": 10.0, "inch": INCH, "in": INCH, "imperial": INCH}
# The modules' own values, in the machine's units, where nothing sets a pin.
_BASE = [(-22.95, 13.25), (22.95, 13.25), (22.95, 13.25), (0.0, -26.5), (0.0, -26.5), (-22.95, 13.25)]
_PLATFORM = [(-1.0, 11.5), (1.0, 11.5), (10.459, -4.884), (9.459, -6.616), (-9.459, -6.616), (-10.459, -4.884)]
_PENTAPOD_BASE = [(-418.03, 324.56), (417.96, 324.56), (-418.03, -325.44), (417.96, -325.44), (-0.06, -492.96)]
_RING_HEIGHTS = [-185.5, -159.5, -67.5, -41.5, -14.0]
_PENTAPOD_TOP, _RING_RADIUS = 895.56, 80.32

Ini = Mapping[str, Mapping[str, list[str]]]


@dataclass(frozen=True)
class _Configuration:
    """What ini and HAL files say: pins by name, sections, mm of a unit of length."""

    source: str
    ini: Ini
    pins: Mapping[str, tuple[str, str, int]]  # value, file, line
    unit: float

    def get_pin(self, name: str, default: float) -> float:
        """Return a pin's value; the module's own where nothing sets it."""
        if name not in self.pins:
            return default
        text, file, line = self.pins[name]
        match = re.fullmatch(r"\[(\w+)\](\w+)", text)
        if match:
            values = self.ini.get(match[1], {}).get(match[2])
            if not values:
                raise InputError(f"{quote(text)} is not in the ini file", file, line)
            text = values[0]
        return _parse_number(text, file, line)

    def get_axis_limits(self, axis: str) -> tuple[float, float]:
        """Return the limits of X, Y or Z, mm; infinite where the ini file has none."""
        section = self.ini.get(f"AXIS_{axis}", {})
        low, high = (
            self.unit * _parse_number(section[key][0], self.source) if section.get(key) else default
            for key, default in (("MIN_LIMIT", -inf), ("MAX_LIMIT", inf))
        )
        return low, high

    def make_drive(self, joint: int, unit: str) -> Drive:
        """Make the drive of a joint with the limits of its section."""
        section = self.ini.get(f"JOINT_{joint}", {})
        scale = self.unit if unit == "mm" else radians(1.0)

        def read(key: str, default: float) -> float:
            values = section.get(key)
            return default if not values else scale * _parse_number(values[0], self.source)

        return Drive(
            f"joint{joint}", "mm" if unit == "mm" else "rad", read("MIN_LIMIT", -inf), read("MAX_LIMIT", inf),
            read("MAX_VELOCITY", inf), read("MAX_ACCELERATION", inf),
        )  # fmt: skip


def read_linuxcnc(path: Path, text: str, unit: str | None) -> ForeignMachine:
    """Read a machine from an ini file with the HAL files that it names, or from a HAL file alone.

    unit : ``mm`` or ``inch`` of lengths; by default the ini file's, of a HAL file alone it has to be given
    """
    source = str(path)
    ini = _parse_ini(text) if path.suffix.lower() == ".ini" else {}
    pins: dict[str, tuple[str, str, int]] = {}
    missing: tuple[str, ...] = ()
    if ini:
        for name in (words.split()[0] for words in ini.get("HAL", {}).get("HALFILE", []) if words):
            if not name.endswith(".hal"):
                continue  # a program, which may do anything
            file = _find_hal_file(path.parent, name, source)
            if file is None:
                missing += (name,)
            else:
                pins |= _parse_hal(read_configuration(file), str(file))
    else:
        pins = _parse_hal(text, source)
    words = ini.get("KINS", {}).get("KINEMATICS") or [pin.partition(".")[0] for pin in pins] or [""]
    names = dict.fromkeys(word.split()[0] for word in words if word.split())
    kinematics = next((name for name in names if name in _MODULES), None)
    if kinematics is None:
        named = next(iter(names), "none")
        raise InputError(f"kinematics {quote(named)} can't be imported, expected one of {', '.join(_MODULES)}", source)
    given = unit or next(iter(ini.get("TRAJ", {}).get("LINEAR_UNITS", [])), None)
    if given is None:
        raise InputError("no unit of length in a HAL file alone: give --units mm or inch", source)
    if given.lower() not in _UNITS:
        raise InputError(f"unit {quote(given)}: expected mm or inch", source)
    configuration = _Configuration(source, ini, pins, _UNITS[given.lower()])
    machine = _MODULES[kinematics](configuration)
    return replace(machine, box=tuple(configuration.get_axis_limits(axis) for axis in "XYZ"), missing=missing)


def _parse_ini(text: str) -> dict[str, dict[str, list[str]]]:
    """Parse sections with keys that may stand several times."""
    sections: dict[str, dict[str, list[str]]] = {}
    keys: dict[str, list[str]] = {}
    for line in text.splitlines():
        line = line.strip()
        if line.startswith("["):
            keys = sections.setdefault(line.strip("[]").strip(), {})
        elif "=" in line and not line.startswith(("#", ";")):
            key, _, value = line.partition("=")
            keys.setdefault(key.strip(), []).append(value.partition("#")[0].strip())
    return sections


def _parse_hal(text: str, file: str) -> dict[str, tuple[str, str, int]]:
    """Parse the pins that ``setp`` sets, and modules that ``loadrt`` loads, as pins without a value."""
    pins: dict[str, tuple[str, str, int]] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.partition("#")[0].replace("=", " ").split()
        if len(words) >= 3 and words[0] == "setp":
            pins[words[1]] = (words[2], file, number)
        elif len(words) >= 2 and words[0] == "loadrt":
            pins.setdefault(words[1], ("", file, number))
    return pins


def _find_hal_file(folder: Path, name: str, source: str) -> Path | None:
    """Find a HAL file beside the ini file, or in LinuxCNC's library; None for one that is not there."""
    file = _LIBRARY / name.removeprefix("LIB:") if name.startswith("LIB:") else folder / name
    chosen = next((candidate for candidate in (file, _LIBRARY / name) if candidate.is_file()), None)
    return None if chosen is None else check_beside(chosen, (folder, _LIBRARY), "HALFILE", source)


def _parse_number(text: str, file: str, line: int | None = None) -> float:
    try:
        value = float(text)
    except ValueError:
        value = inf
    if not abs(value) < 1e9:
        raise InputError(f"{quote(text)}: a number expected", file, line)
    return value


def _build_genhexkins(given: _Configuration) -> ForeignMachine:
    if given.get_pin("genhexkins.screw-lead", 0.0) != 0.0:
        raise InputError(
            "screw-lead turns the struts' screws with the platform, which parakin does not know", given.source
        )
    shift = given.get_pin("genhexkins.spindle-offset", 0.0) + given.get_pin("genhexkins.tool-offset", 0.0)

    def read_point(side: str, strut: int, default: tuple[float, float]) -> Point:
        pins = [f"genhexkins.{side}.{strut}.{axis}" for axis in "xyz"]
        x, y, z = (given.get_pin(pin, own) for pin, own in zip(pins, (*default, 0.0), strict=True))
        return Point((given.unit * x, given.unit * y, given.unit * (z + shift)))

    legs = tuple(
        Length((given.make_drive(i, "mm"),), read_point("platform", i, _PLATFORM[i]), read_point("base", i, _BASE[i]))
        for i in range(6)
    )
    return ForeignMachine(
        "LinuxCNC", "genhexkins", given.source, "tx ty tz rz ry rx", legs, side=1, turning_axes=("A", "B", "C")
    )


def _build_pentakins(given: _Configuration) -> ForeignMachine:
    shift = given.get_pin("pentakins.tool-offset", 0.0)
    legs = []
    for i, side in enumerate(_PENTAPOD_BASE):
        own = zip("xyz", (*side, _PENTAPOD_TOP), strict=True)
        x, y, z = (given.get_pin(f"pentakins.base.{i}.{axis}", default) for axis, default in own)
        radius = given.get_pin(f"pentakins.effector.{i}.r", _RING_RADIUS)
        height = given.get_pin(f"pentakins.effector.{i}.z", _RING_HEIGHTS[i]) + shift
        if radius <= 0.0:
            raise InputError(f"pentakins.effector.{i}.r: a radius above 0 expected", given.source)
        centre = Point((0.0, 0.0, given.unit * height))
        foot = Point((given.unit * x, given.unit * y, given.unit * (z + shift)))
        legs.append(Ring((given.make_drive(i, "mm"),), centre, foot, Size(given.unit * radius)))
    level = sum(leg.foot[2] for leg in legs) / len(legs)
    return ForeignMachine(
        "LinuxCNC",
        "pentakins",
        given.source,
        "tx ty tz ry rx",
        tuple(legs),
        side=-1,
        level=level,
        turning_axes=("B", "C"),
    )


def _build_tripodkins(given: _Configuration) -> ForeignMachine:
    bx, cx, cy = (given.unit * given.get_pin(f"tripodkins.{name}", 1.0) for name in ("Bx", "Cx", "Cy"))
    feet = [Point((0.0, 0.0, 0.0)), Point((bx, 0.0, 0.0)), Point((cx, cy, 0.0))]
    middle = Point((0.0, 0.0, 0.0))
    legs = tuple(Length((given.make_drive(i, "mm"),), middle, foot) for i, foot in enumerate(feet))
    return ForeignMachine("LinuxCNC", "tripodkins", given.source, "tx ty tz", legs, side=1)


def _build_lineardeltakins(given: _Configuration) -> ForeignMachine:
    radius, rod = (
        given.unit * given.get_pin(f"lineardeltakins.{name}", own) for name, own in (("R", 130.25), ("L", 269.0))
    )
    offsets = [given.unit * given.get_pin(f"lineardeltakins.J{i}off", 0.0) for i in range(3)]
    legs = tuple(
        build_tower(given.make_drive(i, "mm"), radius, angle, rod, offsets[i])
        for i, angle in enumerate((90.0, 210.0, 330.0))
    )
    return ForeignMachine("LinuxCNC", "lineardeltakins", given.source, "tx ty tz", legs)


def _build_rotarydeltakins(given: _Configuration) -> ForeignMachine:
    names = (("platformradius", 10.0), ("thighlength", 10.0), ("shinlength", 14.0), ("footradius", 6.0))
    radius, thigh, shin, foot = (given.unit * given.get_pin(f"rotarydeltakins.{name}", own) for name, own in names)
    sizes, hip = ArmSizes(thigh, shin, foot), (radius, 0.0, 0.0)
    legs = tuple(
        build_arm(given.make_drive(i, "deg"), hip, angle, sizes, rises=False, platform_above=False)
        for i, angle in enumerate((270.0, 30.0, 150.0))
    )
    return ForeignMachine("LinuxCNC", "rotarydeltakins", given.source, "tx ty tz", legs, side=-1)


_MODULES: dict[str, Callable[[_Configuration], ForeignMachine]] = {
    "genhexkins": _build_genhexkins,
    "lineardeltakins": _build_lineardeltakins,
    "pentakins": _build_pentakins,
    "rotarydeltakins": _build_rotarydeltakins,
    "tripodkins": _build_tripodkins,
}
