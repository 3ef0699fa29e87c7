"""G-code: random programs against what they were made from, the fast reader against the block reader, and fuzz."""

import io
import random
import tracemalloc

import numpy as np
import pytest
from gcode_model import Program
from gcode_reading import COLUMNS, SHIFTED, both_error, both_reader, refused, same, text_reader

from parakin.errors import InputError
from parakin.toolpath.reading.gcode import motion as gcode_motion
from parakin.toolpath.reading.gcode import reader as gcode
from parakin.toolpath.reading.gcode.reader import read_gcode


@pytest.fixture
def read(tmp_path):
    return text_reader(tmp_path)


@pytest.fixture
def both(tmp_path, monkeypatch):
    return both_reader(tmp_path, monkeypatch)


# random programs


def test_random_programs_against_their_model(both):
    arcs = 0
    for seed in range(150):
        program = Program(seed)
        path = both(program.text, arc_tolerance=0.05)
        program.verify(path)
        arcs += program.arcs
    assert arcs > 500


# large files, memory, progress


def test_progress_and_many_blocks(tmp_path, monkeypatch):
    monkeypatch.setattr(gcode, "READ_SIZE", 1000)
    path = tmp_path / "a.ngc"
    path.write_text("G0 X0 Y0 Z0\nF5\nG1\n" + "".join(f"X{k} Y-.5\nG2 X{k} I1\nG1\n" for k in range(1, 300)) + "M2\n")
    seen = []
    p = read_gcode(path, progress=seen.append, arc_tolerance=1.0)
    assert seen == sorted(seen) and seen[-1] == 1.0 and len(seen) > 5 and seen[0] < 0.5
    monkeypatch.setattr(gcode, "READ_SIZE", 1 << 20)
    same(p, read_gcode(path, arc_tolerance=1.0))
    assert p.line[-1] == 3 + 298 * 3 + 2 and len(p) == 1 + 299 * 9


def test_an_error_far_into_a_large_file(tmp_path):
    path = tmp_path / "big.ngc"
    lines = ["G0 X0 Y0 Z0", "F5", "G1", *["X12.3456 Y-.5 Z1"] * 100_000]
    lines[50_000] = "X1 Y#<b>"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"big\.ngc:50001: #<b> is not set"):
        read_gcode(path)


def test_arcs_do_not_fill_the_memory(read, monkeypatch):
    monkeypatch.setattr(gcode_motion, "_MOST_POINTS", 1000)
    refused(read, "G0 X0 Y0\nF5\n" + "G2 I50 P3\n" * 9, 5, "1000 points in all", "coarser", arc_tolerance=0.01)


