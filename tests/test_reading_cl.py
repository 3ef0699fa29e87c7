"""CL files: both dialects word by word, arcs against closed forms, bulk against line reader, and fuzz."""

import contextlib
import io
import math
import random
import re
import tracemalloc

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from parakin.errors import InputError
from parakin.toolpath.reading.cl import reader as cl
from parakin.toolpath.reading.cl.reader import read_cl

COLUMNS = ("tip", "axis", "line", "rapid", "feed", "spindle")
FAST = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])

CATIA = """\
$$ -----------------------------------------------------------------
$$     Generated on Tuesday
$$     CATIA APT VERSION 1.0
$$*CATIA0
$$ Manufacturing Program.1
$$    0.00000    1.00000    0.00000   10.00000
$$    0.00000    0.00000    1.00000   20.00000
$$    1.00000    0.00000    0.00000   30.00000
PARTNO PART OPERATION.1
UNITS/MM
MULTAX
CUTTER/ 10.000000,  2.000000,  3.000000,  2.000000,  0.000000,$
         0.000000, 50.000000
LOADTL/3
PPRINT OPERATION NAME = A/B $$ aside
FEDRAT/ 1500.0000,MMPM
SPINDL/ 12000.0000,RPM,CLW
RAPID
GOTO  /    0.00000,    0.00000,   50.00000, 0.000000, 0.000000, 1.000000
GOTO  /   15.00000,    0.00000,    0.00000
AUTOPS
INDIRV/    0.00000,    1.00000,    0.00000
TLON,GOFWD/ (CIRCLE/    0.00000,    0.00000,    0.00000,$
   15.00000),ON,2,INTOF,$
 (LINE/    0.00000,    0.00000,    0.00000,$
    0.00000,   15.00000,    0.00000)
COOLNT/OFF
STOP
FINI
"""

NX = """\
TOOL PATH/FINISH,TOOL,MILL_D10
TLDATA/MILL,10.0000,1.5000,75.0000,0.0000,0.0000
MSYS/1.0000,2.0000,3.0000,0.0000000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000
$$ centerline data
PAINT/PATH
PAINT/SPEED,10
LOAD/TOOL,4,ADJUST,4
SPINDL/RPM,3600,CLW
PAINT/COLOR,186
RAPID
GOTO/-5.1250,3.4613,0.0000,0.0000000,0.0000000,1.0000000
PAINT/COLOR,31
FEDRAT/MMPM,250.0000
CIRCLE/-4.2750,3.4613,0.0000,0.0000000,0.0000000,1.0000000,0.8500,0.0600,0.5000,0.0000,0.0000
GOTO/-4.2750,4.3113,0.0000
GOTO/4.8775,4.3113,0.0000
PAINT/TOOL,NOMORE
END-OF-PATH
"""


@pytest.fixture
def read(tmp_path):
    def reads(text, **options):
        path = tmp_path / "part.cl"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_cl(path, **options)

    return reads


@pytest.fixture
def both(read, monkeypatch):
    """Through the kernel in tiny blocks and through the line reader; the same record or the same error, or it fails."""

    def reads(text, block=64, **options):
        results = []
        for bulk, size in ((0, block), (1 << 60, 1 << 20)):
            monkeypatch.setattr(cl, "_BULK_FROM", bulk)
            monkeypatch.setattr(cl, "_BLOCK", size)
            try:
                results.append(read(text, **options))
            except InputError as error:
                results.append(str(error))
        fast, slow = results
        if isinstance(slow, str) or isinstance(fast, str):
            assert fast == slow
            raise InputError(slow)
        for name in COLUMNS:
            np.testing.assert_array_equal(getattr(fast, name), getattr(slow, name), err_msg=name)
            assert getattr(fast, name).dtype == getattr(slow, name).dtype
        np.testing.assert_array_equal(fast.frame, slow.frame)
        for name in ("events", "notes", "tool", "dialect", "units"):
            assert getattr(fast, name) == getattr(slow, name)
        return slow

    return reads


def refused(read, text, line, *words, **options):
    """The file is refused at the line, in one line that has these words."""
    with pytest.raises(InputError) as caught:
        read(text, **options)
    message = str(caught.value)
    assert "\n" not in message
    assert caught.value.line == line, message
    assert message.startswith(caught.value.source + (f":{line}: " if line else ": "))
    for word in words:
        assert word in message
    return message


def notes(path):
    return [n.text for n in path.notes]


# whole files


