"""A second inverse for the machines of the field, in plain NumPy from what their files say in words.

As :mod:`independent`, which has those of the papers: ``INVERSES[name](sizes, poses)``, joints in the default working
mode, NaN where the legs can't close.
"""

from __future__ import annotations

from itertools import repeat

import numpy as np
from independent import leg_of, orientation, rotation, tool_axis, transform, tricept

SIDES = [90.0, 210.0, 330.0]


def on_circle(radius, degrees, z=0.0):
    """Points (n, 3) on a circle about Z."""
    w = np.radians(np.asarray(degrees, float))
    return np.stack([radius * np.cos(w), radius * np.sin(w), np.full(len(w), z)], -1)


def platform_joints(poses, corners, tool):
    """The platform's joints (n, N, 3) in the base, from the tip: the tool goes down from the platform."""
    corners = np.asarray(corners, float) + [0.0, 0.0, tool]
    turn = orientation(*poses[:, 3:].T) if poses.shape[1] == 6 else np.broadcast_to(np.eye(3), (len(poses), 3, 3))
    return np.einsum("nij,kj->kni", turn, corners) + poses[:, :3]


def strut_lengths(feet, ends):
    return np.stack([np.linalg.norm(end - foot, axis=-1) for foot, end in zip(feet, ends, strict=True)], -1)


def hexapod_of(feet_at, platform_at):
    """A hexapod of two circles R and r, their joints at the given degrees."""

    def invert(s, poses):
        ends = platform_joints(poses, on_circle(s["r"], platform_at), s["tool"])
        return strut_lengths(on_circle(s["R"], feet_at), ends)

    return invert


def mikromat_6x(s, poses):
    feet = [*on_circle(s["R"], [70, 190, 310]), *on_circle(s["W"], [110, 230, 350], -s["drop"])]
    corners = on_circle(s["r"], [30, 150, 270, 130, 250, 10])
    return strut_lengths(feet, platform_joints(poses, corners, s["tool"]))


def slides(rods, feet, rails, ends, signs):
    """Where on their rails the rods' feet are: sign +1 ahead of the platform's joint, -1 behind it."""
    joints = []
    for rod, foot, rail, end, sign in zip(rods, feet, rails, ends, signs, strict=True):
        rail, w = np.asarray(rail) / np.linalg.norm(rail), end - np.asarray(foot, float)
        joints.append(w @ rail + sign * leg_of(rod, np.linalg.norm(np.cross(w, rail), axis=-1)))
    return np.stack(joints, -1)


def hexaglide(s, poses):
    y = [60.0, -60.0, 180.0, -180.0, 300.0, -300.0]
    ends = platform_joints(poses, on_circle(s["r"], [30, -30, 100, -100, 162, -162]), s["tool"])
    feet = [[0.0, v, 0.0] for v in y]
    return slides(repeat(s["rod"], 6), feet, repeat([1.0, 0.0, 0.0], 6), ends, [1, 1, -1, -1, -1, -1])


def leaning(lean, degrees):
    """Rails that lead down and, by an angle from the vertical, to the middle, at sides in the given directions."""
    w = np.radians(degrees)
    return np.stack([-np.sin(lean) * np.cos(w), -np.sin(lean) * np.sin(w), np.full(len(w), -np.cos(lean))], -1)


def hexam(s, poses):
    feet = on_circle(s["R"], [78, 102, 198, 222, 318, 342])
    ends = platform_joints(poses, on_circle(s["r"], [40, 140, 160, 260, 280, 20]), s["tool"])
    return slides(repeat(s["rod"], 6), feet, leaning(s["lean"], np.repeat(SIDES, 2)), ends, [-1] * 6)


def linapod6(s, poses):
    corners = [*on_circle(s["r"], [40, 160, 280], 60.0), *on_circle(s["r"], [140, 260, 20], -60.0)]
    ends = platform_joints(poses, corners, s["tool"])
    feet = on_circle(s["R"], [*SIDES, *SIDES])
    off = [np.linalg.norm((end - foot)[:, :2], axis=1) for end, foot in zip(ends, feet, strict=True)]
    rods = [s["long"]] * 3 + [s["short"]] * 3
    return np.stack([end[:, 2] + leg_of(rod, rho) for end, rod, rho in zip(ends, rods, off, strict=True)], -1)


