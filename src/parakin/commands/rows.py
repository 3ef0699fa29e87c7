"""Read rows of numbers from a CSV file: a header is optional, its names are matched."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np

from ..arrays import Array, Indices
from ..errors import InputError, quote, suggest
from ..toolpath.reading.text import LARGEST, open_file
from ..units import ANGLE, LENGTH, UNITS


def read_rows(path: Path, names: Sequence[str], units: Sequence[str]) -> tuple[Array, Indices]:
    """Read values (n, names) in mm and rad, and each row's line.

    Without a header there is a column for each name, in mm and degrees. A header's cells are names, in any order and
    case, with an optional unit: ``X [mm]``; columns by other names are left alone.

    Raises :class:`InputError` with file and line.
    """
    source = str(path)
    try:
        with open_table(path) as file:
            return _read_table(file, source, names, units)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", source) from error
    except UnicodeDecodeError:
        raise InputError("not a text file in UTF-8", source) from None


def open_table(path: Path) -> TextIO:
    """Open a CSV file, which is no pipe and no device: those may never end."""
    return io.TextIOWrapper(open_file(path, str(path)), encoding="utf-8-sig", newline="")


def _read_table(file: TextIO, source: str, names: Sequence[str], units: Sequence[str]) -> tuple[Array, Indices]:
    columns: list[tuple[str, int, float]] = []
    values: list[list[float]] = []
    lines: list[int] = []
    width = 0
    for line, cells in _read_lines(file, source):
        if not columns:
            header = not any(_is_number(cell) for cell in cells)
            columns = _match_columns(cells, names, units, source, line) if header else _number_columns(names, units)
            width = len(cells) if header else len(names)
            if header:
                continue
        if len(cells) != width:
            raise InputError(f"{len(cells)} value{'s' * (len(cells) != 1)}, expected {width}", source, line)
        values.append([_parse_cell(cells[index], factor, name, source, line) for name, index, factor in columns])
        lines.append(line)
    if not values:
        raise InputError(f"no rows, expected {', '.join(names)}", source)
    return np.array(values), np.array(lines)


def _read_lines(file: TextIO, source: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines that are not empty, by their numbers."""
    reader = csv.reader(file)
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                yield reader.line_num, cells
    except csv.Error as error:
        raise InputError(f"not a CSV file ({error})", source, reader.line_num) from None


def _number_columns(names: Sequence[str], units: Sequence[str]) -> list[tuple[str, int, float]]:
    return [(name, i, _find_factor(unit)) for i, (name, unit) in enumerate(zip(names, units, strict=True))]


def _find_factor(unit: str) -> float:
    return math.radians(1.0) if unit == "rad" else 1.0


def _match_columns(
    cells: Sequence[str], names: Sequence[str], units: Sequence[str], source: str, line: int
) -> list[tuple[str, int, float]]:
    header: dict[str, tuple[int, str]] = {}
    for index, cell in enumerate(cells):
        word, _, unit = cell.strip().removesuffix("]").partition("[")
        key = word.strip().lower()
        if key in header and key in (name.lower() for name in names):
            raise InputError(f"column {quote(word.strip())} is there twice", source, line)
        header[key] = index, unit.strip()
    columns = []
    for name, unit in zip(names, units, strict=True):
        if name.lower() not in header:
            raise InputError(f"no column {name}{suggest(name, [])}, expected {', '.join(names)}", source, line)
        index, own_unit = header[name.lower()]
        kind = ANGLE if unit == "rad" else LENGTH
        factor = _find_factor(unit)
        if own_unit:
            factor, dimension = UNITS.get(own_unit, (0.0, ()))
            if dimension != kind.dimension:
                raise InputError(f"column {name}: unit {quote(own_unit)}, expected one of {kind.units}", source, line)
        columns.append((name, index, factor))
    return columns


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _parse_cell(cell: str, factor: float, name: str, source: str, line: int) -> float:
    try:
        value = float(cell)
    except ValueError:
        what = quote(cell.strip()) if cell.strip() else "nothing"
        raise InputError(f"{name}: {what}, expected a number", source, line) from None
    if not abs(value) <= LARGEST:
        raise InputError(f"{name}: {quote(cell.strip())} is out of range", source, line)
    return value * factor