def test_catia(both):
    p = both(CATIA)
    assert (p.dialect, p.units) == ("apt", "mm")
    np.testing.assert_array_equal(p.frame, [[0, 1, 0, 10], [0, 0, 1, 20], [1, 0, 0, 30]])
    assert p.tool == {"diameter": 10.0, "corner_radius": 2.0, "length": 50.0, "number": 3.0}
    np.testing.assert_array_equal(p.tip[[0, 1, -1]], [[0, 0, 50], [15, 0, 0], [0, 15, 0]])
    np.testing.assert_array_equal(p.axis, np.tile([0.0, 0, 1], (len(p), 1)))
    assert p.rapid.tolist() == [True] + [False] * (len(p) - 1)
    assert set(p.feed) == {1500.0} and set(p.spindle) == {12000.0}
    assert p.line[:2].tolist() == [19, 20] and set(p.line[2:]) == {23}
    assert p.notes == ()
    told = [(e.record, e.line, e.text.split("/")[0]) for e in p.events]
    assert told == [
        (0, 9, "PARTNO PART OPERATION.1"),
        (0, 11, "MULTAX"),
        (0, 12, "CUTTER"),
        (0, 14, "LOADTL"),
        (0, 15, "PPRINT OPERATION NAME = A"),
        (0, 17, "SPINDL"),
        (len(p), 27, "COOLNT"),
        (len(p), 28, "STOP"),
        (len(p), 29, "FINI"),
    ]
    assert p.events[4].text == "PPRINT OPERATION NAME = A/B"


def test_nx(both):
    p = both(NX)
    assert (p.dialect, p.units) == ("nx", "mm")
    np.testing.assert_array_equal(p.frame, [[0, 0, 1, 1], [1, 0, 0, 2], [0, 1, 0, 3]])
    assert p.tool["diameter"] == 10.0 and p.tool["name"] == "MILL_D10" and p.tool["number"] == 4.0
    assert p.rapid.tolist() == [True] + [False] * (len(p) - 1)
    assert np.isnan(p.feed[0]) and set(p.feed[1:]) == {250.0} and set(p.spindle) == {3600.0}
    assert p.line[0] == 11 and set(p.line[1:-2]) == {14} and p.line[-2:].tolist() == [15, 16]
    assert p.notes == ()
    # the arc leads tangentially from the left side into the line along +X above: clockwise, a quarter turn
    arc = p.tip[:-1] - [-4.275, 3.4613, 0]
    angle = np.degrees(np.arctan2(arc[:, 1], arc[:, 0]))
    assert angle[0] == 180.0 and angle[-1] == pytest.approx(90.0, abs=1e-9) and (np.diff(angle) < 0).all()


# lines and numbers


