/* The inverse: joints for a pose, the wrist's and all turning ones near the last. */

/* The motion controller stands between two functions in the thread, which set and clear this: what it asks for, the
   joints must do in one cycle. Other questions are about the ends of moves to come. */
static int steps_are_watched;

/* LinuxCNC's last joints are an answer of the cycle before. Where none was asked for then, be it off, they may be those of
   long ago: a wrist on its pole would be held where it was, and the machine could not be switched on again. */
static int last_is_answer, has_answered;

/* The joints that answers are to be near, LinuxCNC's last ones or, where these may be old, those that are commanded. */
static void read_last_joints(const double *joints, double *last)
{
    double commanded[JOINTS];
    read_joints(joints, last);
    if (steps_are_watched && !last_is_answer && read_commanded_joints(commanded))
        for (int i = 0; i < JOINTS; i++)
            last[i] = commanded[i];
}

/* Whether joints can go from the last ones, or from where they are commanded to be, to these in a cycle; after a stop
   LinuxCNC's last joints may be old. */
static int can_step(const double *q, const double *last)
{
    double commanded[JOINTS];
    int far_from_last = 0, far_from_commanded = !read_commanded_joints(commanded);
    for (int i = 0; i < JOINTS; i++) {
        const double step = STEP_FACTOR * CYCLE * joint_speed[i];
        far_from_last |= !(fabs(q[i] - last[i]) <= step);
        far_from_commanded |= !(fabs(q[i] - commanded[i]) <= COMMAND_LAG * step);
    }
    return !far_from_last || !far_from_commanded;
}

/* Whether a pose may be taken. In the box for moves by hand that is proved; elsewhere its limits and singularities are
   measured. */
static int may_be_at(const double *x, const double *q)
{
#if HAND_BOX
    int inside = 1;
    for (int i = 0; i < AXES; i++)
        inside &= x[i] >= box_low[i] && x[i] <= box_high[i];
    if (inside)
        return 1;
#endif
    return finite_all(x, AXES) && allowed(x, q) && regular(x, q);
}

__attribute__((flatten)) int kinematicsInverse(const EmcPose *world, double *joints,
                      const KINEMATICS_INVERSE_FLAGS *iflags, KINEMATICS_FORWARD_FLAGS *fflags)
{ /* flattened: what joints, limits and singularities have in common is computed once */
    double x[AXES], q[JOINTS], last[JOINTS];
    (void)iflags;
    (void)fflags;
    read_pose(world, x);
    read_last_joints(joints, last);
    if (hal_get_bool(pins->identity)) {
        take_axes_as_joints(x, q);
        if (!finite_all(x, AXES) || !finite_all(last, JOINTS))
            return -1;
    } else {
        shift_tip(x, hal_get_real(pins->tool_offset));
        if (!find_joints(x, last, q) || !may_be_at(x, q))
            return -1;
    }
    if (steps_are_watched) {
        if (!can_step(q, last))
            return -1;
        read_pose(world, commanded_pose);
        has_answered = 1;
    }
    write_joints(q, joints);
    return 0;
}
