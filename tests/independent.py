"""A second inverse for every shipped machine, in plain NumPy from the papers' formulas: nothing of the library's.

``INVERSES[name](sizes, poses)`` takes poses (N, axes) to joints (N, joints), in the default working mode; NaN where
the legs can't close.
"""

from __future__ import annotations

import numpy as np

INCH = 25.4


def rotation(axis, angle):
    """Elementary rotation matrices (N, 3, 3) about x, y or z."""
    angle = np.atleast_1d(np.asarray(angle, float))
    s, c = np.sin(angle), np.cos(angle)
    matrix = np.zeros((len(angle), 3, 3))
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    matrix[:, i, i] = 1.0
    matrix[:, j, j], matrix[:, k, k] = c, c
    matrix[:, j, k], matrix[:, k, j] = -s, s
    return matrix


def transform(word, value):
    """Elementary transforms (N, 4, 4): ``tx`` ... ``rz``."""
    value = np.atleast_1d(np.asarray(value, float))
    matrix = np.broadcast_to(np.eye(4), (len(value), 4, 4)).copy()
    if word[0] == "t":
        matrix[:, "xyz".index(word[1]), 3] = value
    else:
        matrix[:, :3, :3] = rotation(word[1], value)
    return matrix


def orientation(a, b, c):
    """R = Rz(C)·Ry(B)·Rx(A), (N, 3, 3)."""
    return rotation("z", c) @ rotation("y", b) @ rotation("x", a)


def tool_axis(b, c):
    """From the tip into the holder, (N, 3)."""
    return np.stack([np.cos(c) * np.sin(b), np.sin(c) * np.sin(b), np.cos(b)], -1)


def leg_of(hypotenuse, *others):
    """√(hypotenuse² - others²) as √((h - ρ)(h + ρ)), which keeps its digits where the difference is small."""
    rho = np.sqrt(sum(np.square(x) for x in others))
    with np.errstate(invalid="ignore"):
        return np.sqrt((hypotenuse - rho) * (hypotenuse + rho))


def tricept(s, poses):
    big, small, l1, l2 = s["R"], s["r"], s["l1"], s["l2"]
    k = tool_axis(poses[:, 3], poses[:, 4])
    dx, dy, dz = (poses[:, :3] + l2 * k).T
    length = np.sqrt(dx**2 + dy**2 + dz**2)
    p = length - l1
    # (20) with √(1 - (Dx/|D|)²) = √(Dy² + Dz²)/|D|, (19)
    theta, psi = np.arctan2(-dx, np.hypot(dy, dz)), np.arctan2(dy, -dz)
    st, ct, sp, cp = np.sin(theta), np.cos(theta), np.sin(psi), np.cos(psi)
    root = np.sqrt(3.0)
    common = p**2 + small**2 + big**2
    half = small * big / 2.0
    d1 = np.sqrt(common - 2.0 * p * big * ct * sp - 2.0 * small * big * cp)  # (26)
    d2 = np.sqrt(common + p * big * (ct * sp - root * st) + half * (-3.0 * ct - root * st * sp - cp))  # (27)
    d3 = np.sqrt(common + p * big * (ct * sp + root * st) + half * (-3.0 * ct + root * st * sp - cp))  # (28)
    kx, ky, kz = np.einsum("nij,ni->jn", rotation("x", psi) @ rotation("y", theta), k)
    theta2 = np.arctan2(np.hypot(kx, ky), kz)  # (39) to (41), with √(1 - kz²) as hypot(kx, ky)
    theta1 = np.arctan2(-ky, -kx)
    return np.stack([d1, d2, d3, theta1, theta2], -1)


def hbg80_2d(s, poses):
    x, y = poses.T
    return np.stack([x - leg_of(s["l1"], y), y - leg_of(s["l2"], x)], -1)  # (2)


def hbg80_3d(s, poses):
    px, py, pz = poses[:, 0] - s["xPT1"], poses[:, 1] - s["yPT1"], poses[:, 2] + s["h"]
    rod = s["l0"]
    return np.stack([px - leg_of(rod, py, pz), py - leg_of(rod, px, pz), -pz - leg_of(rod, px, py)], -1)  # (7)


