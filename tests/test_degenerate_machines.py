"""Machines with joints in one place, rods of no length, parallel rails: no traceback, and no wrong pose."""

import warnings

import numpy as np
import pytest
from geometry import Description
from hypothesis import settings

import parakin as pk

MOTIONS = ["tx ty tz", "tx tz", "tx ty rz", "tx ty tz rz ry rx"]
COUNT = settings().max_examples  # of machines in each of four parts
LENGTHS = [0.0, 1e-9, 100.0, 100.0, 250.0, 400.0]


def draw_points(rng, count):
    """Points that coincide, stand on one line, or in one plane."""
    points = rng.choice([-200.0, 0.0, 0.0, 100.0, 300.0], (count, 3))
    kind = rng.integers(5)
    if kind == 0:
        points[:] = points[0]
    elif kind == 1:
        points = points[0] + np.arange(count)[:, None] * rng.choice([0.0, 0.0, 50.0], 3)
    elif kind == 2:
        points[:, rng.integers(3)] = 0.0
    elif kind == 3:
        points[rng.integers(count)] = points[rng.integers(count)]
    return points


def draw_machine(rng):
    """A machine file of a machine that no engineer would build."""
    motion = str(rng.choice(MOTIONS))
    words = motion.split()
    legs, kind = len(words), str(rng.choice(["length", "slider"]))

    def write(points):
        return "[" + ", ".join("[" + ", ".join(f"{x:.17g} mm" for x in point) + "]" for point in points) + "]"

    feet, ends = draw_points(rng, legs), draw_points(rng, legs)
    if legs < 3 or words[2] != "tz":
        feet[:, 2 if "ty" in words else 1] = ends[:, 2 if "ty" in words else 1] = 0.0
    if not any(word[0] == "r" for word in words) and rng.random() < 0.7:
        ends[:] = 0.0
    letters = dict(zip(("tx", "ty", "tz", "rx", "ry", "rz"), "XYZABC", strict=True))
    home = {letters[w]: f"{rng.choice([0.0, 50.0, -300.0]):g} mm" if w[0] == "t" else "0 deg" for w in words}
    lines = [
        "name: degenerate",
        "source: Sizes were drawn.",
        f"motion: {motion}",
        "legs:",
        f"  kind: {kind}",
        f"  joints: [{', '.join(f'q{i}' for i in range(legs))}]",
        f"  foot: {write(feet)}",
        f"  platform: {write(ends)}",
        "  range: [-3 m, 3 m]" if kind == "slider" else "  range: [0 mm, 3 m]",
        f"home: {{{', '.join(f'{k}: {v}' for k, v in home.items())}}}",
    ]
    if kind == "slider":
        rail = rng.choice([0.0, 1.0], 3)
        lines[7:7] = [f"  rail: [{', '.join(f'{x:g}' for x in rail)}]", f"  rod: {rng.choice(LENGTHS):g} mm"]
        lines[7:7] = ['  branch: "+"']
    return "\n".join(lines) + "\n"


def load(text, folder):
    path = folder / "degenerate.yaml"
    path.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pk.load(path)


@pytest.mark.parametrize("part", range(4))
def test_degenerate_machines_do_no_harm(part, tmp_path):
    loaded = 0
    for seed in range(COUNT * part, COUNT * part + COUNT):
        rng = np.random.default_rng(seed)
        text = draw_machine(rng)
        try:
            machine = load(text, tmp_path)
        except pk.ParakinError:
            continue
        loaded += 1
        poses = machine.home + rng.choice([0.0, 1.0, 50.0], (40, len(machine.axes))) * np.where(
            np.array(machine.axis_units) == "mm", 1.0, 1e-2
        )
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            joints = machine.inverse(poses)
            joints = joints[np.isfinite(joints).all(1)]
            if machine.spec.legs[0].kind == "length":  # a strut without length closes to the root of the rounding
                joints = joints[(joints > 1.0).all(1)]
            methods = ["newton", "constant", *(["closed"] if machine.has_closed_forward else [])]
            for method in methods:
                for near in (None, machine.home):
                    found = machine.forward(joints, near=near, method=method)
                    done = found.converged
                    miss, _ = Description.of(machine.spec).misses(found.poses[done], joints[done])
                    assert miss.max(initial=0.0) < 1e-8, text
                    assert (found.why[~done] > 0).all()
                    back = machine.inverse(found.poses[done]) - joints[done]
                    assert np.abs(back).max(initial=0.0) < 1e-5, text
            for row in joints[:3]:
                try:
                    listed = machine.assemblies(row).poses
                except pk.NoMethodError:
                    continue
                miss, _ = Description.of(machine.spec).misses(listed, np.tile(row, (len(listed), 1)))
                assert miss.max(initial=0.0) < 1e-6, text
    assert loaded > COUNT // 16
