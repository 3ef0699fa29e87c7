/* The queue's end: what LinuxCNC has set for the motions to come, and which of these are taken. */

static int motion_id, timed, stops_exactly, synchronized;
static double tolerance;
static syncdio_t outputs; /* for the next motion */

static void clear_outputs(void) { memset(&outputs, 0, sizeof outputs); }

/* Forget the path. The tool stands where it is. */
static void clear_path(void)
{
    first_motion = next_motion = begun_motion = laid_motion = 0;
    next_piece = cut_piece = 0;
    first_step = next_step = 0;
    laid_from = cut_at = step_place = speed = tool_speed = 0.0;
    laid_still = 1;
    path_refused = cut_jumped = pausing = aborting = 0;
    take_goal_from_pose();
    emcmotStatus->distance_to_go = emcmotStatus->current_vel = emcmotStatus->requested_vel = 0.0;
    emcmotStatus->enables_queued = emcmotStatus->enables_new;
    emcmotStatus->spindleSync = 0;
    emcmotStatus->tcqlen = 0;
    ZERO_EMC_POSE(emcmotStatus->dtg);
}

static void read_joints_now(double *q)
{
    for (int j = 0; j < JOINTS; j++)
        q[j] = emcmotStatus->joint_status[j].pos_cmd * (turning[j] ? DEGREE : 1.0);
}

/* Prepare the next motion of the queue up to its shape; 0 where it can't be taken. */
static Motion *prepare_motion(const EmcPose *end, int canon_type, double asked, double most, unsigned char enables,
                              char at_speed, struct state_tag_t tag)
{
    if (aborting || queue_length() >= QUEUE - 1)
        return 0;
    if (synchronized) {
        rtapi_print_msg(RTAPI_MSG_ERR, MODULE ": motions in step with the spindle (G33, G76, G95) are not planned\n");
        return 0;
    }
    if (!queue_length())
        update_tool_length();
    Motion *m = motion_at(next_motion);
    memcpy(m->start, goal, sizeof goal);
    read_pose(end, m->end);
    if (is_from_old_pose(m->end, !(tag.packed_flags >> GM_FLAG_DISTANCE_MODE & 1))) {
        rtapi_print_msg(RTAPI_MSG_ERR, MODULE ": line %d goes on from where the tool was before its length changed; it "
                        "is tilted, so the tip moved: name X Y Z, or put M66 E0 L0 behind G43\n",
                        tag.fields[GM_FIELD_LINE_NUMBER]);
        return 0;
    }
    m->kind = LINE;
    m->id = motion_id;
    m->tag = tag;
    m->canon_type = canon_type;
    m->enables = enables;
    m->waits_for_spindle = at_speed;
    m->stops = stops_exactly;
    m->tolerance = tolerance;
    m->speed = asked;
    m->most_speed = most;
    m->age = 0;
    m->outputs = outputs;
    return m;
}

/* Whether the joints can follow a motion: looked at in a few places, the steps see the others. */
static int is_reachable(const Motion *m)
{
    const int count = m->kind == TIMED ? 1 : CHECKS;
    if (!goal_known)
        read_joints_now(goal_joints);
    double q[JOINTS];
    memcpy(q, goal_joints, sizeof q);
    for (int k = goal_known ? 1 : 0; k <= count; k++) {
        double x[AXES], last[JOINTS];
        compute_pose(m, k * m->length / count, x);
        memcpy(last, q, sizeof q);
        if (!solve_inverse(x, last, q)) {
            rtapi_print_msg(RTAPI_MSG_ERR, MODULE ": line %d leaves the workspace, %d %% of the way on\n",
                            m->tag.fields[GM_FIELD_LINE_NUMBER], 100 * k / count);
            return 0;
        }
        const int beyond = find_joint_beyond(q);
        if (beyond >= 0) {
            const emcmot_joint_status_t *joint = &emcmotStatus->joint_status[beyond];
            rtapi_print_msg(RTAPI_MSG_ERR, MODULE ": line %d would bring joint %d to %.3f, its limits are %.3f and %.3f\n",
                            m->tag.fields[GM_FIELD_LINE_NUMBER], beyond, q[beyond] / (turning[beyond] ? DEGREE : 1.0),
                            joint->min_pos_limit, joint->max_pos_limit);
            return 0;
        }
    }
    memcpy(goal_joints, q, sizeof q);
    goal_known = 1;
    return 1;
}

static int add_motion(Motion *m)
{
    if (!is_reachable(m))
        return -1;
    memcpy(goal, m->end, sizeof goal);
    reader_may_be_old = 0;
    clear_outputs();
    next_motion++;
    return 0;
}
