/* A planner module as LinuxCNC's motion drives it, for the tests: PLANNER_FILE is compiled with this. */

#include PLANNER_FILE
#include <stdarg.h>
#include <stdio.h>

static emcmot_status_t status;
static emcmot_config_t config;
static char told[256];
static int written[2];

void rtapi_print_msg(int level, const char *format, ...)
{
    va_list arguments;
    (void)level;
    va_start(arguments, format);
    vsnprintf(told, sizeof told, format, arguments);
    va_end(arguments);
}
int hal_init(const char *name) { (void)name; return 1; }
int hal_ready(int id) { (void)id; return 0; }
int hal_exit(int id) { (void)id; return 0; }
void *hal_malloc(long size) { return calloc(1, size); }
int hal_pin_float_newf(int dir, double **data, int id, const char *format, ...)
{
    (void)dir, (void)id, (void)format;
    return *data = calloc(1, sizeof **data), 0;
}
int hal_pin_bit_newf(int dir, char **data, int id, const char *format, ...)
{
    (void)dir, (void)id, (void)format;
    return *data = calloc(1, sizeof **data), 0;
}

static void note_digital(int index, char value) { written[0] = 100 * index + value; }
static void note_analog(int index, double value) { written[1] = 100 * index + (int)value; }

static EmcPose take_pose(const double *v)
{
    const EmcPose pose = {{v[0], v[1], v[2]}, v[3], v[4], v[5], v[6], v[7], v[8]};
    return pose;
}

static struct state_tag_t tag_line(int line)
{
    struct state_tag_t tag = {.packed_flags = 1UL << GM_FLAG_DISTANCE_MODE};
    tag.fields[GM_FIELD_LINE_NUMBER] = line;
    tpSetId(0, line);
    return tag;
}

/* Stand at a pose with joints, and their limits; mm and degrees. */
void start(const double *pose9, const double *joints, const double *low, const double *high)
{
    const EmcPose pose9_ = take_pose(pose9);
    memset(&status, 0, sizeof status);
    if (!pins)
        set_up();
    *pins->tool_offset = 0.0;
    *pins->identity = 0;
    tpMotFunctions(note_digital, note_analog, 0, 0, 0, 0);
    tpMotData(&status, &config);
    config.numSpindles = 1;
    config.numDIO = config.numAIO = 4;
    for (int j = 0; j < JOINTS; j++) {
        status.joint_status[j].pos_cmd = joints[j];
        status.joint_status[j].min_pos_limit = low[j];
        status.joint_status[j].max_pos_limit = high[j];
    }
    told[0] = 0;
    tpCreate(0, 2000, 0);
    tpClear(0);
    tpSetPos(0, &pose9_);
    tpSetCycleTime(0, 0.001);
}

void set_identity(int on) { *pins->identity = (char)on; }

void set_corners(int stops, double tolerance)
{
    tpSetTermCond(0, stops ? TC_TERM_COND_STOP : tolerance > 0.0 ? TC_TERM_COND_PARABOLIC : TC_TERM_COND_EXACT, tolerance);
}

int add_line(const double *pose9, double asked, double most, int waits, int line)
{
    return tpAddLine(0, take_pose(pose9), 2, asked, most, 0.0, 255, (char)waits, -1, tag_line(line));
}

int add_arc(const double *pose9, const double *centre, const double *normal, int turns, double asked, double most, int line)
{
    const PmCartesian c = {centre[0], centre[1], centre[2]}, n = {normal[0], normal[1], normal[2]};
    return tpAddCircle(0, take_pose(pose9), c, n, turns, 3, asked, most, 0.0, 255, 0, tag_line(line));
}

int add_tap(const double *pose9) { return tpAddRigidTap(0, take_pose(pose9), 1.0, 1.0, 1.0, 255, 1.0, tag_line(7)); }
void set_signal(int index, double value) { tpSetAout(0, (unsigned char)index, value, value); }
void set_output(int index, int on) { tpSetDout(0, index, (unsigned char)on, (unsigned char)on); }
void set_spindle(int at_speed) { status.spindle_status[0].at_speed = at_speed; }
void set_synchronized(double sync) { tpSetSpindleSync(0, 0, sync, 0); }
void set_pause(int on) { on ? tpPause(0) : tpResume(0); }
void set_abort(void) { tpAbort(0); }
int is_full(void) { return tcqFull(0); }
int has_error(void) { return status.motionFlag & EMCMOT_MOTION_ERROR_BIT; }
int get_line(void) { return tpGetExecId(0); }
int get_written(int analog) { return written[analog]; }
const char *get_told(void) { return told; }

/* A cycle; the pose that is commanded. The joints follow it. Returns the length of the queue, or -1 where they can't. */
int run_cycle(double feed_scale, double *pose9)
{
    EmcPose p;
    double x[AXES], near[JOINTS], q[JOINTS];
    status.net_feed_scale = feed_scale;
    tpRunCycle(0, 1000000);
    tpGetPos(0, &p);
    const double values[9] = {p.tran.x, p.tran.y, p.tran.z, p.a, p.b, p.c, p.u, p.v, p.w};
    memcpy(pose9, values, sizeof values);
    read_pose(&p, x);
    for (int j = 0; j < JOINTS; j++)
        near[j] = status.joint_status[j].pos_cmd * (turning[j] ? DEGREE : 1.0);
    if (!reach_pose(x, near, q))
        return -1;
    for (int j = 0; j < JOINTS; j++)
        status.joint_status[j].pos_cmd = q[j] / (turning[j] ? DEGREE : 1.0);
    return tpQueueDepth(0);
}

/* Run lines as fast as LinuxCNC sends them, one a cycle: poses (count, 9), speeds, whether each stops at its end and has a
   given time. Writes the pose of every cycle (most, 9) and the line that runs; returns the cycles, negative where a pose
   is out of reach or the planner refuses a line. */
int run_lines(int count, const double *poses, const double *speeds, const int *stops, const int *timed_, int most,
              double *out, int *lines)
{
    int next = 0;
    for (int cycle = 0; cycle < most; cycle++) {
        if (next < count && !tcqFull(0)) {
            tpSetAout(0, SIGNAL, timed_[next], timed_[next]);
            set_corners(stops[next], 0.0);
            if (tpAddLine(0, take_pose(poses + 9 * next), 2, speeds[next], 1e9, 0.0, 255, 0, -1, tag_line(next)) < 0)
                return -cycle - 1;
            next++;
        }
        const int left = run_cycle(1.0, out + 9 * cycle);
        lines[cycle] = left > 0 ? motion_at(first_motion)->id : -1;
        if (left < 0 || has_error())
            return -cycle - 1;
        if (!left && next == count)
            return cycle + 1;
    }
    return most;
}
