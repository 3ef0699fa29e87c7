"""The language of G-code: expressions, parameters, O words, cycles, work systems, and what other controls write."""

import io
import math
import random
import time

import numpy as np
import pytest

from parakin.errors import InputError
from parakin.toolpath.reading.gcode import reader
from parakin.toolpath.reading.gcode.reader import read_gcode

SHIFTED = np.column_stack([np.eye(3), [100.0, 0.5, -1400.0]])  # a workpiece


@pytest.fixture
def read(tmp_path):
    def reads(text, **options):
        path = tmp_path / "part.ngc"
        path.write_text(text)
        return read_gcode(path, **options)

    return reads


def refuse(read, text, line, *words, **options):
    with pytest.raises(InputError) as caught:
        read(text, **options)
    assert caught.value.line == line, caught.value
    assert str(caught.value).isprintable() and all(word in caught.value.message for word in words), caught.value


def column(path, k):
    return path.tip[:, k].tolist()


# expressions and parameters


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("[1+2]", 3), ("[1 + 2*3]", 7), ("[[1+2]*3]", 9), ("-[1]", -1), ("+[1]", 1), ("--1", 1), ("[1--2]", 3),
        ("[2**3**2]", 64), ("[-2**2]", 4), ("[10-3-2]", 5), ("[8/2/2]", 2), ("[7 MOD 4]", 3), ("[-5 mod 3]", 1),
        ("[5 MOD -3]", 2), ("[1 EQ 1.00005]", 1), ("[1 NE 1.0002]", 1), ("[1 lt 2 AND 2 GE 2]", 1), ("[1 xor 1]", 0),
        ("[0 OR -3]", 1), ("[1 GT 2]", 0), ("[2LE2]", 1), ("abs[-2]", 2), ("FIX[-1.5]", -2), ("fup[-1.5]", -1),
        ("round[2.5]", 3), ("round[-2.5]", -3), ("sin[30]", 0.5), ("COS[60]", 0.5), ("tan[45]", 1), ("asin[1]", 90),
        ("acos[0]", 90), ("atan[1]/[-1]", 135), ("a t a n [ 1 ] / [ 1 ]", 45), ("sqrt[16]", 4), ("exp[0]", 1),
        ("ln[exp[2]]", 2), ("[1 2 + . 5]", 12.5), ("[SIN[30]ANDSIN[30]]", 1), ("[1XORABS[0]]", 1), ("[2*-3]", -6),
        ("#31", 0), ("-#1", -5), ("#[1+1]", 7), ("##3", 5), ("#<a name>", 4), ("#<ANAME>", 4), ("#<_g>", 9),
        ("exists[#<aname>]", 1), ("exists[ #<other> ]", 0), ("exists[#<_x>]", 1), ("#<_x>", 1), ("#5420", 1),
        ("#<_line>", 3), ("#<_metric>", 1), ("#5220", 1), ("#<_motion_mode>", 0), ("[#1*[#2-#1]]", 10),
    ],
)  # fmt: skip
def test_values(read, text, value):
    p = read(f"#1=5 #2=7 #3=1 #<a Name>=4 #<_g>=9\nG21 G0 X1 Y0 Z0\nG0 X{text}\nM2\n")
    assert p.tip[1, 0] == pytest.approx(value, abs=1e-12)


def test_parameters_are_set_behind_their_line(read):
    p = read("#1=5 #1=6 G0 X#1 Y0 Z0\nX#1 #1=7 Y#1\nX#1\n")
    assert column(p, 0) == [0, 6, 7] and column(p, 1) == [0, 6, 6]
    assert [n.line for n in p.notes if "not set" in n.text] == [1]


def test_codes_may_be_computed(read):
    p = read("#1=1\nG[21] G#<_metric> F[2*5] X1 Y[#1] Z0\nG[53+0.2-53+0.8] X3 M[2]\nX9\n")
    assert column(p, 0) == [1, 3] and p.feed.tolist() == [10, 10]
    refuse(read, "G[0.55] X1\n", 1, "G0.55 is no G code")
    refuse(read, "M[0.5] X1\n", 1, "M0.5")


