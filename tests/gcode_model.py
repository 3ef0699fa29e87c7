"""Random G-code programs made together with what they must be read as.

A program is made from the motion: a place or an arc is chosen, in exact fractions of a mm, and then put into words in
whatever modes and spelling are in force. So what is expected never comes from reading the text.
"""

import math
import random
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

INCH = Fraction(254, 10)
PLANES = {"G17": "XY", "G18": "ZX", "G19": "YZ"}
CENTRES = {"X": "I", "Y": "J", "Z": "K"}


@dataclass
class Step:
    """What one line must be read as; lengths in mm, turns in degrees, ``sweep`` in rad, right-handed."""

    line: int
    end: dict[str, Fraction]
    rapid: bool
    feed: float
    seconds: float
    rpm: float
    scale: float
    feed_scale: float
    plane: str = "G17"
    sweep: float = 0.0
    centre: tuple[float, float] = (0.0, 0.0)


class Program:
    def __init__(self, seed: int, length: int = 40):
        self.rng = random.Random(seed)
        self.lines: list[str] = []
        self.steps: list[Step] = []
        self.events: list[tuple[int, int, str]] = []
        self.arcs = 0
        self.unit, self.feed_unit = Fraction(1), Fraction(1)
        self.plane, self.relative, self.inverse = "G17", False, False
        self.absolute_centres = False
        self.motion = ""
        self.feed: Fraction | None = None
        self.turning, self.speed = "", math.nan
        self.at = {letter: Fraction(0) for letter in "XYZABC"}
        self.first()
        for _ in range(length):
            self.rng.choice([self.straight, self.straight, self.arc, self.modes, self.machine])()
        self.write(["M2"])
        self.events.append((len(self.steps), len(self.lines), "M2"))

    @property
    def text(self) -> str:
        return "\n".join(self.lines) + "\n"

    # words

    def digits(self, value: Fraction) -> str:
        """An exact decimal, in some spelling."""
        rng = self.rng
        text = f"{abs(value.numerator) * 10**8 // value.denominator:09d}"
        assert Fraction(int(text), 10**8) == abs(value)
        whole, part = text[:-8], text[-8:].rstrip("0")
        whole = whole.lstrip("0") if part and rng.random() < 0.3 else whole.lstrip("0") or "0"
        text = "0" * rng.choice([0, 0, 0, 2]) + whole + ("." + part if part else rng.choice(["", ".", ".0"]))
        return ("-" if value < 0 else rng.choice(["", "", "+"])) + text

    def word(self, letter: str, value: Fraction) -> str:
        return letter + self.rng.choice(["", "", " ", "\t"]) + self.digits(value)

    def code(self, code: str) -> str:
        return code[0] + "0" * self.rng.choice([0, 0, 1]) + code[1:]

    def write(self, words: list[str]) -> None:
        """A line of these words, in any order and look, or as programs usually look."""
        rng = self.rng
        if rng.random() < 0.5:
            words.sort(key=lambda word: "GXYZABCIJKRPFSTM".index(word[0]))
            self.lines.append(" ".join(words))
            return
        rng.shuffle(words)
        parts = [rng.choice(["", f"N{rng.randrange(10**5)}", f"n {rng.randrange(10**8)} "])]
        for word in words:
            parts += [
                rng.choice([str.upper, str.lower])(word),
                rng.choice(["", "", " ", "  ", "\t", *[""] * 9, " (in g1 x7) "]),
            ]
        self.lines.append(rng.choice(["", "", " "]) + "".join(parts) + rng.choice(["", "", "\r", ";X5 (", " (end)"]))

    def amount(self, size: float, decimals: int = 4) -> Fraction:
        return Fraction(round(self.rng.uniform(-size, size) * 10**decimals), 10**decimals)

    # blocks

    def first(self) -> None:
        words = []
        for letter in "XYZABC":
            self.at[letter] = self.amount(50)
            words.append(self.word(letter, self.at[letter]))
        self.lines.append(f"{self.rng.choice(['G21 G54', 'G21 G90'])} G0 " + " ".join(words))
        self.motion = "G0"
        if "G54" in self.lines[0]:
            self.events.append((0, 1, "G54"))
        self.step(True, math.nan)

    def step(self, rapid: bool, seconds: float, **more: object) -> None:
        feed = math.nan if self.inverse or self.feed is None else float(self.feed * self.feed_unit)
        rpm = {"": math.nan, "M5": 0.0}.get(self.turning, self.speed)
        self.steps.append(
            Step(
                len(self.lines), dict(self.at), rapid, feed, seconds, rpm, float(self.unit), float(self.feed_unit),
                self.plane, **more,
            )
        )  # fmt: skip

    def modes(self) -> None:
        """A line that changes modes and moves nothing."""
        rng, words = self.rng, []
        if rng.random() < 0.3:
            self.inverse, self.feed = rng.random() < 0.4, None
            words.append("G93" if self.inverse else "G94")
        if rng.random() < 0.4:
            self.plane = rng.choice(list(PLANES))
            words.append(self.plane)
        if rng.random() < 0.3:
            self.relative = rng.random() < 0.5
            words.append("G91" if self.relative else "G90")
        if rng.random() < 0.2:
            self.unit = rng.choice([Fraction(1), INCH])
            words.append("G21" if self.unit == 1 else "G20")
        if rng.random() < 0.2:
            self.absolute_centres = rng.random() < 0.5
            words.append("G90.1" if self.absolute_centres else "G91.1")
        if words:
            self.write(words)

    def machine(self) -> None:
        """A line of codes that become events, in their order of execution."""
        rng, words, texts, speed = self.rng, [], [], self.speed
        if rng.random() < 0.5:
            speed = float(rng.randrange(100, 20000))
            words.append(f"S{speed:.0f}")
            texts.append(words[-1])
        for choices in (["M6"], ["M3", "M4", "M5"], ["M7", "M8", "M9"], ["M48", "M49"], ["G4"], ["G61", "G64"]):
            if rng.random() < 0.3 and sum(w[0] == "M" for w in words) < 4:
                code = rng.choice(choices)
                words += [self.code(code), "P1.5"] if code == "G4" else [self.code(code)]
                texts.append("G4 P1.5" if code == "G4" else code)
        if not {"G4 P1.5", "G64"} <= set(texts):  # both use P
            self.speed = speed
            if "M6" in texts and self.turning:
                self.turning = "M5"  # LinuxCNC stops the spindle for the change
            self.turning = next((text for text in texts if text in ("M3", "M4", "M5")), self.turning)
            self.write(words)
            self.events += [(len(self.steps), len(self.lines), text) for text in texts]

    def feed_words(self) -> tuple[list[str], float]:
        """F where it is needed, and now and then where it isn't; the time it gives in G93."""
        if self.inverse:
            rate = abs(self.amount(30, 2)) + Fraction(1, 10)
            return [self.word("F", rate)], float(60 / rate)
        if self.feed is None or self.rng.random() < 0.3:
            self.feed, self.feed_unit = abs(self.amount(3000, 2)) + 1, self.unit
            return [self.word("F", self.feed)], math.nan
        return [], math.nan

    def motion_words(self, code: str) -> list[str]:
        known, self.motion = self.motion == code, code
        return [] if known and self.rng.random() < 0.7 else [self.code(code)]

    def straight(self) -> None:
        rng, code = self.rng, self.rng.choice(["G0", "G1", "G1", "G1"])
        words, seconds = self.motion_words(code), math.nan
        if code == "G1":
            feed, seconds = self.feed_words()
            words += feed
        letters = rng.choice(["XYZ", "XYZABC", "AB", "ABC", "X", "YZ", "XC", "ABC"])
        before = dict(self.at)
        for letter in letters:
            scale = self.unit if letter in "XYZ" else Fraction(1)
            value = self.amount(40)
            self.at[letter] = value * scale + (before[letter] if self.relative else 0)
            words.append(self.word(letter, value))
        if code == "G1" and not self.inverse and all(self.at[k] == before[k] for k in "XYZ"):
            degrees = math.sqrt(sum(float(self.at[k] - before[k]) ** 2 for k in "ABC"))
            seconds = 60 * degrees / float(self.feed) if degrees else math.nan
        self.write(words)
        self.step(code == "G0", seconds)

    def arc(self) -> None:
        """An arc about a chosen centre: complex numbers in its plane, in the file's unit."""
        rng, code = self.rng, self.rng.choice(["G2", "G3"])
        one, two = PLANES[self.plane]
        (third,) = set("XYZ") - {one, two}
        words = self.motion_words(code)
        feed, seconds = self.feed_words()
        words += feed
        by_radius = rng.random() < 0.3
        out = complex(self.amount(30, 3) or 1, self.amount(30, 3))
        turn = rng.choice([rng.uniform(0.1, 2.9), rng.uniform(3.4, 6.1)])
        start = complex(self.at[one] / self.unit, self.at[two] / self.unit)
        centre, sense = start + out, 1 if code == "G3" else -1
        end = centre - out * complex(math.cos(turn), sense * math.sin(turn))
        turns = rng.choice([1, 1, 1, 2, 3])
        for letter, value in ((one, end.real), (two, end.imag)):
            base = self.at[letter] if self.relative else Fraction(0)
            given = Fraction(round((value - float(base / self.unit)) * 10**7), 10**7)
            self.at[letter] = given * self.unit + base
            words.append(self.word(letter, given))
        if by_radius:
            size = Fraction(round(abs(out) * 10**7), 10**7)
            words.append(self.word("R", size if turn < math.pi else -size))
        else:
            shift = start if self.absolute_centres else 0
            for letter, value in ((one, (out + shift).real), (two, (out + shift).imag)):
                words.append(self.word(CENTRES[letter], Fraction(round(value * 10**7), 10**7)))
        for letter in rng.choice(["", "", third, "A", third + "BC"]):
            value = self.amount(20)
            scale = self.unit if letter in "XYZ" else Fraction(1)
            self.at[letter] = value * scale + (self.at[letter] if self.relative else 0)
            words.append(self.word(letter, value))
        if turns > 1:
            words.append(f"P{turns}")
        # the code of an arc is said again, for I, J, K or R alone would be no motion
        self.write(words)
        centre *= float(self.unit)
        sweep = sense * (turn + 2 * math.pi * (turns - 1))
        self.step(False, seconds, sweep=sweep, centre=(centre.real, centre.imag))
        self.arcs += 1

    # what was read

    def verify(self, path: object) -> None:
        """Compare a path with what it must be."""
        first = 0
        records = []
        for step in self.steps:
            rows = np.flatnonzero(path.line == step.line)
            assert len(rows) and rows[0] == first and (np.diff(rows) == 1).all()
            records.append(first)
            first = rows[-1] + 1
            end = [float(step.end[k]) for k in "XYZ"]
            np.testing.assert_allclose(path.tip[rows[-1]], end, atol=1e-9)
            turns = [math.radians(step.end[k]) for k in "ABC"]
            np.testing.assert_allclose(path.turns[rows[-1]], turns, atol=1e-12)
            assert (path.rapid[rows] == step.rapid).all()
            np.testing.assert_allclose(path.feed[rows], step.feed, rtol=1e-14)
            np.testing.assert_array_equal(path.spindle[rows], step.rpm)
            total = math.nan if path.seconds is None else path.seconds[rows].sum()
            np.testing.assert_allclose(total, step.seconds, rtol=1e-12)
            if step.sweep:
                self.verify_arc(path, step, rows)
            else:
                assert len(rows) == 1
        assert first == len(path)
        records.append(first)
        assert [(e.record, e.line, e.text) for e in path.events] == [
            (records[record], line, text) for record, line, text in self.events
        ]

    @staticmethod
    def verify_arc(path: object, step: Step, rows: np.ndarray) -> None:
        one, two = ("XYZ".index(letter) for letter in PLANES[step.plane])
        along = 3 - one - two
        rows = np.append(rows[0] - 1, rows)
        flat = path.tip[rows, one] + 1j * path.tip[rows, two] - complex(*step.centre)
        radius = abs(flat[0])
        np.testing.assert_allclose(abs(flat), radius, atol=1e-3)
        angle = np.unwrap(np.angle(flat), period=2 * math.pi) - np.angle(flat[0])
        np.testing.assert_allclose(angle[-1], step.sweep, atol=1e-3)
        share = np.arange(len(rows)) / (len(rows) - 1)
        np.testing.assert_allclose(angle, share * step.sweep, atol=1e-3)
        for column in (path.tip[rows, along], *path.turns[rows].T):
            np.testing.assert_allclose(column, column[0] + share * (column[-1] - column[0]), atol=1e-9)
