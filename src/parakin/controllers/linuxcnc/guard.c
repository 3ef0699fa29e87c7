/* A watch over the machine, once a servo cycle after the motion controller.

   It tells how far the machine is from its nearest limit and which that is; it lets jogs stop softly before one is
   reached, at the end of the box for moves by hand, or where a joint would pass its speed. And it gives the axes their
   low rates while they are moved by hand, and their high ones in coordinated motion, which the trajectory planner keeps
   within the limits; where every axis moves one joint, that joint's range and rates. It keeps the last pose. */

typedef struct {
    hal_real_t position;                         /* axis.L.pos-cmd */
    hal_real_t pose;                             /* kins.L */
    hal_real_t hand_min, hand_max;               /* the box for moves by hand */
    hal_real_t hand_velocity, hand_acceleration; /* rates for moves by hand */
    hal_real_t program_min, program_max, program_velocity, program_acceleration;
    hal_real_t min_limit, max_limit, max_velocity, max_acceleration; /* to ini.L. */
} Axis;

typedef struct {
    Axis axis[AXES];
    hal_real_t joint[JOINTS]; /* joint.N.pos-cmd */
    hal_real_t tool_offset;   /* motion.tooloffset.z */
    hal_bool_t homed, enabled, teleop, coordinated; /* motion. */
    hal_bool_t identity, pose_known; /* kins.: every axis moves the joint of its number; the pose is known all the same */
    hal_uint_t nearest;       /* index of the nearest limit: NAME_model.h and NAME.md have the names */
    hal_real_t distance;      /* to it: 0 where it is reached, 1 where jogs stop */
    hal_bool_t jog_stop;      /* to motion.jog-stop */
} Pins;

static Pins *pins;
static double last_pose[AXES], last_joints[JOINTS], last_margin;
static int knows_last, knows_margin; /* they are those of the cycle before */
static double motion_offset, told_offset; /* of the tool: with which motion has made this cycle's pose, and the one told last */

/* What the machine does in this cycle; mm, rad, s. */
typedef struct {
    double pose[AXES], joints[JOINTS], pose_rates[AXES], joint_rates[JOINTS];
} Motion;

static int read_motion(Motion *m)
{
    double world[AXES], joints[JOINTS], own[JOINTS];
    if (hal_get_bool(pins->identity) && !hal_get_bool(pins->pose_known))
        return 0;
    for (int i = 0; i < AXES; i++)
        world[i] = hal_get_real(hal_get_bool(pins->identity) ? pins->axis[i].pose : pins->axis[i].position)
                   * (turning_axis[i] ? DEGREE : 1.0);
    for (int i = 0; i < JOINTS; i++)
        joints[i] = hal_get_real(pins->joint[i]);
    read_joints(joints, m->joints);
    if (!finite_all(world, AXES) || !finite_all(m->joints, JOINTS))
        return 0;
    for (int i = 0; i < AXES; i++)
        m->pose[i] = world[i];
    shift_tip(m->pose, motion_offset);
    const int known = knows_last;
    for (int i = 0; i < AXES; i++) {
        m->pose_rates[i] = known ? (m->pose[i] - last_pose[i]) / CYCLE : 0.0;
        last_pose[i] = m->pose[i];
    }
    for (int i = 0; i < JOINTS; i++) {
        m->joint_rates[i] = known ? (m->joints[i] - last_joints[i]) / CYCLE : 0.0;
        last_joints[i] = m->joints[i];
    }
    knows_last = 1;
    if (!find_joints(m->pose, m->joints, own))
        return 0;
    for (int i = 0; i < JOINTS; i++) /* the interpolated joints trail the pose by some cycles */
        if (!(fabs(own[i] - m->joints[i]) <= TRAILS * CYCLE * joint_speed[i]))
            return 0;
    return 1;
}

/* The time in which the machine comes to rest if it is stopped now, as time at its speed: every axis or joint by itself. */
static double find_stop_time(int by_axis, int i, double rate)
{
    double slowing = joint_acceleration[i];
    if (by_axis) /* there may be more joints than axes */
        slowing = hal_get_real(pins->axis[i].hand_acceleration) * (turning_axis[i] ? DEGREE : 1.0);
    return 0.5 * fabs(rate) / slowing + LATENCY * CYCLE;
}

static double find_joints_stop_time(const Motion *m)
{
    double most = 0.0;
    for (int i = 0; i < JOINTS; i++)
        most = fmax(most, find_stop_time(0, i, m->joint_rates[i]));
    return most;
}

