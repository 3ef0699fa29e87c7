"""The C of a LinuxCNC configuration compiles without a warning, with gcc and with clang."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import parakin as pk

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from stub import HEADERS, HERE

INSTALLED = Path("/usr/include/linuxcnc")
WARNINGS = ["-Wall", "-Wextra", "-Werror", "-Wdouble-promotion", "-Wshadow", "-Wstrict-prototypes"]
WARNINGS += ["-Wmissing-prototypes", "-Wpointer-arith", "-Wcast-qual", "-Wundef"]
DEFINED = ["-DRTAPI", "-DUSPACE", "-D_GNU_SOURCE", "-D__MODULE__"]


@pytest.fixture
def headers(tmp_path):
    """Options for LinuxCNC's own headers where they are installed, else for the tests' own."""
    if INSTALLED.exists():
        return ["-isystem", str(INSTALLED)]
    for name in HEADERS:
        (tmp_path / name).write_text('#include "stub_hal.h"\n')
    for name in ("motion.h", "tp.h"):
        (tmp_path / name).write_text('#include "stub_motion.h"\n')
    return ["-isystem", str(tmp_path), "-isystem", str(HERE)]


@pytest.mark.parametrize("name", ["tricept", "lambda6", "orthoglide5_table", "hbg80_2d"])
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_no_compiler_warns(compiler, name, headers, tmp_path):
    if not shutil.which(compiler):
        pytest.skip(f"there is no {compiler}")
    files = pk.make_linuxcnc_configuration(pk.load(name))
    sources = [file for file in files if file.endswith((".c", ".h"))]
    assert len(sources) == 4
    for file in sources:
        (tmp_path / file).write_text(files[file], encoding="utf-8")
    for file in sources:
        if file.endswith(".c"):
            command = [compiler, "-O1", "-c", "-o", "/dev/null", *DEFINED, *WARNINGS, *headers, file]
            done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