@pytest.mark.parametrize(
    "text",
    [
        "GOTO/1,2,3\nGOTO/4,5,6,1,0,0\n",
        "goto/1,2,3\nGoTo/4,5,6,1,0,0",
        "  G O T O / 1 , +2. ,\t3.0\r\n GOTO /4,5,6 , 1,0,0\r\n",
        "\ufeffGOTO/1,2,3\nGOTO/4,5,6,1,0,0\n",
        "GOTO/1,2,3 $$ here\nGOTO/4,5,6,1,0,0$$\n",
        "GOTO/1e0,.2E1,0.03D+2\nGOTO/4,5,6,1,0,0\n",
        "GOTO/1,$\n2,$ $$ more\n$$ between\n 3\nGOTO/4,5,$\n6,1,0,0\n",
    ],
)
def test_the_same_two_points(both, text):
    p = both(text)
    np.testing.assert_array_equal(p.tip, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(p.axis, [[0, 0, 1], [1, 0, 0]])
    assert p.line[0] == 1


def test_lines_are_counted_from_where_a_statement_starts(both):
    p = both("$$ one\n\nGOTO/1,$\n2,$\n3\n\nGOTO/4,5,6\n")
    assert p.line.tolist() == [3, 7]


def test_encodings(both):
    p = both(b"PPRINT Gr\xf6\xdfe\nGOTO/1,2,3\n")
    assert p.events[0].text == "PPRINT Gr\u00f6\u00dfe"
    p = both("PPRINT Größe\nGOTO/1,2,3\n".encode())
    assert p.events[0].text == "PPRINT Gr\u00f6\u00dfe"


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("GOTO/1,2\n", 1, ["GOTO", "x,y,z", "2 values"]),
        ("GOTO/1,2,3,4\n", 1, ["4 values"]),
        ("GOTO/1,2,3,0,0,1,5\n", 1, ["7 values"]),
        ("GOTO/1,2,\n", 1, ["not a number"]),
        ("GOTO/\n", 1, ["0 values"]),
        ("GOTO\n", 1, ["0 values"]),
        ("GOTO 1,2,3\n", 1, ["slash"]),
        ("GOTO/1,2,3\nGOTO/1,2,1.2.3\n", 2, ["'1.2.3'"]),
        ("GOTO/1,2,3\nGOTO/1,2,nan\n", 2, ["'NAN'"]),
        ("GOTO/1,2,inf\n", 1, ["not a number"]),
        ("GOTO/1,2,1e999\n", 1, ["out of range"]),
        ("GOTO/1,2,1e99999999999\n", 1, ["out of range"]),
        ("GOTO/1,2,99999999999\n", 1, ["out of range"]),
        ("GOTO/1,2,1_0\n", 1, ["not a number"]),
        ("GOTO/1 2,3,4\n", 1, ["not a number"]),
        ("GOTO/1,2,٣\n", 1, ["not a number"]),
        ("GOTO/1,2,3,0,0,0\n", 1, ["tool axis"]),
        ("GOTO/0,0,0\n" * 40 + "GOTO/1,2,3,0,0,0\n", 41, ["tool axis"]),
        ("GOTO/0,0,0\n" * 40 + "FEDRAT/x,MMPM\n" + "GOTO/0,0,y\n", 41, ["FEDRAT", "'X'"]),
        ("GOTO/0,0,0\nFEDRAT/5\nRAPID\n" * 40 + "\nGOTO/0,0,y\n", 122, ["GOTO"]),
        ("GOTO/1,2,$\n", 1, ["continued"]),
        ("$$*CATIA0\n$$ 1 0 0 0\nGOTO/1,2,3\n", 3, ["CATIA0"]),
        ("$$*CATIA0\n$$ 1 0 0 0\n$$ 0 1 0 0\n$$ 0 0 2 0\n", 4, ["CATIA0", "rotation"]),
        ("$$*CATIA0\n$$ 1 0 0 0\n$$ 0 1 0 0\n$$ 0 0 -1 0\n", 4, ["right-handed"]),
        ("GOTO/1,2,3\n$$*CATIA0\n", 2, ["three rows"]),
        ("FROM/1,2\n", 1, ["FROM"]),
        ("GODLTA/1,2,3\n", 1, ["position"]),
        ("FEDRAT/MMPM\n", 1, ["FEDRAT"]),
        ("FEDRAT/100,MMPM,IPM\n", 1, ["unit"]),
        ("FEDRAT/-1\n", 1, ["below zero"]),
        ("FEDRAT/100,FURLONGS\n", 1, ["FEDRAT"]),
        ("SPINDL/fast,RPM\n", 1, ["SPINDL"]),
        ("SPINDL/1,2,RPM\n", 1, ["SPINDL"]),
        ("UNITS/PARSEC\n", 1, ["UNITS/MM"]),
        ("TLAXIS/0,0\n", 1, ["TLAXIS"]),
        ("TLAXIS/0,0,0\n", 1, ["axis"]),
        ("CUTTER/abc\n", 1, ["CUTTER"]),
        ("TLDATA/MILL,10\n", 1, ["TLDATA"]),
        ("TLDATA/MILL,10,a,1,1,1\n", 1, ["TLDATA"]),
        ("MSYS/0,0,0,1,0,0\n", 1, ["nine"]),
        ("MSYS/0,0,0,1,0,0,1,0,0\n", 1, ["right angles"]),
        ("MSYS/0,0,0,0,0,0,0,1,0\n", 1, ["direction"]),
        ("ORIGIN/1,2\n", 1, ["ORIGIN"]),
        ("", None, ["no motion"]),
        ("\n\n", None, ["no motion"]),
        ("PARTNO X\nFINI\nGOTO/1,2,3\n", None, ["no motion"]),
        (b"\x7fELF\x01\n\x00\x00\x01", 2, ["NUL"]),
        ("GOTO/1,2,3\n".encode("utf-16"), 1, ["NUL"]),
        (b"\x93\xfa\xff\x80\n" * 5, None, ["no motion"]),
    ],
)
def test_refused_with_the_line(both, read, text, line, words):
    refused(read, text, line, *words)
    with pytest.raises(InputError):
        both(text)


def test_files_that_cannot_be_read(tmp_path):
    for path in (tmp_path / "none.cl", tmp_path, str(tmp_path / "nul\0.cl")):
        with pytest.raises(InputError, match=r"cannot be read|expected"):
            read_cl(path)
    with pytest.raises(InputError, match="arc_tolerance"):
        read_cl(tmp_path / "none.cl", arc_tolerance=0.0)


def test_the_file_is_named_as_the_caller_did(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "a.cl").write_text("GOTO/1\n")
    with pytest.raises(InputError, match=r"^sub/\.\./sub/a\.cl:1: "):
        read_cl("sub/../sub/a.cl")


@pytest.mark.parametrize("text", ["X" * 1_000_000, "GOTO/" + "1" * 1_000_000 + ",2,3", "GOTO/" + "1," * 500_000])
def test_long_lines_end_soon(read, text):
    with pytest.raises(InputError):
        read(text)
    assert len(read(text[:1_000_000].replace("GOTO", "WORD") + "\nGOTO/1,2,3\n")) == 1


def test_a_line_without_end_is_refused(both):
    with pytest.raises(InputError, match="4000000 characters"):
        both("GOTO/1,2,3\n" + " " * 9_000_000, block=1 << 16)
    with pytest.raises(InputError, match="4000000 characters"):
        both("GOTO/1,2,3\n" + ("PPRINT" + "x" * 1_000_000 + "$\n") * 9, block=1 << 16)


