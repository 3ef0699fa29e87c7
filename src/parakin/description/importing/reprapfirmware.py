"""RepRapFirmware's config.g of linear deltas: M665, M666 and M669."""

from __future__ import annotations

import re
from math import inf, sqrt

from ...errors import InputError, quote
from ...model.elements import Drive
from .deltas import build_tower
from .foreign_machine import ForeignMachine

_TOWERS = (210.0, 330.0, 90.0)  # deg, without corrections
_LINEAR_DELTA = "3"  # of M669's K
_TILTS = ["A", "B"]  # letters of M666
_DEFAULTS = {"L": "215", "R": "105.6", "H": "240", "B": "80"}  # what the firmware has where M665 does not say, mm


def read_reprapfirmware(text: str, source: str) -> ForeignMachine:
    """Read a linear delta from config.g; joints are its towers X, Y and Z.

    Raises :class:`InputError` for other kinematics, and for what a delta of parakin has not: tilt and more towers.
    """
    words = _Words(text, source)
    kind, line = words.get_text("M669", "K", "3" if words.has_code("M665") else "none")
    if kind != _LINEAR_DELTA:
        raise InputError(f"kinematics K{kind} can't be imported, expected a linear delta, K3", source, line)
    for key in _TILTS:
        if words.get_number("M666", key, "0") != 0.0:
            line = words.get_text("M666", key, "")[1]
            raise InputError(f"M666 {key}: a tilted bed can't be imported", source, line)
    text, line = words.get_text("M665", "L", _DEFAULTS["L"])
    rods = [words.parse_number("L", rod, line) for rod in text.split(":")]
    if len(rods) not in (1, 3):
        raise InputError(f"M665 L: {len(rods)} rods, expected one or three", source, line)
    radius, top, widest = (words.get_number("M665", key, _DEFAULTS[key]) for key in "RHB")
    bottom = words.get_number("M208", "Z", "0") if words.get_text("M208", "S", "0")[0] == "1" else 0.0
    legs = []
    for letter, angle, rod in zip("XYZ", _TOWERS, rods * (3 // len(rods)), strict=True):
        if not 0.0 < radius < rod:
            raise InputError("M665: expected rods (L) longer than the radius (R)", source, line)
        turned = angle + words.get_number("M665", letter, "0")
        high = top + sqrt(rod**2 - radius**2) + words.get_number("M666", letter, "0")
        low = bottom + sqrt(max(0.0, rod**2 - (radius + widest) ** 2))
        legs.append(build_tower(Drive(f"tower_{letter.lower()}", "mm", low, high), radius, turned, rod))
    return ForeignMachine("RepRapFirmware", "linear delta", source, "tx ty tz", tuple(legs))


class _Words:
    """The words of the codes that tell a delta, each with its line; the last one of a letter counts."""

    def __init__(self, text: str, source: str):
        self.source = source
        self.codes: dict[str, dict[str, tuple[str, int]]] = {}
        for number, line in enumerate(text.splitlines(), start=1):
            block = line.partition(";")[0].upper().strip()
            code = block.partition(" ")[0]
            if code in ("M665", "M666", "M669") or (code == "M208" and "Z" in block and re.search(r"\bS1\b", block)):
                letters = self.codes.setdefault(code, {})
                for letter, value in re.findall(r"\b([A-Z])\s*([-+0-9.:]+)", block.removeprefix(code)):
                    letters[letter] = (value, number)

    def has_code(self, code: str) -> bool:
        return code in self.codes

    def get_text(self, code: str, letter: str, default: str) -> tuple[str, int | None]:
        """Return a word's text and line."""
        return self.codes.get(code, {}).get(letter, (default, None))

    def get_number(self, code: str, letter: str, default: str) -> float:
        return self.parse_number(letter, *self.get_text(code, letter, default))

    def parse_number(self, letter: str, text: str, line: int | None) -> float:
        """Parse a number; an error names its line."""
        try:
            value = float(text)
        except ValueError:
            value = inf
        if not abs(value) < 1e9:
            raise InputError(f"{letter} {quote(text)}: a number expected", self.source, line)
        return value
