"""Klipper's printer.cfg of the kinematics delta and rotary_delta."""

from __future__ import annotations

from math import atan2, inf, sqrt
from pathlib import Path

from ...errors import InputError, quote
from ...model.elements import Drive
from .configuration_text import check_beside, read_configuration
from .deltas import ArmSizes, build_arm, build_tower
from .foreign_machine import ForeignMachine

_TOWERS = (210.0, 330.0, 90.0)  # deg, where the file gives no angle
_ARMS = (30.0, 150.0, 270.0)
_STEPPERS = ("stepper_a", "stepper_b", "stepper_c")


class _Sections:
    """The sections of a file and of those that it includes, each option with its place; the last one counts."""

    def __init__(self, path: Path, text: str):
        self.folder, self.source = path.parent, str(path)
        self.values: dict[tuple[str, str], tuple[str, tuple[str, int]]] = {}
        self.missing: tuple[str, ...] = ()
        self._read(path, text, (path.resolve(),))

    def _read(self, path: Path, text: str, within: tuple[Path, ...]) -> None:
        """Read a file, and at its place each that it includes; what SAVE_CONFIG has appended stands below."""
        section = ""
        for number, whole in enumerate(text.splitlines(), start=1):
            line = whole.removeprefix("#*#").partition("#")[0].partition(";")[0].rstrip()
            if line.lstrip().startswith("["):
                section = line.strip().strip("[]").strip()
                word, _, pattern = section.partition(" ")
                if word == "include" and pattern:
                    self._include(path, pattern.strip(), number, within)
            elif (line.strip() and not line[:1].isspace()) or whole.startswith("#*#"):
                key, _, value = line.replace("=", ":", 1).partition(":")
                self.values[section, key.strip().lower()] = (value.strip(), (str(path), number))

    def _include(self, path: Path, pattern: str, line: int, within: tuple[Path, ...]) -> None:
        """Read the files that a pattern names; remember one that is not there."""
        check_beside(path.parent / pattern, (self.folder,), "include", str(path), line)  # no folder elsewhere is listed
        try:
            files = sorted(path.parent.glob(pattern))
        except (ValueError, NotImplementedError) as error:  # ** beside other letters, or an absolute path
            raise InputError(f"include {quote(pattern)}: can't be followed", str(path), line) from error
        if not files and not any(letter in pattern for letter in "*?["):
            self.missing += (pattern,)
        for file in files:
            chosen = check_beside(file, (self.folder,), "include", str(path), line)
            if chosen.resolve() in within:
                raise InputError(f"include {quote(pattern)}: the file includes itself", str(path), line)
            self._read(chosen, read_configuration(chosen), (*within, chosen.resolve()))

    def _tell_lack(self, section: str, key: str) -> InputError:
        """Tell an option that is nowhere, and the files where it may be."""
        files = f" (not there: {', '.join(self.missing)})" if self.missing else ""
        return InputError(f"[{section}] has no {key}{files}", self.source)

    def get_text(self, section: str, key: str) -> str:
        if (section, key) not in self.values:
            raise self._tell_lack(section, key)
        return self.values[section, key][0]

    def get_number(self, section: str, key: str, default: float | None = None, above: float = -inf) -> float:
        """Return a number; ``default`` where it is not given, and an error where there is none."""
        if (section, key) not in self.values:
            if default is None:
                raise self._tell_lack(section, key)
            return default
        text, place = self.values[section, key]
        try:
            value = float(text)
        except ValueError:
            value = inf
        if not above < value < 1e9:
            expected = "a number" if above == -inf else f"a number above {above:g}"
            raise InputError(f"{key} {quote(text)}: {expected} expected", *place)
        return value


def read_klipper(path: Path, text: str) -> ForeignMachine:
    """Read a machine from Klipper's configuration; joints are its steppers a, b and c.

    Raises :class:`InputError` for other kinematics.
    """
    sections = _Sections(path, text)
    kinematics = sections.get_text("printer", "kinematics")
    if kinematics == "delta":
        return _build_delta(sections)
    if kinematics == "rotary_delta":
        return _build_rotary_delta(sections)
    place = sections.values["printer", "kinematics"][1]
    raise InputError(f"kinematics {quote(kinematics)} can't be imported, expected delta or rotary_delta", *place)


def _build_delta(sections: _Sections) -> ForeignMachine:
    """Build towers whose carriages go from the lowest that Klipper's own limits of a pose ask for to their endstops."""
    radius = sections.get_number("printer", "delta_radius", above=0.0)
    widest = radius + sections.get_number("printer", "print_radius", radius, above=0.0)
    bottom = sections.get_number("printer", "minimum_z_position", 0.0)
    rod_a = sections.get_number("stepper_a", "arm_length", above=radius)
    top_a = sections.get_number("stepper_a", "position_endstop")
    legs = []
    for section, usual in zip(_STEPPERS, _TOWERS, strict=True):
        rod = sections.get_number(section, "arm_length", rod_a, above=radius)
        top = sections.get_number(section, "position_endstop", top_a) + sqrt(rod**2 - radius**2)
        low = bottom + sqrt(max(0.0, rod**2 - widest**2))
        angle = sections.get_number(section, "angle", usual)
        legs.append(build_tower(Drive(section, "mm", low, top), radius, angle, rod))
    return ForeignMachine("Klipper", "delta", sections.source, "tx ty tz", tuple(legs), missing=sections.missing)


def _build_rotary_delta(sections: _Sections) -> ForeignMachine:
    """Build arms below their shoulders, which go up to their endstops."""
    radius = sections.get_number("printer", "shoulder_radius", above=0.0)
    height = sections.get_number("printer", "shoulder_height", above=0.0)
    upper_a, lower_a = (
        sections.get_number("stepper_a", key, above=0.0) for key in ("upper_arm_length", "lower_arm_length")
    )
    top_a = sections.get_number("stepper_a", "position_endstop")
    legs = []
    for section, usual in zip(_STEPPERS, _ARMS, strict=True):
        upper = sections.get_number(section, "upper_arm_length", upper_a, above=0.0)
        lower = sections.get_number(section, "lower_arm_length", lower_a, above=0.0)
        angle = sections.get_number(section, "angle", usual)
        top = sections.get_number(section, "position_endstop", top_a)
        drive = Drive(section, "rad", -inf, _find_elbow_angle(-radius, top - height, upper, lower, sections.source))
        sizes = ArmSizes(upper, lower, 0.0)
        legs.append(build_arm(drive, (radius, 0.0, height), angle, sizes, rises=True, platform_above=False))
    return ForeignMachine(
        "Klipper", "rotary_delta", sections.source, "tx ty tz", tuple(legs), side=1, missing=sections.missing
    )


def _find_elbow_angle(x: float, y: float, upper: float, lower: float, source: str) -> float:
    """Find the upper arm's angle where the lower one reaches (x, y), mm from the shoulder, with the elbow outward."""
    square = x * x + y * y
    m = (square + upper**2 - lower**2) / (2.0 * upper)
    if m * m >= square:
        raise InputError("the arms do not reach the endstops' position", source)
    root = sqrt(square - m * m)
    return atan2(y * m + x * root, x * m - y * root)
