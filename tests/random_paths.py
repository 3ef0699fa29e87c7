"""Random tool paths through all that is hard for turning axes, as CL files: poles, corners, reversals, jitter."""

from __future__ import annotations

import numpy as np

# How far tips go from home, mm, and how far axes tilt from the pole, degrees.
REACH = {"tricept": 150.0, "orthoglide5_head": 45.0, "orthoglide5_table": 45.0, "hexapod": 60.0, "lambda6": 60.0}
TILT = {"tricept": 35.0, "orthoglide5_head": 50.0, "orthoglide5_table": 30.0, "hexapod": 18.0, "lambda6": 12.0}
OTHERS = {  # machines that tilt the tool: the same, where nearly all poses are allowed
    "tricept_805": (200.0, 40.0),
    "exechon": (150.0, 40.0),
    "george_v": (150.0, 40.0),
    "sprint_z3": (150.0, 30.0),
    "pentapod": (100.0, 12.0),
    "cmw_300": (120.0, 28.0),
    "variax": (150.0, 28.0),
    "mikromat_6x": (120.0, 22.0),
    "tornado_2000": (150.0, 28.0),
    "g500": (120.0, 28.0),
    "okuma_hexapod": (120.0, 28.0),
    "hexaglide": (60.0, 28.0),
    "hexam": (100.0, 28.0),
    "linapod6": (60.0, 28.0),
    "rus6": (80.0, 25.0),
    "eclipse": (45.0, 18.0),
    "eclipse_overactuated": (45.0, 18.0),
}
REACH_OF_ALL = REACH | {name: reach for name, (reach, _) in OTHERS.items()}
TILT_OF_ALL = TILT | {name: tilt for name, (_, tilt) in OTHERS.items()}
_MISSES = (0.0, 0.0, 1e-7, 1e-6, 1e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2)  # rad, off the pole
_FEEDS = (10.0, 20_000.0)  # mm/min
_STEPS = (1e-4, 40.0)  # mm


def point_at_middle(machine, tip):
    """The pole of a wrist on a leg through the origin."""
    return -tip / np.linalg.norm(tip)


def solve_pole(machine, tip):
    """The pole of a wrist at a tip, a unit vector: sin² off it is quadratic in how far the axis leans to X and Y."""
    lean, step = np.zeros(2), 1e-3
    offsets = step * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1]])
    for _ in range(4):
        x, y = (lean + offsets).T
        poses = np.column_stack([np.tile(tip, (7, 1)), np.arctan(np.hypot(x, y)), np.arctan2(y, x)])
        f = machine.wrist.measure_freedom(poses)
        slope = np.array([f[1] - f[2], f[3] - f[4]]) / (2.0 * step)
        mixed = (f[5] + f[6] - f[1] - f[2] - f[3] - f[4] + 2.0 * f[0]) / (2.0 * step**2)
        bend = np.array([f[1] + f[2] - 2.0 * f[0], f[3] + f[4] - 2.0 * f[0]]) / step**2
        lean = lean - np.linalg.solve([[bend[0], mixed], [mixed, bend[1]]], slope)
        step, offsets = 0.1 * step, 0.1 * offsets
    return np.array([*lean, 1.0]) / np.hypot(1.0, np.linalg.norm(lean))


POLES = {"tricept": point_at_middle, "tricept_805": point_at_middle, "exechon": solve_pole}


