"""Random machines of every structure and leg kind as YAML text, with poses about their homes."""

from __future__ import annotations

import numpy as np
from geometry import LETTERS, Description
from hypothesis import assume
from independent import transform

import parakin as pk


def _numbers(values, unit=""):
    return f"[{', '.join(f'{v!r}{unit}' for v in map(float, values))}]"


def text_of(d):
    """The machine file of a description."""
    lines = ["name: drawn", "source: Drawn at random.", f"motion: {' '.join(d.motion)}", "legs:"]
    for leg in d.legs:
        ranges = ", ".join("[-720 deg, 720 deg]" if unit == "rad" else "[-9 m, 9 m]" for unit in UNITS[leg["kind"]])
        names, joints = len(leg["joints"]), ", ".join(leg["joints"])
        lines += [
            f"  - kind: {leg['kind']}",
            f"    joints: [{joints if names == 1 else f'[{joints}]'}]",
            f"    range: {ranges if names == 1 else f'[{ranges}]'}",
        ]
        for key, value in leg.items():
            if key in ("foot", "pivot", "platform"):
                lines.append(f"    {key}: {_numbers(value, ' mm')}")
            elif key in ("rail", "axis", "zero"):
                lines.append(f"    {key}: {_numbers(value)}")
            elif key == "branch":
                lines.append(f'    branch: "{value}"')
            elif key not in ("kind", "joints"):
                lines.append(f"    {key}: {float(value)!r} mm")
    for part in ("mounting", "head", "table"):
        steps = getattr(d, part)
        lines += [f"{part}:"] * bool(steps)
        for word, value, name, sign in steps:
            unit, rear = "mm" if word[0] == "t" else "rad", "true" if sign < 0 else "false"
            driven = f"joint: {name}, range: [-720 deg, 720 deg], reverse: {rear}, offset: {value!r} rad"
            lines.append(f"  - {word}: {f'{{{driven}}}' if name else f'{value!r} {unit}'}")
    values = zip(d.axes, d.home, strict=True)
    home = ", ".join(f"{axis}: {float(v)!r} {'mm' if axis in 'XYZ' else 'rad'}" for axis, v in values)
    return "\n".join([*lines, *d.limits, f"home: {{{home}}}", ""])


UNITS = {
    "length": ["mm"],
    "ring": ["mm"],
    "slider": ["mm"],
    "crank": ["rad"],
    "lambda": ["mm", "mm"],
    "column": ["rad", "mm"],
    "driven_column": ["rad", "mm", "rad"],
}
SINGLE = ["length", "slider", "crank"]
FAMILIES = {  # motion, leg kinds to draw from
    "six": ("tx ty tz rz ry rx", SINGLE),
    "another order": ("tx ty tz rx rz ry", SINGLE),
    "lambdas": ("tx ty tz rz ry rx", ["lambda"]),
    "columns": ("tx ty tz rz ry rx", ["column"]),
    "any": ("tx ty tz rz ry rx", [*SINGLE, "lambda", "column"]),
    "translational": ("tx ty tz", SINGLE),
    "carried": ("tx ty tz", SINGLE),
    "plane": ("tx tz", SINGLE),
    "planar": ("tx ty rz", SINGLE),
    "sideways": ("ty tz rx", SINGLE),
    "scara": ("tx ty tz rz", SINGLE),
    "central": ("rx ry tz", SINGLE),
    "other central": ("ry rx tz", SINGLE),
    "rolling": ("rz ry rz tz", SINGLE),
    "led": ("rz ry rz tz", SINGLE),
    "led tripod": ("ry rx tz", SINGLE),
    "rings": ("tx ty tz rx ry", ["ring"]),
    "other rings": ("tx ty tz ry rx", ["ring"]),
    "seven": ("tx ty tz rz ry rx", SINGLE),
    "driven columns": ("tx ty tz rz ry rx", ["column", "driven_column"]),
}
MORE_DRIVES = {"seven": 1, "driven columns": 2}  # than freedoms


def _direction(rng):
    v = rng.normal(size=3)
    return np.round(v / np.linalg.norm(v), 3)


def _leg(rng, kind, number, end, plane):
    """A leg to the platform's joint at ``end`` at home; ``plane``: 1 for the directions it may lie in."""
    leg = {"kind": kind, "joints": [f"q{number}{letter}" for letter in "abc"[: len(UNITS[kind])]]}
    foot = np.round(rng.uniform(-500, 500, 3) * plane + [0, 0, 300] * plane, 1)
    if kind in ("column", "driven_column"):
        radius = round(rng.uniform(300, 600), 1)
        out = abs(radius - np.hypot(*end[:2]))
        return leg | {"radius": radius, "rod": round(1.3 * out + 80, 1), "branch": rng.choice(["+", "-"])}
    if kind == "crank":
        axis = _direction(rng) if plane.all() else 1.0 - plane
        zero = np.cross(axis, rng.normal(size=3))
        zero, axis = zero / np.linalg.norm(zero), axis / np.linalg.norm(axis)
        arm, side = round(rng.uniform(100, 250), 1), np.cross(axis, zero)
        # At home the arm stands off the direction that it would have stretched or folded.
        q = np.arctan2((end - foot) @ side, (end - foot) @ zero) + rng.choice([-1, 1]) * rng.uniform(0.8, 2.3)
        knee = foot + arm * (np.cos(q) * zero + np.sin(q) * side)
        sizes = {"arm": arm, "rod": round(np.linalg.norm(end - knee), 1)}
        return leg | {"pivot": foot, "axis": axis, "zero": zero, **sizes, "branch": rng.choice(["+", "-"])}
    if kind == "length":
        return leg | {"foot": foot}
    if kind == "ring":
        return leg | {"foot": foot, "radius": round(rng.uniform(40, 120), 1)}
    rail = _direction(rng) * plane
    rail = rail / np.linalg.norm(rail)
    off = np.linalg.norm(np.cross(end - foot, rail))
    rod = round(1.25 * off + 60, 1)
    if kind == "slider":
        return leg | {"foot": foot, "rail": rail, "rod": rod, "branch": rng.choice(["+", "-"])}
    hinge = round(rng.uniform(0.2, 0.4) * rod, 1)
    short = round(rng.uniform(0.95, 1.2) * (rod - hinge), 1)
    branch = "".join(rng.choice(["+", "-"], 2))
    return leg | {"foot": foot, "rail": rail, "long": rod, "short": short, "hinge": hinge, "branch": branch}


