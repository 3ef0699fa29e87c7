"""Machine files: every kind of error with its text and line, and fuzz."""

from __future__ import annotations

import re
import time
import warnings
from math import isfinite

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from machine_texts import GOOD, errors_of, write

from parakin.description import find_machine_file, list_shipped_machines, read_machine
from parakin.errors import InputError, InputErrors

# Errors.

MISTAKES = [
    ("clearance: 50", "clearence: 50", ['m.yaml:18: unknown key "clearence" in limits, did you mean "clearance"?']),
    ("motion:", "moton:", ['m.yaml:1: missing key "motion"', 'm.yaml:6: unknown key "moton", did you mean "motion"?']),
    (
        "  range: [200",
        "  rnage: [200",
        ['m.yaml:7: missing key "range" in legs', 'm.yaml:12: unknown key "rnage" in legs, did you mean "range"?'],
    ),
    ("[200 mm,", "[200,", ['m.yaml:12: range: "200" needs a unit: mm, cm, m, in']),
    ("[200 mm,", "[200 deg,", ['m.yaml:12: range: "200 deg" is an angle, expected a length (mm, cm, m, in)']),
    ("[200 mm,", "[700 mm,", ["m.yaml:12: range: [700 mm, 650 mm] is empty, expected [low, high] with low < high"]),
    (
        "650 mm]",
        "650 mm]\n  lead: 0 mm",
        ["m.yaml:13: lead: zero, expected what the joint moves while the motor turns once"],
    ),
    ("650 mm]", "650 mm]\n  counts: 0", ['m.yaml:13: counts: "0" is out of range, expected more than 0, at most 1e9']),
    (
        "650 mm]",
        "650 mm]\n  homing: absolut",
        ['m.yaml:13: homing: "absolut": undefined size "absolut", expected one of R, r, or the word absolute'],
    ),
    (
        "650 mm]",
        "650 mm]\n  homing: [absolute, 2 deg, 20 mm]",
        ['m.yaml:13: homing: "2 deg" is an angle, expected a length (mm, cm, m, in), or the word absolute'],
    ),
    (
        "650 mm]",
        "650 mm]\n  homing: [absolute, 155 mm, 696 mm]",
        [
            "m.yaml:13: homing: the switch at 696 mm is far outside of the joint's range, "
            "expected one in 200 to 650 mm or just beside"
        ],
    ),
    (
        "speed: 10 rpm",
        "homing: 2 rad",
        [
            "m.yaml:14: homing: the switch at 114.592 deg is far outside of the joint's range, "
            "expected one in -90 to 90 deg or just beside"
        ],
    ),
    ("[200 mm, 650 mm]", "[200 mm]", ["m.yaml:12: range: expected a pair [low, high], got 1 value"]),
    ("[200 mm, 650 mm]", "650 mm", ['m.yaml:12: range: expected a pair [low, high], got "650 mm"']),
    ("[200 mm,", "[.nan,", ['m.yaml:12: range: ".nan": can\'t read "."']),
    ("[200 mm,", "[1e999 mm,", ['m.yaml:12: range: "1e999 mm" is not a finite value']),
    ("[200 mm,", "[-3000 km,", ['m.yaml:12: range: "-3000 km": unknown unit "km", did you mean "m"?']),
    ("[200 mm,", "[-3000 m,", ['m.yaml:12: range: "-3000 m" is out of range, expected -1 km to 1 km']),
    (" 50 mm", " -50 mm", ['m.yaml:18: clearance: "-50 mm" is out of range, expected more than 0 mm, at most 1 km']),
    (" 50 mm", " 50 mm\n  joined: [d1]", ['m.yaml:19: joined: expected the names of two joints, got "d1"']),
    ("circle: r,", "circle: -r,", ['m.yaml:11: circle: "-r" is out of range, expected more than 0 mm, at most 1 km']),
    ("circle: r,", "circle: l4,", ['m.yaml:11: circle: "l4": undefined size "l4", expected one of R, r']),
    ("0.2 * R", "0.2 * RR", ['m.yaml:5: r: "0.2 * RR": undefined size "RR", did you mean "R"?']),
    ("circle: R", "circle: R / r", ['m.yaml:10: circle: "R / r" is a number, expected a length (mm, cm, m, in)']),
    (
        "  r: 0.2",
        "  mm: 5 mm\n  r: 0.2",
        ["m.yaml:5: mm: a unit or a function has this name, expected another for a size"],
    ),
    ("kind: length", "kind: lenght", ['m.yaml:8: legs: unknown leg kind "lenght", did you mean "length"?']),
    (
        "  kind: length\n",
        "",
        [
            'm.yaml:7: legs: missing key "kind", expected one of column, crank, driven_column, lambda, length, '
            "ring, slider"
        ],
    ),
    ("tx ty rz", "tx ty rw", ['m.yaml:6: motion: unknown word "rw", expected one of tx, ty, tz, rx, ry, rz']),
    (
        "sizes:\n",
        "sizes:\n  2R: 5 mm\n",
        ['m.yaml:4: size "2R" is no name, expected a plain word (letters, digits, _; at most 40)'],
    ),
    (
        "tx ty rz",
        "tx ty tz rz",
        [
            "m.yaml:7: legs: 3 joints (q1, q2, q3) for 4 words of motion (tx ty tz rz), "
            "expected at least as many joints as words"
        ],
    ),
    ("[q1, q2, q3]", "[q1, q2, q1]", ['m.yaml:9: joint "q1" is used twice, first in line 9']),
    ("joint: turn", "joint: q2", ['m.yaml:14: joint "q2" is used twice, first in line 9']),
    (
        "[q1, q2, q3]",
        "[q1, q2, 3q]",
        ['m.yaml:9: joints: expected a plain word (letters, digits, _; at most 40), got "3q"'],
    ),
    ("[q1, q2]", "[q1, q_2]", ['m.yaml:17: between: unknown joint "q_2", did you mean "q2"?']),
    ("[q1, q2]", "[q1, turn]", ['m.yaml:17: between: joint "turn" turns, expected one that slides']),
    (
        "210 deg, 330 deg]}\n  r",
        "210 deg]}\n  r",
        ["m.yaml:11: platform: 2 values for 3 legs, expected one for all or one a leg"],
    ),
    ("true", "yes", ['m.yaml:14: reverse: expected true or false, got "yes"']),
    ("10 rpm", "10 mm/s", ['m.yaml:14: speed: "10 mm/s" is a speed, expected an angular speed (deg/s, rad/s, rpm)']),
    ("10 rpm", "0 rpm", ['m.yaml:14: speed: "0 rpm" is out of range, expected more than 0 (deg/s, rad/s, rpm)']),
    ("- tz: -r", "- -r", ['m.yaml:15: head: expected one transform such as tz: 100 mm, got "-r"']),
    ("- tz: -r", "- tw: -r", ['m.yaml:15: head: unknown transform "tw", expected one of tx, ty, tz, rx, ry, rz']),
    ("C: 0 deg", "C: 5 mm", ['m.yaml:19: C: "5 mm" is a length, expected an angle (deg, rad)']),
    ("C: 0 deg", "c: 0 deg", ['m.yaml:19: unknown key "c" in home, did you mean "C"?']),
    (
        "  clearance: 50 mm",
        "  passive: {tz: [0 mm, 1 mm]}",
        ["m.yaml:18: passive limit of tz, which is not in the motion tx ty rz"],
    ),
    ("motion:", "name: again\nmotion:", ['m.yaml:6: key "name" is written twice, first in line 1']),
    (
        "name: bench",
        "name: my bench",
        ['m.yaml:1: name: expected a plain word (letters, digits, _; at most 40), got "my bench"'],
    ),
    ("Sizes were chosen.", "", ['m.yaml:2: source: expected some words, got ""']),
    ("home: {", "home: [", ["m.yaml:19: not valid YAML: expected ',' or ']', but got '}'"]),
    ("  r: 0.2", "\tr: 0.2", ["m.yaml:5: not valid YAML: found character '\\t' that cannot start any token"]),
    (
        "name: bench",
        "name: !!python/name:os.system x",
        ['m.yaml:1: tag "tag:yaml.org,2002:python/name:os.system" is not known here, expected none'],
    ),
    (
        "name: bench",
        "mounting: inclned 3 deg\nname: x",
        ['m.yaml:1: mounting: unknown mounting "inclned 3 deg", did you mean "inclined"?'],
    ),
    (
        "name: bench",
        "mounting: [rz: {joint: q, range: [0 deg, 1 deg]}]",
        ['m.yaml:1: mounting: joint "q" can\'t be in the mounting, expected head or table'],
    ),
]


