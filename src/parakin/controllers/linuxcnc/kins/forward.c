/* The forward: a pose for joints, near a given one. What does not close, or is another assembly, is none.

   The pose lies on the same side of the parallel singularities as the given one with its own joints. Where LinuxCNC's
   guess says nothing, for its joints are far from the given ones (zeros, at the start), it lies on home's side; and in
   coordinated motion such a guess is refused, for it would show another pose with the same joints. */

#if SPHERES
/* The square of the distance of two poses, mm², an angle counted on the arm of a leg. */
static inline double square_distance(const double *x, const double *near)
{
    double sum = 0.0;
    for (int i = 0; i < AXES; i++) {
        const double off = (x[i] - near[i]) * (turning_axis[i] ? SIZE : 1.0);
        sum += off * off;
    }
    return sum;
}

/* The same where it counts: of a tool's axis nothing but its direction, for upright it has any C. It is no greater. */
static double square_distance_of_tools(const double *x, const double *near)
{
#if TOOL_AXIS
    double k[3], last[3], sum = 0.0;
    find_tool_axis(x, k);
    find_tool_axis(near, last);
    for (int i = 0; i < 3; i++) {
        const double way = x[i] - near[i], turn = (k[i] - last[i]) * SIZE;
        sum += way * way + turn * turn;
    }
    return sum;
#else
    return square_distance(x, near);
#endif
}

static int closes(const double *f)
{
    for (int i = 0; i < CLOSURES; i++)
        if (!(fabs(f[i]) <= TOLERANCE))
            return 0;
    return 1;
}

/* The given pose's own side by its sign; head and table stand in the mode in which the joints have them. */
static double side_of(const double *near, const double *x, const double *q)
{
    double side[1];
    own_side(near, side);
#if WRIST
    double own[JOINTS], over[JOINTS];
    inverse(x, own);
    inverse_over(x, over);
    double far[2] = {0.0, 0.0};
    for (int i = CLOSURES; i < JOINTS; i++) {
        far[0] = fmax(far[0], fabs(within_half_a_turn(own[i] - q[i], 0.0)));
        far[1] = fmax(far[1], fabs(within_half_a_turn(over[i] - q[i], 0.0)));
    }
    if (far[1] < far[0])
        own_side_over(near, side);
#else
    (void)x;
    (void)q;
#endif
    return isfinite(side[0]) ? side[0] : HOME_SIDE;
}

/* Whether a given pose at the square of a distance from a common point is surely on the same side. A leg as long as this
   moves its drive by no more than the root of 2 LONGEST r for a distance r, where it is at right angles. If r and that are
   a quarter of the height over the centres, where there is a singularity, the side is the same: 32 LONGEST r + 16 r r <
   square. */
static inline int is_beside(double far, double square)
{
    const double rest = square - 16.0 * far;
    return rest > 0.0 && 1024.0 * LONGEST * LONGEST * far < rest * rest;
}

/* Whether a given pose at the square of a distance is surely on a common point's side, by the square of the height over
   the centres; and whether it tells a side at all. */
static inline int stands_beside(double far, double square, int *tells)
{
    *tells = far <= TELLS * TELLS;
    return *tells && is_beside(far, square);
}

/* Whether the common point of joints closes, by its squared height over the centres: whatever rounding does, or measured. */
static inline int surely_closes(const double *q, const double *f, double square)
{
#if CERTAIN
    (void)f;
    for (int i = 0; i < CLOSURES; i++)
        if (!(q[i] >= joint_low[i] && q[i] <= joint_high[i]))
            return 0;
    return square >= CERTAIN_HEIGHT;
#else
    (void)q, (void)square;
    return closes(f);
#endif
}

/* The answer of every cycle: home's common point, that the given pose is beside. */
static inline int pose_beside(const double *near, const double *q, double *x)
{
    double f[CLOSURES], square[1];
    int tells;
    common_point_at_home(q, x, f, square);
    return surely_closes(q, f, square[0]) && stands_beside(square_distance(x, near), square[0], &tells);
}

/* Of both common points the answer is the one that a given pose is beside; home's is the first to be asked. Where it is
   beside neither, its own side decides. */
__attribute__((noinline, cold)) static int pose_near(const double *near, const double *q, double *x, double *side,
                                                     int *tells)
{
    double f[CLOSURES], square[1];
    const double over[1] = {-HOME_SIDE};
    common_point_at_home(q, x, f, square);
    if (stands_beside(square_distance_of_tools(x, near), square[0], tells))
        return closes(f);
    if (!*tells) {
        common_point_on(q, over, x, f);
        if (stands_beside(square_distance_of_tools(x, near), square[0], tells))
            return closes(f);
    }
    *side = *tells ? side_of(near, x, q) : HOME_SIDE;
    common_point_on(q, side, x, f);
    return closes(f) && finite_all(x, AXES);
}
#else
/* The sign of the rates of a pose's angles against those of the tool. */
static double angle_sign(const double *x)
{
#if MIDDLE_TURN >= 0
    return fabs(x[MIDDLE_TURN]) <= 0.25 * TURN || cos(x[MIDDLE_TURN]) > 0.0 ? 1.0 : -1.0;
#else
    (void)x;
    return 1.0;
#endif
}