def triglide(s, poses):
    x, y, z = poses.T
    z = z + s["tool"]
    out = s["side"] - s["wide"]
    return np.stack(
        [x - leg_of(s["rod"], y - out, z), x - leg_of(s["rod"], y + out, z), x + leg_of(s["rod"], y, z)], -1
    )


def triglide_pairs(s, poses):
    """By the rods of the pairs that stand behind, and below the other."""
    x, y, z = poses.T
    z, out = z + s["tool"], s["side"] - s["wide"]
    ends = np.stack([x - s["half"], x - s["half"], x], -1)
    off = np.stack([leg_of(s["rod"], aside, z) for aside in (y - out, y + out, y - s["half"] + s["half"])], -1)
    return ends + off * [-1.0, -1.0, 1.0] + [s["half"], s["half"], 0.0]


def linapod3(s, poses):
    off = [poses[:, :2] - p[:2] for p in on_circle(s["R"] - s["r"], SIDES)]
    return np.stack([poses[:, 2] + s["tool"] + leg_of(s["rod"], *o.T) for o in off], -1)


def horizontal(poses):
    """Base coordinates of a machine that lies down: its Z is -Y of the machine frame, its Y is Z."""
    x, y, z = poses.T
    return x, z, -y


def urane_sx(s, poses):
    x, y, z = horizontal(poses)
    off = [np.stack([x, y]) - p[:2, None] for p in on_circle(s["R"] - s["r"], SIDES)]
    return np.stack([z + s["tool"] + leg_of(s["rod"], *o) for o in off], -1)


def quickstep(s, poses):
    x, y, z = horizontal(poses)
    across = [(s["wide"] - 150.0, -s["deep"] + 60.0), (-s["wide"] + 150.0, -s["deep"] + 60.0), (0.0, s["high"] - 120.0)]
    return np.stack([z + s["tool"] + leg_of(s["rod"], x - a, y - b) for a, b in across], -1)


def george_v(s, poses):
    k = tool_axis(poses[:, 3], poses[:, 4])
    t1, t2 = np.arctan2(k[:, 1], k[:, 0]), np.arctan2(np.hypot(k[:, 0], k[:, 1]), k[:, 2])
    tip = transform("tz", -s["arm"]) @ transform("rz", t1) @ transform("ry", t2) @ transform("tz", -s["tool"])
    ends = platform_joints(poses[:, :3] - tip[:, :3, 3], on_circle(s["r"], SIDES), 0.0)
    joints = slides(repeat(s["rod"], 3), on_circle(s["R"], SIDES), leaning(s["lean"], SIDES), ends, [-1] * 3)
    return np.column_stack([joints, t1, t2])


def crank_angles(arm, rod, out, along, side, sign):
    """The angle of an arm whose rod ends at (out, along) in the arm's plane and ``side`` beside it.

    By the triangle of arm, rod seen in the plane, and distance; its half angle keeps the digits. ``sign`` +1 adds it.
    """
    far = np.hypot(out, along)
    seen = leg_of(rod, side)
    with np.errstate(invalid="ignore"):
        less = np.sqrt((seen - far + arm) * (seen + far - arm))
        more = np.sqrt((far + arm - seen) * (far + arm + seen))
    return np.arctan2(along, out) + sign * 2.0 * np.arctan2(less, more)


def rotary_delta(s, poses):
    joints = []
    for angle in np.radians([270.0, 30.0, 150.0]):
        c, d = np.cos(angle), np.sin(angle)
        out = poses[:, 0] * c + poses[:, 1] * d + s["r"] - s["R"]
        joints.append(crank_angles(s["arm"], s["rod"], out, -poses[:, 2], poses[:, 1] * c - poses[:, 0] * d, -1))
    return np.stack(joints, -1)


def rus6(s, poses):
    ends = platform_joints(poses, on_circle(s["r"], [50, 130, 170, 250, 290, 10]), s["tool"])
    pivots = on_circle(s["R"], [75, 105, 195, 225, 315, 345])
    joints = []
    for pivot, end, angle in zip(pivots, ends, np.radians(np.repeat(SIDES, 2)), strict=True):
        w, (c, d) = end - pivot, (np.cos(angle), np.sin(angle))
        out, side = w[:, 0] * c + w[:, 1] * d, w[:, 1] * c - w[:, 0] * d
        joints.append(crank_angles(s["arm"], s["rod"], out, -w[:, 2], side, -1))
    return np.stack(joints, -1)


