"""Controls that run joint programs, as small interpreters after their documents: nothing of the writers' is used.

Each takes a program's text to a :class:`Run`; what the control would refuse is an ``AssertionError``.
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import NamedTuple

import numpy as np

WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))")


class Run(NamedTuple):
    """What a control did: the axes' rows (k, axes), the s to each, whether it stopped exactly there, and actions.

    Actions are by the number of motions before them.
    """

    axes: str
    rows: np.ndarray
    seconds: np.ndarray
    exact: np.ndarray
    actions: list[tuple[int, str]]


class Recorder:
    """Notes motions and actions in their order."""

    def __init__(self):
        self.axes, self.rows, self.seconds, self.exact, self.actions = "", [], [], [], []

    def move(self, words, seconds, exact=False):
        axes = "".join(letter for letter, _ in words)
        self.axes = self.axes or axes
        assert axes == self.axes, "every block has a value for every axis"
        self.rows.append([value for _, value in words])
        self.seconds.append(seconds)
        self.exact.append(exact)

    def act(self, text):
        self.actions.append((len(self.rows), text))

    @property
    def run(self):
        return Run(self.axes, np.array(self.rows), np.array(self.seconds), np.array(self.exact), self.actions)


def read_single(text):
    """grbl's read_float: eight digits, in single precision."""
    sign = -1.0 if text.startswith("-") else 1.0
    digits = text.lstrip("+-")
    whole, _, part = digits.partition(".")
    assert len(whole) <= 8
    kept = (whole + part)[:8]
    return float(np.float32(sign * int(kept) * 10.0 ** -max(len(kept) - len(whole), 0)))


GRBL_G = {10, 4, 53, 28, 30, 92, 0, 1, 2, 3, 38, 80, 17, 18, 19, 90, 91, 93, 94, 20, 21, 40, 43, 49, 54, 61}
GRBL_GROUPS = [
    {4, 10, 28, 30, 53, 92},
    {0, 1, 2, 3, 38, 80},
    {17, 18, 19},
    {90, 91},
    {93, 94},
    {20, 21},
    {40},
    {43, 49},
]
GRBL_M = {0, 1, 2, 30, 3, 4, 5, 8, 9}


def run_grbl(text, axes="XYZ", longest=79, codes=GRBL_M, shown=False):
    """Run a program as grbl 1.1 does (protocol.c, gcode.c); FluidNC is the same with other axes and codes."""
    recorder, inverse, ended = Recorder(), False, False
    modal = {"units": None, "distance": None}
    for raw in text.split("\n"):
        assert not set(raw) & set("!~?"), "realtime commands act inside comments, too"
        assert raw.isascii() and (longest > 79 or len(raw) < 127), "the serial buffer"
        message = re.fullmatch(r"\(MSG,(.*)\)", raw)
        if message and shown:
            recorder.act(f"message {message[1]}")
        line = re.sub(r"\([^)]*\)", "", raw).replace(" ", "").replace("/", "").upper()
        assert len(line) <= longest and "(" not in line and ")" not in line
        if not line:
            continue
        assert not ended
        words = WORD.findall(line)
        assert "".join(letter + value for letter, value in words) == line, line
        g = [float(value) for letter, value in words if letter == "G"]
        m = [float(value) for letter, value in words if letter == "M"]
        values = [(letter, read_single(value)) for letter, value in words if letter not in "GM"]
        assert set(g) <= GRBL_G and set(m) <= set(codes), f"error 20: {line}"
        assert all(len(group & set(g)) <= 1 for group in GRBL_GROUPS), "error 21"
        assert len({letter for letter, _ in values}) == len(values), "error 25"
        inverse = True if 93 in g else False if 94 in g else inverse
        modal |= {"units": 21 in g or modal["units"], "distance": 90 in g or modal["distance"]}
        given = dict(values)
        moved = [(letter, value) for letter, value in values if letter in axes]
        assert set(given) <= set(axes) | set("FSP" + ("EQL" if shown else "")), f"error 20: {line}"
        if moved:
            assert 1 in g and 53 in g and inverse and all(modal.values())
            assert given.get("F", 0.0) > 0.0, "error 22: undefined feed rate"
            assert not set(given) & set("PS")
            recorder.move(moved, 60.0 / given["F"])
        elif 4 in g:
            recorder.act(f"dwell {given['P']:g}")
        elif "S" in given or m:
            texts = [f"speed {given['S']:g}"] if "S" in given else []
            texts += [f"M{code:g}" + "".join(f" {k}{v:g}" for k, v in values if k in "PEQL") for code in m]
            for action in texts:
                recorder.act(action)
            ended = bool({2.0, 30.0} & set(m))
    assert ended
    return recorder.run


