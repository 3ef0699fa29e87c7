"""CL files: the fast reader against the line reader, large files, and fuzz."""

import contextlib
import io
import random
import re
import tracemalloc

import numpy as np
import pytest
from cl_reading import CATIA, COLUMNS, FAST, NX, both_reader, without_feeds  # noqa: F401  without_feeds is taken by every test
from hypothesis import given, settings
from hypothesis import strategies as st

from parakin.errors import InputError
from parakin.toolpath.reading.cl import reader as cl
from parakin.toolpath.reading.cl.reader import read_cl


@pytest.fixture
def both(tmp_path, monkeypatch):
    return both_reader(tmp_path, monkeypatch)


# bulk against line by line

numbers = st.one_of(
    st.floats(-1e4, 1e4).map(lambda v: f"{v:.5f}"),
    st.floats(-1e9, 1e9, width=64).map(repr),
    st.integers(-(10**18), 10**18).map(lambda v: f"{v / 1e9:.12f}"),
    st.sampled_from(
        ["0", "-0.0000", "+1", ".5", "-.5", "5.", "1e-3", "9007199254740993e-9", "0.1000000000000000055511151"]
    ),
)
plain = st.builds(lambda v: "GOTO/" + ",".join(v), st.lists(numbers, min_size=3, max_size=3))
tilted = st.builds(
    lambda v, a: "GOTO/" + ",".join(v) + ",{:.6f},{:.6f},{:.6f}".format(*a),
    st.lists(numbers, min_size=3, max_size=3),
    st.sampled_from([(0, 0, 1), (0.6, 0, 0.8), (0.577350, -0.577350, 0.577350), (0, 0.1, 1), (0, 0, 0), (1, 2, 3)]),
)
other = st.sampled_from(
    [
        "FEDRAT/1500.,MMPM",
        "FEDRAT/0.1,MMPR",
        "fedrat/ipm , 3 ",
        "FEDRAT/200,$\nMMPM",
        "FEDRATE/3",
        "FEDRAT/x",
        "FEDRAT/300",
        "FEDRAT/2,IPM",
        "RAPID",
        "RAPID $$ x",
        "RAPIDLY",
        "PAINT/COLOR,31",
        "PAINTED",
        "SPINDL/1000,RPM",
        "GODLTA/1,2,3",
        "GOTO/1,2,$\n3",
        " goto / 1 ,\t2 , 3 \r",
        "GOTO/1,2,3\r\r",
        "GOTO/1,2",
        "GOTO/1,2,3,",
        "UNITS/INCHES",
        "MSYS/1,2,3,0,1,0,0,0,1",
        "ORIGIN/1,2,3",
        "TLAXIS/0,1,0",
        "INDIRV/0,1,0",
        "CYCLE/DRILL,RAPTO,3,FEDTO,-5",
        "CYCLE/OFF",
        "",
        "$$ note",
        "$$*CATIA0\n$$ 1 0 0 0\n$$ 0 1 0 0\n$$ 0 0 1 0",
        "FINI",
        "PPRINT x",
        "PPRINT x $",
        "\r",
        " \t",
    ]
)


@given(st.lists(st.one_of(plain, plain, tilted, tilted, other), max_size=40), st.integers(1, 300), st.booleans())
@settings(parent=FAST, max_examples=300)
def test_bulk_and_line_reader_agree(both, lines, block, ended):
    with contextlib.suppress(InputError):
        both("\n".join(lines) + ("\n" if ended else ""), block=block)


