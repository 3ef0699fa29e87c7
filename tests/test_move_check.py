"""check_move in C: what it proves is allowed all along, and most of what is allowed it proves."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest
from shipped import load_shipped

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
MOVES = {
    "hexapod": 6_000,
    "lambda6": 14_000,
    "linear_delta": 30_000,
    "orthoglide": 25_000,
    "hbg80_3d": 15_000,
    "five_bar": 10_000,
    "hexaglide": 600,
}
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
    machine = load_shipped(name)
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
    assert 0.3 < allowed.mean() < 0.99
    assert (proved & allowed).sum() > 0.98 * allowed.sum()


@pytest.mark.parametrize("language", ["c99", "c11", "c++11", "c++20"])
def test_any_firmwares_compiler_takes_it(language, tmp_path):
    """Without a GNU extension: Klipper and grblHAL are C, FluidNC and RepRapFirmware C++."""
    (tmp_path / "check_move.h").write_text(render_move_check(load_shipped("linear_delta")))
    (tmp_path / "run.c").write_text(RUN)
    flags = [f"-std={language}", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only"]
    subprocess.run([CC, *flags, "-x", "c++" if "+" in language else "c", "run.c"], cwd=tmp_path, check=True)


def test_moves_to_the_brink(tmp_path):
    """A move that ends just inside what travel proves is allowed, and one that ends just beyond is not."""
    machine = load_shipped("hexapod")
    library = build(machine, tmp_path)
    start, end = draw_moves(machine, 12, 3)
    for pose, direction in zip(start, end - start, strict=True):
        reach = machine.travel(pose, direction).ahead
        if reach.limit == "singularity":
            continue
        ends = pose + np.array([[0.9999], [1.00001]]) * reach.distance * direction
        assert prove(library, np.array([pose, pose]), ends).tolist() == [True, False]


def test_what_is_no_number_is_refused(tmp_path):
    machine = load_shipped("linear_delta")
    library = build(machine, tmp_path)
    home = machine.home[None]
    bad = np.array([[np.nan, 0.0, 280.0], [np.inf, 0.0, 280.0], [0.0, 0.0, -1e300]])
    assert prove(library, home, home).all()
    assert not prove(library, np.tile(home, (3, 1)), bad).any()
    assert not prove(library, bad, np.tile(home, (3, 1))).any()


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_table"])
def test_wrists_are_refused(name):
    with pytest.raises(NoMethodError, match="without turning joints"):
        render_move_check(load_shipped(name))


class Printer:
    """What the module asks of Klipper: toolhead.py calls the kinematics' check_move with every move."""

    def __init__(self, home):
        self.home_position, self.seen = home, []

    def get_printer(self):
        return self

    def register_event_handler(self, event, handler):
        assert event == "klippy:connect"
        self.start = handler

    def lookup_object(self, name):
        assert name == "toolhead"
        return self

    def get_kinematics(self):
        return self

    def check_move(self, move):
        self.seen.append(move)


class Move:
    def __init__(self, start, end):
        self.start_pos, self.end_pos = (*start, 0.0), (*end, 5.0)  # with the extruder's

    def move_error(self, text):
        return ValueError(text)


def test_the_module_for_klipper_refuses_moves(tmp_path):
    machine = load_shipped("linear_delta")
    output = tmp_path / "parakin_check_move.py"
    assert main(["export", "linear_delta", "--to", "check-move-klipper", "-o", str(output)]) == 0
    namespace = {}
    exec(compile(output.read_text(), str(output), "exec"), namespace)
    top = machine.travel(machine.home, "Z").ahead.distance
    home = (0.0, 0.0, 280.0 + top)  # carriages at their endstops, which are the limits
    printer = Printer(home)
    namespace["load_config"](printer)
    printer.start()
    for end in ([50.0, 0.0, 280.0], [-30.0, 40.0, 300.0]):
        printer.check_move(Move(machine.home, end))
    printer.check_move(Move((0.0, 0.0, -900.0), home))  # homing
    printer.check_move(Move(home, machine.home))
    with pytest.raises(ValueError, match="limits"):
        printer.check_move(Move(machine.home, [0.0, 0.0, 281.0 + top]))
    assert len(printer.seen) == 5


def test_command(tmp_path, capsys):
    output = tmp_path / "check_move.h"
    assert main(["export", "linear_delta", "--to", "check-move", "-o", str(output)]) == 0
    assert output.read_text() == render_move_check(load_shipped("linear_delta"))
    assert main(["export", "tricept", "--to", "check-move", "-o", str(tmp_path / "no.h")]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["check_move.h"]