def _two_turns(rng, family):
    """Head and table with the driven turns that the family wants, between fixed tilts and offsets."""

    def fixed(word):
        return (word, round(rng.uniform(-0.4, 0.4) if word[0] == "r" else rng.uniform(-80, 80), 2), None, 1.0)

    def driven(word, name):
        return (word, round(rng.uniform(-0.5, 0.5), 2), name, float(rng.choice([1.0, -1.0])))

    tool = ("tz", -round(rng.uniform(50, 200), 1), None, 1.0)
    first, second = rng.permutation(["rx", "ry", "rz"])[:2]
    if family == "carried":
        if second == "rz":
            first, second = second, first
        turns = [[fixed("tx"), driven(first, "h1"), fixed("ty"), fixed("rx")], [driven(second, "h2"), tool]]
        where = rng.integers(3)
        if where == 0:
            return [*turns[0], *turns[1]], []
        if where == 1:
            return [tool], [fixed("tz"), driven(second, "h2"), fixed("tx"), fixed("ry"), driven(first, "h1")]
        return [driven("ry", "h1"), fixed("tx"), tool], [fixed("ty"), driven("rx", "h2"), fixed("tz")]
    if "rings" in family or "led" in family.split():
        return [tool], []
    if family == "rolling":
        return [tool, driven(rng.choice(["rx", "ry"]), "h1"), tool], []
    if "central" in family:
        return [tool, driven("rz", "h1"), fixed("rx"), driven("ry", "h2"), tool], []
    return ([tool, fixed("rx"), fixed("tx")] if family not in ("plane", "planar", "sideways") else []), []


def draw(family, seed, count=40):
    """A machine of a family, and poses about its home by its own geometry."""
    rng = np.random.default_rng(seed)
    words, kinds = FAMILIES[family]
    motion = words.split()
    if motion[0] == "tx" and len(motion) == 3 and family != "planar":
        motion = list(rng.permutation(motion))
    head, table = _two_turns(rng, family)
    planar = len(motion) < 4 and motion[0][0] == "t" and family not in ("translational", "carried")
    plane = np.array([float(w in motion) for w in ("tx", "ty", "tz")]) if planar else np.ones(3)
    d = Description(tuple(motion), [], head, table)
    if not planar and family != "scara":
        aside, tilt = round(rng.uniform(-99, 99), 1), round(rng.uniform(-2, 2), 2)
        d.mounting = [("tz", aside, None, 1.0), ("rx", tilt, None, 1.0)]
    # The platform at home, and about it.
    middle = np.array([0, 0, -700 * plane[2], 0.1, 0.2, 0.1])
    spread = np.vstack([np.zeros(6), rng.uniform(-1, 1, (count, 6)) * [30, 30, 30, 0.1, 0.1, 0.1]])
    given = dict(zip(LETTERS, (spread + middle).T, strict=True))
    frame = np.broadcast_to(np.eye(4), (count + 1, 4, 4))
    third = iter([given["rz"], given["rx"]])
    for word in motion:
        frame = frame @ transform(word, next(third) if motion.count("rz") == 2 and word == "rz" else given[word])
    total, drives = 0, len(motion) + MORE_DRIVES.get(family, 0)
    while total < drives:
        left = {kind: drives - total - len(UNITS[kind]) for kind in kinds}
        fit = [
            kind for kind, rest in left.items() if rest >= 0 and (rest != 1 or any(len(UNITS[k]) == 1 for k in kinds))
        ]
        kind = rng.choice(fit)
        platform = np.round(rng.uniform(-180, 180, 3) * plane, 1)
        if kind == "ring":
            platform[:2] = 0.0
        end = frame[0, :3, :3] @ platform + frame[0, :3, 3]
        d.legs.append(_leg(rng, kind, len(d.legs), end, plane) | {"platform": platform})
        total += len(UNITS[kind])
    if planar:  # the tool is the platform's own frame: nothing leads out of the plane
        d.head = []
    joints = np.zeros((count + 1, len(d.joints)))
    joints[:, drives:] = rng.uniform(0.3, 0.9, len(d.serial)) + rng.uniform(-0.2, 0.2, (count + 1, len(d.serial)))
    if "rings" in family:
        d.limits = ["limits:", "  cones:", "    - {at: foot, angle: 170 deg}"]
    elif d.turns or rng.random() < 0.5:
        d.limits = ["limits:", "  cones:", "    - {at: foot, angle: 170 deg}", "    - {at: platform, angle: 150 deg}"]
    poses = d.pose(frame, joints)
    d.home = poses[0]
    return d, poses


def machine_of(d, folder):
    """The machine of a description; an example whose home can't be reached in its default mode is drawn anew."""
    path = folder / "drawn.yaml"
    path.write_text(text_of(d), encoding="utf-8")
    try:
        return pk.load(path)
    except pk.ParakinError as error:
        assume("does not reach" not in str(error))
        raise