# O words


def test_a_subroutine(read):
    text = """o<hole> sub
    G0 X#1 Y#2
    o<hole> return [#1*2]
    G0 Z99
o<hole> endsub
#1=7
G0 Z1
O<Hole> call [1] [2]
o<HOLE> call [3]
G0 X#1 Y#<_value> Z#<_value_returned>
M2
"""
    p = read(text)
    assert p.tip.tolist() == [[1, 2, 1], [3, 0, 1], [7, 6, 1]] and p.line.tolist() == [2, 2, 10]


def test_names_are_local(read):
    text = "#<a>=1 #<_g>=2\no1 sub\n#<a>=5 #<_g>=6 #40=8\nG0 X#<a>\no1 endsub\no1 call\nG0 X#<a> Y#<_g> Z#40\n"
    assert read(text).tip.tolist() == [[1, 6, 8]]
    refuse(read, "#<a>=1\no1 sub\nG0 X#<a>\no1 endsub\no1 call\n", 3, "#<a> is not set")


def test_conditions(read):
    text = "o1 if [{0} EQ 1]\nX1\no1 elseif [{0} EQ 2]\nX2\no2 if [1]\nX3\no2 endif\no1 else\nX4\no1 endif\nX5\n"
    for value, expected in ((1, [0, 1, 5]), (2, [0, 2, 3, 5]), (3, [0, 4, 5])):
        assert column(read("G0 X0 Y0 Z0\n" + text.format(value)), 0) == expected


def test_loops(read):
    begin = "G0 X0 Y0 Z0\n#1=0\n"
    assert column(read(begin + "o1 while [#1 LT 3]\n#1=[#1+1]\nX#1\no1 endwhile\n"), 0) == [0, 1, 2, 3]
    assert column(read(begin + "o1 do\n#1=[#1+1]\nX#1\no1 while [#1 LT 3]\n"), 0) == [0, 1, 2, 3]
    assert column(read(begin + "o1 repeat [3]\n#1=[#1+1]\nX#1\no1 endrepeat\nX9\n"), 0) == [0, 1, 2, 3, 9]
    inner = "#1=[#1+1]\no2 if [#1 EQ 2]\no1 {}\no2 endif\nX#1\n"
    assert column(read(begin + f"o1 while [#1 LT 4]\n{inner.format('break')}o1 endwhile\n"), 0) == [0, 1]
    assert column(read(begin + f"o1 while [#1 LT 4]\n{inner.format('continue')}o1 endwhile\n"), 0) == [0, 1, 3, 4]
    nested = "o1 repeat [2]\no2 repeat [2]\n#1=[#1+1]\nX#1\no2 endrepeat\no1 endrepeat\n"
    assert column(read(begin + nested), 0) == [0, 1, 2, 3, 4]
    assert column(read(begin + "o[3-2] repeat [2] (twice)\n#1=[#1+1]\nN7 X#1\nO#5220 endrepeat\n"), 0) == [0, 1, 2]


