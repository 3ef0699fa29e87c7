/* What a planner module needs of LinuxCNC's motion.h and tp.h, with their names and the fields that it uses. */
#ifndef STUB_MOTION_H
#define STUB_MOTION_H

#include "stub_hal.h"

#define EMCMOT_MAX_DIO 64
#define EMCMOT_MAX_AIO 64
#define EMCMOT_MOTION_INPOS_BIT 0x0002
#define EMCMOT_MOTION_ERROR_BIT 0x0008
#define ZERO_EMC_POSE(pose) memset(&(pose), 0, sizeof(EmcPose))

enum { GM_FIELD_LINE_NUMBER, GM_FIELDS = 8 };
enum { GM_FLAG_DISTANCE_MODE = 1 };
struct state_tag_t { int fields[GM_FIELDS]; unsigned long packed_flags; };

typedef enum { TC_TERM_COND_STOP, TC_TERM_COND_EXACT, TC_TERM_COND_PARABOLIC, TC_TERM_COND_TANGENT } tc_term_cond_t;
typedef enum { TC_DIR_FORWARD, TC_DIR_REVERSE } tc_direction_t;
typedef struct { int unused; } TP_STRUCT;
typedef struct { int unused; } TC_QUEUE_STRUCT;
typedef unsigned long long iomask_t;
typedef struct {
    char anychanged;
    iomask_t dio_mask, aio_mask;
    signed char dios[EMCMOT_MAX_DIO];
    double aios[EMCMOT_MAX_AIO];
} syncdio_t;

typedef struct { double pos_cmd, min_pos_limit, max_pos_limit; } emcmot_joint_status_t;
typedef struct { int at_speed; } spindle_status_t;
typedef struct {
    emcmot_joint_status_t joint_status[16];
    spindle_status_t spindle_status[8];
    double net_feed_scale, distance_to_go, current_vel, requested_vel;
    unsigned char enables_new, enables_queued;
    int spindleSync, motionFlag;
    unsigned int tcqlen;
    EmcPose dtg, tool_offset;
} emcmot_status_t;
typedef struct { int numDIO, numAIO, numSpindles; } emcmot_config_t;

#endif
