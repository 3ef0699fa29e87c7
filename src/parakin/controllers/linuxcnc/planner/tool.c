/* The path's end, and the tool's length while the machine stands.

   LinuxCNC adds a tool's length along Z, whatever the tool's direction. As the length changes the joints stay, and so the
   pose of a tilted tool moves on LinuxCNC's side, which its reader of programs doesn't see. A motion that takes a
   coordinate from before the change is refused. */

#define SAME_PLACE 1e-6 /* mm: rounding */

static double goal[AXES];         /* the end of the last motion in the queue */
static double goal_joints[JOINTS];
static int goal_known;            /* the joints there */
static double old_pose[AXES];     /* before the tool's length changed */
static int reader_may_be_old;     /* of programs: it may still have that */

static void take_goal_from_pose(void)
{
    for (int i = 0; i < AXES; i++)
        goal[i] = pose[i];
    goal_known = 0;
}

static int tool_is_up_to_date(void) { return tool_length == emcmotStatus->tool_offset.tran.z; }

/* Take the tool's length as the kinematics has it now; the joints stay. The queue is empty. */
static void update_tool_length(void)
{
    const double length = hal_get_real(pins->tool_offset);
    if (length == tool_length)
        return;
    if (!hal_get_bool(pins->identity)) {
        memcpy(old_pose, pose, sizeof pose);
        shift_tip(pose, tool_length);
        shift_tip(pose, -length);
        reader_may_be_old = 1;
    }
    tool_length = length;
    take_goal_from_pose();
}

/* Whether a motion to an end is from a reader that has not seen the pose move: a coordinate is the old one, or the motion
   is relative and no coordinate is the new one. */
static int is_from_old_pose(const double *end, int relative)
{
    int moved = 0, old = 0, fresh = 0;
    for (int i = 0; i < AXES && reader_may_be_old; i++)
        if (fabs(pose[i] - old_pose[i]) > SAME_PLACE) {
            moved = 1;
            old |= fabs(end[i] - old_pose[i]) <= SAME_PLACE;
            fresh |= fabs(end[i] - pose[i]) <= SAME_PLACE;
        }
    return moved && (old || (relative && !fresh));
}