def test_loops_of_plain_lines_are_read_fast(read):
    text = "G21 G0 X0 Y0 Z0\nG1 F9\no1 repeat [200]\n" + "X1.5 Y2\nX2 Z1\n" * 1000 + "o1 endrepeat\nM2\n"
    begun = time.process_time()
    assert len(read(text)) == 400_001
    assert time.process_time() - begun < 6.0


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("o1 while [1]\n#1=2\no1 endwhile\n", 2, ["50000 blocks"]),
        ("o1 repeat [99999999]\nX1\nX2\no1 endrepeat\n", 3, ["50000 blocks"]),
        ("o1 sub\no1 call\no1 endsub\no1 call\n", 3, ["9 deep"]),
        ("o1 call\n", 2, ["O1 call", "not in this file"]),
        ("o1 sub\no1 endsub\no1 sub\no1 endsub\n", 4, ["O1 stands for two things"]),
        ("o1 if [1]\no1 endif\no1 if [1]\no1 endif\n", 4, ["O1 stands for two things"]),
        ("o1 endif\n", 2, ["O1 endif without its if"]),
        ("o1 if [1]\no1 endwhile\n", 3, ["without its while"]),
        ("o1 if [1]\no1 break\no1 endif\n", 3, ["O1 break without its while or do"]),
        ("o1 endsub\n", 2, ["O1 endsub outside"]),
        ("o1 if [0]\nX1\n", 2, ["without its end"]),
        ("o1 while [0]\nM2\n", 2, ["without its end"]),
        ("o1 if\no1 endif\n", 2, ["a value is missing"]),
        ("o1 if [1] X1\no1 endif\n", 2, ["other words"]),
        ("o1 call [1\n", 2, ["without an end"]),
        ("o<a> X1\n", 2, ["O words"]),
        ("o#1\n", 2, ["O words"]),
        ("o1 sub\no2 sub\nX1\no2 endsub\no1 endsub\no1 call\n", 3, ["within a subroutine"]),
        ("o1 call " + "[1]" * 31 + "\n", 2, ["O1 call"]),
    ],
)
def test_o_words_refused(read, monkeypatch, text, line, words):
    monkeypatch.setattr(reader, "_MOST_BLOCKS", 50_000)
    refuse(read, "G0 X0 Y0 Z0\n" + text, line, *words)


def test_what_is_skipped_is_not_read(read):
    assert len(read("G0 X0 Y0 Z0\no1 if [0]\nrubbish [ ( #\no7 if #\nM2\no1 endif\nX1\n")) == 2


# cycles: the motions that LinuxCNC makes are held against it in test_gcode_programs


def test_a_cycle(read):
    p = read("G21 G0 X0 Y0 Z20\nG98 G81 X10 Y0 Z-5 R2 F100\nX20\nG80\nM2\n")
    assert p.tip[:, [0, 2]].tolist() == [
        [0, 20], [10, 20], [10, 2], [10, -5], [10, 20], [20, 20], [20, 2], [20, -5], [20, 20],
    ]  # fmt: skip
    assert p.rapid.tolist() == [True] * 3 + [False] + [True] * 3 + [False, True]
    assert p.line.tolist() == [1, 2, 2, 2, 2, 3, 3, 3, 3] and p.notes == ()
    p = read("G21 G0 X0 Y0 Z20\nG82 X10 Z-5 R2 P1.5 F100\nM2\n")
    assert (p.tip[-1, 2], [(e.record, e.text) for e in p.events]) == (2, [(4, "G4 P1.5"), (5, "M2")])
    assert [n.line for n in p.notes if "G98 or G99" in n.text] == [2]


def test_cycles_turn_the_spindle(read):
    p = read("G21 G0 X0 Y0 Z20\nS50 M3\nG99 G84 X10 Z-5 R2 F100\nM2\n")
    assert [(e.record, e.text) for e in p.events][2:] == [(4, "M5"), (4, "M4"), (5, "M5"), (5, "M3"), (5, "M2")]
    assert p.rapid.tolist() == [True, True, True, False, False] and p.spindle[1:].tolist() == [50] * 4


# work systems, G92, reference points


def test_work_systems(read):
    text = "G10 L2 P1 X10 Y20 Z30\nG10 L2 P2 X11 Y22 Z33 R90\nG0 X1 Y1 Z1\nG55 X1\nY5\nG54 X0\n"
    # G55 has its origin at (1, 2) and is turned: (1, 1) is its (-1, 0), X1 leads to its (1, 0)
    np.testing.assert_allclose(read(text).tip, [[1, 1, 1], [1, 3, 1], [-4, 3, 1], [0, 3, 1]], atol=1e-12)
    p = read("G0 X1 Y1 Z1\nG10 L2 P2 X101 Y1.5 Z-1400\nG55 X1\n", workpiece=SHIFTED)
    np.testing.assert_allclose(p.tip, [[1, 1, 1], [2, 1, 1]], atol=1e-12)
    p = read("G0 X1 Y1 Z1\nG10 L20 P2 X0 Y0 Z0\nG55 X5\nG10 L20 P0 X0\nX1\n")
    assert p.tip.tolist() == [[1, 1, 1], [6, 1, 1], [7, 1, 1]]
    assert [e.text for e in p.events] == ["G10 L20 P2 X0 Y0 Z0", "G55", "G10 L20 P2 X0"]