@given(st.lists(numbers, min_size=3, max_size=60))
@settings(parent=FAST, max_examples=100)
def test_numbers_are_rounded_correctly(both, texts):
    texts = texts[: len(texts) // 3 * 3]
    if any(abs(float(t)) > 1e9 for t in texts):
        return
    p = both("".join(f"GOTO/{','.join(texts[k : k + 3])}\n" for k in range(0, len(texts), 3)))
    assert p.tip.ravel().tolist() == [float(t) for t in texts]


def test_a_large_file(tmp_path):
    """As a large file is read for real: block edges within lines, feeds in between, and columns that must grow."""
    rng = np.random.default_rng(3)
    n = 60_000
    tip, axis = rng.normal(size=(n, 3)) * 100, rng.normal(size=(n, 3)) * 0.2 + [0, 0, 1]
    lines, expected = ["MULTAX"], []
    for k in range(n):
        if k % 50 == 0:
            lines.append(f"FEDRAT/{1000 + k // 50}.,MMPM")
        lines.append("GOTO/" + ",".join(f"{v:.5f}" for v in tip[k]) + "," + ",".join(f"{v:.6f}" for v in axis[k]))
        expected.append(len(lines))
    path = tmp_path / "big.cl"
    path.write_text("\n".join(lines) + "\n" + "GOTO/0,0,0\n" * 200_000)
    p = read_cl(path)
    assert len(p) == n + 200_000
    np.testing.assert_array_equal(p.line[:n], expected)
    assert p.tip[:n].tolist() == np.round(tip, 5).tolist()
    np.testing.assert_allclose(p.axis[:n], axis / np.linalg.norm(axis, axis=1)[:, None], atol=2e-6)
    np.testing.assert_array_equal(p.feed[:n], 1000 + np.arange(n) // 50)
    np.testing.assert_array_equal(p.axis[n:], np.tile(p.axis[n - 1], (200_000, 1)))
    broken = path.read_text().split("\n")
    broken[50_000] = "GOTO/1,2,oops"
    path.write_text("\n".join(broken))
    with pytest.raises(InputError, match=r"big\.cl:50001: GOTO: 'OOPS'"):
        read_cl(path)


def test_memory_is_the_columns_and_a_buffer(tmp_path):
    path = tmp_path / "big.cl"
    path.write_text("GOTO/123.45678,-12.34567,1.23456,0.000000,0.000000,1.000000\n" * 200_000)
    tracemalloc.start()
    p = read_cl(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    columns = sum(getattr(p, name).nbytes for name in COLUMNS)
    assert columns == 200_000 * 73
    assert peak < 2.2 * columns + 8e6


# fuzz


@given(st.binary(max_size=400))
@settings(parent=FAST, max_examples=300)
def test_any_bytes(both, data):
    with contextlib.suppress(InputError):
        both(data, block=50)


@given(st.text(alphabet="GOTOFEDRATCIRCLETLON/,.$()-+ 0123456789eE\n\t", max_size=300))
@settings(parent=FAST, max_examples=300)
def test_any_text_of_the_alphabet(both, text):
    with contextlib.suppress(InputError):
        both(text)


def mutated(text, rng):
    data = bytearray(text.encode())
    for _ in range(rng.randint(1, 3)):
        k = rng.randrange(len(data))
        kind = rng.randrange(6)
        if kind == 0:
            data[k] = rng.randrange(256)
        elif kind == 1:
            del data[k : k + rng.randint(1, 12)]
        elif kind == 2:
            j = rng.randrange(len(data))
            data[k:k] = data[j : j + rng.randint(1, 80)]
        elif kind == 3:
            data[k:k] = rng.choice([b"$", b"$$", b"\n", b",", b"/", b"1e300", b"nan", b"-", b"0", b"99999999", b"("])
        elif kind == 4:
            lines = data.split(b"\n")
            rng.shuffle(lines)
            data = bytearray(b"\n".join(lines))
        else:
            data = data.replace(rng.choice([b"0", b"1", b".", b"5"]), rng.choice([b"0", b"-3", b"7e9", b""]), 3)
        data = data or bytearray(b"\n")
    return bytes(data)


def taken(monkeypatch, data):
    """Read bytes both ways, without a file; a path, or the one line of an error."""
    results = []
    for bulk, size in ((0, 64), (1 << 60, 1 << 12)):
        monkeypatch.setattr(cl, "_BULK_FROM", bulk)
        monkeypatch.setattr(cl, "_BLOCK", size)
        try:
            with np.errstate(all="ignore"):
                results.append(cl.ClReader("f", len(data), 0.5).read(io.BytesIO(data), lambda fraction: None))
        except InputError as error:
            results.append(str(error))
    fast, slow = results
    if isinstance(slow, str):
        assert fast == slow and re.match(r"f(:[0-9]+)?: ", slow) and slow.isprintable(), (data, fast, slow)
        return None
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(fast, name), getattr(slow, name), err_msg=name)
    assert (fast.events, fast.notes, fast.tool) == (slow.events, slow.notes, slow.tool)
    return slow


@pytest.mark.parametrize("seed", range(8))
def test_mutated_files(monkeypatch, seed):
    rng = random.Random(seed)
    cycle = "GOTO/0,0,50\nCYCLE/DRILL,RAPTO,3.0,FEDTO,-33.0,RTRCTO,AUTO,MMPM,250.0\nGOTO/10,0,0\nCYCLE/OFF\n"
    texts = [CATIA, NX, NX.replace("END-OF-PATH\n", cycle), "UNITS/INCHES\nFROM/1,2,3\n" + CATIA]
    read_ones = 0
    for _ in range(4_000):
        p = taken(monkeypatch, mutated(rng.choice(texts), rng))
        if p is not None:
            read_ones += 1
            assert np.isfinite(p.tip).all()
            assert np.abs((p.axis**2).sum(axis=1) - 1.0).max() < 1e-12
    assert read_ones > 400
