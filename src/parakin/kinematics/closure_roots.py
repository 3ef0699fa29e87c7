"""Roots of the legs' closures by Newton's method, and the working mode in which the legs stand there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array, Flags
from ..kernels.batch import (
    NEVER,
    NewtonSteps,
    Roots,
    Settling,
    evaluate_tape,
    evaluate_tape_with_residual,
    solve_by_newton,
)
from ..kernels.tape import Tape
from ..model.elements import MOTION_UNITS
from ..model.traces import Model
from .tapes import collect_newton_tapes
from .wrist.pole_thresholds import SAME_MODE

CLOSED = 1e-9  # greatest closure error of an answer, mm in a machine of up to ten metres, whose rounding is some 1e-11
MOST_STEPS = 24


def compute_closure_tolerance(model: Model) -> float:
    """Return the greatest closure error of an answer, mm: rounding grows with the machine."""
    return CLOSED * max(1.0, max(model.sizes) / 10_000.0)


def compute_mode_tolerance(model: Model) -> float:
    """Return by how much legs' joints may differ from those of the working mode that they stand in, mm."""
    return SAME_MODE * max(1.0, max(model.sizes) / 1000.0)


def compute_poses(model: Model, coordinates: Array, joints: Array) -> Array:
    """Compute poses from the motion's coordinates and the joints of head and table."""
    return evaluate_tape(model.end_tape(), coordinates, np.empty((len(joints), len(model.axes))), joints)


def list_step_caps(coordinates: Sequence[str], size: float) -> list[float]:
    """List how far one of Newton's steps may go: a third of the greatest leg's size in mm, or half a radian."""
    return [size / 3.0 if MOTION_UNITS[word] == "mm" else 0.5 for word in coordinates]


def find_roots(
    model: Model,
    near: Array,
    joints: Array,
    *,
    most: int = MOST_STEPS,
    poses: bool = True,
    side: Array | None = None,
    end: Tape | None = None,
    settling: Settling = NEVER,
) -> Roots:
    """Solve the closures by Newton's method from ``near`` (1 or N rows), and return what kind of rows it was given.

    poses : ``near`` and the roots are poses, else the motion's coordinates
    most : steps; zero only evaluates the start
    side : of the singularities to end on, as :func:`find_sides` gives it; by default that of the start
    end, settling : what settles a root, see :mod:`.settling`; by default none is settled
    """
    caps = np.array(list_step_caps(model.structure.coordinates, max(model.sizes)))
    tapes = collect_newton_tapes(model, poses)
    if end is not None:
        tapes = tapes._replace(end=end)
    steps = NewtonSteps(caps, min(model.sizes), most, compute_closure_tolerance(model), settling)
    sides = np.empty(0) if side is None else side
    return solve_by_newton(tapes, steps, np.ascontiguousarray(near), joints, sides)


def find_in_mode(model: Model, poses: Array, joints: Array, mode: str | None) -> Flags:
    """Find rows whose legs' joints are those of the inverse at a pose (n, axes) in a working mode, or in any (None).

    Turns do not count. Head and table take the joints as given: they may stand in either of their modes.
    """
    if mode is None or not model.has_modes:
        return np.ones(len(poses), np.bool_)
    off = evaluate_tape_with_residual(model.mode_tape(mode), poses, np.empty((len(poses), 0)), joints)
    return np.asarray(off <= compute_mode_tolerance(model))


def compare_with_mode(model: Model, poses: Array, joints: Array, mode: str) -> Array:
    """Subtract the given joints from the legs' joints in a working mode, leg by leg, mm."""
    return evaluate_tape(model.mode_tape(mode), poses, np.empty((len(poses), model.leg_count)), joints)