def five_bar(s, poses):
    x, y = poses.T
    left = crank_angles(s["arm"], s["rod"], x + s["base"], y, 0.0 * x, 1)
    return np.stack([left, crank_angles(s["arm"], s["rod"], x - s["base"], y, 0.0 * x, -1)], -1)


def five_bar_slides(s, poses):
    x, y = poses.T
    return np.stack([x - leg_of(s["rod"], y), x + leg_of(s["rod"], y - s["rise"])], -1)


def corners_in_plane(poses, radius, degrees):
    """Corners (n, N, 2) of a platform in its plane."""
    return [
        poses[:, :2] + radius * np.stack([np.cos(poses[:, 2] + w), np.sin(poses[:, 2] + w)], -1)
        for w in np.radians(degrees)
    ]


def rpr3(s, poses):
    ends = corners_in_plane(poses, s["r"], [30.0, 150.0, 270.0])
    return np.stack([np.hypot(*(e - f[:2]).T) for e, f in zip(ends, on_circle(s["R"], SIDES), strict=True)], -1)


def rrr3(s, poses):
    joints = []
    for end, pivot, angle in zip(
        corners_in_plane(poses, s["r"], [70.0, 190.0, 310.0]), on_circle(s["R"], SIDES), np.radians(SIDES), strict=True
    ):
        w, (c, d) = end - pivot[:2], (-np.cos(angle), -np.sin(angle))  # the arm at zero points to the middle
        joints.append(crank_angles(s["arm"], s["rod"], w @ [c, d], w @ [-d, c], 0.0 * poses[:, 2], -1))
    return np.stack(joints, -1)


def prr3(s, poses):
    joints = []
    for end, angle in zip(corners_in_plane(poses, s["r"], SIDES), np.radians(SIDES), strict=True):
        along = end @ [np.sin(angle), -np.cos(angle)]
        joints.append(along + leg_of(s["rod"], end @ [np.cos(angle), np.sin(angle)] - s["R"]))
    return np.stack(joints, -1)


def eclipse(s, poses):
    ends = platform_joints(poses, on_circle(s["r"], SIDES), s["tool"])
    angles = [np.arctan2(end[:, 1], end[:, 0]) for end in ends]
    heights = [end[:, 2] + leg_of(s["rod"], s["R"] - np.hypot(end[:, 0], end[:, 1])) for end in ends]
    return np.stack([*angles, *heights], -1)


def eclipse_overactuated(s, poses):
    """The links of the first two columns lean by the arc sine of the fall to their ends, of slides above those."""
    joints = eclipse(s, poses)
    ends = platform_joints(poses, on_circle(s["r"], SIDES[:2]), s["tool"])
    falls = [joints[:, 3 + i] - end[:, 2] for i, end in enumerate(ends)]
    return np.column_stack([joints, *(-np.arcsin(fall / s["rod"]) for fall in falls)])


