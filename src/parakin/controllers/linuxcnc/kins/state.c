/* How LinuxCNC asks for the model.

   LinuxCNC hands the last joints to the inverse and the last pose to the forward, and that is what they stay near to. It
   asks the inverse for the end points of moves to come as well, which would spoil a memory; so its answers have none. The
   last answer of the forward and the last pose of a servo cycle are kept for the cases in which LinuxCNC's pose says
   nothing. Nothing allocates, and every loop has an end. */

/* What the kinematics is told through HAL, and what it tells. */
typedef struct {
    hal_real_t tool_offset;         /* what the tool is longer than the machine's own, mm: motion.tooloffset.z */
    hal_real_t joint[JOINTS];       /* where the joints are commanded to be: joint.N.pos-cmd */
    hal_bool_t teleop, coordinated; /* motion.teleop-mode, motion.coord-mode */
    hal_bool_t homed, in_position;  /* motion.is-all-homed, motion.in-position */
    hal_bool_t identity;            /* every axis moves the joint of its number: motion.switchkins-type 1 */
    hal_bool_t pose_known;
    hal_real_t pose[AXES];          /* the tool's, in mm and degrees, whichever kinematics is in force */
} Pins;

static Pins *pins;

static double own_pose[AXES]; /* of the machine's own tip: the forward's last answer */
static int pose_known;
static double commanded_pose[AXES]; /* the last that LinuxCNC moved to, of the tip in use, mm and rad */
static int guess_is_old; /* LinuxCNC's poses are still those of the kinematics before the switch */

/* Read the joints' commanded positions, mm and rad; 0 where one is not finite. */
static int read_commanded_joints(double *q)
{
    double commanded[JOINTS];
    for (int i = 0; i < JOINTS; i++)
        commanded[i] = hal_get_real(pins->joint[i]);
    read_joints(commanded, q);
    return finite_all(q, JOINTS);
}

/* For memcpy a compiler that saves space writes a string instruction, which takes some 10 ns to begin. */
static inline void copy_pose(const double *from, double *to)
{
    for (int i = 0; i < AXES; i++)
        to[i] = from[i];
}

/* Keep a pose of the machine's own tip as the last answer, and tell the tool's, which it becomes. */
static void keep_pose(double *x)
{
    copy_pose(x, own_pose);
    shift_tip(x, -hal_get_real(pins->tool_offset));
    for (int i = 0; i < AXES; i++)
        hal_set_real(pins->pose[i], x[i] / (turning_axis[i] ? DEGREE : 1.0));
    pose_known = 1;
    hal_set_bool(pins->pose_known, 1);
}

static void forget_pose(void)
{
    pose_known = 0;
    hal_set_bool(pins->pose_known, 0);
}
