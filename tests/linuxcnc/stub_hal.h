/* What a kinematics module needs of LinuxCNC's headers. The tests call every header of theirs by this. */
#ifndef STUB_HAL_H
#define STUB_HAL_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct { double x, y, z; } PmCartesian;
typedef struct EmcPose { PmCartesian tran; double a, b, c, u, v, w; } EmcPose;
typedef enum { KINEMATICS_IDENTITY = 1, KINEMATICS_FORWARD_ONLY, KINEMATICS_INVERSE_ONLY, KINEMATICS_BOTH } KINEMATICS_TYPE;
typedef unsigned long KINEMATICS_FORWARD_FLAGS, KINEMATICS_INVERSE_FLAGS;

#define EMCMOT_MAX_JOINTS 16
#define EMCMOT_MAX_AXIS 9
#define EXPORT_SYMBOL(name) extern int stub_exported_##name
#define RTAPI_MSG_ERR 1
#define RTAPI_MP_STRING(name, text) char **stub_string_##name = &name
#define MODULE_LICENSE(text) const char *const stub_license = text

int kinematicsForward(const double *joints, EmcPose *world,
                      const KINEMATICS_FORWARD_FLAGS *fflags, KINEMATICS_INVERSE_FLAGS *iflags);
int kinematicsInverse(const EmcPose *world, double *joints,
                      const KINEMATICS_INVERSE_FLAGS *iflags, KINEMATICS_FORWARD_FLAGS *fflags);
KINEMATICS_TYPE kinematicsType(void);
int kinematicsSwitchable(void);
int kinematicsSwitch(int type);

typedef double hal_float_t;
typedef char hal_bit_t;
typedef uint32_t hal_u32_t;
typedef int hal_pin_dir_t;
enum { HAL_IN = 16, HAL_OUT = 32 };
void *hal_malloc(long size);
typedef void StubFunction(void *, long);
int hal_export_funct(const char *name, StubFunction *function, void *arg, int fp, int reentrant, int component);
int hal_pin_float_newf(int dir, double **data, int component, const char *format, ...);
int hal_pin_bit_newf(int dir, char **data, int component, const char *format, ...);
int hal_pin_u32_newf(int dir, uint32_t **data, int component, const char *format, ...);

int rtapi_app_main(void);
void rtapi_app_exit(void);
int hal_init(const char *name);
void rtapi_print_msg(int level, const char *format, ...);
int hal_ready(int component);
int hal_exit(int component);

#endif
