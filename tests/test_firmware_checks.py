"""check_move in firmwares: what it is hooked into has the signatures of their own headers, and is called as they do."""

import ctypes
import os
import shutil
import subprocess

import numpy as np
import pytest
from shipped import load_shipped
from test_move_check import SAMPLES, draw_moves

from parakin.cli import main

pytestmark = pytest.mark.skipif(not (shutil.which("gcc") and shutil.which("g++")), reason="no compilers")

COUNT = int(os.environ.get("PARAKIN_MOVES", "10000"))
GRID = 128.0  # steps a mm: moves' ends stand on them, as floats and as motor steps

# grblHAL core of 2026: nuts_bolts.h, planner.h, settings.h, system.h, task.h, kinematics/interface.h; mc_line of
# motion_control.c and limits_soft_check of machine_limits.c.
GRBLHAL = {
    "grbl/hal.h": """
#include <stdbool.h>
#include <stdint.h>
#define N_AXIS 3
#define On 1
#define Off 0
typedef union { float values[N_AXIS]; struct { float x, y, z; }; } coord_data_t;
typedef union { int32_t value[N_AXIS]; struct { int32_t x, y, z; }; } mpos_t;
typedef union { uint8_t mask; } axes_signals_t;
typedef struct {
    float feed_rate;
    struct { uint32_t rapid_motion :1, jog_motion :1, target_validated :1, target_valid :1; } condition;
} plan_line_data_t;
typedef struct { struct { float steps_per_mm; } axis[N_AXIS]; } settings_t;
typedef struct { axes_signals_t homed; } system_t;
typedef enum { HomingMode_Seek = 0 } homing_mode_t;
extern settings_t settings;
extern system_t sys;
""",
    "grbl/task.h": """
typedef void (*foreground_task_ptr)(void *data);
bool task_run_on_startup (foreground_task_ptr fn, void *data);
""",
    "grbl/kinematics/interface.h": """
typedef coord_data_t *(*transform_steps_to_cartesian_ptr)(coord_data_t *position, mpos_t *steps);
typedef coord_data_t *(*transform_from_cartesian_ptr) (coord_data_t *target, coord_data_t *position);
typedef coord_data_t *(*segment_line_ptr) (coord_data_t *target, coord_data_t *position, plan_line_data_t *pl_data,
                                           bool init);
typedef struct {
    transform_steps_to_cartesian_ptr transform_steps_to_cartesian;
    transform_from_cartesian_ptr transform_from_cartesian;
    segment_line_ptr segment_line;
} kinematics_t;
extern kinematics_t kinematics;
""",
    "run.c": """
#include "check.c"
settings_t settings = {{{128.0f}, {128.0f}, {128.0f}}};
system_t sys = {{7}};
kinematics_t kinematics;
static coord_data_t *to_cartesian (coord_data_t *position, mpos_t *steps)
{
    int i;
    for (i = 0; i < 3; i++) position->values[i] = steps->value[i] / 128.0f;
    return position;
}
static coord_data_t *own_segment_line (coord_data_t *target, coord_data_t *position, plan_line_data_t *pl_data,
                                       bool init)
{
    (void)position; (void)pl_data;
    return init ? target : NULL;
}
bool task_run_on_startup (foreground_task_ptr fn, void *data) { fn(data); return true; }
void run(float *moves, int *verdicts, int count, int homed)
{
    int i;
    sys.homed.mask = homed;
    if (kinematics.segment_line == NULL) {
        kinematics.transform_steps_to_cartesian = to_cartesian;
        kinematics.segment_line = own_segment_line;
        parakin_check_move_init();
    }
    for (i = 0; i < count; i++) {
        plan_line_data_t plan = {0};
        kinematics.segment_line((coord_data_t *)(moves + 6 * i + 3), (coord_data_t *)(moves + 6 * i), &plan, true);
        verdicts[i] = plan.condition.target_validated ? plan.condition.target_valid : 1;
        kinematics.segment_line((coord_data_t *)(moves + 6 * i + 3), NULL, &plan, false);
    }
}
""",
}
# FluidNC's Kinematics.h, Planner.h and Limits.h; MotionControl.cpp's mc_linear.
FLUIDNC = {
    "run.cpp": """
#include <cstdint>
#include <cstddef>
struct PlMotion {
    uint8_t rapidMotion : 1;
    uint8_t systemMotion : 1;
    uint8_t noFeedOverride : 1;
    uint8_t inverseTime : 1;
};
struct plan_line_data_t { float feed_rate; PlMotion motion; bool is_jog; bool limits_checked; };
static int errors = 0;
void limit_error() { errors++; }
namespace Kinematics {
    class KinematicSystem {
    public:
        virtual bool cartesian_to_motors(float* target, plan_line_data_t* pl_data, float* position) = 0;
        virtual void constrain_jog(float* cartesian, plan_line_data_t* pl_data, float* position) {}
        virtual bool invalid_line(float* cartesian) { return false; }
        virtual ~KinematicSystem() {}
    };
    class ParallelDelta : public KinematicSystem {
    public:
        bool cartesian_to_motors(float*, plan_line_data_t*, float*) override { return true; }
    };
}
#include "check.h"
extern "C" void run(float *moves, int *verdicts, int count, int homed)
{
    Kinematics::ParakinChecked<Kinematics::ParallelDelta> checked;
    Kinematics::KinematicSystem &system = checked;
    plan_line_data_t plan = {};
    plan.motion.systemMotion = !homed;
    for (int i = 0; i < count; i++) {
        float *start = moves + 6 * i, *end = start + 3;
        const int before = errors;
        verdicts[i] = system.cartesian_to_motors(end, &plan, start);
        if (homed && (errors != before) == (verdicts[i] == 1)) verdicts[i] = -1;
        float jog[3] = {end[0], end[1], end[2]};
        system.constrain_jog(jog, &plan, start);
        const bool stays = jog[0] == start[0] && jog[1] == start[1] && jog[2] == start[2];
        if (homed && stays == (verdicts[i] == 1)) verdicts[i] = -1;
    }
}
""",
}
# RepRapFirmware 3: Kinematics.h, Bitmap.h; GCodes.cpp's DoStraightMove.
REPRAPFIRMWARE = {
    "run.cpp": """
#include <cstdint>
#include <cstddef>
template <class BaseType> class Bitmap
{
public:
	constexpr explicit Bitmap(BaseType n) noexcept : bits(n) { }
	constexpr bool Intersects(const Bitmap<BaseType> other) const noexcept { return (bits & other.bits) != 0; }
private:
	BaseType bits;
};
typedef Bitmap<uint32_t> AxesBitmap;
constexpr AxesBitmap XyzAxes(7);
enum class LimitPositionResult : uint8_t
{
	ok,
	adjusted,
	intermediateUnreachable,
	adjustedAndIntermediateUnreachable
};
class Kinematics
{
public:
	virtual LimitPositionResult LimitPosition(float finalCoords[], const float * initialCoords, size_t numVisibleAxes,
		AxesBitmap axesToLimit, bool isCoordinated, bool applyM208Limits) const noexcept = 0;
	virtual ~Kinematics() { }
};
class LinearDeltaKinematics : public Kinematics
{
public:
	LimitPositionResult LimitPosition(float finalCoords[], const float * initialCoords, size_t numAxes,
		AxesBitmap axesToLimit, bool isCoordinated, bool applyM208Limits) const noexcept override
	{
		return LimitPositionResult::ok;
	}
};
#include "check.h"
extern "C" void run(float *moves, int *verdicts, int count, int homed)
{
	const Kinematics *kinematics = new ParakinChecked<LinearDeltaKinematics>();
	for (int i = 0; i < count; i++)
	{
		float *start = moves + 6 * i, *end = start + 3;
		const auto result = kinematics->LimitPosition(end, start, 3, AxesBitmap(homed), true, true);
		verdicts[i] = result == LimitPositionResult::ok;
		const auto alone = kinematics->LimitPosition(end, nullptr, 3, AxesBitmap(homed), false, true);
		if (verdicts[i] && alone != LimitPositionResult::ok) verdicts[i] = -1;
	}
	delete kinematics;
}
""",
}
FIRMWARES = {
    "grblhal": (GRBLHAL, "check.c", ["gcc", "-std=c99"], "run.c"),
    "fluidnc": (FLUIDNC, "check.h", ["g++", "-std=c++17", "-Wno-unused-parameter"], "run.cpp"),
    "reprapfirmware": (REPRAPFIRMWARE, "check.h", ["g++", "-std=c++17", "-Wno-unused-parameter"], "run.cpp"),
}


