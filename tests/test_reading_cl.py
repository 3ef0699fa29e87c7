"""CL files: both dialects word by word, and every refusal with its line."""

import math

import numpy as np
import pytest
from cl_reading import CATIA, NX, both_reader, notes, refused, text_reader, without_feeds  # noqa: F401  without_feeds is taken by every test

from parakin.errors import InputError
from parakin.toolpath.reading.cl.reader import read_cl


@pytest.fixture
def read(tmp_path):
    return text_reader(tmp_path)


@pytest.fixture
def both(tmp_path, monkeypatch):
    return both_reader(tmp_path, monkeypatch)


# whole files


def test_catia(both):
    p = both(CATIA)
    assert (p.dialect, p.units) == ("catia", "mm")
    np.testing.assert_array_equal(p.frame, [[0, 1, 0, 10], [0, 0, 1, 20], [1, 0, 0, 30]])
    assert p.tool == {"diameter": 10.0, "corner_radius": 2.0, "length": 50.0, "number": 3.0}
    np.testing.assert_array_equal(p.tip[[0, 1, -1]], [[0, 0, 50], [15, 0, 0], [0, 15, 0]])
    np.testing.assert_array_equal(p.axis, np.tile([0.0, 0, 1], (len(p), 1)))
    assert p.rapid.tolist() == [True] + [False] * (len(p) - 1)
    assert set(p.feed) == {1500.0} and set(p.spindle) == {12000.0}
    assert p.line[:2].tolist() == [19, 20] and set(p.line[2:]) == {23}
    assert notes(p) == [
        "read as CATIA V5 writes it",
        "the file's frame: origin 10, 20, 30 mm, X along 0, 0, 1, Z along 0, 1, 0",
    ]
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
    assert notes(p) == [
        "read as Siemens NX writes it",
        "the file's frame: origin 1, 2, 3 mm, X along 0, 1, 0, Z along 1, 0, 0",
    ]
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
        (b"\x7fELF\x01\n\x00\x00\x01", 1, ["control character"]),
        (b"GOTO/1,2,3\n\x00\x00\x01", 2, ["NUL"]),
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
        ("UNITS/MM\nFEDRAT / ipm , 2", 50.8),
        ("FEDRAT/100,PERMIN", 100.0),
        ("UNITS/INCHES\nFEDRAT/PERMIN,10", 254.0),
        ("FEDRAT/PERMIN,10\nUNITS/INCHES", 254.0),
        ("UNITS/INCHES\nFEDRAT/10,MMPM", 10.0),
        ("SPINDL/1000,RPM,CLW\nFEDRAT/0.1,MMPR", 100.0),
        ("SPINDL/RPM,1000,CLW,RANGE,2,MAXRPM,5000\nFEDRAT/0.1,MMPR", 100.0),
        ("FEDRAT/0.1,MMPR\nSPINDL/CCLW,RPM,1000", 100.0),
        ("UNITS/MM\nSPINDL/1000\nFEDRAT/IPR,0.01", 254.0),
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
    assert p.notes == ()


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
    assert [n.line for n in p.notes] == [1, 1, 3] and "another workpiece frame" in p.notes[2].text
    assert len(both("MSYS/10,0,0,1,0,0,0,1,0\nGOTO/1,2,3\n" * 3).notes) == 2


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
    p = both("Bad\nPPRINT a   b\nGOTO/1,2,3\n")
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
