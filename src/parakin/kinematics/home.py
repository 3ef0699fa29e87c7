"""Check a machine's home: every limit holds there, no leg is without length, and it is no singularity."""

from __future__ import annotations

import warnings

import numpy as np

from ..arrays import Array
from ..errors import DescriptionError, SingularHomeWarning
from ..kernels.batch import evaluate_tape
from ..model.elements import MOTION_UNITS
from ..model.traces import Model
from ..units import AXIS_UNITS, name_display_unit, to_display
from .inverse import SINGULAR, solve_inverse
from .tall_matrices import compute_determinants

_LEAST_LEG = 1e-3  # mm, of a leg at home: closures are measured in fractions of it
_ABOUT = 8  # poses about home that are looked at


def check_home(model: Model) -> None:
    """Refuse a home with an unknown axis, off a limit, or with a leg of no length; warn of a singular one.

    Raises :class:`DescriptionError`.
    """
    for letter in model.spec.home:
        if letter not in model.axes:
            raise DescriptionError("home", f"unknown axis {letter}, this machine has {' '.join(model.axes)}")
    with np.errstate(invalid="ignore", divide="ignore"):  # the margins of a home out of reach are NaN
        margins = model.own_margins(model.home, model.mode)
        model.limits  # noqa: B018  refuses names that stand twice
    for limit, margin in margins:
        if not margin >= 0.0:
            value, bound = (to_display(number, limit.unit) for number in (limit.value(float(margin)), limit.bound))
            unit = name_display_unit(limit.unit)
            what = f"{limit.subject} would be {value:,.6g} {unit}, limit {bound:,.6g}"
            if limit.side == "reach":
                what = f"{limit.subject} does not reach it"
            raise DescriptionError("home", f"{what}; home is a pose of the tool in the machine frame")
    if not min(model.sizes) > _LEAST_LEG:
        raise DescriptionError("home", "a leg has no length there, so it holds nothing")
    _warn_of_singular_home(model)


def _warn_of_singular_home(model: Model) -> None:
    """Warn of a machine that is singular at home, and perhaps everywhere."""
    rng = np.random.default_rng(0)
    about = np.array([0.01 * max(model.sizes) if AXIS_UNITS[axis] == "mm" else 0.1 for axis in model.axes])
    poses = model.home + np.vstack([np.zeros(len(about)), rng.uniform(-1.0, 1.0, (_ABOUT, len(about))) * about])
    for kind, regularity in _measure_regularity(model, poses).items():
        singular = regularity[np.isfinite(regularity)] <= SINGULAR
        if singular.any() and singular[0]:
            where, then = "is", "forward finds no pose from there"
            if singular.all():
                where, then = "and all poses about it are", f"the machine is architecturally singular, and {then}"
            text = f"{model.spec.name}: home {where} a {kind} singularity (margin {regularity[0]:.1g} of 1)"
            warnings.warn(f"{text}: {then}", SingularHomeWarning, stacklevel=4)


def _measure_regularity(model: Model, poses: Array) -> dict[str, Array]:
    """Measure how far poses (n, axes) are from singularities, (n,): |determinant| over its rows' sizes, 1 at most.

    Of a redundant machine it is the volume, which may be somewhat more than 1.

    ``parallel`` is of the legs against the motion's coordinates, a turn counted as the greatest leg's length at home;
    ``serial`` of the legs against their drives. NaN out of reach.
    """
    joints, legs, n = solve_inverse(model, poses, model.mode), model.leg_count, len(model.axes)
    m = len(model.drives)
    count = len(model.structure.coordinates)
    coordinates = evaluate_tape(model.begin_tape(), poses, np.empty((len(poses), count)), joints)
    tape, jacobians = model.newton_tape(True), model.jacobian_tape()
    slopes = evaluate_tape(tape, coordinates, np.empty((len(poses), tape.outputs)), joints)
    a = slopes[:, legs:].reshape(-1, legs, count)
    a = a / np.where([MOTION_UNITS[word] == "rad" for word in model.structure.coordinates], max(model.sizes), 1.0)
    both = evaluate_tape(jacobians, poses, np.empty((len(poses), jacobians.outputs)), joints)
    b = both[:, m * n :].reshape(len(poses), m, m)[:, :legs, :legs]
    return {"parallel": _compare_determinant(a), "serial": _compare_determinant(b)}


def _compare_determinant(matrices: Array) -> Array:
    """Divide the sizes of determinants by the products of their rows' sizes (Hadamard)."""
    with np.errstate(all="ignore"):
        return np.abs(compute_determinants(matrices / np.linalg.norm(matrices, axis=2)[:, :, None]))
