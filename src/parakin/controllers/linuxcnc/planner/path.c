/* The path: the queue's motions joined to one curve, in pieces.

   A motion runs straight or on its arc. Two lines that may be joined within a tolerance are joined by a parabola that
   begins and ends as far from their corner. Timed motions are joined by a cubic spline in time, through their ends, with
   continuous speeds and accelerations of every axis; it stands still where a motion stops. */

#define PIECES 2048  /* a power of two, more than the steps */
#define PATIENCE 20  /* cycles for which the last motion waits for the one that follows it */
#define LATE 2000    /* cycles for which a timed one does, whose spline goes on through the ones that follow */
#define RESERVE 200  /* timed motions that are gathered before the first of them begins */
#define BENDING 4    /* timed motions behind a rest, whose splines bend as the trajectory may not: */
#define FINER 0.06   /* steps are no longer than this share of them there, */
#define FINEST 2.5e-4 /* or than so many seconds, so that a cycle lays more than it runs */
#define KNOTS 12     /* intervals ahead that shape a spline: what lies behind them changes it by less than 1e-6 */

enum shape { ON_MOTION, PARABOLA, SPLINE };

typedef struct {
    enum shape shape;
    unsigned motion;
    double from, length;     /* on the motion, in the path's units */
    double speed, most_speed; /* asked for, and under any override */
    double finest;           /* longest step that sees its bends */
    double c[4][AXES];       /* of the parabola or the spline, by powers of the way from its start */
    int begins_still;        /* the path stands still at its start */
    int begins_bent;         /* the path may turn sharply there */
} Piece;

static Piece pieces[PIECES];
static unsigned next_piece;
static unsigned laid_motion; /* the motion on which the path goes on */
static double laid_from;     /* and where on it */
static int laid_still;       /* whether the path stands still there */
static int laid_bent;        /* whether it may turn sharply there */
static double laid_rate[AXES]; /* of a spline: the speeds there */
static int laid_since_rest;    /* timed motions */

static Piece *piece_at(unsigned index) { return &pieces[index % PIECES]; }

static void locate(const Piece *p, double at, double *x)
{
    if (p->shape == ON_MOTION) {
        compute_pose(motion_at(p->motion), p->from + at, x);
        return;
    }
    for (int i = 0; i < AXES; i++)
        x[i] = p->c[0][i] + at * (p->c[1][i] + at * (p->c[2][i] + at * p->c[3][i]));
}

/* The way of the tip a unit of the path, mm. */
static double measure_tip_slope(const Piece *p, double at)
{
    if (p->shape != SPLINE)
        return motion_at(p->motion)->tip_slope;
    double square = 0.0;
    for (int i = 0; i < AXES; i++) {
        const double rate = p->c[1][i] + at * (2.0 * p->c[2][i] + at * 3.0 * p->c[3][i]);
        square += turning_axis[i] ? 0.0 : rate * rate;
    }
    return sqrt(square);
}

static Piece *add_piece(enum shape shape, unsigned motion, double length)
{
    Piece *p = piece_at(next_piece++);
    const Motion *m = motion_at(motion);
    p->shape = shape;
    p->motion = motion;
    p->from = laid_from;
    p->length = length;
    p->speed = m->speed;
    p->most_speed = m->most_speed;
    p->finest = m->kind == ARC ? 0.1 * m->length / fabs(m->angle) : length;
    p->begins_still = laid_still;
    p->begins_bent = laid_bent;
    laid_still = laid_bent = 0;
    return p;
}

/* Choose how far from the corner between two lines the parabola begins. */
static double choose_blend(const Motion *m, const Motion *next)
{
    if (m->kind != LINE || next->kind != LINE || !(m->tolerance > 0.0) || next->waits_for_spindle || m->stops)
        return 0.0;
    double linear = 0.0, rotary = 0.0, most = 0.5 * fmin(m->length, next->length);
    for (int i = 0; i < AXES; i++) {
        const double change = (next->end[i] - next->start[i]) / next->length - (m->end[i] - m->start[i]) / m->length;
        if (turning_axis[i])
            rotary += change / DEGREE * (change / DEGREE);
        else
            linear += change * change;
    }
    /* The parabola passes the corner by a quarter of this change times the distance; a degree counts as a mm. */
    const double change = sqrt(fmax(linear, rotary));
    return change * most > 4.0 * m->tolerance ? 4.0 * m->tolerance / change : most;
}

