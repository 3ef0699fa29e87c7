"""Single calls under pytest-benchmark, for watching one's own change: ``pytest benchmarks --benchmark-enable``."""

import numpy as np
import pytest

import parakin as pk

COUNT = 10_000


@pytest.fixture(params=pk.machines())
def machine(request):
    return pk.load(request.param)


@pytest.fixture
def poses(machine):
    spread = np.where(np.array(machine.axis_units) == "mm", 20.0, 0.05)
    return machine.home + np.random.default_rng(2).uniform(-1.0, 1.0, (COUNT, len(machine.axes))) * spread


def test_inverse(benchmark, machine, poses):
    assert benchmark(machine.inverse, poses).shape == (COUNT, len(machine.joints))


def test_inverse_of_one_pose(benchmark, machine):
    assert np.isfinite(benchmark(machine.inverse, machine.home)).all()


def test_forward(benchmark, machine, poses):
    joints = machine.inverse(poses)
    assert benchmark(machine.forward, joints, poses).converged.mean() > 0.99


def test_check(benchmark, machine, poses):
    assert benchmark(machine.check, poses).shape == (COUNT,)


def test_jacobians(benchmark, machine, poses):
    assert len(benchmark(machine.jacobians, poses)) == 2
