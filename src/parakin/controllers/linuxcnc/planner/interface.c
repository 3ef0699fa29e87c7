/* What LinuxCNC asks of a trajectory planner. It calls all of this from its servo thread. */

/* From 2.10 on LinuxCNC tells each motion its jerk, of which this planner makes no use. */
#ifdef DEFAULT_AXIS_MAX_JERK
#define TOLD_JERK double told_jerk,
#define IGNORE_JERK (void)told_jerk
#else
#define TOLD_JERK
#define IGNORE_JERK
#endif

int tpCreate(TP_STRUCT *tp, int size, int id)
{
    (void)tp;
    (void)size;
    (void)id;
    return 0;
}

/* LinuxCNC calls it when the machine is switched off, and then does not look at "in position" until it is on again: off
   amid a move its screens would wait for that in vain, seconds for each command. */
int tpClear(TP_STRUCT *tp)
{
    (void)tp;
    clear_path();
    clear_outputs();
    timed = synchronized = 0;
    emcmotStatus->motionFlag |= EMCMOT_MOTION_INPOS_BIT;
    return 0;
}

int tpSetCycleTime(TP_STRUCT *tp, double seconds)
{
    (void)tp;
    if (!(seconds > 0.0))
        return -1;
    cycle_seconds = seconds;
    return 0;
}

int tpSetVmax(TP_STRUCT *tp, double most, double ini_most) { (void)tp; (void)most; (void)ini_most; return 0; }
int tpSetAmax(TP_STRUCT *tp, double most) { (void)tp; (void)most; return 0; }

int tpSetVlimit(TP_STRUCT *tp, double most)
{
    (void)tp;
    most_tip_speed = most;
    return 0;
}

int tpSetId(TP_STRUCT *tp, int id) { (void)tp; motion_id = id; return 0; }

int tpSetTermCond(TP_STRUCT *tp, int condition, double allowed)
{
    (void)tp;
    stops_exactly = condition == TC_TERM_COND_STOP;
    tolerance = condition == TC_TERM_COND_PARABOLIC ? (allowed > 0.0 ? allowed : NO_TOLERANCE) : 0.0;
    return 0;
}

int tpSetPos(TP_STRUCT *tp, const EmcPose *position)
{
    (void)tp;
    read_pose(position, pose);
    tool_length = hal_get_real(pins->tool_offset);
    reader_may_be_old = 0;
    clear_path();
    return 0;
}

int tpSetSpindleSync(TP_STRUCT *tp, int spindle, double sync, int mode)
{
    (void)tp;
    (void)spindle;
    (void)mode;
    synchronized = sync != 0.0;
    return 0;
}

int tpSetAout(TP_STRUCT *tp, unsigned char index, double start, double end)
{
    (void)tp;
    (void)end;
    if (index >= EMCMOT_MAX_AIO)
        return -1;
    if (index == SIGNAL) {
        timed = start > 0.0;
        return 0;
    }
    outputs.anychanged = 1;
    outputs.aio_mask |= 1ULL << index;
    outputs.aios[index] = start;
    return 0;
}

int tpSetDout(TP_STRUCT *tp, int index, unsigned char start, unsigned char end)
{
    (void)tp;
    (void)end;
    if (index < 0 || index >= EMCMOT_MAX_DIO)
        return -1;
    outputs.anychanged = 1;
    outputs.dio_mask |= 1ULL << index;
    outputs.dios[index] = start > 0 ? 1 : -1;
    return 0;
}

int tpSetRunDir(TP_STRUCT *tp, tc_direction_t direction)
{
    (void)tp;
    return direction == TC_DIR_FORWARD ? 0 : -1;
}

int tpAddLine(TP_STRUCT *tp, EmcPose end, int canon_type, double asked, double most, double acceleration,
              TOLD_JERK unsigned char enables, char at_speed, int indexer, struct state_tag_t tag)
{
    (void)tp;
    (void)acceleration;
    IGNORE_JERK;
    Motion *m = prepare_motion(&end, canon_type, asked, most, enables, at_speed, tag);
    if (!m || indexer >= 0)
        return -1;
    if (!measure_line(m))
        return 1; /* LinuxCNC takes it for done */
    if (timed) {
        m->kind = TIMED;
        m->length /= m->speed; /* s */
        m->speed = m->most_speed = 1.0;
    }
    return add_motion(m);
}

int tpAddCircle(TP_STRUCT *tp, EmcPose end, PmCartesian centre, PmCartesian normal, int turns, int canon_type,
                double asked, double most, double acceleration, TOLD_JERK unsigned char enables, char at_speed,
                struct state_tag_t tag)
{
    (void)tp;
    (void)acceleration;
    IGNORE_JERK;
    Motion *m = prepare_motion(&end, canon_type, asked, most, enables, at_speed, tag);
    if (!m || !describe_arc(m, &centre, &normal, turns))
        return -1;
    m->kind = ARC;
    m->tip_slope = 1.0;
    return add_motion(m);
}

int tpAddRigidTap(TP_STRUCT *tp, EmcPose end, double asked, double most, double acceleration,
                  TOLD_JERK unsigned char enables, double scale, struct state_tag_t tag)
{
    (void)tp;
    IGNORE_JERK;
    (void)end;
    (void)asked;
    (void)most;
    (void)acceleration;
    (void)enables;
    (void)scale;
    rtapi_print_msg(RTAPI_MSG_ERR, MODULE ": line %d: rigid tapping is not planned\n", tag.fields[GM_FIELD_LINE_NUMBER]);
    return -1;
}

int tpPause(TP_STRUCT *tp) { (void)tp; pausing = 1; return 0; }
int tpResume(TP_STRUCT *tp) { (void)tp; pausing = 0; return 0; }