/* Lay a line or an arc, and the parabola at its end; 0 where it is not known yet what follows. */
static int lay_motion(void)
{
    const Motion *m = motion_at(laid_motion);
    const int followed = laid_motion + 1 != next_motion;
    if (!followed && !m->stops && m->age < PATIENCE)
        return 0;
    const Motion *next = followed ? motion_at(laid_motion + 1) : 0;
    const double blend = followed ? choose_blend(m, next) : 0.0, rest = m->length - blend - laid_from;
    if (rest > 1e-12 * m->length || blend <= 0.0)
        add_piece(ON_MOTION, laid_motion, fmax(rest, 1e-12 * m->length));
    laid_motion++;
    laid_from = 0.0;
    laid_still = !followed || m->stops || next->waits_for_spindle || next->kind == TIMED;
    laid_bent = !(blend > 0.0);
    if (blend > 0.0) {
        double from[AXES], to[AXES];
        compute_pose(m, m->length - blend, from);
        compute_pose(next, blend, to);
        Piece *p = add_piece(PARABOLA, laid_motion, 2.0 * blend);
        p->speed = fmin(m->speed, next->speed);
        p->most_speed = fmin(m->most_speed, next->most_speed);
        p->finest = 0.25 * p->length;
        for (int i = 0; i < AXES; i++) {
            p->c[0][i] = from[i];
            p->c[1][i] = (m->end[i] - from[i]) / blend;
            p->c[2][i] = (to[i] - 2.0 * m->end[i] + from[i]) / (4.0 * blend * blend);
            p->c[3][i] = 0.0;
        }
        laid_from = blend;
    }
    return 1;
}

/* Lay a timed motion: the first interval of the spline through the motions ahead. One that runs by itself, as in single
   block, is straight, and as quick as the joints can. */
static int lay_spline(void)
{
    double seconds[KNOTS], upper[KNOTS], rate[KNOTS + 1][AXES];
    int count = 0, halts = 0;
    while (count < KNOTS && !halts && laid_motion + count != next_motion
           && motion_at(laid_motion + count)->kind == TIMED) {
        const Motion *m = motion_at(laid_motion + count);
        seconds[count++] = m->length;
        halts = m->stops;
    }
    const int last = laid_motion + count == next_motion;
    const int age = motion_at(next_motion - 1)->age;
    if (count < KNOTS && !halts && last && age < LATE)
        return 0;
    if (laid_motion == first_motion && laid_still && next_motion - first_motion < RESERVE && age < PATIENCE)
        return 0;
    halts = halts || count < KNOTS;
    /* Speeds at the knots, v: of v[i-1]/h[i-1] + 2 v[i] (1/h[i-1] + 1/h[i]) + v[i+1]/h[i] = 3 (s[i-1]/h[i-1] + s[i]/h[i])
       with the intervals h and the slopes s; the first speed is given, the last is zero or the last slope. */
    for (int i = 0; i < AXES; i++) {
        const Motion *end = motion_at(laid_motion + count - 1);
        rate[0][i] = laid_rate[i];
        rate[count][i] = halts ? 0.0 : (end->end[i] - end->start[i]) / end->length;
    }
    for (int k = 1; k < count; k++) {
        const Motion *m = motion_at(laid_motion + k - 1), *n = motion_at(laid_motion + k);
        const double before = 1.0 / seconds[k - 1], after = 1.0 / seconds[k];
        const double pivot = 1.0 / (2.0 * (before + after) - (k > 1 ? before * upper[k - 1] : 0.0));
        upper[k] = after * pivot;
        for (int i = 0; i < AXES; i++)
            rate[k][i] = pivot * (3.0 * ((m->end[i] - m->start[i]) * before * before
                                         + (n->end[i] - n->start[i]) * after * after)
                                  - before * rate[k - 1][i]);
    }
    for (int k = count - 1; k >= 1; k--)
        for (int i = 0; i < AXES; i++)
            rate[k][i] -= upper[k] * rate[k + 1][i];
    const Motion *m = motion_at(laid_motion);
    const int alone = count == 1 && laid_still && !m->stops;
    Piece *p = add_piece(SPLINE, laid_motion, m->length);
    laid_since_rest = p->begins_still ? 0 : laid_since_rest + 1;
    p->finest = laid_since_rest < BENDING ? fmax(FINER * m->length, FINEST) : m->length;
    for (int i = 0; i < AXES; i++) {
        const double h = m->length, slope = (m->end[i] - m->start[i]) / h;
        if (alone)
            rate[0][i] = rate[1][i] = slope;
        p->c[0][i] = m->start[i];
        p->c[1][i] = rate[0][i];
        p->c[2][i] = (3.0 * slope - 2.0 * rate[0][i] - rate[1][i]) / h;
        p->c[3][i] = (rate[0][i] + rate[1][i] - 2.0 * slope) / (h * h);
        laid_rate[i] = alone ? 0.0 : rate[1][i];
    }
    laid_motion++;
    const Motion *next = laid_motion != next_motion ? motion_at(laid_motion) : 0;
    laid_still = !next || next->kind != TIMED || next->waits_for_spindle;
    return 1;
}

/* Lay the next piece of the path; 0 where none can be yet. */
static int lay_piece(void)
{
    if (laid_motion == next_motion)
        return 0;
    if (motion_at(laid_motion)->kind == TIMED)
        return lay_spline();
    for (int i = 0; i < AXES; i++)
        laid_rate[i] = 0.0;
    return lay_motion();
}