# words


def test_modal_axis_and_godlta(both):
    p = both(
        "TLAXIS/1,0,0\nFROM/1,2,3\nGODLTA/1,1,1\nGOTO/0,0,0,0,1,0\nGODLTA/0,0,-5\nMULTAX/OFF\nGODLTA/1,0,0,0,0,1\n"
    )
    np.testing.assert_array_equal(p.tip, [[1, 2, 3], [2, 3, 4], [0, 0, 0], [0, 0, -5], [1, 0, -5]])
    np.testing.assert_array_equal(p.axis, [[1, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1]])


def test_rapid_holds_for_one_motion(both):
    p = both("FROM/0,0,0\nRAPID\nPPRINT\nFEDRAT/5\nGOTO/1,0,0\nGOTO/2,0,0\nRAPID\nGODLTA/1,0,0\nRAPID\n\nGOTO/3,3,3\n")
    assert p.rapid.tolist() == [False, True, False, True, True]


@pytest.mark.parametrize(
    ("words", "feed"),
    [
        ("FEDRAT/1500.,MMPM", 1500.0),
        ("FEDRAT/MMPM,1500.", 1500.0),
        ("FEDRAT / ipm , 2", 50.8),
        ("FEDRAT/100,PERMIN", 100.0),
        ("UNITS/INCHES\nFEDRAT/PERMIN,10", 254.0),
        ("FEDRAT/PERMIN,10\nUNITS/INCHES", 254.0),
        ("UNITS/INCHES\nFEDRAT/10,MMPM", 10.0),
        ("SPINDL/1000,RPM,CLW\nFEDRAT/0.1,MMPR", 100.0),
        ("FEDRAT/0.1,MMPR\nSPINDL/CCLW,RPM,1000", 100.0),
        ("SPINDL/1000\nFEDRAT/IPR,0.01", 254.0),
        ("UNITS/INCHES\nSPINDL/RPM,500\nFEDRAT/0.02,PERREV", 254.0),
        ("FEDRAT/7,MMPM\nFEDRAT/8", 8.0),
        ("", math.nan),
    ],
)
def test_feeds(both, words, feed):
    p = both(words + "\nGOTO/1,2,3\n")
    np.testing.assert_allclose(p.feed, [feed], rtol=1e-15)
    assert not any("revolution" in n for n in notes(p))


def test_feed_per_revolution_follows_the_spindle(both):
    p = both(
        "FEDRAT/0.5,MMPR\nGOTO/1,0,0\nGOTO/2,0,0\nSPINDL/100\nGOTO/3,0,0\nSPINDL/200\nGOTO/4,0,0\nSPINDL/OFF\nGOTO/5,0,0\n"
    )
    np.testing.assert_array_equal(p.feed, [math.nan, math.nan, 50, 100, 0])
    np.testing.assert_array_equal(p.spindle, [math.nan, math.nan, 100, 200, 0])
    assert [(n.line, "(2 times)" in n.text) for n in p.notes] == [(2, True)]


def test_surface_speed_leaves_the_spindle_open(both):
    p = both("SPINDL/120,SMM,CLW\nGOTO/1,2,3\n")
    assert np.isnan(p.spindle[0]) and p.notes[0].line == 1


def test_inches(both):
    text = "$$*CATIA0\n$$ 1 0 0 1\n$$ 0 1 0 2\n$$ 0 0 1 3\nUNITS/INCHES\nCUTTER/0.5\nGOTO/1,2,3\nGODLTA/1,0,0\n"
    p = both(text)
    np.testing.assert_allclose(p.tip, [[25.4, 50.8, 76.2], [50.8, 50.8, 76.2]], rtol=1e-15)
    np.testing.assert_allclose(p.frame[:, 3], [25.4, 50.8, 76.2], rtol=1e-15)
    assert p.units == "inch" and p.tool == {"diameter": 12.7}


def test_units_change_within_the_file(both):
    p = both("UNITS/INCHES\nGOTO/1,0,0\nUNITS/MM\nGODLTA/1,0,0\nGOTO/1,0,0\n")
    np.testing.assert_allclose(p.tip[:, 0], [25.4, 26.4, 1], rtol=1e-15)
    assert p.units == "inch" and p.notes[0].line == 3


def test_origin_is_subtracted(both):
    p = both("ORIGIN/10,20,30\nGOTO/11,22,33\nGODLTA/1,0,0\nORIGIN/0,0,0\nGOTO/1,1,1,0,1,0\n")
    np.testing.assert_allclose(p.tip, [[1, 2, 3], [2, 2, 3], [1, 1, 1]], atol=1e-14)
    p = both("ORIGIN/10,0,0,0,1,0,0,0,1\nGOTO/10,5,1,0,1,0\n")
    np.testing.assert_allclose(p.tip, [[5, 0, 1]], atol=1e-14)
    np.testing.assert_allclose(p.axis, [[1, 0, 0]], atol=1e-14)


