"""RepRapFirmware's config.g of linear deltas: M665, M666 and M669, and the files that it reads."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import inf, sqrt
from pathlib import Path

from ...errors import InputError, quote
from ...model.elements import Drive
from .configuration_text import check_beside, read_configuration
from .deltas import build_tower
from .foreign_machine import ForeignMachine

_TOWERS = (210.0, 330.0, 90.0)  # deg, without corrections
_LINEAR_DELTA = "3"  # of M669's K
_TILTS = ["A", "B"]  # letters of M666
_DEFAULTS = {"L": "215", "R": "105.6", "H": "240", "B": "80"}  # what the firmware has where M665 does not say, mm
_OVERRIDE = "config-override.g"  # what M501 reads, and M500 has written
_DEPTH = 8  # of files that call files, as deep as the firmware goes


def read_reprapfirmware(path: Path, text: str) -> ForeignMachine:
    """Read a linear delta from config.g; joints are its towers X, Y and Z.

    Raises :class:`InputError` for other kinematics, and for what a delta of parakin has not: tilt and more towers.
    """
    words, source = _Words(path, text), str(path)
    if not (words.has_code("M665") or words.has_code("M669")):
        raise InputError("neither M665 nor M669 tells a linear delta" + words.tell_missing(), source)
    kind, place = words.get_text("M669", "K", _LINEAR_DELTA if words.has_code("M665") else "0")
    if kind != _LINEAR_DELTA:
        raise InputError(f"kinematics K{kind} can't be imported, expected a linear delta, K3", *place)
    for key in _TILTS:
        if words.get_number("M666", key, "0") != 0.0:
            raise InputError(f"M666 {key}: a tilted bed can't be imported", *words.get_text("M666", key, "")[1])
    text, place = words.get_text("M665", "L", _DEFAULTS["L"])
    rods = [words.parse_number("L", rod, place) for rod in text.split(":")]
    if len(rods) not in (1, 3):
        raise InputError(f"M665 L: {len(rods)} rods, expected one or three", *place)
    radius, top, widest = (words.get_number("M665", key, _DEFAULTS[key]) for key in "RHB")
    bottom = words.get_number("M208", "Z", "0")
    legs = []
    for letter, angle, rod in zip("XYZ", _TOWERS, rods * (3 // len(rods)), strict=True):
        if not 0.0 < radius < rod:
            raise InputError("M665: expected rods (L) longer than the radius (R)", *place)
        turned = angle + words.get_number("M665", letter, "0")
        high = top + sqrt(rod**2 - radius**2) + words.get_number("M666", letter, "0")
        low = bottom + sqrt(max(0.0, rod**2 - (radius + widest) ** 2))
        if not low < high:
            raise InputError(f"M665: tower {letter} has no stroke above the bed", *place)
        legs.append(build_tower(Drive(f"tower_{letter.lower()}", "mm", low, high), radius, turned, rod))
    return ForeignMachine("RepRapFirmware", "linear delta", source, "tx ty tz", tuple(legs), missing=words.missing)


class _Words:
    """The words of the codes that tell a delta, each with its file and line; the last one of a letter counts."""

    def __init__(self, path: Path, text: str):
        self.folder, self.source = path.parent, str(path)
        self.codes: dict[str, dict[str, tuple[str, tuple[str, int | None]]]] = {}
        self.missing: tuple[str, ...] = ()
        self._read(text, self.source, 1)

    def _read(self, text: str, source: str, depth: int) -> None:
        for number, line in enumerate(text.splitlines(), start=1):
            for code, arguments in _split_codes(line):
                if code == "M501":
                    self._call(_OVERRIDE, source, number, depth)
                elif code == "M98":
                    match = re.search(r'P"(?:\d:)?/*(?:sys/)?([^"]+)"', arguments, re.IGNORECASE)
                    if match:
                        self._call(match[1], source, number, depth)
                elif code in ("M665", "M666", "M669", "M208"):
                    self._take(code, arguments.upper(), (source, number))

    def _call(self, name: str, source: str, line: int, depth: int) -> None:
        """Read a file that this one calls, from its own folder; remember one that is not there."""
        file = check_beside(self.folder / name, (self.folder,), "M98", source, line)
        if not file.is_file():
            self.missing += (name,)
        elif depth < _DEPTH:
            self._read(read_configuration(file), str(file), depth + 1)

    def _take(self, code: str, arguments: str, place: tuple[str, int | None]) -> None:
        """Take a code's words. Of M208 only the lowest Z counts: ``Z-1 S1``, or ``Z-1:300``."""
        words = dict(re.findall(r"(?<![A-Z])([A-Z])\s*(\{|[-+0-9.:E]+)", arguments))
        if code == "M208":
            low, colon, _ = words.get("Z", "").partition(":")
            words = {"Z": low} if low and (colon or words.get("S") == "1") else {}
        letters = self.codes.setdefault(code, {})
        for letter, value in words.items():
            if value == "{":
                raise InputError(f"{code} {letter}: an expression can't be imported, write the number", *place)
            letters[letter] = (value, place)

    def has_code(self, code: str) -> bool:
        return code in self.codes

    def tell_missing(self) -> str:
        """Tell the files that were called and are not there, as a message ends."""
        return f" (not there: {', '.join(self.missing)})" if self.missing else ""

    def get_text(self, code: str, letter: str, default: str) -> tuple[str, tuple[str, int | None]]:
        """Return a word's text, its file and its line."""
        return self.codes.get(code, {}).get(letter, (default, (self.source, None)))

    def get_number(self, code: str, letter: str, default: str) -> float:
        return self.parse_number(letter, *self.get_text(code, letter, default))

    def parse_number(self, letter: str, text: str, place: tuple[str, int | None]) -> float:
        """Parse a number; an error names its line."""
        try:
            value = float(text)
        except ValueError:
            value = inf
        if not abs(value) < 1e9:
            raise InputError(f"{letter} {quote(text)}: a number expected", *place)
        return value


def _split_codes(line: str) -> Iterator[tuple[str, str]]:
    """Split a line into its codes, each with its arguments; quoted text and comments hold none."""
    plain = re.sub(r'"[^"]*"', lambda match: "_" * len(match[0]), line).partition(";")[0]
    starts = list(re.finditer(r"(?<![A-Za-z0-9_{.])([GMT]\d+)(?![\d.])", plain, re.IGNORECASE))
    for i, match in enumerate(starts):
        end = starts[i + 1].start() if i + 1 < len(starts) else len(plain)
        yield match[1].upper(), line[match.end() : end]
