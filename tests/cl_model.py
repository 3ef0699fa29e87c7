"""Random CL programs made together with what they must be read as: where the tool is in the machine, motion by motion.

What is expected is computed from the numbers as written by rotations and shifts, and never from reading the text.
"""

import math
from dataclasses import dataclass

import numpy as np

UNITS = {"MM": 1.0, "INCHES": 25.4}
FEEDS = {
    "MMPM": (1.0, 0),
    "IPM": (25.4, 0),
    "PERMIN": (None, 0),
    "MMPR": (1.0, 1),
    "IPR": (25.4, 1),
    "PERREV": (None, 1),
}
UPRIGHT = np.array([0.0, 0.0, 1.0])
PECK_GAP = 0.254  # mm
CHORD = 0.01  # mm, the reader's own


@dataclass
class Arc:
    """An arc in the machine: centre, normal (right-handed), radius and angle in rad."""

    centre: np.ndarray
    normal: np.ndarray
    radius: float
    sweep: float


@dataclass
class Step:
    """What one motion must be read as: its end and the tool axis in the machine, mm and mm/min."""

    tip: np.ndarray
    axis: np.ndarray
    rapid: bool
    feed: float
    arc: Arc | None = None


def draw_rotation(rng):
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return rotation * np.sign(np.linalg.det(rotation))