def test_frame_with_and_without_dollars(read):
    for mark in ("$$", ""):
        p = read(f"$$*CATIA0\n{mark} 1 0 0 1.5\n{mark}\t0 1 0 2\n{mark} 0,0,1,3\nGOTO/1,2,3\n")
        np.testing.assert_array_equal(p.frame, [[1, 0, 0, 1.5], [0, 1, 0, 2], [0, 0, 1, 3]])
    assert read("GOTO/1,2,3\n").frame is None


def test_a_rounded_frame_is_a_rotation(read):
    p = read("$$*CATIA0\n$$ .70711 -.70711 0 0\n$$ .70711 .70711 0 0\n$$ 0 0 1 0\nGOTO/1,2,3\n")
    np.testing.assert_allclose(p.frame[:, :3] @ p.frame[:, :3].T, np.eye(3), atol=1e-15)
    assert p.frame[0, 0] == pytest.approx(math.sqrt(0.5))


def test_later_frames_are_brought_into_the_first(both):
    second = "MSYS/10,0,5,0,1,0,-1,0,0\nGOTO/1,2,3,1,0,0\nGOTO/0,0,0\n"
    p = both("MSYS/10,0,0,1,0,0,0,1,0\nGOTO/1,2,3,1,0,0\n" + second + "MSYS/10,0,0,1,0,0,0,1,0\nGOTO/7,8,9,1,0,0\n")
    np.testing.assert_array_equal(p.frame, [[1, 0, 0, 10], [0, 1, 0, 0], [0, 0, 1, 0]])
    # the second frame is turned by +90 degrees about Z and lies 5 higher
    np.testing.assert_allclose(p.tip, [[1, 2, 3], [-2, 1, 8], [0, 0, 5], [7, 8, 9]], atol=1e-14)
    np.testing.assert_allclose(p.axis, [[1, 0, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0]], atol=1e-14)
    assert [n.line for n in p.notes] == [3]
    assert both("MSYS/10,0,0,1,0,0,0,1,0\nGOTO/1,2,3\n" * 3).notes == ()


def test_steps_go_on_over_a_change_of_frame(both):
    p = both("MSYS/0,0,0,1,0,0,0,1,0\nGOTO/1,2,3\nMSYS/0,0,9,0,1,0,-1,0,0\nGODLTA/1,0,0\n")
    np.testing.assert_allclose(p.tip, [[1, 2, 3], [1, 3, 3]], atol=1e-14)


def test_axes_off_unit_length(both):
    p = both("GOTO/0,0,0,0,0,1.0005\nGOTO/0,0,0,0,0,1.01\nGOTO/0,0,0,0,3,4\nGOTO/1,1,1\nGOTO/0,0,0,0,0,0.5\n")
    np.testing.assert_array_equal(p.axis, [[0, 0, 1], [0, 0, 1], [0, 0.6, 0.8], [0, 0.6, 0.8], [0, 0, 1]])
    assert [(n.line, "(3 times)" in n.text, "by 4" in n.text) for n in p.notes] == [(2, True, True)]


def test_unknown_words_are_grouped(both):
    p = both("FOO/1\nGOTO/1,2,3\n" + "FOO/2\nBAR\n" * 500 + "bar/x\n")
    assert [(n.line, n.text) for n in p.notes] == [
        (1, "unknown word 'FOO', not acted on (501 times)"),
        (4, "unknown word 'BAR', not acted on (501 times)"),
    ]
    many = both("GOTO/1,2,3\n" + "".join(f"W{k}\n" for k in range(5000)))
    assert len(many.notes) < 300 and sum("left out" in n for n in notes(many)) == 1


def test_notes_and_events_print_in_one_line(both):
    p = both("\x1b[2J\x07Bad\nPPRINT a   b\nGOTO/1,2,3\n")
    assert all(n.text.isprintable() for n in p.notes) and p.events[0].text == "PPRINT a b"


def test_after_fini(both):
    p = both("GOTO/1,2,3\nFINI\n\n$$ x\nGOTO/4,5,6\nGOTO/broken\n")
    assert len(p) == 1 and [(n.line, "(2 times)" in n.text) for n in p.notes] == [(5, True)]


def test_several_tools(both):
    p = both("LOADTL/1\nCUTTER/10\nGOTO/1,2,3\nLOADTL/2\nCUTTER/8\nGOTO/1,2,4\n")
    assert p.tool == {"number": 1.0, "diameter": 10.0} and p.notes[0].line == 4
    assert [e.record for e in p.events] == [0, 0, 1, 1]


def test_progress(tmp_path):
    path = tmp_path / "a.cl"
    path.write_text("GOTO/1,2,3\n" * 300_000)
    seen = []
    assert len(read_cl(path, progress=seen.append)) == 300_000
    assert seen == sorted(seen) and seen[-1] == 1.0 and len(seen) > 2 and seen[0] < 0.5