def test_memory_is_a_few_times_the_columns(tmp_path):
    path = tmp_path / "big.ngc"
    path.write_text("G21 G0 X0 Y0 Z0 A0\nF5\nG1\n" + "X123.4567 Y-12.3456 Z1.2345 A12.34\n" * 30_000)
    tracemalloc.start()
    p = read_gcode(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    columns = sum(getattr(p, name).nbytes for name in COLUMNS if getattr(p, name) is not None)
    assert peak < 3.5 * columns + 1.6e7


@pytest.mark.parametrize("text", ["X" * 1_000_000, "G0 X" + "1" * 1_000_000, " " * 1_000_000 + "!", "(" * 1_000_000])
def test_long_lines_end_soon(both, text):
    for begin, line in (("", 1), ("G0 X1\n", 2)):
        for after in ("", "\nG0 X1\n"):
            refused(both_error(both), begin + text + after, line)


# fuzz

ALPHABET = b"GMXYZABCIJKRFSTPNHQ0123456789.-+ %/();#[]\n\r\t"
PIECES = [
    b"G0", b"G1", b"G2", b"G3", b"G17", b"G18", b"G19", b"G20", b"G21", b"G90", b"G91", b"G93", b"G94", b"G53", b"G54",
    b"G43.1", b"G64", b"G4", b"G80", b"G90.1", b"M3", b"M30", b"M2", b"X1", b"Y-2.5", b"Z.5", b"A30", b"B-7", b"C370",
    b"I5", b"J-5", b"K1", b"R7", b"R-7", b"F100", b"F0", b"P2", b"S5", b"T1", b"H1", b"\n", b"\n", b"\n", b"(MSG,a)",
    b"%", b"X999999999", b"R1e9", b"/", b";", b"P999999999", b"X0.0000001", b"I1e-9", b"TRAORI",
]  # fmt: skip


def taken(data, tolerance=1.0):
    """Read bytes, both ways; anything but a path or one line of an error is a failure."""
    results = []
    for run in (PLAIN, lambda lines, at, first, motion: at):
        gcode.read_plain_lines = run
        try:
            with np.errstate(all="ignore"):
                results.append(
                    gcode.GcodeReader("f", len(data), tolerance, SHIFTED).read(io.BytesIO(data), lambda fraction: None)
                )
        except InputError as error:
            results.append(str(error))
    fast, slow = results
    if isinstance(slow, str):
        assert fast == slow and slow.startswith("f:") and slow.isprintable(), (data, fast, slow)
        return None
    same(fast, slow)
    assert np.isfinite(slow.tip).all()
    np.testing.assert_allclose((slow.axis**2).sum(axis=1), 1.0, atol=1e-12)
    assert (np.diff(slow.line) >= 0).all() and all(0 <= e.record <= len(slow) for e in slow.events)
    return slow


PLAIN = gcode.read_plain_lines


def mutated(data, rng):
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 3))):
        kind, k = rng.randrange(6), rng.randrange(len(data))
        if kind == 0:
            data[k] = rng.randrange(256)
        elif kind == 1:
            data[k] = ALPHABET[rng.randrange(len(ALPHABET))]
        elif kind == 2:
            del data[k : k + rng.randint(1, 6)]
        elif kind == 3:
            data[k:k] = rng.choice(PIECES)
        elif kind == 4:
            data[k:k] = data[rng.randrange(len(data)) :][:20]
        else:
            data[k] ^= 0x20
        data = data or bytearray(b"\n")
    return bytes(data)


SEEDS = [
    b"%\nN1 G21 G17 G90\nG0 X10 Y0 Z5 A0 B0\nG1 X1 F100 (MSG,a)\nG3 X1 Y10 J5 P2 F3\n%\n",
    b"G20 G91.1\nG0 X1 Y.5 Z2.5\nF30\nG1 X-2.\nA30 Y1\nG2 X3 Y3 R4\nM5\nM2\n",
    b"G0 X0 Y0 Z0\nG93 G1 X2 F4\nG18 G2 X4 Z1 I1 K.5 B7 F2\nG91 G1 C3 F1\nM30\nX1",
]


@pytest.mark.parametrize("seed", range(4))
def test_mutated_bytes(monkeypatch, seed):
    monkeypatch.setattr(gcode, "read_plain_lines", PLAIN)
    rng, read_ones = random.Random(seed), 0
    for _ in range(5_000):
        path = taken(mutated(rng.choice(SEEDS), rng))
        read_ones += path is not None
    assert read_ones > 500


def test_random_pieces(monkeypatch):
    monkeypatch.setattr(gcode, "read_plain_lines", PLAIN)
    rng, read_ones = random.Random(0), 0
    for _ in range(5_000):
        data = b"G0 X1 Y2 Z3 F9\n" + b" ".join(rng.choices(PIECES, k=rng.randint(1, 9)))
        read_ones += taken(data) is not None
    assert read_ones > 500


def test_random_bytes(monkeypatch):
    monkeypatch.setattr(gcode, "read_plain_lines", PLAIN)
    rng = random.Random(0)
    for _ in range(13_000):
        taken(rng.randbytes(rng.randint(0, 40)))
        taken(bytes(rng.choices(ALPHABET, k=rng.randint(0, 60))))
