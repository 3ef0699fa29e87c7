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


# LinuxCNC's HAL by 2026-09: pins are handles, and what 2.9 has for them gives warnings and is to go.
NEWER_HAL = """
#ifndef HAL_BOOL
#define HAL_BOOL HAL_BIT
typedef struct stub_real *hal_real_t;
typedef struct stub_bool *hal_bool_t;
typedef struct stub_uint *hal_uint_t;
typedef hal_pin_dir_t hal_pdir_t;
double hal_get_real(const hal_real_t pin);
double hal_set_real(hal_real_t pin, double value);
bool hal_get_bool(const hal_bool_t pin);
bool hal_set_bool(hal_bool_t pin, bool value);
rtapi_u32 hal_set_ui32(hal_uint_t pin, rtapi_u32 value);
int hal_pin_new_real(int, hal_pdir_t, hal_real_t *, double, const char *, ...) __attribute__((format(printf, 5, 6)));
int hal_pin_new_bool(int, hal_pdir_t, hal_bool_t *, bool, const char *, ...) __attribute__((format(printf, 5, 6)));
int hal_pin_new_ui32(int, hal_pdir_t, hal_uint_t *, rtapi_u32, const char *, ...) __attribute__((format(printf, 5, 6)));
#pragma GCC poison hal_float_t hal_bit_t hal_u32_t hal_pin_dir_t hal_pin_float_newf hal_pin_bit_newf hal_pin_u32_newf
#endif
"""
NEWER_KINEMATICS = """
#include "emcmotcfg.h"
extern int kinematicsJacobian(const double *joint, const EmcPose *world,
                              double jac[EMCMOT_MAX_JOINTS][EMCMOT_MAX_AXIS], const KINEMATICS_INVERSE_FLAGS *iflags);
"""


def write_newer_headers(folder):
    """LinuxCNC's headers with what its master changed by 2026-09 of what modules have to do.

    Motions have a jerk, kinematics.h declares a Jacobian, and pins are handles.
    """
    for header in INSTALLED.glob("*.h"):
        (folder / header.name).write_bytes(header.read_bytes())
    functions = (folder / "tp.h").read_text()
    changed = functions.replace("double acc,", "double acc, double ini_maxjerk,")
    assert changed.count("ini_maxjerk") == 3  # lines, arcs, rigid tapping
    (folder / "tp.h").write_text(changed)
    added = {
        "emccfg.h": "#define DEFAULT_AXIS_MAX_JERK 0.0\n",
        "hal.h": NEWER_HAL,
        "kinematics.h": NEWER_KINEMATICS,
    }
    for name, text in added.items():
        with (folder / name).open("a") as file:
            file.write(text)
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
def test_no_compiler_warns_with_newer_headers(tmp_path):
    (tmp_path / "linuxcnc").mkdir()
    files = make_configuration(load_shipped("linear_delta"))
    sources = {file: text for file, text in files.items() if file.endswith((".c", ".h"))}
    compile_all_quietly("gcc", sources, write_newer_headers(tmp_path / "linuxcnc"), tmp_path)
