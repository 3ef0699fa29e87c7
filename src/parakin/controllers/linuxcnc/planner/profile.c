/* The speed profile: how fast each place of the path may be passed, so that every joint keeps its speed and its
   acceleration and the machine can still stop where the known path ends.

   The path is cut into steps. Along a step the joints are parabolas of the way s; with the path's speed v, x = v^2 and its
   acceleration a, every joint's limits are |q' v| <= speed and |q' a + q'' x| <= acceleration. Backward from the end of the
   known path the greatest x is found from which each step leads to one that is allowed: the controllable speeds of Pham
   and Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis, IEEE T-RO 34 (2018). */

#define STEPS 1024        /* a power of two */
#define STEP_SECONDS 2e-3 /* a step moves no joint farther than its speed allows in this time */
#define MOST_BEND 0.01    /* of that way, a joint may be off the straight line amid a step */
#define TRIFLE 0.9        /* of a joint's way in a cycle at its speed: what it may jump by at the pole */
#define LAID_A_CYCLE 8    /* most steps laid in a cycle */
#define LEAST_STEP 1e-6   /* of the path's units: a joint that goes farther in less jumps */
#define KINK 0.02         /* of the acceleration in a cycle: what a corner may add to it */
#define NEARBY 1e-3       /* of the path's units: for the joints' rates beside a corner */
#define EDGE 1e-9         /* of the path's units: how well it is known where a wrist begins to be held */
#define BEYOND 1e-6       /* mm or degrees: rounding */
#define UNKNOWN -1.0      /* a speed that is not computed yet */

typedef struct {
    unsigned piece;
    double at, length;                            /* on the piece */
    double first[JOINTS], last[JOINTS], bend[JOINTS]; /* q' at start and end and q'', over the acceleration limits */
    double cap;    /* x on it under any feed override */
    double corner; /* x at its start by the corner there */
    double most;   /* x at its start, so that all that follows can be kept */
} Step;

static Step steps[STEPS];
static unsigned first_step, next_step; /* first_step is the one that the tool is on */
static unsigned cut_piece;             /* the piece that is being cut */
static double cut_at;                  /* and where on it */
static double cut_length;              /* of the last step */
static double cut_joints[JOINTS];      /* there */
static int cut_jumped;                 /* the joints have jumped there by a trifle */
static int path_refused;               /* the joints can't go on there, */
static const char *obstacle = "";      /* for this reason */

static Step *step_at(unsigned index) { return &steps[index % STEPS]; }

/* The range of a that keeps the joints' accelerations from a place on a step to its end, at x there. low and high are
   lines p + q x: the ones that bind at x are given. */
static void find_range(const Step *s, double place, double x, double low[2], double high[2])
{
    const double rest = s->length - place;
    low[0] = -1e9;
    high[0] = 1e9;
    low[1] = high[1] = 0.0;
    for (int end = 0; end < 2; end++)
        for (int j = 0; j < JOINTS; j++) {
            const double bend = s->bend[j], rate = end ? s->last[j] + 2.0 * rest * bend : s->first[j] + place * bend;
            if (!(fabs(rate) > 1e-9))
                continue;
            const double turn = -bend / rate, reach = 1.0 / fabs(rate);
            if (-reach + turn * x > low[0] + low[1] * x) {
                low[0] = -reach;
                low[1] = turn;
            }
            if (reach + turn * x < high[0] + high[1] * x) {
                high[0] = reach;
                high[1] = turn;
            }
        }
}

/* The greatest x at a place on a step by the joints' speeds alone, and by what bends where a joint does not move. */
static double find_cap(const Step *s, double place)
{
    double cap = s->cap;
    for (int j = 0; j < JOINTS; j++) {
        const double rate = fabs(s->first[j] + place * s->bend[j]), bend = fabs(s->bend[j]);
        const double most = joint_speed[j] / (joint_acceleration[j] * rate);
        cap = fmin(cap, fmin(most * most, 1.0 / bend));
    }
    return cap;
}

/* The greatest x at a place on a step from which it can be passed to an x of at most next at its end. The excess of the
   lower bound of a over the upper one is a convex function of x, whose root Newton's method finds from above. */
static double find_controllable(const Step *s, double place, double next)
{
    const double towards = 0.5 / (s->length - place);
    double x = find_cap(s, place);
    for (int round = 0; round < 4 * JOINTS + 4 && x > 0.0; round++) {
        double low[2], high[2];
        find_range(s, place, x, low, high);
        if ((next - x) * towards < high[0] + high[1] * x) {
            high[0] = next * towards;
            high[1] = -towards;
        }
        const double excess = low[0] - high[0] + (low[1] - high[1]) * x;
        if (excess <= 1e-9 * (fabs(low[0]) + fabs(high[0])))
            return x;
        if (!(low[1] > high[1]))
            return 0.0;
        x -= excess / (low[1] - high[1]);
    }
    return fmax(x, 0.0);
}

