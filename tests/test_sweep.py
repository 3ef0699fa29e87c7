"""Sweeps over designs: against machines of their own, resumed after an interruption, with workers that are lost."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest

import parakin as pk
from parakin.cli import main
from parakin.commands.design_problem import read_design_problem
from parakin.export import sweep_folder
from parakin.performance.indices import compute_performance
from parakin.synthesis.sweep import SweepEvaluator

GLIDE = """\
machine: orthoglide
free: {L: [200 mm, 500 mm]}
box: {X: [-100 mm, 100 mm], Y: [-100 mm, 100 mm], Z: [-100 mm, 100 mm]}
bounds: {amplification: 3}
minimise: L
"""
TILTED = """\
machine: tricept
free: {R: [300 mm, 400 mm], l2: [100 mm, 300 mm]}
box: {X: [-700 mm, 700 mm], Y: [-700 mm, 700 mm], Z: [-1700 mm, -1500 mm], B: 10 deg}
minimise: footprint
"""


def read_problem(tmp_path, text):
    (tmp_path / "problem.yaml").write_text(text)
    return read_design_problem(tmp_path / "problem.yaml")


def read_table(folder):
    return pq.read_table(folder, partitioning=None).to_pydict()


@pytest.mark.parametrize("text", [GLIDE, TILTED])
def test_each_design_is_the_machine_of_its_numbers(tmp_path, text):
    problem = read_problem(tmp_path, text)
    plan = pk.SweepPlan(problem, 40, 60)
    chunk, evaluator = SweepEvaluator(plan).evaluate(0), SweepEvaluator(plan)
    assert 0.0 < chunk.allowed.mean() < 1.0
    names = problem.family.names
    for row in range(0, 40, 3):
        machine = problem.family.at(chunk.designs[row, : len(names)])
        poses = problem.place_poses(chunk.designs[row], plan.points)
        broken = machine.check(poses)
        assert chunk.allowed[row] == pytest.approx((broken == 0).mean(), abs=1e-12)
        counts = np.bincount(broken[broken > 0], minlength=len(machine.limits) + 1)
        if counts.any():
            assert counts[1 + machine.limits.index(evaluator.limits[chunk.limit[row]])] == counts.max()
        else:
            assert chunk.limit[row] == -1
        if "amplification" in plan.quantities:
            told = compute_performance(machine, poses)
            worst = max(told.greatest.max(), (1.0 / told.least).max())
            value = chunk.values[row, plan.quantities.index("amplification")]
            assert value == pytest.approx(worst, rel=1e-6) or not np.isfinite(worst) or (broken != 0).any()


def test_a_sweep_goes_on_where_it_was_interrupted(tmp_path, monkeypatch):
    problem = read_problem(tmp_path, GLIDE)
    monkeypatch.setattr("parakin.synthesis.sweep._ROWS", 2000)
    plan = pk.SweepPlan(problem, 1000, 100)
    assert plan.chunk_count == 50

    def stop(fraction):
        if fraction > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pk.run_sweep(plan, tmp_path / "a", progress=stop)
    done = len(list((tmp_path / "a").glob("*.parquet")))
    assert 0 < done < 50
    result = pk.run_sweep(plan, tmp_path / "a")
    assert result.made == 20 * (50 - done)
    whole = pk.run_sweep(plan, tmp_path / "b")
    assert read_table(tmp_path / "a") == read_table(tmp_path / "b")
    assert (whole.made, whole.keeping, whole.best) == (1000, result.keeping, result.best)
    table = read_table(tmp_path / "a")
    kept = [rod for rod, keeps in zip(table["L [mm]"], table["keeps"], strict=True) if keeps]
    assert len(kept) == result.keeping
    assert result.best["L"]["L [mm]"] == min(kept)
    with pytest.raises(pk.InputError, match="another sweep"):
        pk.run_sweep(pk.SweepPlan(problem, 1000, 100, seed=1), tmp_path / "a")


class Cluster:
    """A scheduler and workers, processes of their own."""

    def __init__(self, folder):
        self.folder, self.workers = folder, []
        self.file = folder / "scheduler.json"
        self.scheduler = self.start("dask_scheduler", "--port", "0", "--no-dashboard", "--host", "127.0.0.1")

    def start(self, module, *arguments):
        command = [sys.executable, "-m", f"distributed.cli.{module}", "--scheduler-file", str(self.file), *arguments]
        with (self.folder / "log.txt").open("ab") as log:
            return subprocess.Popen(command, cwd=self.folder, stdout=log, stderr=log, start_new_session=True)

    def add_worker(self):
        self.workers.append(self.start("dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard"))

    @property
    def address(self):
        return json.loads(self.file.read_text())["address"]

    def close(self):
        for process in (*self.workers, self.scheduler):
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@pytest.fixture
def cluster(tmp_path):
    from distributed import Client

    made = Cluster(tmp_path)
    try:
        made.add_worker()
        made.add_worker()
        with Client(scheduler_file=str(made.file), timeout=60) as client:
            client.wait_for_workers(2, timeout=120)
        yield made
    finally:
        made.close()


def test_a_killed_worker_loses_nothing(tmp_path, cluster):
    problem = read_problem(tmp_path, GLIDE.replace("bounds: {amplification: 3}\n", ""))
    plan = pk.SweepPlan(problem, 20_000, 1000)
    killed = []

    def kill(fraction):
        if fraction > 0.2 and not killed:
            killed.append(fraction)
            os.killpg(cluster.workers[0].pid, signal.SIGKILL)

    result = pk.run_sweep(plan, tmp_path / "far", cluster.address, kill)
    assert killed
    assert result.made == 20_000
    near = pk.run_sweep(plan, tmp_path / "near")
    assert read_table(tmp_path / "far") == read_table(tmp_path / "near")
    assert (near.keeping, near.best) == (result.keeping, result.best)


def test_the_dashboard_is_told_where_there_is_one():
    services = {"dashboard": 8787}
    client = SimpleNamespace(
        scheduler_info=lambda n_workers: {"services": services}, dashboard_link="http://127.0.0.1:8787/status"
    )
    assert sweep_folder.find_dashboard(client) == "http://127.0.0.1:8787/status"
    services.clear()
    assert sweep_folder.find_dashboard(client) == ""


def write_command(tmp_path, text, designs):
    read_problem(tmp_path, text)
    sizes = ["--designs", str(designs), "--poses", "50"]
    return ["sweep", str(tmp_path / "problem.yaml"), "-o", str(tmp_path / "out"), *sizes]


def test_the_command(tmp_path, capsys):
    read_problem(tmp_path, f"{GLIDE}within: {{L: 0.1 mm}}\n")
    arguments = [
        "sweep",
        str(tmp_path / "problem.yaml"),
        "-o",
        str(tmp_path / "out"),
        "--designs",
        "500",
        "--poses",
        "50",
    ]
    assert main(arguments) == 0
    said = capsys.readouterr()
    assert "of 500 designs keep all limits and bounds" in said.out
    assert "nominal machines are looked at" in said.err
    assert main([*arguments, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["made"] == 0
    assert answer["best"]["L"]["amplification"] <= 3.0
    again = subprocess.run([sys.executable, "-m", "parakin", *arguments], capture_output=True, text=True, timeout=120)
    assert (again.returncode, again.stderr.count("Traceback")) == (0, 0)  # in a process that has written no part
    part = tmp_path / "out" / "part-00000.parquet"
    content = bytearray(part.read_bytes())
    content[1000] ^= 1  # a bit of the lengths
    for damaged in (bytes(content), b"x"):
        part.write_bytes(damaged)
        assert main(arguments) == 2
        error = capsys.readouterr().err
        assert error.splitlines()[1].startswith(f"{part}: is no part of this sweep")  # behind the remark on within
        assert len(error.splitlines()) == 2


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--poses", "4"], "--poses: 8 (the corners) to"),
        (["--designs", "0"], "--designs: one or more expected"),
        (["--seed", "-1"], "--seed: 0 or more expected"),
        (["--scheduler", "tcp://127.0.0.1:1"], '--scheduler: "tcp://127.0.0.1:1": no scheduler answers'),
        (["--scheduler", "nonsense://x"], '--scheduler: "nonsense://x": no scheduler answers'),
    ],
)
def test_what_is_mistaken_is_said_in_one_line(tmp_path, capsys, monkeypatch, more, said):
    monkeypatch.setattr(sweep_folder, "_TIMEOUT", 1.0)
    read_problem(tmp_path, GLIDE)
    assert main(["sweep", str(tmp_path / "problem.yaml"), "-o", str(tmp_path / "out"), *more]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert not (tmp_path / "out").exists()
    assert "Traceback" not in error


def test_no_design_keeps_all(tmp_path, capsys):
    read_problem(tmp_path, GLIDE.replace("amplification: 3", "amplification: 1.01"))
    arguments = [
        "sweep",
        str(tmp_path / "problem.yaml"),
        "-o",
        str(tmp_path / "out"),
        "--designs",
        "50",
        "--poses",
        "50",
    ]
    assert main(arguments) == 3
    assert "0 of 50 designs" in capsys.readouterr().out
    assert Path(tmp_path / "out" / "_sweep.json").exists()


def test_a_sweep_whose_designs_all_keep_their_limits(tmp_path):
    problem = read_problem(tmp_path, GLIDE.replace("[200 mm, 500 mm]", "[330 mm, 340 mm]"))
    result = pk.run_sweep(pk.SweepPlan(problem, 20, 20), tmp_path / "out")
    assert set(read_table(tmp_path / "out")["limit"]) == {None}
    assert result.designs == 20
    with pytest.raises(pk.PoseError, match="designs: at most"):
        pk.SweepPlan(problem, 10**15, 20)


def test_a_scheduler_without_workers_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(sweep_folder, "_TIMEOUT", 2.0)
    made = Cluster(tmp_path)
    try:
        while not made.file.exists():
            time.sleep(0.1)
        plan = pk.SweepPlan(read_problem(tmp_path, GLIDE), 20, 20)
        with pytest.raises(pk.InputError, match="the scheduler has no worker"):
            pk.run_sweep(plan, tmp_path / "out", made.address)
    finally:
        made.close()


def test_the_example_runs(tmp_path):
    script = Path(__file__).parents[1] / "examples" / "sweep.py"
    done = subprocess.run(
        [sys.executable, script, "-o", tmp_path, "--designs", "400"], capture_output=True, text=True, check=True
    )
    assert re.search(r"\d+ of 400 designs keep all limits and bounds", done.stdout)
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.png"]