@pytest.fixture(scope="module")
def moves():
    """Moves (N, 6) of floats, and which of them keep all limits of linear_delta at all samples."""
    machine = load_shipped("linear_delta")
    start, end = (np.round(rows * GRID) / GRID for rows in draw_moves(machine, COUNT, 12))
    allowed = np.ones(len(start), bool)
    for share in np.linspace(0.0, 1.0, SAMPLES):
        rows = np.flatnonzero(allowed)
        allowed[rows] = machine.check(start[rows] + share * (end[rows] - start[rows])) == 0
    return np.ascontiguousarray(np.concatenate([start, end], axis=1), np.float32), allowed


def build(firmware, folder):
    stub, name, compiler, source = FIRMWARES[firmware]
    for path, text in stub.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    assert main(["export", "linear_delta", "--to", f"check-move-{firmware}", "-o", str(folder / name)]) == 0
    flags = ["-O2", "-Wall", "-Wextra", "-Werror", "-DCHECK_MOVE_SLACK=0.0", "-I.", "-shared", "-fPIC"]
    subprocess.run([*compiler, *flags, source, "-o", "run.so", "-lm"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "run.so"))


def run(library, moves, homed=7):
    verdicts = np.empty(len(moves), np.int32)
    pointers = (array.ctypes.data_as(ctypes.c_void_p) for array in (moves, verdicts))
    library.run(*pointers, len(moves), homed)
    return verdicts


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_no_false_yes_in_a_firmware(firmware, moves, tmp_path):
    rows, allowed = moves
    library = build(firmware, tmp_path)
    verdicts = run(library, rows)
    assert len(rows) == COUNT
    assert np.isin(verdicts, (0, 1)).all()
    assert not ((verdicts == 1) & ~allowed).any()
    assert 0.3 < allowed.mean() < 0.97
    assert (verdicts[allowed] == 1).mean() > 0.98
    assert (run(library, rows[:500], homed=0) == 1).all()  # unhomed axes and homing are not checked


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_machines_of_other_axes_are_refused(firmware, tmp_path, capsys):
    ending = "c" if firmware == "grblhal" else "h"
    assert main(["export", "hexapod", "--to", f"check-move-{firmware}", "-o", str(tmp_path / f"x.{ending}")]) == 2
    assert "moves X, Y and Z" in capsys.readouterr().err
