"""Random programs of everything that LinuxCNC reads, against LinuxCNC's own interpreter: where the tool goes.

PARAKIN_PROGRAMS sets how many are made.
"""

import math
import os
import random
import re
import shutil
import subprocess
from dataclasses import dataclass, field

import numpy as np
import pytest

from parakin.errors import InputError
from parakin.toolpath.reading.gcode import reader
from parakin.toolpath.reading.gcode.reader import read_gcode

pytestmark = pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC's interpreter is not here")

COUNT = int(os.environ.get("PARAKIN_PROGRAMS", "400"))
TOOLS = {1: 12.5, 2: 40.0, 3: 101.6, 7: 0.5}
INCH = 25.4
SECONDS = 3  # of the processor for a program; a few never end
_CALL = re.compile(r"N\.*\s*\d*\s*([A-Z_0-9]+)\((.*)\)")
# what is refused here and read there, or has no value there that this file tells
HOME, OTHER_HOME = (3.0, -7.0, 60.0, 0.0, 0.0, 0.0), (-5.0, 8.0, 70.0, 10.0, 20.0, -30.0)
HOMES = "(homes)"  # stands for the lines that set the reference points, inches there and mm here
KNOWN = re.compile(
    "is turned|turns the coordinates|unit has changed|is in force|not known|not set in this file"
    "|points in all|control's own|by R|Q is too small|motions in all|without a feed"
)


@dataclass
class Canon:
    """What LinuxCNC's interpreter does: the tool's tip in the machine, and what else there is in between."""

    motions: list[tuple[str, list[float], float]] = field(default_factory=list)
    events: list[str] = field(default_factory=list)
    error: str = ""


def set_homes(text, unit):
    words = [
        f"#{first + k}={value / (unit if k < 3 else 1.0):.8f}"
        for first, home in ((5161, HOME), (5181, OTHER_HOME))
        for k, value in enumerate(home)
    ]
    return text.replace(HOMES, " ".join(words))


def run_rs274(text, folder):
    text = set_homes(text, INCH)
    (folder / "part.ngc").write_text(text)
    (folder / "tool.tbl").write_text("".join(f"T{n} P{n} Z{z / INCH:.8f} D0\n" for n, z in TOOLS.items()))
    with (folder / "canon").open("w+") as output:
        run = subprocess.run(
            ["prlimit", f"--cpu={SECONDS}", "rs274", "-g", "-t", "tool.tbl", "part.ngc"], cwd=folder,
            env={**os.environ, "HOME": str(folder)}, stdout=output, stderr=subprocess.PIPE, text=True,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
        if run.returncode < 0:
            return Canon(error="it never ends")
        output.seek(0)
        lines = output.readlines()
    canon, scale, feed = Canon(error=run.stderr.removeprefix("executing").strip()), 1.0, math.nan
    work, local, turn, plane = [0.0] * 6, [0.0] * 6, 0.0, (0, 1, 2)
    for line in lines:
        match = _CALL.search(line)
        if match is None:
            continue
        name, words = match.groups()
        if name == "PROGRAM_END":
            del canon.events[-1:]  # M2 stops the spindle
            break
        if name == "CHANGE_TOOL" and canon.events:
            canon.events.pop()  # it stops the spindle
        if name == "USE_LENGTH_UNITS":
            scale = INCH if "INCH" in words else 1.0
        elif name == "SELECT_PLANE":
            plane = {"XY": (0, 1, 2), "XZ": (2, 0, 1), "YZ": (1, 2, 0)}[words[-2:]]
        elif name == "SET_FEED_RATE":
            feed = float(words) * scale
        elif name in ("SET_G5X_OFFSET", "SET_G92_OFFSET"):
            values = [float(value) for value in words.split(",")][-6:]
            values = [value * (scale if k < 3 else 1.0) for k, value in enumerate(values)]
            work, local = (values, local) if name == "SET_G5X_OFFSET" else (work, values)
        elif name == "SET_XY_ROTATION":
            turn = math.radians(float(words))
        elif name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "ARC_FEED"):
            values = [float(value) for value in words.split(",")]
            if name == "ARC_FEED":
                end = [0.0, 0.0, 0.0, *values[6:9]]
                for axis, value in zip(plane, (values[0], values[1], values[5]), strict=True):
                    end[axis] = value
                values = end
            point = [value * (scale if k < 3 else 1.0) + local[k] for k, value in enumerate(values[:6])]
            x, y = point[:2]
            point[0], point[1] = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
            canon.motions.append((name, [p + q for p, q in zip(point, work, strict=True)], feed))
        elif name in EVENTS:
            canon.events.append(EVENTS[name] + (f"{float(words):.3g}" if name == "DWELL" else ""))
    return canon