@pytest.mark.parametrize(("old", "new", "expected"), MISTAKES, ids=[m[1].strip()[:30] for m in MISTAKES])
def test_mistake(tmp_path, old, new, expected):
    assert old in GOOD
    assert errors_of(tmp_path, GOOD.replace(old, new, 1)) == expected


def test_several_errors_in_line_order(tmp_path):
    text = GOOD.replace("50 mm\n", "50\n").replace("R: 500 mm", "R: 500 furlong").replace("rz: {joint: turn,", "rz: {")
    text = text.replace("kind: length", "kind: length\n  branch: '+'")
    assert errors_of(tmp_path, text) == [
        'm.yaml:4: R: "500 furlong": unknown unit "furlong", expected a unit such as mm, in or deg',
        'm.yaml:9: unknown key "branch" in legs, expected one of '
        "kind, joints, range, speed, acceleration, jerk, counts, lead, homing, offset, force, rated, power, "
        "inertia, stiffness, platform, foot",
        'm.yaml:15: missing key "joint" in head',
        'm.yaml:19: clearance: "50" needs a unit: mm, cm, m, in',
    ]
    with pytest.raises(InputErrors) as caught:
        read_machine(write(tmp_path, text))
    assert [e.line for e in caught.value.errors] == [4, 9, 15, 19]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "m.yaml:1: empty, expected a machine's description"),
        (b"# only a comment\n", "m.yaml:1: empty, expected a machine's description"),
        (b"- a\n- b\n", "m.yaml:1: expected keys such as name, motion and legs, got a list"),
        (b"just words\n", 'm.yaml:1: expected keys such as name, motion and legs, got "just words"'),
        (b"a: 1\nb: \xff\xfe\n", "m.yaml:2: not a text file in UTF-8, expected YAML"),
        (b"a: 1\n\x00\n", "m.yaml:2: holds a character that YAML does not allow, expected text"),
        (b"a: 1\n---\nb: 2\n", "m.yaml:2: not valid YAML: but found another document"),
        (b"a: &x [*x]\n", "m.yaml:1: nested too deeply (does an alias hold itself?)"),
        (b"[" * 3000, "m.yaml:1: nested too deeply"),
        (b"x" * 200_000, "m.yaml: longer than 100000 bytes, expected a YAML file of some twenty lines"),
        (
            b"".join(b"%c: &%c [%s]\n" % (c, c, b"*%c,1," % (c - 1) * 8 if c > 97 else b"1") for c in b"abcdef"),
            "m.yaml:3: more than 20000 values, aliases included",
        ),
    ],
)  # fmt: skip
def test_no_machine_at_all(tmp_path, content, message):
    path = tmp_path / "m.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_machine(path)
    assert str(caught.value) == f"{tmp_path}/{message}"