def test_g10_moves_the_workpiece(read):
    p = read("G21 G10 L2 P1 X101 Y0.5 Z-1400\nG0 X1 Y1 Z1\nM2\n", workpiece=SHIFTED)
    assert p.tip.tolist() == [[2, 1, 1]] and [n.line for n in p.notes] == [1]
    p = read("G21 G10 L2 P1 X100 Y0.5 Z-1400\nG0 X1 Y1 Z1\nM2\n", workpiece=SHIFTED)
    assert p.tip.tolist() == [[1, 1, 1]] and p.notes == ()


def test_g92(read):
    p = read("G0 X1 Y2 Z3\nG92 X0 Y0\nX5\nG92.2\nX5\nG92.3\nX5\nG92.1\nG92.3\nX5\nG52 X1 A2\nX5 A0\n")
    assert column(p, 0) == [1, 6, 5, 6, 5, 6] and np.degrees(p.turns[-1, 0]) == pytest.approx(2)
    p = read("G92 X5 Y5 Z0\nG1 X6 F9\n")
    assert p.tip.tolist() == [[6, 5, 0]] and [n.line for n in p.notes if "G92" in n.text] == [1]


def test_reference_points(read):
    text = "#5161=100 #5162=0.5 #5163=-1300\nG0 X1 Y2 Z3\nG28 Z9\nG28\n"
    assert read(text, workpiece=SHIFTED).tip.tolist() == [[1, 2, 3], [1, 2, 9], [1, 2, 100], [0, 0, 100]]
    p = read("G91 G28 Z0\nG90 G0 X1 Y2\nG0 Z3\n", workpiece=SHIFTED, reference={"Z": -1300.0})
    assert p.tip.tolist() == [[1, 2, 100], [1, 2, 3]]
    p = read("G0 X1 Y2 Z3 A5\nG30.1\nX7 A0\nG30\n", workpiece=SHIFTED)
    np.testing.assert_allclose(p.tip[-1], [1, 2, 3], atol=1e-9)
    assert np.degrees(p.turns[-1, 0]) == pytest.approx(5)
    refuse(read, "G28 G91 Z0\n", 1, "#5163", workpiece=SHIFTED, reference={"X": 1.0})
    for options in ({"reference": {"Q": 1.0}}, {"start": {"X": math.nan}}, {"tools": {1: math.inf}}):
        with pytest.raises(InputError, match=next(iter(options))):
            read("G0 X1\n", **options)


# where the program begins


def test_a_start(read):
    p = read("M3\nG1 X1 F5\nG2 X3 I1\n", start={"X": 0.0, "Y": 2.0, "Z": 3.0, "B": 90.0})
    assert p.tip[:2].tolist() == [[0, 2, 3], [1, 2, 3]] and p.rapid[:2].tolist() == [True, False]
    assert p.line[:3].tolist() == [2, 2, 3] and [(e.record, e.text) for e in p.events] == [(1, "M3")]
    np.testing.assert_allclose(p.turns[:, 1], math.pi / 2)
    p = read("G1 X1 Y1 F5\nZ2\n", start={"Z": 3.0})
    assert p.tip.tolist() == [[1, 1, 3], [1, 1, 2]]


def test_a_first_z_alone(read):
    p = read("G21\nG1 Z5 F500\nG0 X0 Y0\nG1 Z-1\nM2\n")
    assert p.tip.tolist() == [[0, 0, 5], [0, 0, -1]] and [n.line for n in p.notes] == [2]
    refuse(read, "G1 Z5 F500\nX1\nY1\n", 2, "Y is not known")


