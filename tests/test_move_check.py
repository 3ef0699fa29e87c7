"""check_move in C: what it proves is allowed all along, and most of what is allowed it proves."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

import parakin as pk
from parakin.cli import main
from parakin.controllers.move_check.move_check import render_move_check
from parakin.errors import NoMethodError

CC = shutil.which("gcc") or shutil.which("cc")
pytestmark = pytest.mark.skipif(CC is None, reason="no C compiler")

RUN = """
#include "check_move.h"
void run(const double *moves, int *verdicts, int count)
{
    int i;
    for (i = 0; i < count; i++) verdicts[i] = check_move(moves + 2 * CM_AXES * i, moves + 2 * CM_AXES * i + CM_AXES);
}
"""
MOVES = {"hexapod": 6_000, "lambda6": 14_000, "linear_delta": 30_000, "orthoglide": 25_000, "hbg80_3d": 25_000}
SAMPLES = 40


def build(machine, folder):
    (folder / "check_move.h").write_text(render_move_check(machine))
    (folder / "run.c").write_text(RUN)
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run([CC, *flags, "run.c", "-o", "run.so", "-lm"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "run.so"))


def prove(library, start, end):
    moves = np.ascontiguousarray(np.concatenate([start, end], axis=1))
    verdicts = np.empty(len(moves), np.int32)
    library.run(moves.ctypes.data_as(ctypes.c_void_p), verdicts.ctypes.data_as(ctypes.c_void_p), len(moves))
    return verdicts == 1


def draw_moves(machine, count, seed):
    """Moves short and long, most of them from poses that are allowed."""
    rng = np.random.default_rng(seed)
    size = 0.4 * np.median(machine.leg_sizes)
    spread = np.array([size if unit == "mm" else 0.6 for unit in machine.axis_units])
    start = machine.home + rng.uniform(-1.0, 1.0, (4 * count, len(spread))) * spread * rng.random((4 * count, 1))
    start = start[machine.check(start) == 0][:count]
    length = 10.0 ** rng.uniform(-2.0, 0.3, (len(start), 1))
    return start, start + rng.uniform(-1.0, 1.0, start.shape) * spread * length


@pytest.mark.parametrize("name", MOVES)
def test_no_false_yes(name, tmp_path):
    """1e5 moves over all machines: each that is proved keeps all limits at all its samples, and its side."""
    machine = pk.load(name)
    start, end = draw_moves(machine, MOVES[name], 7)
    assert len(start) == MOVES[name]
    proved = prove(build(machine, tmp_path), start, end)
    allowed = np.ones(len(start), bool)
    side = np.sign(machine.sides(machine.home[None]))
    for share in np.linspace(0.0, 1.0, SAMPLES):
        poses = start + share * (end - start)
        allowed &= machine.check(poses) == 0
        if share in (0.0, 1.0):
            allowed &= np.sign(machine.sides(poses)) == side
    assert not (proved & ~allowed).any()
    assert 0.3 < allowed.mean() < 0.97
    assert (proved & allowed).sum() > 0.98 * allowed.sum()


def test_moves_to_the_brink(tmp_path):
    """A move that ends just inside what travel proves is allowed, and one that ends just beyond is not."""
    machine = pk.load("hexapod")
    library = build(machine, tmp_path)
    start, end = draw_moves(machine, 12, 3)
    for pose, direction in zip(start, end - start, strict=True):
        reach = machine.travel(pose, direction).ahead
        if reach.limit == "singularity":
            continue
        ends = pose + np.array([[0.9999], [1.00001]]) * reach.distance * direction
        assert prove(library, np.array([pose, pose]), ends).tolist() == [True, False]


def test_what_is_no_number_is_refused(tmp_path):
    machine = pk.load("linear_delta")
    library = build(machine, tmp_path)
    home = machine.home[None]
    bad = np.array([[np.nan, 0.0, 280.0], [np.inf, 0.0, 280.0], [0.0, 0.0, -1e300]])
    assert prove(library, home, home).all()
    assert not prove(library, np.tile(home, (3, 1)), bad).any()
    assert not prove(library, bad, np.tile(home, (3, 1))).any()


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_table"])
def test_wrists_are_refused(name):
    with pytest.raises(NoMethodError, match="without turning joints"):
        render_move_check(pk.load(name))


def test_command(tmp_path, capsys):
    output = tmp_path / "check_move.h"
    assert main(["export", "linear_delta", "--to", "check-move", "-o", str(output)]) == 0
    assert output.read_text() == render_move_check(pk.load("linear_delta"))
    assert main(["export", "tricept", "--to", "check-move", "-o", str(tmp_path / "no.h")]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["check_move.h"]
