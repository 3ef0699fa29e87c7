/* A HAL that does nothing, so that a kinematics module runs without LinuxCNC, and loops that call one many times.
   LinuxCNC's own modules find here what they link against, too: pins are plain memory. */
#include "stub_hal.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

double *stub_tool_offset; /* the last module's length of the tool, which a test may set */
double *stub_joint[16];   /* where its joints are commanded to be */
char *stub_coordinated;    /* whether LinuxCNC moves its pose */
char stub_name[64];
int stub_ready;

int hal_init(const char *name)
{
    snprintf(stub_name, sizeof stub_name, "%s", name);
    stub_ready = 0;
    stub_tool_offset = NULL;
    return 1;
}

int hal_ready(int component) { return stub_ready = component, 0; }
int hal_exit(int component) { return (void)component, stub_ready = 0; }
void *hal_malloc(long size) { return calloc(1, size); }
void rtapi_print(const char *format, ...) { (void)format; }
void rtapi_print_msg(int level, const char *format, ...) { (void)level, (void)format; }

/* The functions that modules export, by their names, which different modules may share. */
enum { MOST_FUNCTIONS = 256 };
static struct { char name[64]; StubFunction *function; } functions[MOST_FUNCTIONS];
static int function_count;

int hal_export_funct(const char *name, StubFunction *function, void *arg, int fp, int reentrant, int component)
{
    (void)arg, (void)fp, (void)reentrant, (void)component;
    if (function_count == MOST_FUNCTIONS)
        return -1;
    snprintf(functions[function_count].name, sizeof functions[0].name, "%s", name);
    functions[function_count++].function = function;
    return 0;
}

int stub_count(void) { return function_count; }

/* Run a function once that was exported among the first ``before``, the last of that name; whether there is one. */
int stub_run(const char *name, int before)
{
    for (int i = before; i-- > 0;)
        if (!strcmp(functions[i].name, name))
            return functions[i].function(NULL, 1000000), 1;
    return 0;
}

static void *pin(size_t size) { return calloc(1, size); }

int hal_pin_float_newf(int dir, double **data, int component, const char *format, ...)
{
    (void)dir, (void)component;
    *data = pin(sizeof **data);
    if (!strcmp(format, "kins.tool-offset"))
        stub_tool_offset = *data;
    if (!strcmp(format, "kins.joint-%d")) {
        va_list given;
        va_start(given, format);
        stub_joint[va_arg(given, int)] = *data;
        va_end(given);
    }
    return 0;
}

int hal_pin_float_new(const char *name, int dir, double **data, int component)
{
    return (void)name, hal_pin_float_newf(dir, data, component, "");
}

int hal_param_float_newf(int dir, double *data, int component, const char *format, ...)
{
    (void)dir, (void)component, (void)format;
    return *data = 0.0, 0;
}

int hal_pin_bit_newf(int dir, char **data, int component, const char *format, ...)
{
    (void)dir, (void)component;
    *data = pin(sizeof **data);
    if (!strcmp(format, "kins.coord-mode"))
        stub_coordinated = *data;
    return 0;
}

int hal_pin_u32_newf(int dir, uint32_t **data, int component, const char *format, ...)
{
    (void)dir, (void)component, (void)format;
    return *data = pin(sizeof **data), 0;
}

int hal_pin_bit_new(const char *name, int dir, char **data, int component)
{
    return (void)name, hal_pin_bit_newf(dir, data, component, "");
}

int hal_pin_s32_new(const char *name, int dir, uint32_t **data, int component)
{
    return (void)name, hal_pin_u32_newf(dir, data, component, "");
}

typedef int Forward(const double *, EmcPose *, const KINEMATICS_FORWARD_FLAGS *, KINEMATICS_INVERSE_FLAGS *);
typedef int Inverse(const EmcPose *, double *, const KINEMATICS_INVERSE_FLAGS *, KINEMATICS_FORWARD_FLAGS *);

/* Rows of joints (n, width) and of poses (n, 9), each a call of its own; poses begin as the starts. */
void stub_forward(Forward *forward, long n, long width, const double *joints, EmcPose *poses, int *codes)
{
    unsigned long fflags = 0, iflags = 0;
    for (long i = 0; i < n; i++)
        codes[i] = forward(joints + i * width, poses + i, &fflags, &iflags);
}

/* As LinuxCNC does it cycle by cycle: one pose, that each call starts from and leaves behind. */
void stub_forward_path(Forward *forward, long n, long width, const double *joints, EmcPose *pose, EmcPose *poses,
                       int *codes)
{
    unsigned long fflags = 0, iflags = 0;
    for (long i = 0; i < n; i++) {
        codes[i] = forward(joints + i * width, pose, &fflags, &iflags);
        poses[i] = *pose;
    }
}

/* Joints begin as the last ones of every row. */
void stub_inverse(Inverse *inverse, long n, long width, const EmcPose *poses, double *joints, int *codes)
{
    unsigned long fflags = 0, iflags = 0;
    for (long i = 0; i < n; i++)
        codes[i] = inverse(poses + i, joints + i * width, &iflags, &fflags);
}

/* Cycle by cycle: one joint vector, that each call starts from and leaves behind. */
void stub_inverse_path(Inverse *inverse, long n, long width, const EmcPose *poses, double *joint, double *joints,
                       int *codes)
{
    unsigned long fflags = 0, iflags = 0;
    for (long i = 0; i < n; i++) {
        codes[i] = inverse(poses + i, joint, &iflags, &fflags);
        memcpy(joints + i * width, joint, width * sizeof *joint);
    }
}