int tpAbort(TP_STRUCT *tp)
{
    (void)tp;
    if (queue_length())
        aborting = 1;
    timed = reader_may_be_old = 0;
    return 0;
}

int tpGetPos(const TP_STRUCT *tp, EmcPose *position)
{
    (void)tp;
    write_pose(pose, position);
    return 0;
}

int tpIsDone(TP_STRUCT *tp) { (void)tp; return queue_length() == 0 && tool_is_up_to_date(); }
int tpQueueDepth(TP_STRUCT *tp) { (void)tp; return queue_length(); }
int tpActiveDepth(TP_STRUCT *tp) { (void)tp; return queue_length() > 0; }
int tcqFull(const TC_QUEUE_STRUCT *queue) { (void)queue; return queue_length() >= QUEUE - MARGIN; }

int tpGetMotionType(TP_STRUCT *tp)
{
    (void)tp;
    return queue_length() ? motion_at(first_motion)->canon_type : 0;
}

int tpGetExecId(TP_STRUCT *tp)
{
    (void)tp;
    return queue_length() ? motion_at(first_motion)->id : 0;
}

struct state_tag_t tpGetExecTag(TP_STRUCT *tp)
{
    static const struct state_tag_t none;
    (void)tp;
    return queue_length() ? motion_at(first_motion)->tag : none;
}

/* The joints can't go on: LinuxCNC is told so and aborts the program. */
static void refuse_path(void)
{
    rtapi_print_msg(RTAPI_MSG_ERR, MODULE ": line %d: %s\n",
                    motion_at(piece_at(cut_piece)->motion)->tag.fields[GM_FIELD_LINE_NUMBER], obstacle);
    emcmotStatus->motionFlag |= EMCMOT_MOTION_ERROR_BIT;
    clear_path();
}

static void report_status(void)
{
    const Motion *m = motion_at(first_motion);
    double left[AXES];
    for (int i = 0; i < AXES; i++)
        left[i] = m->end[i] - pose[i];
    write_pose(left, &emcmotStatus->dtg);
    emcmotStatus->distance_to_go = measure_way(pose, m->end).told;
    emcmotStatus->enables_queued = m->enables;
    const double slope = m->tip_slope > 0.0 ? m->tip_slope : 1.0;
    emcmotStatus->requested_vel = m->kind == TIMED ? tool_speed : m->speed * slope;
    emcmotStatus->current_vel = tool_speed;
    emcmotStatus->tcqlen = queue_length();
}

int tpRunCycle(TP_STRUCT *tp, long period)
{
    (void)tp;
    (void)period;
    if (!queue_length()) {
        update_tool_length();
        clear_path();
        return 0;
    }
    if (next_step == first_step && cut_piece == 0 && cut_at == 0.0) { /* from rest */
        cut_length = 1.0;
        read_joints_now(cut_joints);
        memset(laid_rate, 0, sizeof laid_rate);
    }
    motion_at(next_motion - 1)->age++;
    look_ahead();
    double before[AXES];
    memcpy(before, pose, sizeof pose);
    if (next_step != 0) {
        advance(cycle_seconds);
        locate_tool(pose);
    }
    tool_speed = measure_way(before, pose).told / cycle_seconds;
    if (first_step == next_step)
        speed = 0.0;
    report_status();
    if (aborting && !(speed > 0.0))
        clear_path();
    else if (first_step == next_step && path_refused)
        refuse_path();
    else if (first_step == next_step && laid_motion == next_motion && cut_piece == next_piece)
        clear_path();
    return 0;
}

void tpMotFunctions(void (*digital)(int, char), void (*analog)(int, double), void (*set_unlock)(int, int),
                    int (*get_unlock)(int), double (*speed_limit)(int), double (*acceleration_limit)(int))
{
    write_digital = digital;
    write_analog = analog;
    (void)set_unlock;
    (void)get_unlock;
    (void)speed_limit;
    (void)acceleration_limit;
}

void tpMotData(emcmot_status_t *status, emcmot_config_t *config)
{
    emcmotStatus = status;
    emcmotConfig = config;
}

EXPORT_SYMBOL(tpMotFunctions);
EXPORT_SYMBOL(tpMotData);
EXPORT_SYMBOL(tpCreate);
EXPORT_SYMBOL(tpClear);
EXPORT_SYMBOL(tpSetCycleTime);
EXPORT_SYMBOL(tpSetVmax);
EXPORT_SYMBOL(tpSetVlimit);
EXPORT_SYMBOL(tpSetAmax);
EXPORT_SYMBOL(tpSetId);
EXPORT_SYMBOL(tpGetExecId);
EXPORT_SYMBOL(tpGetExecTag);
EXPORT_SYMBOL(tpSetTermCond);
EXPORT_SYMBOL(tpSetPos);
EXPORT_SYMBOL(tpRunCycle);
EXPORT_SYMBOL(tpPause);
EXPORT_SYMBOL(tpResume);
EXPORT_SYMBOL(tpAbort);
EXPORT_SYMBOL(tpAddRigidTap);
EXPORT_SYMBOL(tpAddLine);
EXPORT_SYMBOL(tpAddCircle);
EXPORT_SYMBOL(tpGetPos);
EXPORT_SYMBOL(tpIsDone);
EXPORT_SYMBOL(tpQueueDepth);
EXPORT_SYMBOL(tpActiveDepth);
EXPORT_SYMBOL(tpGetMotionType);
EXPORT_SYMBOL(tpSetSpindleSync);
EXPORT_SYMBOL(tpSetAout);
EXPORT_SYMBOL(tpSetDout);
EXPORT_SYMBOL(tpSetRunDir);
EXPORT_SYMBOL(tcqFull);