/* What a step of Newton's method needs of the closures' slopes. */
typedef struct {
    double a[CLOSURES][MOTIONS];
#if REDUNDANT
    double r[MOTIONS][MOTIONS];
#else
    int order[CLOSURES];
#endif
} Factors;

static inline double factor_slopes(Factors *by)
{
#if REDUNDANT
    return orthogonalise(CLOSURES, MOTIONS, by->a, by->r);
#else
    return factor(CLOSURES, by->a, by->order);
#endif
}

static inline double greatest(int n, const double *f)
{
    double worst = 0.0;
    for (int i = 0; i < n; i++)
        if (!(fabs(f[i]) <= worst))
            worst = fabs(f[i]);
    return worst;
}

/* The given pose's own side, by its sign. Its determinant with the given joints is at hand, which is its own for struts
   of any length; that of other legs' own joints can have the other sign, however near the pose is to the answer. */
static double side_of(const double *near, double det)
{
#if LEG_MODES
    double own[JOINTS], y[MOTIONS], f[CLOSURES];
    Factors by;
    inverse(near, own);
    if (finite_all(own, JOINTS)) {
        begin(near, own, y);
        closures_and_slopes(y, own, f, by.a[0]);
        det = factor_slopes(&by);
    }
#endif
    return fabs(det) > NO_SIDE ? det * angle_sign(near) : HOME_SIDE;
}

/* Newton's method on the legs' closures in bounded steps. The matrix serves on while it gains enough. With more drives
   than freedoms it ends at the pose of least squares, where joints may disagree as far as following errors let them. Its
   frame is large, and there is one of it. */
__attribute__((noinline)) static int pose_near(const double *near, const double *q, double *x, double *side, int *tells)
{
    double y[MOTIONS], f[CLOSURES], det = 0.0, before = 0.0, first = 0.0;
    int anew = 1, last = 0, closed = 0;
    Factors by;
#if REDUNDANT
    double change[MOTIONS], closable[CLOSURES];
#else
    double *change = f;
#endif
    *tells = 0;
    begin(near, q, y);
    for (int step = 0;; step++) {
        if (anew) {
            closures_and_slopes(y, q, f, by.a[0]);
            det = factor_slopes(&by);
        } else {
            closures(y, q, f);
        }
        const double open = greatest(CLOSURES, f);
        double worst = open, shrink = 1.0;
#if REDUNDANT
        memcpy(closable, f, sizeof f);
        solve_least_squares(CLOSURES, MOTIONS, by.a, by.r, f, change);
        for (int i = 0; i < CLOSURES; i++)
            closable[i] -= f[i];
        worst = greatest(CLOSURES, closable);
#endif
        if (!isfinite(worst))
            break;
        if (step == 0) {
            first = det;
            *tells = open <= TELLS;
        }
        if (worst < FINE || (last && worst <= TOLERANCE) || step == MOST_STEPS) {
            closed = worst <= TOLERANCE && open <= AGREEMENT;
            break;
        }
        const double ratio = anew ? worst / SIZE : worst / before; /* what the next step will leave of it */
        last = ratio * worst < FINE;
        anew = anew ? worst * worst > WORTH * SIZE : ratio > SLOW;
#if REDUNDANT
        anew |= last; /* what joints that disagree leave is at right angles to the columns of its own place */
#endif
        before = worst;
#if !REDUNDANT
        substitute(CLOSURES, by.a, by.order, f);
#endif
        for (int i = 0; i < MOTIONS; i++)
            if (fabs(change[i]) * shrink > caps[i])
                shrink = caps[i] / fabs(change[i]);
        for (int i = 0; i < MOTIONS; i++)
            y[i] -= shrink * change[i];
    }
    if (closed)
        end(y, q, x);
    closed = closed && finite_all(x, AXES);
    if (*tells)
        *side = side_of(near, first);
    return closed && det * angle_sign(x) * *side > 0.0;
}
#define pose_beside(near, q, x) 0
#endif

#if LEG_MODES
static int same_legs(const double *p, const double *q)
{
    for (int i = 0; i < CLOSURES; i++)
        if (!(fabs(turning[i] ? within_half_a_turn(p[i] - q[i], 0.0) : p[i] - q[i]) <= same_mode[i]))
            return 0;
    return 1;
}

/* Whether legs stand where the working mode has them. Beside the end of a leg's reach, where two modes meet, the joints
   decide; a table's turns move the legs, so each of its solutions counts. */