def test_no_file(tmp_path):
    with pytest.raises(InputError, match="can't read this file: No such file or directory"):
        read_machine(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="can't read this file: Is a directory"):
        read_machine(tmp_path)


def test_machine_file(tmp_path):
    assert find_machine_file("tricept") == list_shipped_machines()["tricept"]
    assert find_machine_file(tmp_path / "x.yaml") == tmp_path / "x.yaml"
    with pytest.raises(InputError, match=r'unknown machine "tricpt", did you mean "tricept"\?'):
        find_machine_file("tricpt")
    with pytest.raises(InputError, match="an empty name"):
        find_machine_file("")


# Fuzz: whatever a file holds, it is read or refused with a place.

SOURCES = [GOOD, *(p.read_text(encoding="utf-8") for p in list_shipped_machines().values())]
JUNK = st.one_of(
    st.text(max_size=12),
    st.sampled_from(list("{}[],:-&*!|>'\"%@`#\t\n?~0/")),
    st.sampled_from([".nan", ".inf", "0x10", "1e999", "<<:", "&a", "*a", "!!int", "---", "...", "()", "sqrt(", "mm"]),
    st.sampled_from(["9" * 500, "[" * 60, "(" * 60, "- " * 30, "a: {b: [c", "%YAML 9.9\n---"]),
    st.sampled_from(["\ud7ff", "\u2028", "\x85", "\ufeff", "null", "true"]),
)


def read_or_refuse(path):
    try:
        spec = read_machine(path)
    except InputError as error:
        for line in str(error).split("\n"):
            assert re.match(r"(parameters|.*\.yaml(:\d+)?): \S", line), line
            assert line.isprintable()
    else:
        assert all(isfinite(v) for v in spec.home.values())
        assert all(d.low < d.high for d in spec.drives)


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_mutated_files(tmp_path, data):
    text = data.draw(st.sampled_from(SOURCES))
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(text)))
        length = data.draw(st.integers(0, 12))
        text = text[:start] + data.draw(JUNK) + text[start + length :]
    path = tmp_path / "f.yaml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    read_or_refuse(path)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_swapped_values(tmp_path, data):
    """Pieces between YAML's signs change places, so most files still are YAML and the mistakes lie deeper."""
    text = data.draw(st.sampled_from(SOURCES))
    pieces = re.split(r"([\n,:\[\]{}])", text)
    for _ in range(data.draw(st.integers(1, 4))):
        at = 2 * data.draw(st.integers(0, len(pieces) // 2))
        pieces[at] = data.draw(st.sampled_from(pieces[::2])).replace("#", "")
    path = tmp_path / "f.yaml"
    path.write_text("".join(pieces), encoding="utf-8")
    read_or_refuse(path)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=200))
def test_binary(tmp_path, content):
    path = tmp_path / "f.yaml"
    path.write_bytes(content)
    read_or_refuse(path)


@pytest.mark.parametrize(
    "content",
    [
        "[" * 90_000,
        "sizes: " + "[" * 5000 + "]" * 5000,
        "\n".join(f"a{i}: &a{i} [{','.join([f'*a{i - 1}'] * 9) if i else ''}]" for i in range(12)),
        GOOD.replace("motion: ", "motion: " + "tx " * 20_000),
        "sizes: {" + ", ".join(f"s{i}: s{i - 1}*1" for i in range(3000, 0, -1)) + "}",
        "sizes: {a: &x 1 mm, b: &x 2 mm}",
    ],
)
def test_long_and_deep_files_are_refused_shortly_and_soon(tmp_path, content):
    path = tmp_path / "f.yaml"
    path.write_text(content)
    began = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(InputError) as caught:
            read_machine(path)
    assert time.process_time() - began < 20.0
    lines = str(caught.value).split("\n")
    assert len(lines) <= 31
    assert all(re.match(r".*\.yaml:\d+: \S", line) and len(line) < 600 for line in lines)