def test_a_message_does_not_swallow_motion(both):
    p = both("PPRINT COST IN $\nGOTO/1,2,3\nPPRINT LONG $\nTEXT\nGOTO/4,5,6\n")
    assert len(p) == 2 and [e.text for e in p.events] == ["PPRINT COST IN", "PPRINT LONG TEXT"]


def test_a_frame_after_points_without_one(both):
    p = both("GOTO/1,2,3\nMSYS/0,0,5,1,0,0,0,1,0\nGOTO/1,2,3\n")
    np.testing.assert_array_equal(p.frame, np.eye(3, 4))
    np.testing.assert_array_equal(p.tip, [[1, 2, 3], [1, 2, 8]])


def test_lines_are_counted_over_blanks_and_comments(both):
    p = both("GOTO/1,2,3\n\n  \n\r\nGOTO/4,5,6\n$$ x\n\nGOTO/7,8,9\n\n")
    assert p.line.tolist() == [1, 5, 8]


# arcs


def chord_error(points, centre, radius):
    """Largest distance of the chords between points on a circle from it."""
    middle = (points[1:] + points[:-1]) / 2 - centre
    return radius - np.linalg.norm(middle, axis=1).min()


def rotation(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def catia_arc(start, tangent, centre, radius, end):
    def text(values):
        return ",".join(f"{v:.15g}" for v in values)

    return (
        f"GOTO/{text(start)}\nINDIRV/{text(tangent)}\nTLON,GOFWD/(CIRCLE/{text(centre)},$\n{radius:.15g}),ON,2,INTOF,$\n"
        f"(LINE/{text(centre)},{text(end)})\n"
    )


@pytest.mark.parametrize("dialect", ["catia", "nx"])
@pytest.mark.parametrize("turn", [0.3, math.pi / 2, math.pi, 4.0, 6.28, 2 * math.pi])
@pytest.mark.parametrize("tolerance", [0.1, 0.01, 1e-4])
def test_arcs_in_space(both, dialect, turn, tolerance):
    rng = np.random.default_rng(int(turn * 1000))
    basis, centre, radius = rotation(rng), rng.normal(size=3) * 50, 20.0

    def at(angle):
        return centre + radius * (math.cos(angle) * basis[:, 0] + math.sin(angle) * basis[:, 1])

    start, end = at(0.0), at(turn) if turn < 6.283 else at(0.0)
    if dialect == "catia":
        text = catia_arc(start, basis[:, 1], centre, radius, end)
    else:  # NX turns clockwise about the axis it states
        values = ",".join(f"{v:.15g}" for v in (*centre, *-basis[:, 2], radius, 0.06, 0.5, 10, 0))
        text = "GOTO/{:.15g},{:.15g},{:.15g}\n".format(*start) + f"CIRCLE/{values}\n"
        text += "PAINT/COLOR,31\nGOTO/{:.15g},{:.15g},{:.15g}\n".format(*end)
    p = both(text, arc_tolerance=tolerance)
    local = (p.tip - centre) @ basis
    np.testing.assert_allclose(np.hypot(local[:, 0], local[:, 1]), radius, atol=1e-9)
    np.testing.assert_allclose(local[:, 2], 0.0, atol=1e-9)
    angle = np.unwrap(np.arctan2(local[:, 1], local[:, 0]), discont=math.pi)
    assert (np.diff(angle) > 0).all()
    assert angle[-1] - angle[0] == pytest.approx(turn, abs=1e-9)
    np.testing.assert_allclose(p.tip[-1], end, atol=1e-12)
    error = chord_error(p.tip, centre, radius)
    assert error <= tolerance * (1 + 1e-9)
    # no more points than the tolerance asks for
    step = min(2 * math.acos(1 - tolerance / radius), math.pi / 4)
    assert len(p) - 1 <= math.ceil(turn / step - 1e-9) + 1


def test_indirv_decides_the_way_round(both):
    left = both(catia_arc((15, 0, 0), (0, 1, 0), (0, 0, 0), 15, (0, 15, 0)))
    right = both(catia_arc((15, 0, 0), (0, -1, 0), (0, 0, 0), 15, (0, 15, 0)))
    assert (left.tip[1:, 1] > 0).all() and (right.tip[1:3, 1] < 0).all()
    assert len(right) - 1 == pytest.approx(3 * (len(left) - 1), abs=2)
    half = both(catia_arc((15, 0, 0), (0, 0, 1), (0, 0, 0), 15, (-15, 0, 0)))
    assert (half.tip[1:-1, 2] > 0).all() and np.allclose(half.tip[:, 1], 0)


@pytest.mark.parametrize(("sign", "steps_up"), [(1, False), (-1, True)])
def test_nx_axis_sign_decides_the_way_round(both, sign, steps_up):
    p = both(f"GOTO/10,0,0\nCIRCLE/0,0,0,0,0,{sign},10,.1,.5,0,0\nGOTO/-10,0,0\n")
    assert (p.tip[1:-1, 1] > 0).all() == steps_up and (p.tip[1:-1, 1] < 0).all() != steps_up


def test_rounded_arcs_keep_their_given_ends(both):
    a, b = 12.345, 71.2345
    start = [round(7.5 * math.cos(math.radians(a)), 3), round(7.5 * math.sin(math.radians(a)), 3), 0]
    end = [round(7.5 * math.cos(math.radians(b)), 3), round(7.5 * math.sin(math.radians(b)), 3), 0]
    p = both(catia_arc(start, (-0.213, 0.977, 0), (0, 0, 0), 7.5, end))
    np.testing.assert_array_equal(p.tip[[0, -1]], [start, end])
    np.testing.assert_allclose(np.linalg.norm(p.tip[1:-1], axis=1), 7.5, atol=1e-12)


def test_arcs_in_inches(both):
    p = both("UNITS/INCHES\n" + catia_arc((1, 0, 0), (0, 1, 0), (0, 0, 0), 1, (0, 1, 0)), arc_tolerance=0.001)
    np.testing.assert_allclose(np.linalg.norm(p.tip, axis=1), 25.4, atol=1e-12)
    assert chord_error(p.tip, np.zeros(3), 25.4) <= 0.001 * (1 + 1e-9)


def test_the_axis_turns_on_the_arc(both):
    p = both("GOTO/10,0,0,0,0,1\nCIRCLE/0,0,0,0,0,-1,10,.1,.5,0,0\nGOTO/0,10,0,1,0,0\n", arc_tolerance=0.001)
    np.testing.assert_allclose(np.linalg.norm(p.axis, axis=1), 1, atol=1e-14)
    turned = np.arctan2(p.axis[:, 0], p.axis[:, 2])
    along = np.arctan2(p.tip[:, 1], p.tip[:, 0])
    np.testing.assert_allclose(turned, along, atol=1e-12)
    np.testing.assert_array_equal(p.axis[-1], [1, 0, 0])


def test_rapid_feed_and_lines_of_arcs(both):
    p = both("GOTO/10,0,0\nFEDRAT/5\nCIRCLE/0,0,0,0,0,1,10,.1,.5,0,0\nRAPID\nGOTO/0,10,0\nGOTO/9,9,9\n")
    assert p.rapid.tolist() == [False] + [True] * (len(p) - 2) + [False]
    assert set(p.line[1:-2]) == {3} and p.line[-2] == 5 and set(p.feed[1:]) == {5.0}


def test_nx_helix(both):
    p = both("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,-1,10,.1,.5,0,0\nGOTO/0,10,-3\n")
    np.testing.assert_allclose(np.hypot(p.tip[:, 0], p.tip[:, 1]), 10, atol=1e-12)
    np.testing.assert_allclose(p.tip[:, 2], -3 * np.arctan2(p.tip[:, 1], p.tip[:, 0]) / (math.pi / 2), atol=1e-12)
    assert "helix" in p.notes[0].text


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (catia_arc((15, 0, 0), (0, 1, 0), (0, 0, 0), 15, (0, 15.1, 0)), 3, ["end", "0.1 mm"]),
        (catia_arc((15, 0.6, 0), (0, 1, 0), (0, 0, 0), 15, (0, 14.9, 0)), 3, ["start"]),
        (catia_arc((15, 0, 0), (1, 0, 0), (0, 0, 0), 15, (0, 15, 0)), 3, ["INDIRV"]),
        (catia_arc((15, 0, 0), (0, 0, 1), (0, 0, 0), 15, (0, 15, 0)), 3, ["INDIRV"]),
        (catia_arc((0, 0, 0), (0, 1, 0), (0, 0, 0), 0, (0, 0, 0)), 3, ["radius"]),
        ("GOTO/1,0,0\nTLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,0,1,0)\n", 2, ["INDIRV"]),
        ("INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,0,1,0)\n", 2, ["position"]),
        ("GOTO/1,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,1),ON,(LINE/0,0,0,0,1,0)\n", 3, ["TLON"]),
        ("GOTO/1,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,0,1,q)\n", 3, ["'Q'"]),
        ("GOTO/1,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(LINE/0,0,0,1)\n", 3, ["TLON,GOFWD/(CIRCLE"]),
        ("GOTO/1,0,0\nINDIRV/0,0,0\n", 2, ["INDIRV"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10,0,0,0,0\nGOTO/0,10.5,0\n", 3, ["end", "0.5 mm"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,0,10,0,0,0,0\nGOTO/0,10,0\n", 2, ["CIRCLE"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,-10,0,0,0,0\nGOTO/0,10,0\n", 3, ["radius"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/0,10,0\n", 2, ["radius"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10,0,0,0,0,TIMES,2\nGOTO/0,10,0\n", 2, ["TIMES"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\n", 2, ["GOTO"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nFINI\n", 3, ["CIRCLE"]),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nGODLTA/1,1,1\n", 3, ["GOTO"]),
        ("CIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\n", 2, ["position"]),
        ("GOTO/10,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0,0,0,-1\n", 3, ["180"]),
    ],
)
def test_arcs_refused(both, read, text, line, words):
    refused(read, text, line, *words)
    with pytest.raises(InputError):
        both(text)


def test_an_arc_of_too_many_points(read):
    text = "GOTO/1e8,0,0\nCIRCLE/0,0,0,0,0,1,1e8\nGOTO/0,1e8,0\n"
    refused(read, text, 3, "points", arc_tolerance=1e-7)


# drill cycles


def test_drilling(both):
    p = both(
        "FEDRAT/MMPM,900\nGOTO/0,0,50,0,0,1\nCYCLE/DRILL,RAPTO,3.0000,FEDTO,-33.0,RTRCTO,AUTO,MMPM,250.0000\n"
        "GOTO/10,0,0\nPAINT/COLOR,31\nGOTO/20,0,5\nCYCLE/OFF\nGOTO/0,0,60\n"
    )
    expected = [
        (0, 0, 50, False, 900),
        (10, 0, 50, True, 900),
        (10, 0, 3, True, 900),
        (10, 0, -33, False, 250),
        (10, 0, 50, True, 900),
        (20, 0, 50, True, 900),
        (20, 0, 8, True, 900),
        (20, 0, -28, False, 250),
        (20, 0, 50, True, 900),
        (0, 0, 60, False, 900),
    ]
    np.testing.assert_array_equal(np.column_stack([p.tip, p.rapid, p.feed]), np.array(expected, float))
    assert p.line.tolist() == [2, 4, 4, 4, 4, 6, 6, 6, 6, 8]
    assert [(n.line, "(2 times)" in n.text) for n in p.notes] == [(4, True)]


def test_drilling_at_the_clearance_and_along_a_tilted_axis(both):
    p = both(
        "GOTO/9,0,0,1,0,0\nCYCLE/DRILL,RAPTO,2,FEDTO,-5\nGOTO/0,1,0\nGOTO/3,1,4\nCYCLE/OFF\nCYCLE/ON\nGOTO/0,0,0\n"
    )
    tip = [[9, 0, 0], [9, 1, 0], [2, 1, 0], [-5, 1, 0], [2, 1, 0]]
    # the second hole's clearance is higher: up first, then across
    tip += [[5, 1, 0], [5, 1, 4], [-2, 1, 4], [5, 1, 4], [5, 0, 0], [2, 0, 0], [-5, 0, 0], [2, 0, 0]]
    np.testing.assert_array_equal(p.tip, tip)
    np.testing.assert_array_equal(p.axis, np.tile([1.0, 0, 0], (len(tip), 1)))


@pytest.mark.parametrize(
    "cycle",
    [
        "CYCLE/TAP,RAPTO,3,FEDTO,-5",
        "CYCLE/DRILL,DEEP,RAPTO,3,FEDTO,-5",
        "CYCLE/DRILL,126.0,85.0,1.0,MMPR",
        "CYCLE/DRILL,RAPTO,3,FEDTO,-5,STEP,1",
        "CYCLE/DRILL,RAPTO,3",
        "CYCLE/DRILL,RAPTO,3,FEDTO",
        "CYCLE/DRILL,RAPTO,3,FEDTO,abc",
        "CYCLE/DRILL,RAPTO,3,FEDTO,4",
        "CYCLE/DRILL,RAPTO,3,FEDTO,-4,RTRCTO,1",
        "CYCLE/ON",
        "CYCLE/",
    ],
)
def test_cycles_that_are_not_motion_are_refused(read, cycle):
    refused(read, f"GOTO/0,0,9\n{cycle}\nGOTO/0,0,0\n", 2, "CYCLE")


def test_motion_other_than_goto_in_a_cycle_is_refused(read):
    start = "GOTO/0,0,9\nCYCLE/DRILL,RAPTO,3,FEDTO,-5,RTRCTO,AUTO\n"
    for word in ("GODLTA/1,1,1", "FROM/1,1,1", "CIRCLE/0,0,0,0,0,1,10", "UNITS/MM", "MSYS/0,0,0,1,0,0,0,1,0"):
        refused(read, f"{start}{word}\n", 3)
    refused(read, f"{start}GOTO/0,0,0,1,0,0\n", 3, "AUTO")
    refused(read, "CYCLE/DRILL,RAPTO,3,FEDTO,-5,RTRCTO,AUTO\nGOTO/0,0,0\n", 2, "AUTO")


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
    for _ in range(12_500):
        p = taken(monkeypatch, mutated(rng.choice(texts), rng))
        if p is not None:
            read_ones += 1
            assert np.isfinite(p.tip).all()
            assert np.abs((p.axis**2).sum(axis=1) - 1.0).max() < 1e-12
    assert read_ones > 1250
