"""The C of a LinuxCNC configuration compiles without a warning, with gcc and with clang."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from machine_texts import write
from shipped import load_shipped
from test_redundant import PLANAR

import parakin as pk
from parakin.controllers.linuxcnc.guard import write_guard
from parakin.controllers.linuxcnc.model_header import name_model, write_model
from parakin.controllers.linuxcnc.planner import write_planner

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from simulation import make_configuration
from stub import HEADERS, HERE, PLANNER_HEADERS

INSTALLED = Path("/usr/include/linuxcnc")
WARNINGS = ["-Wall", "-Wextra", "-Werror", "-Wdouble-promotion", "-Wshadow", "-Wstrict-prototypes"]
WARNINGS += ["-Wmissing-prototypes", "-Wpointer-arith", "-Wcast-qual", "-Wundef"]
DEFINED = ["-DRTAPI", "-DUSPACE", "-D_GNU_SOURCE", "-D__MODULE__"]


def write_stub_headers(folder):
    """The tests' own headers in the place of LinuxCNC's."""
    for name in HEADERS:
        (folder / name).write_text('#include "stub_hal.h"\n')
    for name in PLANNER_HEADERS:
        (folder / name).write_text('#include "stub_motion.h"\n')
    return ["-isystem", str(folder), "-isystem", str(HERE)]


def write_newer_headers(folder):
    """LinuxCNC's headers with what its master changed by 2026 of what the planner has to do: motions have a jerk."""
    for header in INSTALLED.glob("*.h"):
        (folder / header.name).write_bytes(header.read_bytes())
    functions = (folder / "tp.h").read_text()
    changed = functions.replace("double acc,", "double acc, double ini_maxjerk,")
    assert changed.count("ini_maxjerk") == 3  # lines, arcs, rigid tapping
    (folder / "tp.h").write_text(changed)
    with (folder / "emccfg.h").open("a") as file:
        file.write("#define DEFAULT_AXIS_MAX_JERK 0.0\n")
    return ["-isystem", str(folder)]


@pytest.mark.parametrize("name", ["tricept", "lambda6", "orthoglide5_table", "hbg80_2d"])
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_no_compiler_warns(compiler, name, tmp_path):
    if not shutil.which(compiler):
        pytest.skip(f"there is no {compiler}")
    headers = ["-isystem", str(INSTALLED)] if INSTALLED.exists() else write_stub_headers(tmp_path)
    files = make_configuration(load_shipped(name))
    sources = {file: text for file, text in files.items() if file.endswith((".c", ".h"))}
    assert len(sources) == 4
    compile_all_quietly(compiler, sources, headers, tmp_path)


def test_no_compiler_warns_of_more_joints_than_axes(tmp_path):
    """The guard looks at joints and axes side by side."""
    if not shutil.which("gcc"):
        pytest.skip("there is no gcc")
    machine = pk.load(write(tmp_path, PLANAR))
    headers = ["-isystem", str(INSTALLED)] if INSTALLED.exists() else write_stub_headers(tmp_path)
    sources = {name_model(machine): write_model(machine), "guard.c": write_guard(machine)}
    compile_all_quietly("gcc", sources, headers, tmp_path)


def compile_all_quietly(compiler, sources, headers, folder):
    for file, text in sources.items():
        (folder / file).write_text(text, encoding="utf-8")
    for file in sources:
        if file.endswith(".c"):
            compile_quietly(compiler, ["-O1", "-c", "-o", "/dev/null", *headers, file], folder)


def compile_quietly(compiler, arguments, folder):
    command = [compiler, *DEFINED, *WARNINGS, *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(not INSTALLED.exists(), reason="LinuxCNC's headers are not installed")
def test_the_planner_takes_the_jerk_of_newer_headers(tmp_path):
    machine, headers = load_shipped("linear_delta"), write_newer_headers(tmp_path)
    (tmp_path / name_model(machine)).write_text(write_model(machine))
    (tmp_path / "planner.c").write_text(write_planner(machine))
    compile_quietly("gcc", ["-fsyntax-only", *headers, "planner.c"], tmp_path)