/* Bring the controllable speeds up to date, from the end of the path back to where nothing changes. */
static void update_profile(void)
{
    double next = 0.0;
    for (unsigned i = next_step; i-- != first_step;) {
        Step *s = step_at(i);
        const double most = fmin(find_controllable(s, 0.0, next), s->corner);
        if (s->most >= most - 1e-12 * most && s->most <= most)
            return;
        s->most = next = most;
    }
}

/* The joint that is beyond the range that LinuxCNC has for it; -1 where none is. */
static int find_joint_beyond(const double *q)
{
    for (int j = 0; j < JOINTS; j++) {
        const emcmot_joint_status_t *joint = &emcmotStatus->joint_status[j];
        const double at = q[j] / (turning[j] ? DEGREE : 1.0);
        if (!(at >= joint->min_pos_limit - BEYOND && at <= joint->max_pos_limit + BEYOND))
            return j;
    }
    return -1;
}

#if WRIST
/* Whether a wrist's first joint is held at a place. */
static int is_held(const Piece *p, double at)
{
    double x[AXES], own[AXES], lean[1];
    if (hal_get_bool(pins->identity))
        return 0;
    locate(p, at, x);
    shift_to_own_tip(x, own);
    freedom(own, lean);
    return lean[0] < FREE * FREE;
}
#endif

/* The joints at a place of the piece that is cut, near given ones; 0 where there are none or they lie too far. */
static int reach_joints(const Piece *p, double at, const double *near, double *q)
{
    double x[AXES];
    locate(p, at, x);
    obstacle = "the path leaves the workspace";
    if (!solve_inverse(x, near, q))
        return 0;
    obstacle = "a joint would pass its range";
    if (find_joint_beyond(q) >= 0)
        return 0;
    obstacle = "a joint would jump";
    for (int j = 0; j < JOINTS; j++)
        if (!(fabs(q[j] - near[j]) <= 0.5 * STEP_SECONDS * joint_speed[j]))
            return 0;
    return 1;
}

/* The joints' rates at a place of a piece on one side of it, by the joints there and at both ends of two ways, which are
   less than zero behind it; 0 where there are none. */
static int measure_rates(const Piece *p, double at, double way, double *rates)
{
    double x[AXES], here[JOINTS], near[JOINTS], far[JOINTS];
    locate(p, at, x);
    if (!reach_pose(x, cut_joints, here))
        return 0;
    locate(p, at + way, x);
    if (!reach_pose(x, here, near))
        return 0;
    locate(p, at + 2.0 * way, x);
    if (!reach_pose(x, near, far))
        return 0;
    for (int j = 0; j < JOINTS; j++)
        rates[j] = (4.0 * near[j] - 3.0 * here[j] - far[j]) / (2.0 * way);
    return 1;
}

/* The greatest x at which the corner between a piece and the one before may be passed: a joint changes its speed there
   within a cycle. */
static double find_corner_cap(const Piece *p)
{
    const Piece *last = p - 1 < pieces ? &pieces[PIECES - 1] : p - 1;
    double before[JOINTS], after[JOINTS], cap = HUGE_VAL;
    if (!measure_rates(last, last->length, -fmin(NEARBY, 0.25 * last->length), before)
        || !measure_rates(p, 0.0, fmin(NEARBY, 0.25 * p->length), after))
        return 0.0;
    for (int j = 0; j < JOINTS; j++)
        cap = fmin(cap, KINK * joint_acceleration[j] * cycle_seconds / fabs(after[j] - before[j]));
    return cap * cap;
}

/* The joints amid a step of a length and at its end; 0 where it is too long for a parabola, or there are none. */
static int try_step(const Piece *p, double length, double *middle, double *end)
{
    if (!reach_joints(p, cut_at + 0.5 * length, cut_joints, middle) || !reach_joints(p, cut_at + length, middle, end))
        return 0;
    for (int j = 0; j < JOINTS; j++)
        if (!(fabs(end[j] - 2.0 * middle[j] + cut_joints[j]) <= MOST_BEND * STEP_SECONDS * joint_speed[j]))
            return 0;
    return 1;
}

/* Go on with the joints a hair's breadth farther, if they jump there by a trifle; 0 if they jump by more. Nearer to its
   pole than FREE a wrist is held, and leaves the pole in a direction that digits tell. */
static int take_jump(const Piece *p, double at)
{
    double x[AXES], q[JOINTS];
    locate(p, fmin(at + LEAST_STEP, p->length), x);
    if (!solve_inverse(x, cut_joints, q) || find_joint_beyond(q) >= 0)
        return 0;
    for (int j = 0; j < JOINTS; j++)
        if (!(fabs(q[j] - cut_joints[j]) <= TRIFLE * cycle_seconds * joint_speed[j]))
            return 0;
    memcpy(cut_joints, q, sizeof q);
    cut_jumped = 1;
    return 1;
}