class PathMaker:
    """Makes one random path on a machine. Points are a tip, mm, and the tool axis by tilt and azimuth from a pole."""

    def __init__(self, machine, seed):
        self.rng, self.machine = np.random.default_rng(seed), machine
        self.name = machine.name.removeprefix("trial_")
        self.home, self.reach = np.asarray(machine.home)[:3], REACH_OF_ALL[self.name]
        apart = self.name in POLES  # the wrist's pole from that of a pose
        self.upright = not apart or self.rng.random() < 0.3
        self.tip = self.home + self.rng.uniform(-1.0, 1.0, 3) * self.reach * 0.7
        self.lines, self.recipes = [], []
        self.digits = int(self.rng.choice([4, 6, 9]))
        self.widest = np.radians(TILT_OF_ALL[self.name])

    def make(self):
        """Make a path of a few pieces; return its CL text."""
        self.lines = ["TOOL PATH/RANDOM", "FEDRAT/1000.0,MMPM"]
        kinds = [self.pass_over, self.turn_on_pole, self.star, self.begin_on_pole, self.go_back, self.plunge]
        kinds += [self.jitter, self.tilt_at_once, self.wander, self.circle, self.creep]
        for kind in self.rng.choice(kinds, int(self.rng.integers(1, 4))):
            self.recipes.append(kind.__name__)
            self.set_feed()
            if len(self.lines) > 3 and self.rng.random() < 0.3:
                self.go(
                    self.tip + [0.0, 0.0, self.rng.uniform(1.0, 20.0)], self.choose_tilt(), self.choose_azimuth(), True
                )
            kind()
        return "\n".join([*self.lines, "FINI", ""])

    # Points

    def set_feed(self):
        self.lines.append(f"FEDRAT/{np.exp(self.rng.uniform(*np.log(_FEEDS))):.1f},MMPM")

    def go(self, tip, tilt, azimuth, rapid=False, noise=0.0):
        """Go to a tip, held within reach of home, with the axis tilted from the pole there."""
        away = np.asarray(tip) - self.home
        self.tip = self.home + np.clip(away, -self.reach, self.reach)
        z = np.array([0.0, 0.0, 1.0]) if self.upright else POLES[self.name](self.machine, self.tip)
        x = np.cross([0.0, 1.0, 0.0], z)
        x /= np.linalg.norm(x)
        y = np.cross(z, x)
        axis = np.cos(tilt) * z + np.sin(tilt) * (np.cos(azimuth) * x + np.sin(azimuth) * y)
        axis = axis + noise * self.rng.integers(-1, 2, 3)
        axis /= np.linalg.norm(axis)
        if rapid:
            self.lines.append("RAPID")
        words = [f"{value:.{max(self.digits, 4)}f}" for value in self.tip] + [f"{v:.{self.digits}f}" for v in axis]
        self.lines.append("GOTO/" + ",".join(words))

    def choose_azimuth(self):
        return self.rng.uniform(-np.pi, np.pi)

    def choose_tilt(self):
        return self.rng.uniform(0.02, 1.0) * self.widest

    def choose_miss(self):
        return float(self.rng.choice(_MISSES))

    def choose_step(self):
        """A step in any direction, of any size."""
        step = self.rng.normal(size=3)
        return step / np.linalg.norm(step) * np.exp(self.rng.uniform(*np.log(_STEPS)))

    # Pieces

    def pass_over(self):
        """Straight over the pole, or beside it."""
        miss, most, azimuth = self.choose_miss(), self.choose_tilt(), self.choose_azimuth()
        count, step = int(self.rng.choice([2, 3, 5, 20, 60])), self.choose_step()
        self.sweep(miss, np.linspace(-most, most, count), azimuth, step)

    def sweep(self, miss, tilts, azimuth, step):
        start = self.tip
        for i, tilt in enumerate(tilts):
            lean = np.hypot(tilt, miss)
            self.go(start + step * (i / max(len(tilts) - 1, 1)), lean, azimuth + np.arctan2(miss, tilt))

    def turn_on_pole(self):
        """To the pole, or near it, and on in another direction."""
        self.go(self.tip + self.choose_step(), self.choose_tilt(), self.choose_azimuth())
        self.go(self.tip + self.choose_step(), self.choose_miss(), self.choose_azimuth())
        if self.rng.random() < 0.3:
            self.go(self.tip + self.choose_step(), self.choose_miss(), self.choose_azimuth())
        self.go(self.tip + self.choose_step(), self.choose_tilt(), self.choose_azimuth())

    def star(self):
        """Several ways out of one point and back."""
        middle = self.tip
        for _ in range(int(self.rng.integers(2, 6))):
            self.go(middle, self.choose_miss(), self.choose_azimuth())
            self.go(middle + self.choose_step(), self.choose_tilt(), self.choose_azimuth())

    def begin_on_pole(self):
        """From the pole, and sometimes back to it."""
        azimuth = self.choose_azimuth()
        self.go(self.tip, self.choose_miss(), azimuth)
        for tilt in np.linspace(0.0, self.choose_tilt(), int(self.rng.integers(2, 12)))[1:]:
            self.go(self.tip + self.choose_step() * 0.3, tilt, azimuth)
        if self.rng.random() < 0.5:
            self.go(self.tip + self.choose_step(), self.choose_miss(), azimuth)

    def go_back(self):
        """There and back on the same points."""
        azimuth, start, step = self.choose_azimuth(), self.tip, self.choose_step()
        tilts = np.linspace(self.choose_miss(), self.choose_tilt(), int(self.rng.integers(2, 10)))
        for tilt in [*tilts, *tilts[::-1]]:
            self.go(start + step * tilt / self.widest, tilt, azimuth)

    def plunge(self):
        """Along the axis, on the pole or near it."""
        azimuth, tilt = self.choose_azimuth(), self.choose_miss()
        for depth in (0.0, -self.rng.uniform(1.0, 20.0), self.rng.uniform(1.0, 20.0)):
            self.go(self.tip + [0.0, 0.0, depth], tilt, azimuth)

    def jitter(self):
        """On the pole but for the last digit that is printed."""
        step = self.choose_step()
        for _ in range(int(self.rng.integers(3, 40))):
            self.go(self.tip + step, 0.0, 0.0, noise=10.0**-self.digits)

    def tilt_at_once(self):
        """One long tilting motion."""
        self.go(self.tip, self.choose_miss(), self.choose_azimuth())
        self.go(self.tip + self.choose_step(), self.choose_tilt(), self.choose_azimuth())

    def wander(self):
        """Anywhere in steps of all sizes."""
        tilt, azimuth = self.choose_tilt(), self.choose_azimuth()
        for _ in range(int(self.rng.integers(3, 40))):
            change = np.exp(self.rng.uniform(np.log(1e-6), np.log(0.3)))
            tilt = abs(tilt + change * self.rng.normal()) % self.widest
            azimuth += change * self.rng.normal() * self.rng.choice([0.1, 1.0, 10.0])
            self.go(self.tip + self.choose_step() * 0.3, tilt, azimuth)

    def circle(self):
        """Round the pole, near or far."""
        tilt = max(self.choose_miss(), 1e-5) if self.rng.random() < 0.5 else self.choose_tilt()
        azimuth, round_, step = self.choose_azimuth(), self.rng.uniform(-7.0, 7.0), self.choose_step()
        count = int(self.rng.integers(5, 60))
        for share in np.linspace(0.0, 1.0, count):
            self.go(self.tip + step / count, tilt, azimuth + share * round_)

    def creep(self):
        """Least steps of the tip, with tilts."""
        azimuth, tilt = self.choose_azimuth(), self.choose_tilt()
        for _ in range(int(self.rng.integers(2, 20))):
            self.go(self.tip + self.rng.normal(size=3) * 1e-4, abs(tilt), azimuth)
            tilt = tilt + self.rng.normal() * self.rng.choice([0.0, 1e-4, 0.02])
