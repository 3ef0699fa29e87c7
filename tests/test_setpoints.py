"""Setpoints as CSV and Parquet: the trajectory at every tick, in degrees, the last when the motion is over."""

import csv
import io
import math
import tracemalloc

import numpy as np
import pyarrow.parquet as pq
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.export.tables.setpoints import (
    MOST_ROWS,
    count_setpoints,
    make_setpoint_csv,
    make_setpoint_parquet,
    name_setpoint_columns,
)
from parakin.toolpath.path import ToolPath
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.timing import plan_trajectory

RATE = 7000.0  # more rows than are formatted at a time


def trajectory_of(name, tip, axis=(0.0, 0.0, 1.0), feed=6000.0):
    tip = np.asarray(tip, float)
    n = len(tip)
    axis = np.broadcast_to(np.asarray(axis, float), (n, 3))
    path = ToolPath("part.apt", tip, axis, np.arange(n) + 1, np.zeros(n, bool), np.full(n, feed), np.full(n, np.nan))
    return plan_trajectory(post_path(load_shipped(name), path))


@pytest.fixture(scope="module")
def trajectory():
    turn = np.linspace(0.0, 5.0, 40)
    tip = np.stack([120 * np.cos(turn), 120 * np.sin(turn), -1650 + 10 * np.sin(3 * turn)], axis=1)
    lean = 0.3 + 0.1 * np.sin(2 * turn)
    return trajectory_of("tricept", tip, np.stack([np.sin(lean), 0 * lean, np.cos(lean)], axis=1))


@pytest.fixture(scope="module")
def table(trajectory):
    file = io.BytesIO()
    make_setpoint_csv(trajectory, RATE)(file)
    return file.getvalue().decode()


def test_columns_have_units(trajectory, table):
    head = next(csv.reader(io.StringIO(table)))
    assert head == name_setpoint_columns(trajectory)
    assert head[:6] == ["time [s]", "d1 [mm]", "d2 [mm]", "d3 [mm]", "theta1 [deg]", "theta2 [deg]"]
    assert head[9:11] == ["theta1 speed [deg/s]", "theta2 speed [deg/s]"]
    assert head[11:15:3] == ["d1 acceleration [mm/s2]", "theta1 acceleration [deg/s2]"]
    assert head[16:] == ["X [mm]", "Y [mm]", "Z [mm]", "B [deg]", "C [deg]"]


def in_degrees(trajectory, points):
    """The trajectory's own table, its angles in degrees by the names of its columns."""
    turning = {"theta1", "theta2", "B", "C"}
    factors = [180.0 / math.pi if name.split(".")[0] in turning else 1.0 for name in points.columns]
    return points.table * factors


def test_csv_is_the_trajectory_sampled(trajectory, table):
    read = np.loadtxt(io.StringIO(table), delimiter=",", skiprows=1)
    expected = in_degrees(trajectory, trajectory.sample(RATE))
    assert read.shape == expected.shape
    assert len(read) > 20_000
    digits = np.array([6 if "mm" in name else 8 for name in name_setpoint_columns(trajectory)])
    off = np.abs(read - expected) - 4e-16 * np.abs(expected)
    assert (off <= 0.5001 * 10.0**-digits).all()


def test_parquet_is_the_trajectory_sampled(trajectory):
    file = io.BytesIO()
    make_setpoint_parquet(trajectory, RATE)(file)
    read = pq.read_table(io.BytesIO(file.getvalue()))
    assert read.column_names == name_setpoint_columns(trajectory)
    expected = in_degrees(trajectory, trajectory.sample(RATE))
    values = np.column_stack([column.to_numpy() for column in read.columns])
    np.testing.assert_allclose(values, expected, rtol=1e-15, atol=0)


def test_parquet_in_several_groups(trajectory, monkeypatch):
    monkeypatch.setattr("parakin.export.tables.setpoints._GROUP", 1000)
    file, said = io.BytesIO(), []
    make_setpoint_parquet(trajectory, 1000.0, said.append)(file)
    read = pq.ParquetFile(io.BytesIO(file.getvalue()))
    assert read.num_row_groups == math.ceil(count_setpoints(trajectory, 1000.0) / 1000) > 2
    np.testing.assert_array_equal(read.read()["time [s]"].to_numpy(), trajectory.sample(1000.0).times)
    assert said == sorted(said)
    assert said[-1] == 1.0


@pytest.mark.parametrize("rate", [3.0, 250.0, 999.9])
def test_the_last_row_is_the_first_at_rest(trajectory, rate):
    count = count_setpoints(trajectory, rate)
    assert (count - 2) / rate < trajectory.seconds <= (count - 1) / rate
    file = io.BytesIO()
    make_setpoint_csv(trajectory, rate)(file)
    rows = list(csv.DictReader(io.StringIO(file.getvalue().decode())))
    assert len(rows) == count
    assert {rows[-1][name] for name in rows[-1] if "speed" in name or "acceleration" in name} == {"0"}
    assert float(rows[-1]["X [mm]"]) == pytest.approx(trajectory.posted.poses[-1, 0], abs=1e-6)


def test_a_cycle_of_whole_ticks_ends_on_one(trajectory):
    assert count_setpoints(trajectory, 1.0 / trajectory.seconds) == 2
    assert count_setpoints(trajectory, 1000.0 / trajectory.seconds) == 1001


def test_a_machine_without_turns():
    trajectory = trajectory_of("linear_delta", [[0, 0, 280], [40, 0, 280]])
    file = io.BytesIO()
    make_setpoint_csv(trajectory, 100.0)(file)
    head = file.getvalue().decode().partition("\n")[0]
    assert "deg" not in head
    assert head.count(",") == 3 * 3 + 3


def test_a_single_record_stands_still():
    trajectory = trajectory_of("linear_delta", [[1, 2, 280]])
    for writer in (make_setpoint_csv, make_setpoint_parquet):
        file = io.BytesIO()
        writer(trajectory, 1000.0)(file)
    assert pq.read_table(io.BytesIO(file.getvalue()))["Y [mm]"].to_pylist() == [2.0]


@pytest.mark.parametrize("writer", [make_setpoint_csv, make_setpoint_parquet])
@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan, math.inf, 1e12, 1e300])
def test_senseless_rates_are_refused_at_once(trajectory, writer, rate):
    with pytest.raises(pk.InputError) as caught:
        writer(trajectory, rate)
    assert str(caught.value).startswith("--rate: ")
    assert "expected" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_rows_are_refused_by_their_count(trajectory):
    assert count_setpoints(trajectory, 0.999 * MOST_ROWS / trajectory.seconds) <= MOST_ROWS
    with pytest.raises(pk.InputError, match="at most 100,000,000"):
        count_setpoints(trajectory, 1.001 * MOST_ROWS / trajectory.seconds)


class Sink:
    """A file that counts what it takes."""

    size = 0

    def write(self, data):
        self.size += len(data)


def test_long_tables_do_not_fill_the_memory(trajectory):
    rate = 1_000_000.0 / trajectory.seconds
    file = Sink()
    make_setpoint_csv(trajectory, 1000.0)(Sink())  # compiled
    tracemalloc.start()
    try:
        make_setpoint_csv(trajectory, rate)(file)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    whole = 1_000_000 * 21 * 8
    assert file.size > whole
    assert peak < 0.4 * whole