/* Where the machine comes to rest if it is stopped now: every axis by itself in a jog, all in step else. */
static void predict_stop(const Motion *m, int by_axes, double *pose)
{
    const double together = find_joints_stop_time(m);
    for (int i = 0; i < AXES; i++) {
        const double rate = m->pose_rates[i];
        pose[i] = m->pose[i] + rate * (by_axes ? find_stop_time(1, i, rate) : together);
    }
}

/* Whether joints that move by themselves would take the machine too near to a parallel singularity before they stand. On
   the way to one the pose moves faster and faster: the margin's square, not the margin, falls evenly with the joints. */
static int runs_into_singularity(const Motion *m)
{
    double margins[SINGULARITIES];
    measure_singularities(m->pose, m->joints, margins);
    const double least = least_singularity[0], rate = knows_margin ? (margins[0] - last_margin) / CYCLE : 0.0;
    last_margin = margins[0];
    knows_margin = 1;
    return rate < 0.0 && margins[0] * (margins[0] + 2.0 * FOR_CURVES * rate * find_joints_stop_time(m)) < least * least;
}

/* The distance to the nearest limit where the machine would be; below zero too where it can't be at all. */
static double distance_at(const double *pose, const double *near, double *joints)
{
    int nearest;
    return find_joints(pose, near, joints) ? distance_to_limits(pose, joints, &nearest) : -1.0;
}

static int leaves_the_box(const Motion *m, const double *stop)
{
    for (int i = 0; i < AXES; i++) {
        const double unit = turning_axis[i] ? DEGREE : 1.0;
        const Axis *axis = &pins->axis[i];
        if ((m->pose_rates[i] > 0.0 && stop[i] > hal_get_real(axis->hand_max) * unit)
            || (m->pose_rates[i] < 0.0 && stop[i] < hal_get_real(axis->hand_min) * unit))
            return 1;
    }
    return 0;
}

/* Whether a joint would pass its speed on the way to where the machine stops. */
static int swings(const Motion *m, const double *stop)
{
    double here[JOINTS], there[JOINTS], ahead[AXES];
    for (int part = 0; part <= PARTS; part++) {
        for (int i = 0; i < AXES; i++)
            ahead[i] = m->pose[i] + part * (stop[i] - m->pose[i]) / PARTS;
        if (!find_joints(ahead, m->joints, here))
            return 1;
        for (int i = 0; i < AXES; i++)
            ahead[i] += m->pose_rates[i] * CYCLE;
        if (!find_joints(ahead, here, there))
            return 1;
        for (int i = 0; i < JOINTS; i++)
            if (!(fabs(there[i] - here[i]) <= SWINGS * CYCLE * joint_speed[i]))
                return 1;
    }
    return 0;
}

static void give_rates(void)
{
    const int program = hal_get_bool(pins->coordinated);
    for (int i = 0; i < AXES; i++) {
        const Axis *axis = &pins->axis[i];
        const double unit = turning[i] ? DEGREE : 1.0;
        if (hal_get_bool(pins->identity)) {
            hal_set_real(axis->min_limit, joint_low[i] / unit);
            hal_set_real(axis->max_limit, joint_high[i] / unit);
            hal_set_real(axis->max_velocity, joint_speed[i] / unit);
            hal_set_real(axis->max_acceleration, joint_acceleration[i] / unit);
            continue;
        }
        hal_set_real(axis->min_limit, hal_get_real(axis->program_min));
        hal_set_real(axis->max_limit, hal_get_real(axis->program_max));
        hal_set_real(axis->max_velocity, hal_get_real(program ? axis->program_velocity : axis->hand_velocity));
        hal_set_real(axis->max_acceleration,
                     hal_get_real(program ? axis->program_acceleration : axis->hand_acceleration));
    }
}