def test_percent(read):
    for text in ("G0 X1\nG0 X2\n%\n", "%\nG0 X1\nG0 X2\n%\n", "G0 X1\nG0 X2\n%\nG0 X3\n"):
        assert column(read(text), 0) == [1, 2]


def test_polar_words(read):
    """Distances from the zero in force and angles from X; in G91 steps of both."""
    p = read("G0 X3 Y4 Z0\n@10\n^90\n@[2*5] ^#31\nG91 @2 ^90\n^90\nG20 @1\n")
    np.testing.assert_allclose(
        p.tip[:, :2], [[3, 4], [6, 8], [0, 10], [10, 0], [0, 12], [-12, 0], [-37.4, 0]], atol=1e-12
    )
    for text in ("G0 X0 Y0 Z0\n@1\n", "G0 X1 Y0 Z0\n@1 X2\n", "G0 @1\n", "G0 X1 Y0 Z0\nG81 @9 Z-1 R1 F9\n"):
        refuse(read, text, text.count("\n"), "@" if "81" in text else "polar")


def test_the_loaded_tools_offset(read):
    text = "G0 X0 Y0 Z0\n{}\nX#5403\n"
    assert column(read(text.format("T2 M6"), tools={2: 40.0}), 0) == [0, 40]
    assert column(read(text.format("G10 L1 P2 Z30\nM61 Q2"), tools={2: 40.0}), 0) == [0, 30]
    refuse(read, text.format(""), 3, "#5403")
    refuse(read, text.format("T2 M6"), 3, "#5403")


# other codes


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("T1 M6\nG43 H2\nG0 X0 Y0 Z0\nG1 X1 F9\nM2\n", 2),
        ("T1 M6\nG43\nG0 X0 Y0 Z0\nT2 M6\nG1 X1 F9\nM2\n", 4),
        ("G10 L1 P2 Z55\nT2 M6\nG43 H1\nG0 X0 Y0 Z0\nG1 X1 F9\nM2\n", 3),
        ("T1 M6\nG43\nG0 X0 Y0 Z0\nT2 M6\nG43\nG1 X1 F9\nM2\n", None),
        ("T1 M6\nG0 X0 Y0 Z0\nG1 X1 F9\nT2 M6\nG43\nG0 X2\nM2\n", 1),
        ("T1 M6\nG0 X0 Y0 Z0\nG43 H1\nG1 X1 F9\nM2\n", None),
    ],
)
def test_a_tool_with_another_ones_offset_is_told(read, text, line):
    path = read("G21 G90\n" + text, tools={1: 100.0, 2: 200.0})
    told = [note.line for note in path.notes if "not with its own" in note.text]
    assert told == ([] if line is None else [line + 1])


def test_an_offset_in_the_block_of_a_change_needs_its_number(read):
    text = "G21 G90\nT1 M6 G43{}\nG0 X0 Y0 Z0\nM2\n"
    after = "G21 G90\nT1 M6\nG43{}\nG0 X0 Y0 Z0\nM2\n"
    for number in ("", " H0", " H1"):  # rs274 takes the tool in the spindle for H0 too
        assert read(after.format(number), tools={1: 100.0}).tools[0].data["set_length"] == 100.0
    assert read(text.format(" H1"), tools={1: 100.0}).tools[0].data["set_length"] == 100.0
    with pytest.raises(InputError, match="expected H") as caught:
        read(text.format(""), tools={1: 100.0})
    assert caught.value.line == 2
    assert "set_length" not in read(text.format("")).tools[0].data


def test_codes_that_pass_through(read):
    p = read("G21 G0 X0 Y0 Z0\nM64 P0\nM67 E1 Q2.5\nM66 P1 L3 Q2\nM101 P5\nM10\nM106 S255\nM50 P0\nM19 R90\nX1 M2\n")
    expected = ["M64 P0", "M67 E1 Q2.5", "M66 P1 L3 Q2", "M101 P5", "M10", "S255", "M106", "M50 P0", "M19 R90", "M2"]
    assert [e.text for e in p.events] == expected
    assert [(n.line, n.text.split(":")[0]) for n in p.notes] == [(5, "M101"), (6, "M10"), (7, "M106")]


