"""Which numbers measurements tell apart: singular values of the identification matrix, in lengths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import Array, Indices
from ..errors import ParakinError, join_words
from ..families.family import Family
from ..machine import Machine
from ..model.geometric_parameters import Parameter

AMPLIFIED = 20.0  # times the measurement's noise: a combination that leaves the tool a greater error is not told apart
_DEPENDENT = 1e-6  # of a column: what is left of one that others can replace
_NOTHING = 1e-12  # of the greatest singular value: rounding
_NAMED = 0.15  # of the greatest share: numbers of a combination that are named
_MOST_NAMED = 6


class UnidentifiableError(ParakinError):
    """Measurements that can't tell some numbers of a machine apart; the text says what to measure besides."""


class Combination(NamedTuple):
    """A combination of numbers that measurements tell apart from the others, or don't.

    amplification : the error that it leaves to the tool, root mean square over the workspace, over the measurement's
        noise
    names : of the numbers that it is made of, the greatest share first
    """

    amplification: float
    names: tuple[str, ...]


def compute_scales(machine: Machine, parameters: Sequence[Parameter]) -> Array:
    """Compute what counts as much as a millimetre of each parameter, (k,): a turn of the greatest leg by 1 mm."""
    return np.array([1.0 if p.unit == "mm" else 1.0 / max(machine.leg_sizes) for p in parameters])


def find_combinations(family: Family, slopes: Array, effects: Array, length: float) -> list[Combination]:
    """List the combinations of sizes, the one that leaves the tool the greatest error first.

    slopes : (rows, k) of what is measured, weighed by its noise; what else is unknown is projected out
    effects : (poses, n, k) of the sizes on the tool over the workspace, mm
    length : the standard deviation of a measured length, mm
    """
    scales = compute_scales(family.machine, family.parameters)
    triangle = np.linalg.qr(np.vstack(effects) * scales / np.sqrt(len(effects)), mode="r")  # type: ignore[call-overload]
    back = np.linalg.inv(triangle)
    _, values, shares = np.linalg.svd(slopes * scales @ back, full_matrices=True)
    known = np.zeros(len(shares))
    known[: len(values)] = values
    combinations = []
    for value, row in sorted(zip(known.tolist(), shares, strict=True), key=lambda pair: pair[0]):
        amplification = np.inf if value <= _NOTHING * known.max() else 1.0 / (value * length)
        combinations.append(Combination(float(amplification), _name_shares(family, np.abs(back @ row))))
    return combinations


def _name_shares(family: Family, shares: Array) -> tuple[str, ...]:
    named = np.flatnonzero(shares > _NAMED * shares.max())
    return tuple(family.names[i] for i in named[np.argsort(-shares[named], kind="stable")])


def format_names(names: Sequence[str]) -> str:
    """Format names in short: ``legs.*.rod`` for the same number of several legs or joints."""
    words: dict[str, list[str]] = {}
    for name in names:
        kind, _, rest = name.partition(".")
        tail = rest.partition(".")[2] if kind in ("legs", "joints") else ""
        words.setdefault(f"{kind}.*.{tail}" if tail else name, []).append(name)
    short = [pattern if len(own) > 1 else own[0] for pattern, own in words.items()]
    others = len(short) - _MOST_NAMED
    return join_words(short[:_MOST_NAMED]) + (f" and {others} more" if others > 0 else "")


def project_out(slopes: Array, others: Array) -> Array:
    """Project what other unknowns explain out of slopes (rows, k); ``others`` are theirs, (rows, j)."""
    if not others.shape[1]:
        return slopes
    basis, triangle = np.linalg.qr(others)
    basis = basis[:, np.abs(np.diag(triangle)) > 1e-12 * np.abs(triangle).max()]
    return np.asarray(slopes - basis @ (basis.T @ slopes))


def choose_independent(slopes: Array) -> tuple[Indices, Indices]:
    """Choose columns of slopes (rows, k) one after the other that those before can't replace; also the rest."""
    basis = np.empty((len(slopes), 0))
    chosen, left = [], []
    for i, column in enumerate(slopes.T):
        size = np.linalg.norm(column)
        rest = column - basis @ (basis.T @ column)
        rest = rest - basis @ (basis.T @ rest)
        if size == 0.0 or np.linalg.norm(rest) <= _DEPENDENT * size:
            left.append(i)
            continue
        chosen.append(i)
        basis = np.hstack([basis, (rest / np.linalg.norm(rest))[:, None]])
    return np.array(chosen, np.int64), np.array(left, np.int64)