static void watch(void *arg, long period)
{
    Motion m;
    double stop[AXES], joints[JOINTS];
    int nearest = 0, is_known, moves = 0;
    (void)arg;
    (void)period;
    give_rates();
    motion_offset = told_offset;
    told_offset = hal_get_real(pins->tool_offset);
    if (!hal_get_bool(pins->homed) || !hal_get_bool(pins->enabled))
        knows_last = 0;
    if (!knows_last)
        knows_margin = 0;
    is_known = hal_get_bool(pins->homed) && hal_get_bool(pins->enabled) && read_motion(&m);
    if (!is_known) { /* not homed, switched off, or driven out of a singularity joint by joint */
        hal_set_real(pins->distance, 0.0);
        hal_set_bool(pins->jog_stop, 0);
        return;
    }
    const double distance = distance_to_limits(m.pose, m.joints, &nearest);
    hal_set_real(pins->distance, distance);
    hal_set_ui32(pins->nearest, nearest);
    for (int i = 0; i < AXES; i++)
        moves |= m.pose_rates[i] != 0.0;
    const int by_axes = hal_get_bool(pins->teleop) && !hal_get_bool(pins->identity);
    predict_stop(&m, by_axes, stop);
    const double ahead = moves ? distance_at(stop, m.joints, joints) : distance;
    if (hal_get_bool(pins->coordinated)) {
        hal_set_bool(pins->jog_stop, 0);
        return;
    }
    const int is_near = ahead < 1.0 && ahead < distance;
    const int stops = moves && (is_near || (by_axes ? leaves_the_box(&m, stop) || swings(&m, stop)
                                                    : runs_into_singularity(&m)));
    hal_set_bool(pins->jog_stop, stops);
}

/* A float pin of an axis, by its letter. */
static int axis_pin(hal_pdir_t direction, hal_real_t *pin, int i, const char *name)
{
    return hal_pin_new_real(component, direction, pin, 0, "guard.%c.%s", axis_letters[i], name);
}

static int make_pins(void)
{
    int bad = 0;
    for (int i = 0; i < AXES; i++) {
        Axis *axis = &pins->axis[i];
        bad |= axis_pin(HAL_IN, &axis->position, i, "position");
        bad |= axis_pin(HAL_IN, &axis->pose, i, "pose");
        bad |= axis_pin(HAL_IN, &axis->hand_min, i, "hand-min");
        bad |= axis_pin(HAL_IN, &axis->hand_max, i, "hand-max");
        bad |= axis_pin(HAL_IN, &axis->hand_velocity, i, "hand-velocity");
        bad |= axis_pin(HAL_IN, &axis->hand_acceleration, i, "hand-acceleration");
        bad |= axis_pin(HAL_IN, &axis->program_min, i, "program-min");
        bad |= axis_pin(HAL_IN, &axis->program_max, i, "program-max");
        bad |= axis_pin(HAL_IN, &axis->program_velocity, i, "program-velocity");
        bad |= axis_pin(HAL_IN, &axis->program_acceleration, i, "program-acceleration");
        bad |= axis_pin(HAL_OUT, &axis->min_limit, i, "min-limit");
        bad |= axis_pin(HAL_OUT, &axis->max_limit, i, "max-limit");
        bad |= axis_pin(HAL_OUT, &axis->max_velocity, i, "max-velocity");
        bad |= axis_pin(HAL_OUT, &axis->max_acceleration, i, "max-acceleration");
    }
    for (int i = 0; i < JOINTS; i++)
        bad |= hal_pin_new_real(component, HAL_IN, &pins->joint[i], 0, "guard.joint-%d", i);
    bad |= hal_pin_new_real(component, HAL_IN, &pins->tool_offset, 0, "guard.tool-offset");
    bad |= hal_pin_new_bool(component, HAL_IN, &pins->homed, 0, "guard.homed");
    bad |= hal_pin_new_bool(component, HAL_IN, &pins->enabled, 0, "guard.enabled");
    bad |= hal_pin_new_bool(component, HAL_IN, &pins->teleop, 0, "guard.teleop-mode");
    bad |= hal_pin_new_bool(component, HAL_IN, &pins->coordinated, 0, "guard.coord-mode");
    bad |= hal_pin_new_bool(component, HAL_IN, &pins->identity, 0, "guard.identity");
    bad |= hal_pin_new_bool(component, HAL_IN, &pins->pose_known, 0, "guard.pose-known");
    bad |= hal_pin_new_ui32(component, HAL_OUT, &pins->nearest, 0, "guard.nearest");
    bad |= hal_pin_new_real(component, HAL_OUT, &pins->distance, 0, "guard.distance");
    bad |= hal_pin_new_bool(component, HAL_OUT, &pins->jog_stop, 0, "guard.jog-stop");
    return bad;
}

static int set_up(void)
{
    pins = hal_malloc(sizeof *pins);
    return !pins || make_pins() || hal_export_funct("guard.watch", watch, NULL, 1, 0, component);
}
