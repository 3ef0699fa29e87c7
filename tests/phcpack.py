"""PHCpack's forty solutions of a platform, another program's answer on equations of their own.

A platform's closures are linear in seventeen forms of Study's parameters (Wampler, Soma coordinates, 1996). PHCpack's
black box has solved six closures with random complex numbers, a generic member of that linear space, and found forty
solutions. From these its path tracker follows the line to the closures of a given platform, which stays in that space
(Morgan and Sommese, Coefficient-parameter polynomial continuation, 1989). That takes 0.2 s where the black box takes
10 s.

``python phcpack.py`` asks the black box for the forty again.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

PHC = shutil.which("phc")
START = Path(__file__).parent / "phcpack_start.txt"
NAMES = "suvwdxyz"  # of e = s + u·i + v·j + w·k and g = d + x·i + y·j + z·k: turned by e, moved by 2·g·e*/|e|²
FORMS = [  # |g|² and what places are made of; then products of e, which the turns are made of
    *["(d^2+x^2+y^2+z^2)", "(s*x-u*d)", "(s*y-v*d)", "(s*z-w*d)", "(v*z-w*y)", "(w*x-u*z)", "(u*y-v*x)"],
    *["s^2", "u^2", "v^2", "w^2", "s*u", "s*v", "s*w", "v*w", "u*w", "u*v"],
]
STUDY = "s*d+u*x+v*y+w*z;"
PATCH = np.exp(1j * np.arange(8.0) ** 2)  # that combination of a point is 1: complex, for a real one is zero somewhere
INFINITE = 1e-10  # |e|² of a point of length one
SAME = 1e-7  # rad
CLOSED = 1e-8  # of an equation
SEED = 3  # of the black box
PHASES = 5
CORRECTIONS = dict.fromkeys((21, 23, 25, 27), "1e-6")  # precision along a path; all ends are refined
END = {4: "1e-3", 12: "0.1"}  # from where on, and by what steps, an end game goes on: these ends are regular


def describe_closures(feet, corners, lengths):
    """The numbers (6, 17) of a platform's closures, 4|g|² + ... as Husty (1996) has them."""
    turns = -2.0 * feet[:, :, None] * corners[:, None, :]
    square = (feet**2).sum(1) + (corners**2).sum(1) - lengths**2
    trace = np.trace(turns, axis1=1, axis2=2)
    numbers = [np.full(6, 4.0), *4.0 * (corners - feet).T, *-4.0 * (corners + feet).T]
    numbers += [square + trace, *(square - trace + 2.0 * turns[:, i, i] for i in range(3))]
    pairs = [(1, 2), (2, 0), (0, 1)]
    numbers += [2.0 * (turns[:, j, i] - turns[:, i, j]) for i, j in pairs]
    numbers += [2.0 * (turns[:, j, i] + turns[:, i, j]) for i, j in pairs]
    return np.column_stack(numbers)


def draw_generic():
    return np.random.default_rng(1996).normal(size=(6, 17, 2)).view(complex)[..., 0]


def write_system(numbers):
    """Write the equations of closures (6, 17) for PHCpack, each with one of the first six forms."""
    lines = [STUDY, "".join(f"{_write_factor(a)}*{name}" for a, name in zip(PATCH, NAMES, strict=True)) + "-1;"]
    for form, row in zip(FORMS, np.linalg.solve(numbers[:, :6], numbers[:, 6:]).astype(complex), strict=False):
        lines.append(
            form + "".join(f"{_write_factor(a)}*{other}" for a, other in zip(row, FORMS[6:], strict=True)) + ";"
        )
    return "8\n" + "\n".join(lines) + "\n"


def _write_factor(a):
    return f"+({a.real:+.17g}{a.imag:+.17g}*i)"