def test_words_without_effect(read):
    p = read("G21 G40 D1\nG17 G0 X10 Y0 Z0\nG3 X0 Y10 I-10 K0 F9\nM2\n")
    np.testing.assert_allclose(np.hypot(*p.tip[:, :2].T), 10, atol=1e-9)
    assert [n.line for n in p.notes] == [1]


@pytest.mark.parametrize(
    ("text", "line", "control"),
    [
        ("0 BEGIN PGM TEST MM\n", 1, "Heidenhain"),
        ("BEGIN PGM X MM\n", 1, "Heidenhain"),
        ("L X+10 Y+20 R0 FMAX\n", 1, "Heidenhain"),
        ("%test G71 *\nN10 G00 X0*\n", 1, "Heidenhain"),
        ("; %_N_PART_MPF\nN10 G90 G71\n", 2, "Siemens"),
        ("G0 X0\nG0 A0. C=30.\n", 2, "Siemens"),
        ("G0 X0\nCYCLE832(0.01)\n", 2, "Siemens"),
        ("G0 X0\nG0 A3=0 B3=0 C3=1\n", 2, "Siemens"),
        ("G0 X0\nAROT Z30\n", 2, "Siemens"),
        ("G0 X0\nSTART_PRINT BED=60\n", 2, "Marlin"),
        (";FLAVOR:Marlin\nG28\n", 2, "Marlin"),
        ("G0 X0 F1\nG1 X1 E0.5\n", 2, "Marlin"),
        ("SET_VELOCITY_LIMIT ACCEL=1\n", 1, "Marlin"),
        ("G0 X0\n$H\n", 2, "grbl"),
        ("G0 X0\nG187 P1\n", 2, "Haas"),
        ("G0 X0\nG103 P1\n", 2, "Haas"),
        ("G0 X0\nG12 I10 F9\n", 2, "Haas"),
        ("G0 X0\nG154 P5\n", 2, "Haas"),
        ("$J=G91 X10 F100\n", 1, "grbl"),
        ("N5 $P_UIFR[1,X,TR]=5\n", 1, "Siemens"),
        ("G0 X0\nG05 P10000\n", 2, "Fanuc"),
        ("G0 X0\nG5.1 Q1\n", 2, "Fanuc"),
        ("G0 X0\nM98 P100\n", 2, "Fanuc"),
        ("G0 X0\nIF[#1EQ1]GOTO 10\n", 2, "Fanuc"),
        ("G0 X0\nG68.2 X0\n", 2, "Fanuc"),
        ("G0 X0\nG54.1 P3\n", 2, "Fanuc"),
    ],
)
def test_other_controls_are_named(read, text, line, control):
    refuse(read, text, line, "is of a program for " + control)


def test_the_end_of_a_long_line_is_its_own(read):
    text = "G1 X [" + "1+" * 196 + "1*" + "2]"  # the 400th character is the asterisk
    with pytest.raises(InputError) as caught:
        read(f"G21 G90\n{text} Q5\n")
    assert text[399] == "*" and "Heidenhain" not in str(caught.value)


def test_plain_programs_of_other_controls_are_read(read):
    for head in ("(FANUC 31i)", "; grbl", "(Haas VF2)", ";FLAVOR:Marlin"):
        assert len(read(f"{head}\nG21 G90\nG0 X0 Y0 Z0\nG1 X1 F5\nM30\n")) == 2


# whatever comes

