"""Proofs of signs by closer forms: true at every sample, and strong enough for all orientations within 20 degrees."""

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.workspaces.certified.containment import prove_boxes


@pytest.mark.parametrize("name", ["hexapod", "eclipse", "tricept", "hexaglide"])
def test_what_is_proved_is_true_at_samples(name):
    m, rng = load_shipped(name), np.random.default_rng(0)
    turning = [axis for axis in m.axes if axis in "ABC"]
    home = dict(zip(m.axes, m.home, strict=True))
    region = pk.region(m, every={axis: (home[axis] - 0.3, home[axis] + 0.3) for axis in turning})
    scale = np.array([150.0] * len(region.free_axes) + [0.3] * len(turning))
    middle = [home[axis] for axis in (*region.free_axes, *region.swept_axes)] + rng.uniform(
        -1, 1, (500, len(scale))
    ) * scale
    half = 10.0 ** rng.uniform(-3, 0, (500, 1)) * scale
    decided = 0
    for constraint in region.constraints:
        if constraint.sign is None:
            continue
        sign, _, planes = constraint.sign(middle - half, middle + half)
        decided += np.count_nonzero(sign)
        for _ in range(8):
            shares = np.clip(rng.uniform(-1.4, 1.4, half.shape[:1] + scale.shape), -1.0, 1.0)
            points = middle + half * shares
            low, high = (end[:, 0] for end in constraint.point_program(points, points))
            assert not ((sign > 0.0) & (high < 0.0)).any()
            assert not ((sign < 0.0) & (low >= 0.0)).any()
            if planes is not None:
                change = (planes.slopes * shares).sum(1)
                assert not ((change + planes.low >= 0.0) & (high < 0.0)).any()
                assert not ((change + planes.high < 0.0) & (low >= 0.0)).any()
    assert decided > 200


def test_a_hexapod_keeps_its_limits_at_all_orientations():
    m, turn = load_shipped("hexapod"), np.deg2rad(20.0)
    region = pk.region(m, every=dict.fromkeys("ABC", (-turn, turn)))
    contained = prove_boxes(region, m.home[None, :3] - 30.0, m.home[None, :3] + 30.0)
    assert contained.proved.all()
    assert contained.boxes[0] < 5000  # half a million were not enough for struts beside each other without directions
