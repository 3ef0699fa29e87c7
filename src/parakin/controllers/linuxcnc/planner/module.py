"""Write the planner module: LinuxCNC's coordinated motion within the joints' limits."""

from __future__ import annotations

from hashlib import sha256
from importlib.resources import files

from ....machine import Machine
from ..model_header import GPL, format_title, name_model, write_model
from ..tape_to_c import format_c

# A timed motion may pass a joint's speed and acceleration by this factor before it is slowed: a spline through the
# points of a trajectory that uses the limits fully is beyond them by a little here and there.
TIMED_SLACK = 1.02
NO_TOLERANCE = 0.1  # mm by which corners are cut where a program says G64 without a tolerance
CHECKS = 16  # places in which a motion is looked at before it is taken
SIGNAL = 63  # the analog output by which a program says that its motions have given times
_FILES = ("queue.c", "path.c", "profile.c", "execution.c", "interface.c")

_HEADER = """\
/* {name}.c: LinuxCNC's trajectory planner of {machine}, {title}.

   It keeps every joint's speed and acceleration, in programs, MDI and probing, at any feed override and in every pause.
   Made by parakin from the machine's description; make it anew rather than edit it.
   {gpl}

   Build and install:  sudo halcompile --install {name}.c
   The ini file names it: [TRAJ] TPMOD = {name} */

#pragma GCC optimize ("O3")

#include "rtapi.h"
#include "rtapi_app.h"
#include "rtapi_math.h"
#include "rtapi_string.h"
#include "hal.h"
#include "kinematics.h"
#include "motion.h"
#include "tp.h"

#include "{model}"
"""

_STATE = """\
static emcmot_status_t *emcmotStatus;
static emcmot_config_t *emcmotConfig;
static double cycle_seconds = 0.001;
static void (*write_digital)(int, char);
static void (*write_analog)(int, double);

/* The pose of the machine's own tip for that of the tool in use. */
static void shift_to_own_tip(const double *x, double *own)
{
    memcpy(own, x, AXES * sizeof *x);
    shift_tip(own, emcmotStatus->tool_offset.tran.z);
}

/* The joints of a pose, near given ones; 0 where a leg can't reach it. */
static int reach_pose(const double *x, const double *near, double *q)
{
    double own[AXES];
    shift_to_own_tip(x, own);
    return find_joints(own, near, q);
}

/* The joints of a pose that the machine may take, near given ones; 0 where it may not. */
static int solve_inverse(const double *x, const double *near, double *q)
{
    double own[AXES];
    shift_to_own_tip(x, own);
    return find_joints(own, near, q) && allowed(own, q) && regular(own, q);
}
"""

_MODULE = """\
MODULE_LICENSE("GPL");

static int component;
static char *made = "";
RTAPI_MP_STRING(made, "the making of the configuration that loads this");

int rtapi_app_main(void)
{
    if (*made && strcmp(made, MADE) != 0) {
        rtapi_print_msg(RTAPI_MSG_ERR, PLANNER " was made from another description than the configuration: install its "
                        "file with sudo halcompile --install " PLANNER ".c\\n");
        return -1;
    }
    component = hal_init(PLANNER);
    if (component < 0)
        return component;
    hal_ready(component);
    return 0;
}

void rtapi_app_exit(void) { hal_exit(component); }
"""


def name_planner(machine: Machine) -> str:
    """Name the planner module."""
    return f"{machine.name}_tp"


def write_planner(machine: Machine) -> str:
    """Write the C source of a machine's planner; it includes the machine's model."""
    head = _HEADER.format(
        name=name_planner(machine),
        machine=machine.name,
        title=format_title(machine),
        gpl=GPL,
        model=name_model(machine),
    )
    return "\n".join([head, f'#define MADE "{hash_planner(machine)}"', *_write_body(machine)])


def hash_planner(machine: Machine) -> str:
    """Hash a machine's planner and model, so that a module of an older description is recognised."""
    return sha256("\n".join([write_model(machine), *_write_body(machine)]).encode()).hexdigest()[:16]


def _write_body(machine: Machine) -> list[str]:
    sources = [files(__package__).joinpath(name).read_text(encoding="utf-8") for name in _FILES]
    return [_write_numbers(machine), _STATE, *sources, _MODULE]


def _write_numbers(machine: Machine) -> str:
    return "\n".join(
        [
            f'#define PLANNER "{name_planner(machine)}"',
            f"#define TIMED_SLACK {format_c(TIMED_SLACK)} /* by which a timed motion may pass a joint's limits */",
            f"#define NO_TOLERANCE {format_c(NO_TOLERANCE)} /* mm: where a program says G64 without one */",
            f"#define CHECKS {CHECKS} /* places in which a motion is looked at before it is taken */",
            f"#define SIGNAL {SIGNAL} /* M67 E{SIGNAL} Q1: the motions that follow have given times; Q0 ends that */",
            "",
        ]
    )