class ClProgram:
    """A program in the words of Siemens NX."""

    def __init__(self, seed: int, length: int = 25):
        self.rng = np.random.default_rng(seed)
        self.lines = ["$$ Siemens NX"]
        self.steps: list[Step] = []
        self.scale, self.origin = 1.0, np.zeros(3)
        self.rotation, self.shift = np.eye(3), np.zeros(3)
        self.at = np.zeros(3)
        self.axis = UPRIGHT
        self.feed, self.unit, self.rpm = 100.0, "PERMIN", 900.0
        self.rapid = False
        self.change_units()
        if self.rng.random() < 0.6:
            self.change_frame()
        self.say("SPINDL/900,RPM")
        self.say("FEDRAT/100")
        self.go_to()
        words = [self.go_to] * 5 + [self.go_by] * 2 + [self.cut_arc] * 2 + [self.drill] * 2
        words += [self.set_rapid, self.set_feed, self.set_speed, self.set_axis, self.set_origin, self.change_units]
        words += [self.change_frame]
        for _ in range(length):
            words[self.rng.integers(len(words))]()

    @property
    def text(self) -> str:
        return "\n".join(self.lines) + "\n"

    # words

    def say(self, statement: str) -> None:
        """Write a statement in some look: continued, in small letters, with blanks or a comment."""
        look, comma = self.rng.integers(4), statement.rfind(",")
        if look == 0:
            statement = statement.lower()
        elif look == 1 and comma > 0:
            self.lines.append(statement[: comma + 1] + self.rng.choice(["$", "$ ", " $", "$ $$ more"]))
            statement = statement[comma + 1 :]
        elif look == 2:
            statement = statement.replace("/", " / ", 1).replace(",", " ,  ")
        self.lines.append(statement + self.rng.choice(["", "", "\r", " $$ note", "\t"]))

    def write(self, values) -> tuple[str, np.ndarray]:
        """Write numbers in some spelling; return them as written, too."""
        forms = ("{:.6f}", "{:+.6f}", "{:.7E}", " {:.6f} ")
        words = [forms[self.rng.integers(4)].format(value) for value in values]
        words = [word[1:] if word.startswith("0.") else word for word in words]
        return ",".join(words), np.array([float(word) for word in words])

    def draw(self, size: float) -> tuple[str, np.ndarray]:
        return self.write(self.rng.uniform(-size, size, 3))

    # state

    def place(self, point) -> np.ndarray:
        return self.rotation @ (self.scale * (point - self.origin)) + self.shift

    def find_local(self) -> np.ndarray:
        """Where the tool is in the file's numbers."""
        return self.rotation.T @ (self.at - self.shift) / self.scale + self.origin

    def find_feed(self) -> float:
        length, per_turn = FEEDS[self.unit]
        return self.feed * (self.scale if length is None else length) * (self.rpm if per_turn else 1.0)

    def move(self, point, rapid: bool, feed: float | None = None, arc: Arc | None = None) -> None:
        self.at = self.place(point)
        feed = self.find_feed() if feed is None else feed
        self.steps.append(Step(self.at, self.rotation @ self.axis, rapid, feed, arc))

    def change_units(self) -> None:
        unit = self.rng.choice(list(UNITS))
        self.say(f"UNITS/{unit}")
        self.origin, self.scale = self.origin * self.scale / UNITS[unit], UNITS[unit]

    def change_frame(self) -> None:
        turns = self.rng.random() < 0.6
        self.rotation = draw_rotation(self.rng) if turns else self.rotation
        text, shift = self.draw(50.0)
        self.shift = shift * self.scale
        self.say(f"MSYS/{text}," + ",".join(f"{value:.12f}" for value in self.rotation[:, :2].T.ravel()))
        self.axis = UPRIGHT if turns else self.axis  # the old axis is not in the new directions

    def set_origin(self) -> None:
        text, self.origin = self.draw(9.0)
        self.say(f"ORIGIN/{text}")

    def set_axis(self) -> None:
        axis = self.rng.normal(size=3)
        self.axis = axis / np.linalg.norm(axis)
        self.say("TLAXIS/" + ",".join(f"{value:.9f}" for value in self.axis))

    def set_rapid(self) -> None:
        self.rapid = True
        self.say("RAPID")

    def set_feed(self) -> None:
        self.feed, self.unit = float(self.rng.integers(1, 500)), self.rng.choice(list(FEEDS))
        words = [f"{self.feed:g}", self.unit]
        self.say("FEDRAT/" + ",".join(words if self.rng.random() < 0.5 else words[::-1]))

    def set_speed(self) -> None:
        self.rpm = float(self.rng.integers(100, 9000))
        self.say(self.rng.choice(["SPINDL/{:.0f},RPM,CLW", "SPINDL/RPM,{:.0f}", "SPINDL/{:.0f}"]).format(self.rpm))

    # motion

    def go_to(self) -> None:
        text, point = self.draw(30.0)
        if self.rng.random() < 0.4:
            axis = self.rng.normal(size=3)
            self.axis = axis / np.linalg.norm(axis)
            text += "," + ",".join(f"{value:.9f}" for value in self.axis)
        self.say(f"GOTO/{text}")
        self.move(point, self.rapid)
        self.rapid = False

    def go_by(self) -> None:
        text, step = self.draw(9.0)
        self.say(f"GODLTA/{text}")
        self.move(self.find_local() + step, self.rapid)
        self.rapid = False

    def cut_arc(self) -> None:
        """Go round a circle, left-handed about its axis as NX has it, and leave it in rapid, which proves nothing."""
        rng, here, basis = self.rng, self.find_local(), draw_rotation(self.rng)
        radius, sweep, turns = rng.uniform(1.0, 20.0), rng.uniform(0.2, 6.0), ""
        if rng.random() < 0.3:
            count = rng.integers(1, 4)
            sweep, turns = 2.0 * math.pi * count, f",TIMES,{count}"
        centre = here - radius * basis[:, 0]
        end = centre + radius * (math.cos(sweep) * basis[:, 0] - math.sin(sweep) * basis[:, 1])
        values = (*centre, *basis[:, 2], radius)
        self.say("CIRCLE/" + ",".join(f"{value:.9f}" for value in values) + ",.01,.5,1,0" + turns)
        self.say("GOTO/" + ",".join(f"{value:.9f}" for value in end))
        arc = Arc(self.place(centre), -self.rotation @ basis[:, 2], radius * self.scale, sweep)
        self.move(end, self.rapid, arc=arc)
        self.rapid = True
        self.say("RAPID")
        self.go_to()

    def drill(self) -> None:
        """Drill holes by a cycle: down to the clearance, in pecks or at once to the depth, and out."""
        rng = self.rng
        kind = rng.choice(["DRILL", "BORE", "DRILL,DEEP", "CSINK"])
        clear, depth, step, back = (float(f"{rng.uniform(*ends):.4f}") for ends in ((1, 5), (1, 20), (3, 9), (5, 9)))
        way_out = rng.choice(["", ",RTRCTO,AUTO", f",RTRCTO,{back}"])
        pecks = f",STEP,{step}" if "DEEP" in kind else ""
        own = rng.random() < 0.5
        feed, height = 77.5 if own else self.find_feed(), self.find_local() @ self.axis
        self.rapid = False
        self.say(f"CYCLE/{kind},RAPTO,{clear},FEDTO,-{depth}{way_out}{pecks}{',MMPM,77.5' if own else ''}")
        for _ in range(rng.integers(1, 3)):
            text, hole = self.draw(9.0)
            self.say(f"GOTO/{text}")
            here = self.find_local()
            above = (here - hole) @ self.axis
            if above < clear:
                self.move(here + (clear - above) * self.axis, True)
            else:
                self.move(hole + above * self.axis, True)
            out = max(clear, height - hole @ self.axis) if "AUTO" in way_out else back if way_out else clear
            strokes = [(clear, True)]
            for reached in np.arange(step, depth, step) if pecks else ():
                strokes += [(-reached, False), (clear, True), (PECK_GAP / self.scale - reached, True)]
            strokes += [(-depth, False), (clear, False)] if kind == "BORE" else [(-depth, False)]
            strokes += [(out, True)] if kind != "BORE" or out != clear else []
            for stroke, rapid in strokes:
                self.move(hole + stroke * self.axis, rapid, feed)
        self.say("CYCLE/OFF")

    # what was read

    def verify(self, path) -> None:
        """Compare a path with what it must be."""
        frame = np.eye(3, 4) if path.frame is None else path.frame
        tip, axis = path.tip @ frame[:, :3].T + frame[:, 3], path.axis @ frame[:, :3].T
        row = -1
        for step in self.steps:
            begin, row = row + 1, row + 1
            if step.arc is not None:
                row = self.follow_arc(step.arc, tip, begin)
            np.testing.assert_allclose(tip[row], step.tip, atol=1e-5)
            np.testing.assert_allclose(axis[row], step.axis, atol=1e-6)
            assert (path.rapid[begin : row + 1] == step.rapid).all()
            if not step.rapid:
                np.testing.assert_allclose(path.feed[begin : row + 1], step.feed, rtol=1e-12)
        assert row + 1 == len(path)

    @staticmethod
    def follow_arc(arc: Arc, tip, row: int) -> int:
        """Follow the rows along an arc, each on its circle and near enough to the next; return the last one."""
        first = (tip[row - 1] - arc.centre) / arc.radius
        second, last, swept = np.cross(arc.normal, first), 0.0, 0.0
        while True:
            out = tip[row] - arc.centre
            assert abs(np.linalg.norm(out) - arc.radius) < 1e-4 and abs(out @ arc.normal) < 1e-4
            angle = math.atan2(out @ second, out @ first)
            turn = (angle - last) % (2.0 * math.pi)
            assert arc.radius * (1.0 - math.cos(0.5 * turn)) < 1.01 * CHORD
            last, swept = angle, swept + turn
            if swept > arc.sweep - 1e-4:
                assert abs(swept - arc.sweep) < 1e-4
                return row
            row += 1