PIECES = [
    "o1 sub", "o1 endsub", "o1 call [1] [2]", "o2 if [#1 LT 3]", "o2 else", "o2 endif", "o3 while [#2 LT 4]",
    "o3 endwhile", "o4 do", "o4 while [0]", "o5 repeat [3]", "o5 endrepeat", "o3 break", "o3 continue", "o1 return [1]",
    "#1=[#1+1]", "#2=[#2+1]", "#<a>=4", "X#1 Y[#2*2]", "X#<a>", "G0", "G1", "G81 X1 Z-1 R1", "G83 X1 Z-9 R1 Q2", "G80",
    "G92 X1", "G92.1", "G92.3", "G10 L2 P1 X1 R30", "G10 L20 P2 X0 Y0 Z0", "G55", "G54", "G28 Z1", "G28.1", "G53 Z0",
    "G43 H1", "G43.1 Z5", "G49", "G91", "G90", "G20", "G52 X1", "G18", "M3", "T1 M6", "G2 X3 I1", "[", "]", "#", "%",
    "M2", "X[1/0]", "o", "o<", "G91 G81 X1 Z-1 R1 L5", "G87 X1 Z-1 R1 I1 J1 K1", "B5", "G98", "EXISTS[#<a>]",
]  # fmt: skip
PLAIN = reader.read_plain_lines


def outcomes(data, monkeypatch):
    """Read bytes with the fast reader and without it."""
    for run in (PLAIN, lambda lines, at, first, motion: at):
        monkeypatch.setattr(reader, "read_plain_lines", run)
        try:
            made = reader.GcodeReader("f", len(data), 0.5, SHIFTED, {1: 30.0}, {"X": 0.0, "Y": 0.0, "Z": 9.0})
            with np.errstate(all="ignore"):
                yield made.read(io.BytesIO(data), lambda fraction: None)
        except InputError as error:
            yield str(error)


@pytest.mark.parametrize("seed", range(4))
def test_random_lines(monkeypatch, seed):
    monkeypatch.setattr(reader, "_MOST_BLOCKS", 2_000)
    rng, read_ones = random.Random(seed), 0
    for _ in range(1500):
        lines = ["G21 G0 X1 Y2 Z3 F9", *rng.choices(PIECES, k=rng.randint(1, 12))]
        data = "\n".join(lines).encode()
        if rng.random() < 0.2:
            k = rng.randrange(len(data))
            data = data[:k] + bytes([rng.choice(b"[]#<>oX=1. /*")]) + data[k + rng.randint(0, 2) :]
        fast, slow = outcomes(data, monkeypatch)
        if isinstance(slow, str) or isinstance(fast, str):
            assert fast == slow and slow.startswith("f:") and slow.isprintable(), data
            continue
        assert fast.tip.tobytes() == slow.tip.tobytes() and fast.events == slow.events and fast.notes == slow.notes
        assert np.isfinite(fast.tip).all() and np.isfinite(fast.axis).all()
        read_ones += 1
    assert read_ones > 100


@pytest.mark.parametrize("text", ["[" * 3000, "#" * 3000, "-" * 3000 + "1", "sin[" * 900, "#<" * 1500, "1" * 3999])
def test_deep_lines_end_soon(read, text):
    for begin in ("G0 X", "#1=", "o1 if ", "o1 call ", "o"):
        begun = time.process_time()
        with pytest.raises(InputError):
            read(begin + text + "\n")
        assert time.process_time() - begun < 1.0


# small files that went wrong elsewhere