def run_fluidnc(text):
    return run_grbl(text, "XYZABC", 254, GRBL_M | {6, 7, 61, 62, 63, 64, 65, 66, 67, 68}, shown=True)


def run_fanuc(text):
    """Run a program as a Fanuc 16 does with increment system IS-B."""
    lines = text.split("\n")
    assert lines[0] == "%" and lines[-2:] == ["%", ""] and re.match(r"O\d{4} \(", lines[1])
    recorder, inverse, modal = Recorder(), False, set()
    for line in lines[1:-2]:
        assert "%" not in line and len(line) <= 72
        assert re.fullmatch(r"(?:O\d{4} )?(?:\([A-Z0-9 +\-.,/*=\[\]:]*\)|[A-Z0-9 .\-]+)", line), line
        code = re.sub(r"\(.*\)", "", line)
        words = WORD.findall(code)
        assert "".join(letter + value for letter, value in words) == code.replace(" ", "")
        g = [int(value) for letter, value in words if letter == "G"]
        modal |= set(g)
        inverse = True if 93 in g else False if 94 in g else inverse
        given = {letter: value for letter, value in words if letter not in "GO"}
        moved = [(letter, value) for letter, value in words if letter in "XYZUVWABC"]
        if 4 in g:
            assert set(given) == {"X"} and "." in given["X"]
            recorder.act(f"dwell {float(given['X']):g}")
        elif moved:
            assert 1 in g and inverse and {21, 90, 40, 49, 54, 64} <= modal and not {53, 43, 68} & modal
            assert all(re.fullmatch(r"-?\d{1,5}\.\d{3}", value) for _, value in moved), line
            assert re.fullmatch(r"\d{1,4}\.\d{3}", given["F"]) and 0.001 <= float(given["F"]) <= 9999.999
            recorder.move([(k, float(v)) for k, v in moved], 60.0 / float(given["F"]), 9 in g)
        else:
            if "S" in given:
                assert re.fullmatch(r"\d{1,5}", given["S"])
                recorder.act(f"speed {given['S']}")
            if "M" in given:
                recorder.act(f"M{given['M']}")
    assert recorder.actions[-1] == (len(recorder.rows), "M30")
    return recorder.run


def run_siemens(text):
    """Run a program as a Sinumerik 840D does."""
    lines = text.split("\n")
    assert re.fullmatch(r"%_N_[A-Z][A-Z0-9_]+_MPF", lines[0]) and lines[1] == ";$PATH=/_N_MPF_DIR" and lines[-1] == ""
    recorder, modal = Recorder(), set()
    for line in lines[2:-1]:
        assert len(line) <= 512
        code = line.partition(";")[0] if not line.startswith("MSG") else line
        message = re.fullmatch(r'MSG\("([^"]*)"\)', code)
        if message:
            recorder.act(f"message {message[1]}")
            continue
        tokens = code.split()
        if "SUPA" in tokens:
            assert {"TRAFOOF", "D0", "G90", "G71", "G93", "G64", "G601", "G40"} <= modal
            tokens.remove("SUPA")
            exact = "G9" in tokens
            assert "G1" in tokens
            words = [WORD.fullmatch(token).groups() for token in tokens if token not in ("G9", "G1")]
            assert words[-1][0] == "F" and float(words[-1][1]) > 0.0
            assert all(letter in "XYZUVWABC" for letter, _ in words[:-1])
            recorder.move([(k, float(v)) for k, v in words[:-1]], 60.0 / float(words[-1][1]), exact)
        elif tokens[:1] == ["G4"]:
            assert len(tokens) == 2 and tokens[1][0] == "F"
            recorder.act(f"dwell {float(tokens[1][1:]):g}")
        else:
            modal |= set(tokens)
            assert all(re.fullmatch(r"[GMD]\d+|TRAFOOF|S[\d.]+", token) for token in tokens), line
            for token in tokens:
                if token[0] in "SM":
                    recorder.act(f"speed {float(token[1:]):g}" if token[0] == "S" else token)
    assert recorder.actions[-1] == (len(recorder.rows), "M30")
    return recorder.run


