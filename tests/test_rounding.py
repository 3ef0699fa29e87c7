"""Bounds of rounding: against longer numbers, and where there is no bound."""

from __future__ import annotations

import numpy as np
import pytest
from shipped import load_shipped

from parakin.algebra import Trace, sqrt
from parakin.controllers.linuxcnc.certainty import CLEAR
from parakin.controllers.linuxcnc.rounding import bound_rounding


@pytest.mark.parametrize("name", ["linear_delta", "linapod3", "quickstep", "urane_sx"])
def test_common_points_are_as_near_to_those_of_longer_numbers(name):
    """Joints all over their ranges, and many that bring the point down to where the bound begins."""
    machine = load_shipped(name)
    trace, least = Trace(), CLEAR * min(machine.leg_sizes)
    point, square = machine.trace_common_point(trace.inputs(3))
    box = [(drive.low, drive.high) for drive in machine.drives]
    bounds = np.array(bound_rounding(trace, point, box, {square: least**2}))
    joints = np.random.default_rng(1).uniform(*np.transpose(box), (200_000, 3))
    with np.errstate(invalid="ignore"):
        height = np.sqrt(machine.trace_common_point(list(joints.T))[1])
        joints = joints[(height >= least) & ((height < 1.2 * least) | (np.arange(len(joints)) < 20_000))]
        numbers = (joints, joints.astype(np.longdouble))
        short, long = (np.array(machine.trace_common_point(list(q.T))[0]) for q in numbers)
    errors = np.abs(short - long).max(1)
    assert np.isfinite(short).all() and len(joints) > 1000
    assert (errors <= bounds).all()
    assert (bounds < 1e-9).all() and (bounds < 1e4 * errors).all()


def test_what_may_be_zero_has_no_bound():
    trace = Trace()
    x, y = trace.inputs(2)
    assert bound_rounding(trace, [1.0 / (x - y)], [(0.0, 1.0), (0.5, 2.0)], {}) == [np.inf]
    assert bound_rounding(trace, [sqrt(x - y)], [(0.0, 1.0), (0.5, 2.0)], {}) == [np.inf]
    assert bound_rounding(trace, [1.0 / (x - y)], [(0.0, 1.0), (1.5, 2.0)], {})[0] < 1e-13
    assert bound_rounding(trace, [sqrt(x - y)], [(0.0, 1.0), (0.5, 2.0)], {x - y: 0.01})[0] < 1e-13


def test_what_is_known_of_a_product_is_known_of_its_factor():
    trace = Trace()
    x, y = trace.inputs(2)
    known = (x - 3.0) * (y + 1.0)
    assert bound_rounding(trace, [1.0 / (x - 3.0)], [(0.0, 9.0), (0.0, 1.0)], {known: 0.5})[0] < 1e-13
    assert bound_rounding(trace, [1.0 / (x - 3.0)], [(0.0, 9.0), (-2.0, 1.0)], {known: 0.5}) == [np.inf]