EVENTS = {
    "DWELL": "G4 P", "STOP_SPINDLE_TURNING": "M5", "START_SPINDLE_CLOCKWISE": "M3",
    "START_SPINDLE_COUNTERCLOCKWISE": "M4",
}  # fmt: skip


def compare(path, canon, text):
    """The motions that lead anywhere, one by one; an arc has points on its way."""
    turns = np.zeros((len(path), 3)) if path.turns is None else np.degrees(path.turns)
    rows = np.column_stack([path.tip, turns])
    at, here, made = 0, np.zeros(6), 0
    for kind, end, feed in canon.motions:
        if np.abs(np.array(end) - here).max() < 4e-3 and kind != "ARC_FEED":
            continue
        while at < len(rows) and np.abs(rows[at] - here).max() < 4e-3:
            at += 1
        last = at
        while kind == "ARC_FEED" and last < len(rows) - 1 and np.abs(rows[last] - end).max() > 6e-3:
            last += 1
        assert last < len(rows), (text, end)
        np.testing.assert_allclose(rows[last], end, atol=6e-3, err_msg=text)
        assert path.rapid[last] == (kind == "STRAIGHT_TRAVERSE"), text
        if not path.rapid[last] and not math.isnan(path.feed[last]):
            assert path.feed[last] == pytest.approx(feed, rel=1e-3, abs=2e-3), text
        at, here, made = last + 1, np.array(end), made + 1
    assert np.abs(rows[at:] - here).max(initial=0.0) < 6e-3, text
    told = [e.text for e in path.events if re.fullmatch(r"M[345]|G4 P.*", e.text)]
    told = [t for t in told if t != "G4 P0"]
    told = [f"G4 P{float(t[4:]):.3g}" if t.startswith("G4") else t for t in told]
    assert told == [event for event in canon.events if event != "G4 P0"], text
    return made