def lambda6(s, poses):
    x, y, z, a, b, c = poses.T
    turn = orientation(a, b, c)
    joints = np.empty((len(poses), 6))
    long, short, rest = s["c"], s["u"], s["c"] - s["r"]
    for i, angle in enumerate(np.radians([180.0, 60.0, -60.0])):
        direction = np.array([np.cos(angle), np.sin(angle), 0.0])
        point = np.stack([x, y, z], -1) + turn @ (s["D"] * direction)
        off = point - s["C"] * direction
        low = point[:, 2] - leg_of(long, off[:, 0], off[:, 1])
        reach = rest * (point[:, 2] - low) / long
        joints[:, i] = low  # (6) to (8)
        with np.errstate(invalid="ignore"):
            joints[:, i + 3] = low + reach + np.sqrt(reach**2 - rest**2 + short**2)  # (9) to (11)
    return joints


def orthoglide(s, poses):
    x, y, z = poses.T
    rod = s["L"]
    return np.stack([x + leg_of(rod, y, z), y + leg_of(rod, z, x), z + leg_of(rod, x, y)], -1)


def orthoglide5_head(s, poses):
    k = tool_axis(poses[:, 3], poses[:, 4])
    t1, t2 = np.arctan2(k[:, 1], k[:, 0]), np.arctan2(np.hypot(k[:, 0], k[:, 1]), k[:, 2])
    tip = transform("rz", t1) @ transform("ry", t2) @ transform("tz", -s["tool"])
    return np.column_stack([orthoglide(s, poses[:, :3] - tip[:, :3, 3]), t1, t2])


def orthoglide5_table(s, poses):
    k = tool_axis(poses[:, 3], poses[:, 4])
    # Rx(a)·Rz(c)·k = Z of the machine, with the cradle's tilt a ≥ 0.
    tilt, turn = np.arctan2(np.hypot(k[:, 0], k[:, 1]), k[:, 2]), np.arctan2(k[:, 0], k[:, 1])
    middle = s["middle"]
    place = transform("tx", middle) @ transform("ty", middle) @ transform("tz", middle - s["tool"])
    table = place @ transform("rx", tilt) @ transform("rz", turn)
    tip = np.einsum("nij,nj->ni", table, np.column_stack([poses[:, :3], np.ones(len(poses))]))
    return np.column_stack([orthoglide(s, tip[:, :3] + s["tool"] * np.eye(3)[2]), tilt, turn])


def hexapod(s, poses):
    base = INCH * np.array([[-22.95, 13.25, 0.0], [22.95, 13.25, 0.0], [0.0, -26.5, 0.0]])
    feet = base[[0, 1, 1, 2, 2, 0]]
    xy = [[-1.0, 11.5], [1.0, 11.5], [10.459, -4.884], [9.459, -6.616], [-9.459, -6.616], [-10.459, -4.884]]
    corners = INCH * np.column_stack([xy, np.zeros(6)]) + [0.0, 0.0, s["tool"]]  # from the tip
    turn = orientation(*poses[:, 3:].T)
    struts = poses[:, None, :3] + np.einsum("nij,kj->nki", turn, corners) - feet
    return np.linalg.norm(struts, axis=-1)


def linear_delta(s, poses):
    joints = []
    for angle in np.radians([90.0, 210.0, 330.0]):
        off = poses[:, :2] - (s["tower"] - s["plate"]) * np.array([np.cos(angle), np.sin(angle)])
        joints.append(poses[:, 2] + s["tool"] + leg_of(s["rod"], off[:, 0], off[:, 1]))
    return np.stack(joints, -1)


INVERSES = {
    function.__name__: function
    for function in (
        tricept,
        hbg80_2d,
        hbg80_3d,
        lambda6,
        orthoglide,
        orthoglide5_head,
        orthoglide5_table,
        hexapod,
        linear_delta,
    )
}
