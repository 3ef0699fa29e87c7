/* What LinuxCNC and HAL tell the planner, and the joints of a pose in the kinematics that is in force. */

typedef struct {
    hal_real_t tool_offset; /* motion.tooloffset.z, as the kinematics has it */
    hal_bool_t identity;    /* kins.identity: every axis moves the joint of its number */
} Pins;

static Pins *pins;
static emcmot_status_t *emcmotStatus;
static emcmot_config_t *emcmotConfig;
static double cycle_seconds = 0.001;
static void (*write_digital)(int, char);
static void (*write_analog)(int, double);
static double tool_length; /* by which the poses are shifted */

/* The pose of the machine's own tip for that of the tool in use. */
static void shift_to_own_tip(const double *x, double *own)
{
    memcpy(own, x, AXES * sizeof *x);
    shift_tip(own, tool_length);
}

/* The joints of a pose, near given ones; 0 where a leg can't reach it. */
static int reach_pose(const double *x, const double *near, double *q)
{
    double own[AXES];
    if (hal_get_bool(pins->identity)) {
        take_axes_as_joints(x, q);
        return 1;
    }
    shift_to_own_tip(x, own);
    return find_joints(own, near, q);
}

/* The joints of a pose that the machine may take, near given ones; 0 where it may not. */
static int solve_inverse(const double *x, const double *near, double *q)
{
    double own[AXES];
    shift_to_own_tip(x, own);
    return reach_pose(x, near, q) && (hal_get_bool(pins->identity) || (allowed(own, q) && regular(own, q)));
}

static int set_up(void)
{
    pins = hal_malloc(sizeof *pins);
    if (!pins)
        return -1;
    const int failed = hal_pin_new_real(component, HAL_IN, &pins->tool_offset, 0, "planner.tool-offset");
    return failed | hal_pin_new_bool(component, HAL_IN, &pins->identity, 0, "planner.identity");
}