class Maker:
    """Makes a program of random blocks that mostly make sense."""

    def __init__(self, seed):
        self.rng = random.Random(seed)
        self.label = 100
        self.lines = ["G21 G17 G90 G94 G80 G40 G49 G54 G0 X0 Y0 Z50 A0 B0 C0", "F200 S100 M3 #6=1", HOMES]
        self.subs = []
        rng = self.rng
        for k in range(1, 6):
            self.lines.append(f"#{k} = {self.number(9)} #<v{k}>={self.number(5)} #<_g{k}>=[{self.expression(1)}]")
        for number in (2, 3):
            self.lines.append(f"G10 L2 P{number} X{self.number(20)} Y{self.number(20)} Z{self.number(9)}")
        if rng.random() < 0.3:
            self.subs = [self.sub(10 + k) for k in range(rng.choice([1, 2]))]
        for _ in range(rng.randint(4, 14)):
            self.block(2)
        self.lines.append("M2")
        self.text = "\n".join(self.lines) + "\n"

    def number(self, size):
        return f"{self.rng.uniform(-size, size):.3f}"

    def parameter(self):
        return self.rng.choice(
            ["#1", "#2", "#3", "#4", "#5", "#<v1>", "#<_g2>", "#<_g3>", "#[1+2]", "##6", "#<_x>", "#5421"]
        )

    def expression(self, depth):
        rng = self.rng
        if depth == 0 or rng.random() < 0.2:
            return rng.choice([self.number(5), str(rng.randint(0, 9)), "#1", "#2", "#3"])
        kind = rng.random()
        if kind < 0.5:
            sign = rng.choice(
                ["+", "-", "*", " + ", " - ", "*", " MOD ", " EQ ", " NE ", " gt ", "LE", " AND ", "OR", "xor", "/"]
            )
            right = rng.choice(["2", "3", "[1.5]"]) if sign in ("/", " MOD ") else self.expression(depth - 1)
            return f"{self.expression(depth - 1)}{sign}{right}"
        if kind < 0.6:
            return f"{rng.choice(['2', '1.5', '[3]'])}**{rng.choice(['2', '3', '[-1]', '0.5'])}"
        if kind < 0.85:
            name = rng.choice(
                ["abs", "SIN", "cos", "fix", "FUP", "round", "sqrt[abs", "atan", "exp[0.1*cos", "asin[0.9*sin"]
            )
            inside = self.expression(depth - 1)
            if name == "atan":
                return f"atan[{inside}]/[{self.expression(0)}]"
            return f"{name}[{inside}]" + "]" * name.count("[")
        return f"[{self.expression(depth - 1)}]" if kind < 0.95 else f"-[{self.expression(depth - 1)}]"

    def value(self, size=30):
        kind = self.rng.random()
        if kind < 0.6:
            return self.number(size)
        return self.parameter() if kind < 0.75 else f"[{self.expression(2)}]"

    def axes(self, letters="XYZ", size=30, share=0.6):
        words = [f"{letter}{self.value(size)}" for letter in letters if self.rng.random() < share]
        return " ".join(words or [f"{letters[0]}{self.number(size)}"])

    def block(self, depth):
        rng = self.rng
        kinds = [
            self.straight,
            self.straight,
            self.straight,
            self.cycle,
            self.cycle,
            self.mode,
            self.offset,
            self.assign,
        ]
        kinds += [self.arc, self.arc_by_radius, self.arc_about_centre, self.inverse_time, self.turn, self.other]
        rng.choice(kinds + [self.length, self.spindle] + ([self.control] * 2 if depth else []))(depth)

    def straight(self, depth):
        code = self.rng.choice(["G0 ", "G1 ", "G1 ", "", "G1 F150 "])
        if self.rng.random() < 0.1:
            self.lines.append(
                f"{code}{self.rng.choice(['@{0}', '^{1}', '@{0} ^{1}'])}".format(self.value(), self.number(400))
            )
            return
        self.lines.append(code + self.axes(self.rng.choice(["XYZ", "XYZ", "XYZABC"])))

    def arc(self, depth):
        i, j = self.number(9), self.number(9)
        plane, words = self.rng.choice([("G17", f"I{i} J{j} K0"), ("G18", f"I{i} K{j}"), ("G19", f"J{i} K{j}")])
        if plane == "G17":
            words = words.removesuffix(" K0")
        self.lines += [f"{plane} {self.rng.choice(['G2', 'G3'])} {words}", "G17 G1"]

    def arc_by_radius(self, depth):
        rng = self.rng
        plane, (first, second) = rng.choice([("G17", "XY"), ("G18", "XZ"), ("G19", "YZ")])
        radius = f"R{rng.choice(['', '-'])}{rng.uniform(13, 40):.3f}"
        words = [f"G91 {plane}", rng.choice(["G2", "G3"]), first + self.number(9), second + self.number(9), radius]
        self.lines += [" ".join([*words, rng.choice(["", f"A{self.number(20)}"]), "F300"]), "G90 G17 G1"]

    def arc_about_centre(self, depth):
        rng = self.rng
        x, y, radius = rng.uniform(-9, 9), rng.uniform(-9, 9), rng.uniform(1, 20)
        (a, b), (c, d) = (
            (x + radius * math.cos(angle), y + radius * math.sin(angle))
            for angle in (rng.uniform(0, 3), rng.uniform(3.2, 6.2))
        )
        height = rng.choice(["", " Z[#1]"])
        self.lines += [
            f"G90 G0 X{a:.4f} Y{b:.4f}",
            f"G90.1 G17 {rng.choice(['G2', 'G3'])} X{c:.4f} Y{d:.4f}{height} I{x:.4f} J{y:.4f}",
            "G91.1 G1",
        ]

    def inverse_time(self, depth):
        rng = self.rng
        self.lines.append(f"G93 G1 F{rng.uniform(0.5, 20):.2f} {self.axes('XYZABC')}")
        self.lines.append(f"G94 F{rng.randint(10, 900)} {rng.choice(['', 'X1', 'G0 Y1'])}")

    def turn(self, depth):
        rng = self.rng
        offset = rng.choice([f"G10 L2 P{rng.randint(1, 3)}", "G92", f"G10 L20 P{rng.randint(0, 3)}", "G0", "G1 F99"])
        self.lines.append(f"{offset} {self.axes('ABC', 40)}")

    def other(self, depth):
        rng, tool = self.rng, self.rng.choice(list(TOOLS))
        told = f"G10 L1 P{tool} Z{rng.uniform(0, 50):.3f}"
        self.lines += rng.choice(
            [
                ["G64 P0.1 Q0.2"], ["G61"], ["G61.1"], ["M3 S250 G4 P1"], ["(MSG, x) G0 X1"], ["M62 P3 G0 X2"],
                ["M67 E1 Q2.5 X3"], ["M66 P1 L0"], ["G97 S77"], ["M5 M9"], ["F33"], ["G53 G1 X3 Y4"], ["S#2*0"],
                ["N12.5 G0 X1"], ["x1y2 z3"], ["G0X-.5Y+1. ;c"], ["g 1 x 1 y 2"], ["/G0 X1"], ["/N5 Z3"], ["G8"],
                [f"T{tool} G0 X3"], [told], [told, f"G43 H{tool} G0 X1 Y1 Z1"],
            ]
        )  # fmt: skip

    def cycle(self, depth):
        rng = self.rng
        code = rng.choice([73, 74, 81, 81, 81, 82, 82, 83, 83, 84, 85, 86, 87, 89])
        if code in (74, 84, 86, 87):
            self.lines.append("M4" if code == 74 else "M3")
        words = [f"G{code}", rng.choice(["", "G98", "G99"])]
        if rng.random() < 0.2 and code not in (74, 84):
            words.append(rng.choice(["G18", "G19"]))
        low, high = rng.uniform(-20, -0.1), rng.uniform(0, 20)
        plane = {"G18": "ZXY", "G19": "YZX"}.get(words[-1], "XYZ")
        words.append(self.axes(plane[:2]))
        words += [f"{plane[2]}{low:.3f}", f"R{high:.3f}"]
        words += [f"Q{rng.uniform(2, 30):.3f}"] if code in (73, 83) else []
        words += (
            [f"P{rng.choice([0, 0.5, 2])}"] if code in (82, 86, 89) or (code in (74, 84) and rng.random() < 0.3) else []
        )
        words += [self.axes("IJK", 5, 1.0)] if code == 87 else []
        words += [f"L{rng.choice([1, 2, 3])}"] if rng.random() < 0.3 and code != 74 else []
        self.lines.append(" ".join(words))
        for _ in range(rng.choice([0, 0, 1, 2])):
            self.lines.append(rng.choice(["", "", "G98 ", "G99 "]) + self.axes(plane[:2]))
        self.lines.append(rng.choice(["G80 G0", "G0 Z30", "G80 G17 G0 X1"]) if plane == "XYZ" else "G80 G17 G1")

    def mode(self, depth):
        self.lines.append(
            self.rng.choice(
                ["G20", "G21", "G90", "G91", "G90", "G21", "G98", "G99", "G54", "G55", "G56", "M8", "G4 P1"]
            )
        )

    def offset(self, depth):
        rng = self.rng
        self.lines.append(
            rng.choice(
                [
                    f"G92 {self.axes()}", f"G92 {self.axes()}", "G92.1", "G92.2", "G92.3", f"G52 {self.axes()}",
                    f"G10 L2 P{rng.randint(0, 3)} {self.axes()}", f"G10 L20 P{rng.choice([0, 1, 2])} {self.axes()}",
                    f"G10 L2 P{rng.randint(1, 3)} R{rng.choice([0, 30, -90, 12.5])}", "G28.1", "G30.1",
                    "G28", f"G28 {self.axes()}", f"G30 {self.axes()}", f"G53 G0 {self.axes('XYZABC')}", "G91 G28 Z0",
                ]
            )
        )  # fmt: skip
        if rng.random() < 0.5:
            self.lines.append("G0 X1 Y1 Z1")

    def length(self, depth):
        rng, number = self.rng, self.rng.choice(list(TOOLS))
        # behind a change rs274 takes the tip to be where it was before any offset: a whole place puts that right
        full = f"X{self.number(9)} Y{self.number(9)} Z{self.number(9)}"
        self.lines.append(
            rng.choice(
                [
                    f"G43 H{number}", f"G43 H{number} Z5", "G49", "G49 G0 X3", f"G43.1 Z{self.number(20)}",
                    f"G43.1 X{self.number(9)} Z{self.number(9)}",
                    f"T{number} M6\nG90 G0 {full}", f"T{number} M6\nG90 G0 {full}\nG43", f"G43.2 H{number}",
                    f"M61 Q{number}\nG90 G0 {full}",
                ]
            )
        )  # fmt: skip

    def spindle(self, depth):
        self.lines.append(self.rng.choice(["M3", "M4", "M5", "M3 S500", "M62 P1", "M65 P0", "M9", "M48"]))

    def assign(self, depth):
        rng = self.rng
        name = rng.choice(["#1", "#2", "#3", "#4", "#5", "#<v1>", "#<v2>", "#<_g2>", "#<_g 3>", "#[1+1]", "#40"])
        self.lines.append(f"{name} = {self.value(9)}" + rng.choice(["", "", f" #1={self.number(4)} X#1 Y[#1+1]"]))
        self.lines.append(rng.choice(["#6=1", "#6=2", "", "#<_g3>=EXISTS[#<v9>]", "#<v3>=exists[#<v1>]"]))

    def new_label(self):
        self.label += 1
        return self.rng.choice([f"o{self.label}", f"O{self.label} ", f"o<l{self.label}>", f"N5 o {self.label}"])

    def blocks(self, depth):
        for _ in range(self.rng.randint(1, 3)):
            self.block(depth - 1)

    def control(self, depth):
        rng, o, n = self.rng, self.new_label(), 50 + self.label
        kind = rng.choice(["if", "if", "while", "repeat", "do", "call"])
        if kind == "if":
            self.lines.append(f"{o} if [{self.expression(1)}]")
            self.blocks(depth)
            for _ in range(rng.choice([0, 0, 1])):
                self.lines.append(f"{o} elseif [{self.expression(1)}]")
                self.blocks(depth)
            if rng.random() < 0.5:
                self.lines.append(f"{o} else")
                self.blocks(depth)
            self.lines.append(f"{o} endif")
        elif kind == "repeat":
            self.lines.append(f"{o} repeat [{rng.choice(['2', '3', '0', '#<v1>', '1.4'])}]")
            self.blocks(depth)
            self.lines.append(f"{o} endrepeat (end)")
        elif kind == "while":
            self.lines += [f"#{n}=0", f"{o} while [#{n} LT {rng.choice([0, 1, 3])}]", f"#{n}=[#{n}+1]"]
            self.leave_loop(o, n)
            self.blocks(depth)
            self.lines.append(f"{o} endwhile")
        elif kind == "do":
            self.lines += [f"#{n}=0", f"{o} do", f"#{n}=[#{n}+1]"]
            self.leave_loop(o, n)
            self.blocks(depth)
            self.lines.append(f"{o} while [#{n} LT {rng.choice([0, 2, 3])}]")
        elif self.subs:
            self.lines.append(f"{rng.choice(self.subs)} call [{self.expression(1)}] [{self.number(9)}] [1]")
            self.lines.append(rng.choice(["", "G0 X#<_value>", "G0 Y#<_value_returned>"]))

    def leave_loop(self, o, n):
        if self.rng.random() < 0.3:
            inner = self.new_label()
            word = self.rng.choice(["break", "continue"])
            self.lines += [f"{inner} if [#{n} EQ 2]", f"{o} {word}", f"{inner} endif"]

    def sub(self, number):
        o = self.rng.choice([f"o{number}", f"o<sub {number}>"])
        self.lines.append(f"{o} sub")
        self.lines.append("#<v1>=#1 #<v2>=2 #<v3>=3 #6=1")
        self.blocks(1)
        if self.rng.random() < 0.4:
            i = self.new_label()
            self.lines += [f"{i} if [#1 gt 0]", f"{o} return {self.rng.choice(['', '[#2]'])}", f"{i} endif"]
        self.blocks(1)
        self.lines.append(f"{o} endsub {self.rng.choice(['', '[#1+1]'])}")
        return o


def read(text, folder):
    (folder / "mine.ngc").write_text(set_homes(text, 1.0))
    try:
        return read_gcode(folder / "mine.ngc", workpiece=np.eye(3, 4), tools=TOOLS, arc_tolerance=0.05)
    except InputError as error:
        assert error.line is not None or "no motion" in error.message, text
        return error.message


@pytest.mark.parametrize("part", range(4))
def test_random_programs(tmp_path, monkeypatch, part):
    monkeypatch.setattr(reader, "_MOST_BLOCKS", 50_000)  # a few of the programs never end
    made = both = refused = 0
    for seed in range(part, COUNT, 4):
        maker = Maker(seed)
        canon, path = run_rs274(maker.text, tmp_path), read(maker.text, tmp_path)
        if isinstance(path, str):
            assert canon.error or KNOWN.search(path), (seed, path, maker.text)
            refused += 1
            continue
        assert not canon.error, (seed, canon.error, maker.text)
        made += compare(path, canon, f"seed {seed}\n{maker.text}")
        both += 1
    assert both > COUNT // 4 * 0.3, (both, refused)
