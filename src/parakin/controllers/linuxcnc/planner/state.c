static emcmot_status_t *emcmotStatus;
static emcmot_config_t *emcmotConfig;
static double cycle_seconds = 0.001;
static void (*write_digital)(int, char);
static void (*write_analog)(int, double);

/* The pose of the machine's own tip for that of the tool in use. */
static void shift_to_own_tip(const double *x, double *own)
{
    memcpy(own, x, AXES * sizeof *x);
    shift_tip(own, emcmotStatus->tool_offset.tran.z);
}

/* The joints of a pose, near given ones; 0 where a leg can't reach it. */
static int reach_pose(const double *x, const double *near, double *q)
{
    double own[AXES];
    shift_to_own_tip(x, own);
    return find_joints(own, near, q);
}

/* The joints of a pose that the machine may take, near given ones; 0 where it may not. */
static int solve_inverse(const double *x, const double *near, double *q)
{
    double own[AXES];
    shift_to_own_tip(x, own);
    return find_joints(own, near, q) && allowed(own, q) && regular(own, q);
}

static int set_up(void) { return 0; }
