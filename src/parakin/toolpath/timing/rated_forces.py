"""What the root mean square of a drive's force may be, as a limit of the whole trajectory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...dynamics.inverse_dynamics import Dynamics
from ...errors import PoseError
from .drive_forces import TimedMotion
from .force_limits import list_cutting_force
from .trajectory import Trajectory


def keep_rated_forces(trajectory: Trajectory) -> Trajectory:
    """Stretch a trajectory in time until no drive's rms is more than its file says.

    Stretched by a factor, all times as one, what moves asks for that factor's square less, and what is at rest for as
    much as before. So the mean square is a quadratic in the inverse of the square, whose root is the factor; no other
    limit is nearer than it was.

    Raises :class:`PoseError` where a drive can't bear weight and cutting alone.
    """
    machine = trajectory.posted.machine
    rated = np.array([drive.rated for drive in machine.drives])
    if not np.isfinite(rated).any():
        return trajectory
    motion, dynamics = TimedMotion(trajectory, list_cutting_force(trajectory.posted)), Dynamics(machine)
    rest, both, moving = (np.zeros(len(rated)) for _ in range(3))  # mean squares and mean product
    for block, state, tip in motion.list_blocks():
        still = np.zeros_like(state.speeds)
        at_rest = dynamics.compute_forces(state._replace(speeds=still, accelerations=still), tip)
        added, weights = dynamics.compute_forces(state, tip) - at_rest, motion.weights[block]
        rest, both, moving = (
            rest + weights @ at_rest**2,
            both + weights @ (at_rest * added),
            moving + weights @ added**2,
        )
    most = rated**2
    for name, own in zip(machine.joints, rest >= most, strict=True):
        if own:
            raise PoseError(f"{name} can't bear weight and cutting for long: its rated force is too small")
    over = rest + 2.0 * both + moving > most
    if not over.any():
        return trajectory
    with np.errstate(invalid="ignore", divide="ignore"):
        squares = (np.sqrt(both**2 + moving * (most - rest)) - both) / moving
    worst = int(np.where(over, squares, np.inf).argmin())
    factor = float(squares[worst]) ** -0.5
    profile = trajectory.profile.stretch_pieces(np.full(len(trajectory.profile.row), factor))
    binding = np.full_like(trajectory.binding, trajectory.names.index(f"{machine.joints[worst]}.rated"))
    return replace(trajectory, profile=profile, binding=binding)