def write_solutions(points):
    """Write points (k, 8) that solve a system, scaled as its equations have them, to stand behind it."""
    lines = ["", "THE SOLUTIONS :", f"{len(points)} 8", "=" * 75]
    for number, point in enumerate(points / (points @ PATCH)[:, None], 1):
        lines += [f"solution {number} :", "t : 0.0 0.0", "m : 1", "the solution for t :"]
        lines += [f" {name} : {a.real:.17e} {a.imag:.17e}" for name, a in zip(NAMES, point, strict=True)]
        lines.append("== err : 1.0E-15 = rco : 1.0E-01 = res : 1.0E-15 ==")
    return "\n".join(lines) + "\n"


def read_points(text):
    """Read all finite solutions (k, 8), complex, each once."""
    points = []
    for block in text[text.rindex("THE SOLUTIONS") :].split("the solution for t :")[1:]:
        numbers = re.findall(r"^ (\w) : +(\S+) +(\S+)", block, re.M)[:8]
        values = {name: complex(float(real), float(imaginary)) for name, real, imaginary in numbers}
        point = np.array([values[name] for name in NAMES])
        unit = point / np.linalg.norm(point)
        closed = float(re.search(r"res : +(\S+)", block)[1]) < CLOSED
        known = measure_angles(unit[None], np.array(points).reshape(-1, 8)).min(initial=np.inf) < SAME
        if closed and abs(unit[:4] @ unit[:4]) > INFINITE and not known:
            points.append(point)
    return np.array(points).reshape(-1, 8)


def measure_angles(points, others):
    """The angles (k, m), rad, between points (k, 8) and others (m, 8) of projective space."""
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    others = others / np.linalg.norm(others, axis=1, keepdims=True)
    rest = others - (others @ points.conj().T).T[..., None] * points[:, None]
    return np.arcsin(np.minimum(np.linalg.norm(rest, axis=2), 1.0))


def match_points(points, others):
    """The greatest angle between points and others matched one to one; infinite where they are not."""
    angles = measure_angles(points, others)
    nearest = angles.argmin(1) if angles.size else np.arange(len(points))
    matched = len(points) == len(others) and len(set(nearest.tolist())) == len(points)
    return angles.min(1, initial=np.inf).max(initial=0.0) if matched else np.inf


def read_start():
    """The generic member's forty solutions."""
    return np.loadtxt(START).view(complex)


def track_by_phcpack(folder, closures):
    """The solutions (k, 8) of closures (6, 17), and how many phases it took until no two of the paths had met."""
    best = np.empty((0, 8))
    for phase in range(1, PHASES + 1):
        points = track_paths(folder, closures, phase)
        best = points if len(points) > len(best) else best
        if len(best) == len(read_start()):
            break
    return best, phase


def track_paths(folder, closures, phase):
    """The solutions (k, 8) of closures (6, 17), where PHCpack's forty paths end that a phase, rad, leads."""
    start, target, out = folder / "start.txt", folder / "target.txt", folder / "out.txt"
    if not start.exists():
        start.write_text(write_system(draw_generic()) + write_solutions(read_start()))
    target.write_text(write_system(closures))
    out.unlink(missing_ok=True)
    homotopy = ["k", 1, "a", np.cos(phase), np.sin(phase), 0]
    steps = [word for setting in (CORRECTIONS | END).items() for word in setting] + [0]
    answers = [target.name, out.name, "n", start.name, *homotopy, *steps, 0]
    given = "".join(f"{answer}\n" for answer in answers)
    subprocess.run([PHC, "-p"], input=given, text=True, cwd=folder, check=True, capture_output=True, timeout=300)
    return read_points(out.read_text())


def main():
    with tempfile.TemporaryDirectory() as folder:
        system, out = Path(folder) / "generic.txt", Path(folder) / "out.txt"
        system.write_text(write_system(draw_generic()))
        subprocess.run([PHC, "-b", f"-0{SEED}", system, out], check=True, capture_output=True)
        points = read_points(out.read_text())
    np.savetxt(START, np.ascontiguousarray(points).view(float), fmt="%.16e")
    print(f"{len(points)} solutions")


if __name__ == "__main__":
    main()
