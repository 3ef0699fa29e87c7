"""The geometry of any machine by explicit 4 × 4 matrices, poses and joints to rods: nothing of the library's."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from independent import orientation, tool_axis, transform

LETTERS = dict(zip(("tx", "ty", "tz", "rx", "ry", "rz"), "XYZABC", strict=True))


@dataclass
class Description:
    """A machine in plain numbers. Steps are (word, value, joint or None, sign); legs are dictionaries."""

    motion: tuple[str, ...]
    legs: list[dict]
    head: list[tuple] = field(default_factory=list)
    table: list[tuple] = field(default_factory=list)
    mounting: list[tuple] = field(default_factory=list)
    limits: str = ""
    home: np.ndarray | None = None  # pose, in the order of axes
    start: np.ndarray = field(default_factory=lambda: np.eye(3))
    constraints: list[dict] = field(default_factory=list)  # points in planes, and rods
    parasitic: tuple[str, ...] = ()

    @classmethod
    def of(cls, spec):
        """From a machine's specification, a plain record of its file."""
        legs = [
            {"kind": leg.kind, "joints": [d.name for d in leg.drives]}
            | {k: v for k, v in vars(leg).items() if k != "drives"}
            for leg in spec.legs
        ]
        steps = [
            [(s.axis, s.value, s.drive and s.drive.name, s.sign) for s in part]
            for part in (spec.head, spec.table, spec.mounting)
        ]
        return cls(
            tuple(spec.motion),
            legs,
            *steps,
            constraints=[vars(each) for each in spec.constraints],
            parasitic=spec.parasitic,
        )

    @property
    def serial(self):
        return [step[2] for step in (*self.head, *self.table) if step[2]]

    @property
    def joints(self):
        """Names: the legs' first joints, their second ones, third ones, head's and table's."""
        legs = [leg["joints"][i] for i in range(3) for leg in self.legs if len(leg["joints"]) > i]
        return tuple(legs + self.serial)

    @property
    def turns(self):
        return [word for word in self.motion if word[0] == "r"]

    @property
    def hangs(self):
        """Whether a central leg holds the platform."""
        return self.motion[0][0] == "r" and [word for word in self.motion if word[0] == "t"] == ["tz"]

    @property
    def tells_axis(self):
        """Whether of the tool's orientation its axis counts only."""
        return bool(self.serial) or len(self.motion) == 5

    @property
    def axes(self):
        if self.tells_axis:
            return tuple("XYZBC")
        if self.hangs:
            return tuple("XYZC")[: len(self.motion)]
        return tuple(LETTERS[word] for word in LETTERS if word in self.motion and word not in self.parasitic)

    def chain(self, steps, joints):
        """Transform (N, 4, 4) along steps, for joints (N, joints)."""
        result = np.broadcast_to(np.eye(4), (len(joints), 4, 4))
        for word, value, name, sign in steps:
            q = joints[:, self.joints.index(name)] * sign if name else np.zeros(len(joints))
            result = result @ transform(word, value + q)
        return result

    def pose(self, platform, joints):
        """Tool's poses (N, axes) in the workpiece for the platform's frames (N, 4, 4) in the base."""
        table, mount, head = (self.chain(steps, joints) for steps in (self.table, self.mounting, self.head))
        w = np.linalg.inv(table) @ mount @ platform @ head
        if self.tells_axis:
            k = w[:, :3, 2]
            angles = {"B": np.arctan2(np.hypot(k[:, 0], k[:, 1]), k[:, 2]), "C": np.arctan2(k[:, 1], k[:, 0])}
        elif len(self.turns) == 3:
            r = w[:, :3, :3]
            b = np.arctan2(-r[:, 2, 0], np.hypot(r[:, 0, 0], r[:, 1, 0]))
            angles = {"A": np.arctan2(r[:, 2, 1], r[:, 2, 2]), "B": b, "C": np.arctan2(r[:, 1, 0], r[:, 0, 0])}
        else:
            i = ["rx", "ry", "rz"].index(self.turns[0]) if self.turns else 0
            j, k = (i + 1) % 3, (i + 2) % 3
            angles = {"ABC"[i]: np.arctan2(platform[:, k, j], platform[:, j, j])}
        values = dict(zip("XYZ", w[:, :3, 3].T, strict=True)) | angles
        return np.stack([values[axis] for axis in self.axes], -1)

    def platform(self, poses, joints):
        """The platform's frames (N, 4, 4) for poses and joints, and by how much the tool's axis misses (N,)."""
        given = dict(zip(self.axes, poses.T, strict=True))
        zero = np.zeros(len(poses))
        table, mount, head = (self.chain(steps, joints) for steps in (self.table, self.mounting, self.head))
        tip = np.stack([*(given.get(x, zero) for x in "XYZ"), zero + 1.0], -1)[..., None]
        tip = (np.linalg.inv(mount) @ table @ tip)[:, :3, 0]
        frame = np.broadcast_to(np.eye(4), (len(poses), 4, 4)).copy()
        missed = zero
        rotation = orientation(*(given.get(x, zero) for x in "ABC"))
        if self.hangs and not self.serial:
            rotation = self._hung(tip, given.get("C"), mount[:, :3, :3])
        elif len(self.parasitic) == 3 and not self.serial:  # rods alone tell it, or planes
            rotation, _ = self._guided(tip, None, head, joints)
        elif len(self.turns) == 3 and not self.serial:
            rotation = mount[:, :3, :3].transpose(0, 2, 1) @ rotation @ head[:, :3, :3].transpose(0, 2, 1)
        elif self.tells_axis:
            k = np.einsum("nji,njk,nk->ni", mount[:, :3, :3], table[:, :3, :3], tool_axis(given["B"], given["C"]))
            if len(self.motion) == 5:  # the frame about the tool's axis is anyone
                a, b = -np.arcsin(np.clip(k[:, 1], -1.0, 1.0)), np.arctan2(k[:, 0], k[:, 2])
                rotation = orientation(a, b, zero)
            else:
                rotation, missed = self._guided(tip, k, head, joints) if self.constraints else self._led(tip, k, head)
        frame[:, :3, :3] = rotation
        frame[:, :3, 3] = tip - np.einsum("nij,nj->ni", rotation, head[:, :3, 3])
        if self.constraints:
            return frame, missed
        planar = [i for i, word in enumerate(("tx", "ty", "tz")) if word not in self.motion]
        if not self.hangs:
            frame[:, planar, 3] = 0.0
        return frame, missed

    def carried(self, rod, joints):
        """Where a passive rod's foot is, (N, 3)."""
        foot = np.array(rod["foot"], float)
        if rod["drive"] is None:
            return np.broadcast_to(foot, (len(joints), 3))
        leg = next(leg for leg in self.legs if rod["drive"] in leg["joints"])
        q = joints[:, self.joints.index(rod["drive"])]
        if leg["kind"] == "slider":
            return foot + np.outer(q, leg["rail"])
        arm, axis = foot - np.array(leg["pivot"]), np.array(leg["axis"])
        about = np.outer(np.cos(q), arm) + np.outer(np.sin(q), np.cross(axis, arm))
        return np.array(leg["pivot"]) + about + np.outer(1.0 - np.cos(q), axis * (axis @ arm))

    def open_constraints(self, rotation, origin, joints):
        """How far points are from their planes, and rods from their lengths, (N, constraints), mm."""
        far = []
        for each in self.constraints:
            if "rod" in each:
                end = origin + rotation @ np.array(each["platform"])
                far.append(np.linalg.norm(end - self.carried(each, joints), axis=1) - each["rod"])
                continue
            span = origin + rotation @ np.array(each["platform"]) - np.array(each["foot"])
            normal = np.broadcast_to(np.array(each["normal"]), span.shape)
            if each["plane_of"] == "platform":
                normal = np.einsum("nij,nj->ni", rotation, normal)
            far.append((span * normal).sum(1))
        return np.stack(far, 1)

    def _guided(self, tip, k, head, joints):
        """Platform's rotation that keeps the constraints and points the tool, by Gauss and Newton from a start."""
        rotation = np.broadcast_to(self.start, (len(tip), 3, 3))

        def measure(rotation):
            origin = tip - np.einsum("nij,nj->ni", rotation, head[:, :3, 3])
            far = self.open_constraints(rotation, origin, joints)
            if k is None:
                return far
            return np.concatenate([far, 300.0 * (np.einsum("nij,nj->ni", rotation, head[:, :3, 2]) - k)], 1)

        closed = np.abs(measure(rotation)).max(1) < 1.5e-9  # beside a singularity rounding would turn it far
        for _ in range(16):
            here = measure(rotation)
            turned = [rotation @ transform(word, 1e-6)[:, :3, :3] for word in ("rx", "ry", "rz")]
            slopes = np.stack([(measure(r) - here) / 1e-6 for r in turned], 2)
            across = slopes.swapaxes(1, 2)
            square = across @ slopes + 1e-9 * np.eye(3)  # of mm², so that it has an inverse anywhere
            step = -np.linalg.solve(square, (across @ here[..., None]))[..., 0]
            step *= np.minimum(1.0, 0.3 / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
            step[closed] = 0.0
            for word, angle in zip(("rx", "ry", "rz"), step.T, strict=True):
                rotation = rotation @ transform(word, angle)[:, :3, :3]
            if np.abs(step).max(initial=0.0) < 1e-14:
                break
        return rotation, np.linalg.norm(measure(rotation)[:, len(self.constraints) :], axis=1) / 300.0

    def _led(self, tip, k, head):
        """Platform's rotation under a driven head: none, or that of the central leg through the wrist's centre."""
        along = head[:, :3, 2]
        if not self.hangs:
            return np.broadcast_to(np.eye(3), (len(k), 3, 3)), np.linalg.norm(along - k, axis=1)
        # The central leg hangs, from the base towards -z. The wrist's centre is the point of the tool's axis that the
        # platform's axis x = y = 0 passes through.
        probe = self.chain(self.head, np.full((1, len(self.joints)), 0.7))[0, :2]
        centre = tip - (probe[:, 3] @ probe[:, 2]) / (probe[:, 2] @ probe[:, 2]) * k
        r = self._lead(-centre / np.linalg.norm(centre, axis=1, keepdims=True))
        seen = np.einsum("nji,nj->ni", r, k)
        if len(self.turns) == 3:
            roll = np.arctan2(seen[:, 1], seen[:, 0]) - np.arctan2(along[:, 1], along[:, 0])
            return r @ transform("rz", roll)[:, :3, :3], np.abs(seen[:, 2] - along[:, 2])
        return r, np.linalg.norm(seen - along, axis=1)

    def _hung(self, tip, c, mount):
        """Platform's rotation where the tool lies along the central leg."""
        z = -tip / np.linalg.norm(tip, axis=1, keepdims=True)
        if len(self.turns) == 2:
            return self._lead(z)
        x, y, w = np.einsum("nji,nj->in", orientation(0.0 * c, 0.0 * c, c), np.einsum("nij,nj->ni", mount, z))
        return mount.transpose(0, 2, 1) @ orientation(np.arcsin(-y), np.arctan2(x, w), c)

    def _lead(self, z):
        """Rotation by the central leg's first two turns that leads its line along z (N, 3)."""
        x, y, z = z.T
        first, second = {
            ("rx", "ry"): (np.arctan2(-y, z), np.arctan2(x, np.hypot(y, z))),
            ("ry", "rx"): (np.arctan2(x, z), np.arctan2(-y, np.hypot(x, z))),
            ("rz", "ry"): (np.arctan2(y, x), np.arctan2(np.hypot(x, y), z)),
        }[self.motion[:2]]
        return (transform(self.motion[0], first) @ transform(self.motion[1], second))[:, :3, :3]

    def misses(self, poses, joints):
        """The greatest distance, mm, by which a rod or a hinge misses its place, and the axis' error, both (N,).

        Constraints hold the platform in several ways: of these the one in which the rods miss least.
        """
        if not self.constraints:
            return self._misses(poses, joints)
        miss, tilt = (np.full(len(poses), np.inf) for _ in range(2))
        for turns in ([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]):
            rows = np.flatnonzero(~(miss + 300.0 * tilt < 1e-8))
            self.start = np.diag(np.array(turns, float))
            off, lean = self._misses(poses[rows], joints[rows])
            less = off + 300.0 * lean < miss[rows] + 300.0 * tilt[rows]
            miss[rows[less]], tilt[rows[less]] = off[less], lean[less]
        return miss, tilt

    def _misses(self, poses, joints):
        frame, missed = self.platform(poses, joints)
        tube = np.cross(frame[:, :3, 3], frame[:, :3, 2])  # a central leg's slides along the platform's z
        worst = [np.linalg.norm(tube, axis=1) * self.hangs]
        if self.constraints:
            worst += list(np.abs(self.open_constraints(frame[:, :3, :3], frame[:, :3, 3], joints)).T)
        for leg in self.legs:
            place = np.broadcast_to(np.array(leg["platform"]), (len(poses), 3))
            if leg["kind"] == "ring":  # its joint is there on the ring where the foot is
                seen = np.linalg.inv(frame) @ np.array([*leg["foot"], 1.0])
                azimuth = np.arctan2(seen[:, 1], seen[:, 0])
                place = place + leg["radius"] * np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], -1)
            end = frame[:, :3, 3] + np.einsum("nij,nj->ni", frame[:, :3, :3], place)
            worst += leg_misses(leg, end, [joints[:, self.joints.index(name)] for name in leg["joints"]])
        return np.max(worst, 0), missed