/* How far on from a place a wrist begins to be held, within a length; 0 where it does not. */
static double find_hold(const Piece *p, double at, double length)
{
#if WRIST
    double low = EDGE, high = length;
    if (!(high > low) || is_held(p, at + low) || !is_held(p, at + high))
        return 0.0;
    while (high - low > EDGE) {
        const double middle = 0.5 * (low + high);
        if (is_held(p, at + middle))
            high = middle;
        else
            low = middle;
    }
    return low;
#else
    (void)p;
    (void)at;
    (void)length;
    return 0.0;
#endif
}

/* Bring the next step's length to where a wrist begins to be held, or to the last bit of the way there. That takes a
   cycle at least, so that the first joint, which stands in the cycle that follows, stops within its acceleration. Returns
   the greatest x of the step by that. In timed motions that joint stands on the way there, too. */
static double slow_down_to_hold(const Piece *p, double *length)
{
    const double hold = find_hold(p, cut_at, *length);
    double rates[JOINTS], most = HUGE_VAL; /* of speed, by what the joints can change theirs in a cycle */
    if (!(hold > LEAST_STEP) || !measure_rates(p, cut_at + hold, -fmin(NEARBY, 0.25 * (cut_at + hold)), rates))
        return HUGE_VAL;
    for (int j = 0; j < JOINTS; j++)
        if (turning[j])
            most = fmin(most, joint_acceleration[j] * cycle_seconds / fabs(rates[j]));
    const double bit = most * cycle_seconds, slow = fmin(0.5 * most, hold / cycle_seconds);
    *length = hold > bit + LEAST_STEP ? hold - bit : hold;
    return *length < hold ? HUGE_VAL : slow * slow;
}

/* Cut the next step from the path; 0 where there is none. */
static int cut_step(void)
{
    const Piece *p = piece_at(cut_piece);
    Step *s = step_at(next_step);
    const double rest = p->length - cut_at, limit = p->shape == SPLINE ? fmin(STEP_SECONDS, p->finest) : p->finest;
    double length = fmin(fmin(2.0 * cut_length, rest), limit), middle[JOINTS], end[JOINTS];
    while (!try_step(p, length, middle, end)) {
        length *= 0.5;
        if (length < LEAST_STEP) {
            path_refused = cut_jumped || !take_jump(p, cut_at + length); /* one jump must be enough */
            return 0;
        }
    }
    if (length > 0.5 * rest && length < rest) { /* two equal ones rather than a long and a short one, if they do */
        if (try_step(p, 0.5 * rest, middle, end))
            length = 0.5 * rest;
        else if (!try_step(p, length, middle, end))
            return 0;
    }
    const double whole = length, slow = p->shape == SPLINE ? HUGE_VAL : slow_down_to_hold(p, &length);
    if (length < whole && !try_step(p, length, middle, end))
        return 0;
    s->piece = cut_piece;
    s->at = cut_at;
    s->length = length;
    s->cap = fmin(p->most_speed * p->most_speed, slow);
    s->corner = cut_at > 0.0 ? HUGE_VAL : p->begins_still ? 0.0 : p->begins_bent ? find_corner_cap(p) : HUGE_VAL;
    s->most = UNKNOWN;
    const double slack = p->shape == SPLINE ? TIMED_SLACK : 1.0;
    for (int j = 0; j < JOINTS; j++) {
        const double unit = 1.0 / (slack * joint_acceleration[j]), h = 1.0 / length;
        s->first[j] = (4.0 * middle[j] - 3.0 * cut_joints[j] - end[j]) * h * unit;
        s->last[j] = (3.0 * end[j] - 4.0 * middle[j] + cut_joints[j]) * h * unit;
        s->bend[j] = 4.0 * (end[j] - 2.0 * middle[j] + cut_joints[j]) * h * h * unit;
        cut_joints[j] = end[j];
        if (cut_jumped) {
            const double left = (1.0 - TRIFLE) * joint_speed[j] / (joint_acceleration[j] * fabs(s->first[j]));
            s->corner = fmin(s->corner, left * left);
        }
    }
    cut_jumped = 0;
    next_step++;
    cut_length = length;
    cut_at += length;
    if (cut_at >= p->length * (1.0 - 1e-12)) {
        cut_piece++;
        cut_at = 0.0;
    }
    return 1;
}

/* Lay the path ahead and cut it into steps, a few a cycle; then the profile. */
static void look_ahead(void)
{
    int cut = 0;
    while (cut < LAID_A_CYCLE && next_step - first_step < STEPS - 1 && !path_refused) {
        if (cut_piece == next_piece && !lay_piece())
            break;
        if (!cut_step())
            break;
        cut++;
    }
    if (cut)
        update_profile();
}
