"""What the tests of G-code share: a whole program, and readings with and without the fast reader."""

import re

import numpy as np
import pytest

from parakin.errors import InputError
from parakin.toolpath.reading.gcode import reader as gcode
from parakin.toolpath.reading.gcode.reader import read_gcode

COLUMNS = ("tip", "axis", "line", "rapid", "feed", "spindle", "turns", "seconds")

SHIFTED = np.column_stack([np.eye(3), [100.0, 0.5, -1400.0]])  # a workpiece
SAMPLE = """\
%
(A pocket in two depths)
N10 G21 G17 G40 G49 G80 G90 G94 G98 ; as every program begins
N20 G54 G64 P0.02 Q0.01
N30 T3 M6 (MSG, the 6 mm mill)
N40 S12000 M3
N50 G43 H3
N60 G0 X10 Y0 Z50 M8
N70 Z2
N80 G1 Z-1 F300
N90 G3 X0 Y10 I-10 J0 F800
N100 G1 X-20.
/N110 G1 Y.5
N120 G4 P0.5
N130 G0 Z50 M9
N140 M5
N150 M30
%
"""


def text_reader(folder):
    """A function that reads a text as a file of a folder."""

    def reads(text, **options):
        path = folder / "part.ngc"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_gcode(path, **options)

    return reads


def both_reader(folder, monkeypatch):
    """With and without the fast reader; the same path or the same error, or it fails."""
    read = text_reader(folder)
    plain = gcode.read_plain_lines

    def reads(text, **options):
        results = []
        for run in (plain, lambda lines, at, first, motion: at):
            monkeypatch.setattr(gcode, "read_plain_lines", run)
            try:
                results.append(read(text, **options))
            except InputError as error:
                results.append(str(error))
        fast, slow = results
        if isinstance(slow, str) or isinstance(fast, str):
            assert fast == slow
            raise InputError(slow)
        same(fast, slow)
        return slow

    return reads


def same(fast, slow):
    for name in COLUMNS:
        a, b = getattr(fast, name), getattr(slow, name)
        assert (a is None) == (b is None), name
        if a is not None:
            assert a.tobytes() == b.tobytes(), (name, a, b)  # to the bit
            assert a.dtype == b.dtype and a.shape == b.shape and a.flags.c_contiguous
    for name in ("events", "notes", "tool", "units", "frame"):
        assert getattr(fast, name) == getattr(slow, name)


def told(path):
    return [(e.record, e.line, e.text) for e in path.events]


def notes(path):
    """Notes but for the three that nearly every snippet here earns."""
    return [n for n in path.notes if not n.text.startswith(("no G20", "the program ends", "A, B or C without"))]


def refused(read, text, line, *words, **options):
    with pytest.raises(InputError) as caught:
        read(text, **options)
    message = str(caught.value)
    assert "\n" not in message and message.isprintable()
    assert caught.value.line == line, message
    place = caught.value.source + (f":{line}: " if line else ": ")
    assert message.startswith(place)
    for word in words:
        assert word in message.removeprefix(place), message
    return message


def both_error(both):
    """The same error either way, with its place."""

    def reads(text, **options):
        try:
            return both(text, **options)
        except InputError as error:
            found = re.fullmatch(r"(.*?\.ngc)(?::(\d+))?: (.*)", str(error), re.DOTALL)
            raise InputError(found[3], found[1], found[2] and int(found[2])) from error

    return reads