RIGHT = [
    ("k0", "G21 G90 G17\nG0 X10 Y0 Z0\nG1 Z-1 F100\nG2 X0 Y-10 I-10 J0 K0\nM2\n", (0, -10, -1)),
    ("k0b", "G21 G90 G17\nG0 X10 Y0 Z0\nG1 Z-1 F100\nG3 X0 Y10 Z-1 I-10 J0 K0.000\nM2\n", (0, 10, -1)),
    ("tail_pct", "G21 G90\nG0 X0 Y0 Z5\nG1 Z-1 F100\nX10\nM2\n%\n", (10, 0, -1)),
    ("tail_pct_no_m2", "G21 G90\nG0 X0 Y0 Z5\nG1 Z-1 F100\nX10\n%\n", (10, 0, -1)),
    ("expr", "G21 G90\nG0 X0 Y0 Z[2*3]\nG1 X[1+2] F100\nM2\n", (3, 0, 6)),
    ("var", "G21 G90\n#1=5\nG0 X0 Y0 Z#1\nG1 X1 F100\nM2\n", (1, 0, 5)),
    ("g81", "G21 G90\nG0 X0 Y0 Z20\nG98 G81 X10 Y0 Z-5 R2 F100\nX20\nG80\nM2\n", (20, 0, 20)),
    ("g83", "G21 G90\nG0 X0 Y0 Z20\nG99 G83 X10 Y0 Z-15 R2 Q3 F100\nX20\nG80\nG0 Z20\nM2\n", (20, 0, 20)),
    ("g92", "G21 G90\nG0 X0 Y0 Z0\nG92 X0\nG1 X1 F100\nM2\n", (1, 0, 0)),
    ("g92z", "G21 G90\nG92.1\nG0 X0 Y0 Z0\nG1 X1 F100\nM2\n", (1, 0, 0)),
    ("zfirst", "G21 G90\nG1 Z5 F500\nG0 X0 Y0\nG1 Z-1 F100\nX10\nM2\n", (10, 0, -1)),
    ("m62", "G21 G90\nG0 X0 Y0 Z0\nM64 P0\nG1 X1 F100\nM65 P0\nM2\n", (1, 0, 0)),
    ("d_word", "G21 G90 G40 D1\nG0 X0 Y0 Z0\nG1 X1 F100\nM2\n", (1, 0, 0)),
    ("m106", "G21 G90\nG0 X0 Y0 Z0\nM106 S255\nG1 X1 F100\nM107\nM2\n", (1, 0, 0)),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "end"), RIGHT)
def test_small_files(tmp_path, name, text, end):
    (tmp_path / f"{name}.nc").write_text(text)
    np.testing.assert_allclose(read_gcode(tmp_path / f"{name}.nc", arc_tolerance=0.1).tip[-1], end, atol=1e-9)


@pytest.mark.parametrize(
    "loop",
    [
        "o1 while [#1 GT 3]\nX1\no1 endwhile",
        "o1 do\nX1\no1 while [1]",
        "o1 while [1]\no2 if [#1 LT 9]\no1 continue\no2 endif\no1 endwhile",
    ],
)
def test_a_loop_that_sets_nothing_never_ends(read, loop):
    start = time.process_time()
    with pytest.raises(InputError, match="never ends"):
        read("G0 X0 Y0 Z0\n#1=5\n" + loop + "\nM2\n")
    assert time.process_time() - start < 1.0


@pytest.mark.parametrize(
    ("loop", "count"),
    [
        ("o1 repeat [3]\no2 while [1]\nX1\no2 break\no2 endwhile\no1 endrepeat", 4),
        ("o1 repeat [3]\no2 do\nX1\no2 break\no2 while [1]\no1 endrepeat", 4),
        ("G91\no1 while [#5420 LT 3]\nX1\no1 endwhile", 4),
        ("o1 repeat [3]\no2 while [0]\nX1\no2 endwhile\nX2\no1 endrepeat", 4),
    ],
)
def test_loops_that_end_without_setting_a_parameter(read, loop, count):
    assert len(read("G0 X0 Y0 Z0\n" + loop + "\nM2\n")) == count


def test_a_program_that_never_ends_is_refused_soon():
    """Bounded by a count of blocks, so that a file has one answer; the count is some seconds of work."""
    lines = ["G21 G90 F100", "#1=0", "o1 while [1]", "#1=[#1+1]", "G1 X[#1] Y0 Z0", "o1 endwhile", "M2"]
    data, begun = "\n".join(lines).encode(), time.process_time()
    with pytest.raises(InputError, match="expected a program that ends"):
        reader.GcodeReader("f", len(data), 0.5).read(io.BytesIO(data), lambda fraction: None)
    assert time.process_time() - begun < 15.0  # some 4 of an idle processor