def run_heidenhain(text):
    """Run a program in Klartext as a TNC does; F is per minute of the axes' common way, FT the time."""
    lines = text.split("\n")
    assert lines.pop() == ""
    blocks = []
    for number, line in enumerate(lines):
        said, _, block = line.partition(" ")
        assert said == str(number) and len(line) <= 110
        blocks.append(block)
    name = re.fullmatch(r"BEGIN PGM ([A-Z0-9_]+) MM", blocks[0])[1]
    assert blocks[-1] == f"END PGM {name} MM" and blocks[-2] == "M30"
    recorder, before = Recorder(), None
    for block in blocks[1:-1]:
        axes = r"((?: [XYZUVWABC][-+]\d{1,5}\.\d{4})+)"
        line = re.fullmatch(rf"L{axes} R0 (F|FT)(\d+\.\d{{3}}) M91", block)
        if line:
            words = [(word[0], float(word[1:])) for word in line[1].split()]
            row, value = np.array([v for _, v in words]), float(line[3])
            assert 0.0 < value <= (99999.0 if line[2] == "F" else 999.999)
            mixed = any(letter in "ABC" for letter, _ in words) and any(letter in "XYZUVW" for letter, _ in words)
            assert mixed == (line[2] == "FT")
            way = np.nan if before is None else float(np.linalg.norm(row - before))
            assert way != 0.0
            recorder.move(words, value if mixed else 60.0 * way / value)
            before = row
        elif block.startswith(";"):
            assert "~" not in block
        elif block.startswith("CYCL DEF 9.1 DWELL "):
            recorder.act(f"dwell {float(block.split()[-1]):g}")
        elif block != "CYCL DEF 9.0 DWELL TIME":
            speed = re.fullmatch(r"TOOL CALL Z S(\d+)", block)
            assert speed or re.fullmatch(r"M\d+", block), block
            recorder.act(f"speed {speed[1]}" if speed else block)
    return recorder.run


class Table(NamedTuple):
    """A table of set positions: head lines, columns' names, and rows."""

    head: list[str]
    names: list[str]
    rows: np.ndarray


def read_twincat(text):
    """Read a table as a PLC does with FB_CSVMemBufferReader: semicolons, CRLF after every line."""
    assert text.endswith("\r\n") and text.count("\n") == text.count("\r\n")
    lines = text.split("\r\n")[:-1]
    count = int(re.match(r"# (\d+) lines of head", lines[0])[1])
    assert all(line.startswith("# ") for line in lines[: count - 1])
    names = lines[count - 1].split(";")
    rows = np.array([[float(field) for field in line.split(";")] for line in lines[count:]])
    assert rows.shape[1] == len(names)
    return Table(lines[: count - 1], names, rows)


def plan_as_grbl(steps, seconds, accelerations, deviation, blocks):
    """The seconds of grbl's planner, motion by motion: planner.c of 1.1 with its ring buffer, in plain loops.

    The buffer is kept full; a motion's speeds are final when it is taken out.
    """
    length = [float(np.sqrt(np.sum(np.square(step)))) for step in steps]
    unit = [np.asarray(step) / size for step, size in zip(steps, length, strict=True)]
    nominal = [size / time for size, time in zip(length, seconds, strict=True)]

    def limit(direction):
        return min(a / abs(x) for a, x in zip(accelerations, direction, strict=True) if x != 0.0)

    rate = [limit(direction) for direction in unit]
    junction = [0.0]
    for before, after in pairwise(unit):
        cosine = -float(before @ after)
        if cosine > 0.999999:
            junction.append(0.0)
        elif cosine < -0.999999:
            junction.append(np.inf)
        else:
            turn = after - before
            half = np.sqrt(0.5 * (1.0 - cosine))
            junction.append(limit(turn / np.linalg.norm(turn)) * deviation * half / (1.0 - half))
    greatest = [min(junction[i], nominal[i] ** 2, nominal[i - 1] ** 2 if i else np.inf) for i in range(len(length))]
    entry, total = 0.0, 0.0
    for i in range(len(length)):
        last = min(i + blocks, len(length))
        speeds = [0.0] * (last - i + 1)  # squares, planned backwards from a stand
        for k in range(last - 1, i, -1):
            speeds[k - i] = min(greatest[k], speeds[k - i + 1] + 2.0 * rate[k] * length[k])
        leave = min(speeds[1], entry + 2.0 * rate[i] * length[i])
        peak = min(nominal[i] ** 2, 0.5 * (entry + leave) + rate[i] * length[i])
        up, down = (peak - entry) / (2.0 * rate[i]), (peak - leave) / (2.0 * rate[i])
        ramps = (np.sqrt(peak) - np.sqrt(entry) + np.sqrt(peak) - np.sqrt(leave)) / rate[i]
        total += ramps + max(length[i] - up - down, 0.0) / np.sqrt(peak)
        entry = leave
    return total