__attribute__((noinline, cold)) static int legs_are_same(const double *x, const double *q)
{
    double again[JOINTS];
    inverse(x, again);
    int same = same_legs(again, q);
#if WRIST
    if (!same) {
        inverse_over(x, again);
        same = same_legs(again, q);
    }
    double lean[1];
    freedom(x, lean);
    if (!same && lean[0] < FREE * FREE) {
        inverse_held(x, &q[FIRST], again);
        same = same_legs(again, q);
    }
#endif
    return same;
}

/* Whether legs that close stand in the working mode: in another one the inverse would make them jump. */
static inline int in_mode(const double *x, const double *q)
{
    return legs_keep_mode(x, q) || legs_are_same(x, q);
}
#else
#define in_mode(x, q) 1
#endif

/* Of the ways to write an orientation the one nearest to the last, as find_nearest_direction of parakin. */
static void write_near(double *x, const double *near)
{
#if TOOL_AXIS
    double *turns = &x[AXES - 2]; /* B and C */
    const double *last = &near[AXES - 2];
    const int upright = turns[0] < UPRIGHT || turns[0] > 0.5 * TURN - UPRIGHT; /* C is free */
    const double own[2] = {turns[0], upright ? last[1] : turns[1]}, other[2] = {-own[0], own[1] + 0.5 * TURN};
    double stay[2], flip[2], excess[1];
    for (int i = 0; i < 2; i++) {
        stay[i] = within_half_a_turn(own[i], last[i]) - last[i];
        flip[i] = within_half_a_turn(other[i], last[i]) - last[i];
    }
    compare_ways(stay, flip, excess);
    for (int i = 0; i < 2; i++)
        turns[i] = within_half_a_turn(excess[0] < 0.0 ? other[i] : own[i], last[i]);
#else
    for (int i = 0; i < AXES; i++)
        if (turning_axis[i])
            x[i] = within_half_a_turn(x[i], near[i]);
#endif
}

/* Write an orientation as it is commanded where the tool's axis is the commanded one within rounding: upright it tells no
   C, and nearly so none that is worth showing. */
static void write_as_commanded(double *x)
{
#if TOOL_AXIS
    double k[3], commanded[3];
    find_tool_axis(x, k);
    find_tool_axis(commanded_pose, commanded);
    for (int i = 0; i < 3; i++)
        if (!(fabs(k[i] - commanded[i]) <= SAME_AXIS))
            return;
    for (int i = AXES - 2; i < AXES; i++)
        x[i] = commanded_pose[i];
#else
    (void)x;
#endif
}

/* The pose of joints near a given one, not on another side of the singularities than that; 0 where there is none. */
static int find_pose_near(const double *near, const double *q, double *x)
{
    double side = HOME_SIDE;
    int tells;
    return pose_near(near, q, x, &side, &tells) && tells;
}

/* The pose of joints for homing, where LinuxCNC's guess may say nothing: then from home, whose turns it has not. */
static int find_pose_for_homing(double *near, const double *q, double *x)
{
    double side = HOME_SIDE;
    int tells;
    if (finite_all(near, AXES) && pose_near(near, q, x, &side, &tells))
        return 1;
    if (!(side * HOME_SIDE > 0.0))
        return 0;
    copy_pose(home, near);
    return pose_near(near, q, x, &side, &tells);
}

/* The pose of joints while LinuxCNC moves the pose. Its guess says nothing where the tool's length has changed; then the
   last answer is the guess. */
static int find_pose_in_motion(double *near, const double *q, double *x)
{
    if (find_pose_near(near, q, x))
        return 1;
    copy_pose(own_pose, near);
    return pose_known && find_pose_near(near, q, x);
}

__attribute__((flatten)) int kinematicsForward(const double *joints, EmcPose *world,
                      const KINEMATICS_FORWARD_FLAGS *fflags, KINEMATICS_INVERSE_FLAGS *iflags)
{ /* flattened, as the inverse is; what no cycle needs is a call, which leaves registers to the rest */
    double q[JOINTS], near[AXES], x[AXES];
    (void)fflags;
    (void)iflags;
    read_joints(joints, q);
    if (hal_get_bool(pins->identity)) {
        if (!finite_all(q, JOINTS))
            return -1;
        take_joints_as_axes(q, x);
        write_pose(x, world);
        return 0;
    }
    read_pose(world, near);
    shift_tip(near, hal_get_real(pins->tool_offset));
    if (guess_is_old)
        copy_pose(own_pose, near);
    const int in_motion = hal_get_bool(pins->teleop) || hal_get_bool(pins->coordinated);
    if (!pose_beside(near, q, x) && !(in_motion ? find_pose_in_motion(near, q, x) : find_pose_for_homing(near, q, x)))
        return -1;
    if (!in_mode(x, q))
        return -1;
    write_near(x, near);
    if (in_motion)
        write_as_commanded(x);
    keep_pose(x);
    write_pose(x, world);
    return 0;
}