def four_struts(s, poses):
    """The tool lies on the line through the central leg's foot; C turns the level line across the tool's own x."""
    tip, c = poses[:, :3], poses[:, 3]
    z = -tip / np.linalg.norm(tip, axis=1, keepdims=True)
    x = np.cross(np.stack([-np.sin(c), np.cos(c), 0.0 * c], -1), z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    turn = np.stack([x, np.cross(z, x), z], -1)
    corners = on_circle(s["r"], [90, 90, 270, 270])
    return strut_lengths(on_circle(s["R"], [45, 135, 225, 315]), [tip + s["tool"] * z + turn @ p for p in corners])


def sprint_z3(s, poses):
    """The 3-PRS turns without torsion, and its middle moves aside by r/2·(1 - cos B): Carretero and others (2000)."""
    k, b, c = tool_axis(poses[:, 3], poses[:, 4]), poses[:, 3], poses[:, 4]
    turn = rotation("z", c) @ rotation("y", b) @ rotation("z", -c)
    aside = s["r"] * np.sin(b / 2.0) ** 2  # r/2·(1 - cos B)
    ahead = c - np.pi / 2.0  # from the first rail
    x, y = -aside * np.cos(2.0 * ahead), aside * np.sin(2.0 * ahead)
    middle = np.stack([-y, x, poses[:, 2] - s["drop"] + s["tool"] * np.cos(b)], -1)
    rails = []
    for corner, angle in zip(on_circle(s["r"], SIDES), np.radians(SIDES), strict=True):
        end = middle + turn @ corner
        rails.append(end[:, 2] + leg_of(s["rod"], s["R"] - end @ [np.cos(angle), np.sin(angle), 0.0]))
    return np.stack([*rails, *(middle - s["tool"] * k - poses[:, :3])[:, :2].T], -1)


def exechon(s, poses):
    """The platform turns by Rx(alpha)·Ry(beta): Bi and Jin (2011)."""
    k = tool_axis(poses[:, 3], poses[:, 4])
    centre = poses[:, :3] + s["tool"] * k
    alpha = np.arctan2(centre[:, 1], -centre[:, 2])  # the plane of both struts holds the centre
    x, y, z = (np.array([0.0, s["c"], 0.0]) - centre).T
    beta = np.arctan2(x, np.cos(alpha) * z - np.sin(alpha) * y)  # and that of the third one too
    turn = rotation("x", alpha) @ rotation("y", beta)
    feet = np.array([[-s["a"], 0.0, 0.0], [s["a"], 0.0, 0.0], [0.0, s["c"], 0.0]])
    corners = np.array([[-s["p"], 0.0, s["arm"]], [s["p"], 0.0, s["arm"]], [0.0, s["o"], s["arm"]]])
    struts = strut_lengths(feet, [centre + turn @ corner for corner in corners])
    kx, ky, kz = np.einsum("nji,nj->in", turn, k)
    return np.concatenate([struts, np.stack([np.arctan2(ky, kx), np.arctan2(np.hypot(kx, ky), kz)], -1)], 1)


def pentapod(s, poses):
    """LinuxCNC's pentakins: the foot in the effector's frame by rpy angles, then the distance to the ring."""
    k = tool_axis(poses[:, 3], poses[:, 4])
    a, b = -np.arcsin(np.clip(k[:, 1], -1.0, 1.0)), np.arctan2(k[:, 0], k[:, 2])
    turn = rotation("y", b) @ rotation("x", a)
    struts = []
    sides = [(-418.03, 324.56), (417.96, 324.56), (-418.03, -325.44), (417.96, -325.44), (-0.06, -492.96)]
    for (x, y), height in zip(sides, [-185.5, -159.5, -67.5, -41.5, -14.0], strict=True):
        seen = np.einsum("nji,nj->ni", turn, np.array([x, y, s["top"]]) - poses[:, :3])
        out = np.hypot(seen[:, 0], seen[:, 1]) - s["ring"]
        struts.append(np.hypot(seen[:, 2] - s["tool"] - height, out))
    return np.stack(struts, -1)


PAIRS, SPREAD = [80, 100, 200, 220, 320, 340], [30, 150, 150, 270, 270, 30]
INVERSES = {
    "variax": hexapod_of(PAIRS, [45, 135, 165, 255, 285, 15]),
    "cmw_300": hexapod_of([78, 102, 198, 222, 318, 342], [42, 138, 162, 258, 282, 18]),
    "tornado_2000": hexapod_of(PAIRS, SPREAD),
    "okuma_hexapod": hexapod_of(np.repeat(SIDES, 2), SPREAD),
    "g500": hexapod_of(np.repeat(SIDES, 2), [40, 140, 160, 260, 280, 20]),
    "tricept_805": tricept,
} | {
    function.__name__: function
    for function in (
        mikromat_6x,
        hexaglide,
        hexam,
        linapod6,
        triglide,
        triglide_pairs,
        linapod3,
        urane_sx,
        quickstep,
        george_v,
        rotary_delta,
        rus6,
        five_bar,
        five_bar_slides,
        rpr3,
        rrr3,
        prr3,
        eclipse,
        eclipse_overactuated,
        sprint_z3,
        four_struts,
        exechon,
        pentapod,
    )
}
