/* Kinematics to switch to: motion.switchkins-type 0 is the machine's, 1 has every axis move the joint of its number.

   In the second the pose is followed on, cycle by cycle, from the last one that the machine's kinematics had. So it is
   known on which side of the singularities the machine stands, unless it comes so near to one that the joints don't tell;
   then only homing does. Back to the machine's kinematics it goes only from joints whose pose is known, on home's side,
   within all limits and in the legs' own working mode. */

#define SIDE_IS_SURE 0.1 /* of the least singularity margin: nearer to it the joints don't tell the side */

static double joints_before[JOINTS]; /* commanded a cycle ago */
static int joints_stand, was_homed;

/* Follow the pose for joints, from the last one. */
static void follow_pose(const double *q)
{
    double x[AXES], near[AXES], margins[SINGULARITIES];
    copy_pose(own_pose, near);
    if (!hal_get_bool(pins->homed)) {
        forget_pose();
        return;
    }
    if (!was_homed) {
        copy_pose(home, near);
        pose_known = find_pose_for_homing(near, q, x);
    } else {
        pose_known = pose_known && find_pose_near(near, q, x);
    }
    if (pose_known) {
        measure_singularities(x, q, margins);
        pose_known = joints_tell_pose(margins, SIDE_IS_SURE);
    }
    if (!pose_known) {
        forget_pose();
        return;
    }
    write_near(x, near);
    keep_pose(x);
}

static void begin_steps(void *arg, long period)
{
    double q[JOINTS];
    (void)arg;
    (void)period;
    steps_are_watched = 1;
    last_is_answer = has_answered;
    has_answered = 0;
    const int known = read_commanded_joints(q);
    joints_stand = known;
    for (int i = 0; i < JOINTS && known; i++) {
        joints_stand &= fabs(q[i] - joints_before[i]) <= 1e-6 * CYCLE * joint_speed[i];
        joints_before[i] = q[i];
    }
    if (hal_get_bool(pins->identity) && known)
        follow_pose(q);
    was_homed = hal_get_bool(pins->homed);
}

static void end_steps(void *arg, long period)
{
    (void)arg;
    (void)period;
    steps_are_watched = guess_is_old = 0;
}

/* Why the machine's kinematics can't be taken up where the joints stand; nothing where it can. */
static const char *find_obstacle(void)
{
    double q[JOINTS];
    if (!hal_get_bool(pins->homed))
        return ""; /* it begins with homing */
    if (!pose_known || !read_commanded_joints(q))
        return "it has been too near to a singularity, the joints don't tell the pose: home the machine";
    if (!regular(own_pose, q))
        return "it is too near to a singularity, or beyond one: move the joints on";
    if (!allowed(own_pose, q))
        return "it is beyond a limit: move the joints on";
    if (!in_mode(own_pose, q))
        return "a leg stands in another working mode: move the joints on";
    return "";
}

int kinematicsSwitchable(void) { return 1; }

/* LinuxCNC takes what it asked for as done, so a switch that is refused changes nothing and is no error of it; the pin
   kins.identity tells what is in force, and the programs for M428 to M430 look at it. */
int kinematicsSwitch(int type)
{
    const char *obstacle = "";
    if (type == !!hal_get_bool(pins->identity))
        return 0;
    if (type != 0 && type != 1)
        obstacle = "there is no such type";
    else if (hal_get_bool(pins->teleop))
        obstacle = "not while the axes are moved by hand";
    else if (!joints_stand || !hal_get_bool(pins->in_position))
        obstacle = "not while anything moves or a program is paused";
    else if (type == 0)
        obstacle = find_obstacle();
#if REDUNDANT
    else
        obstacle = "there are more drives than freedoms, so no joint moves by itself";
#endif
    if (*obstacle) {
        rtapi_print_msg(RTAPI_MSG_ERR, MODULE ": the kinematics is not switched to type %d: %s\n", type, obstacle);
        return 0;
    }
    hal_set_bool(pins->identity, type != 0);
    guess_is_old = pose_known;
    return 0;
}