def leg_misses(leg, end, q):
    """By how much a leg's rods miss, mm, with its platform joint at ``end`` (N, 3)."""

    def far(point):
        return np.linalg.norm(end - point, axis=1)

    kind = leg["kind"]
    if kind in ("length", "ring"):
        return [np.abs(far(np.array(leg["foot"])) - q[0])]
    if kind == "column":
        foot = np.stack([leg["radius"] * np.cos(q[0]), leg["radius"] * np.sin(q[0]), q[1]], -1)
        return [np.abs(far(foot) - leg["rod"]), np.abs(np.sin(q[0]) * end[:, 0] - np.cos(q[0]) * end[:, 1])]
    if kind == "driven_column":
        inward = -np.stack([np.cos(q[0]), np.sin(q[0]), 0.0 * q[0]], -1)
        foot = -leg["radius"] * inward + np.outer(q[1], [0, 0, 1])
        link = np.cos(q[2])[:, None] * inward + np.outer(np.sin(q[2]), [0, 0, 1])
        return [np.linalg.norm(foot + leg["rod"] * link - end, axis=1)]
    if kind == "crank":
        zero, axis = np.array(leg["zero"]), np.array(leg["axis"])
        arm = np.outer(np.cos(q[0]), zero) + np.outer(np.sin(q[0]), np.cross(axis, zero))
        return [np.abs(far(np.array(leg["pivot"]) + leg["arm"] * arm) - leg["rod"])]
    start = np.array(leg["foot"]) + np.outer(q[0], leg["rail"])
    if kind == "slider":
        return [np.abs(far(start) - leg["rod"])]
    hinge = end + (start - end) * (leg["hinge"] / leg["long"])
    short = np.linalg.norm(hinge - np.array(leg["foot"]) - np.outer(q[1], leg["rail"]), axis=1)
    return [np.abs(far(start) - leg["long"]), np.abs(short - leg["short"])]
