/* The queue: the motions that LinuxCNC has given, in their order, and what is known of each. */

#define QUEUE 2048 /* motions, a power of two */
#define MARGIN 16  /* LinuxCNC sends a few more before it reads that the queue is full */
#define STILL 1e-8     /* mm: X Y Z stand where each moves less, says LinuxCNC's canon, and gives degrees a second */
#define SHORTEST 1e-7  /* mm or degrees: shorter ways are none */
#define MOST_TURN 1e3  /* degrees a mm: where the tool turns by more, the path's units are degrees */

enum kind { LINE, ARC, TIMED };

typedef struct {
    enum kind kind;
    int id;
    struct state_tag_t tag;
    int canon_type;
    unsigned char enables;
    int waits_for_spindle; /* before it begins */
    int stops;             /* at its end */
    double tolerance;      /* mm by which the corner at its end may be cut; 0: not at all */
    double start[AXES], end[AXES];
    double length;           /* of the path: mm; degrees where X Y Z hardly move; s of a timed motion */
    double tip_slope;        /* the way of the tip a unit of the path, mm; 0 where X Y Z stand still */
    double speed;            /* asked for, in the path's units a second */
    double most_speed;       /* under any feed override */
    double centre[3];        /* of an arc, mm */
    double plane[2][3];      /* of an arc: from the centre to the start, and a quarter turn on, mm */
    double rise[3];          /* of an arc: the way along its axis, mm */
    double growth;           /* of an arc: the end's radius over the start's, less 1 */
    double angle;            /* of an arc, rad */
    int age;                 /* cycles for which it was the last one */
    syncdio_t outputs;       /* written when it begins */
} Motion;

static Motion motions[QUEUE];
static unsigned first_motion, next_motion; /* first_motion <= i < next_motion are in the queue */

static Motion *motion_at(unsigned index) { return &motions[index % QUEUE]; }
static int queue_length(void) { return (int)(next_motion - first_motion); }

/* Add to a pose what an arc is off the straight line, a share of the way on. */
static void bend(const Motion *m, double share, double *x)
{
    const double angle = share * m->angle, radius = 1.0 + share * m->growth;
    for (int k = 0; k < 3; k++)
        if (place_columns[k] >= 0)
            x[place_columns[k]] = m->centre[k] + share * m->rise[k]
                          + radius * (cos(angle) * m->plane[0][k] + sin(angle) * m->plane[1][k]);
}

/* Compute the pose at a place on a motion, 0 to its length. */
static void compute_pose(const Motion *m, double at, double *x)
{
    const double share = at / m->length;
    for (int i = 0; i < AXES; i++)
        x[i] = m->start[i] + share * (m->end[i] - m->start[i]);
    if (m->kind == ARC)
        bend(m, share, x);
}

typedef struct {
    double linear, rotary; /* mm, degrees */
    double told;           /* that of them whose speed LinuxCNC tells */
    int stands;            /* whether X Y Z do */
} Way;

static Way measure_way(const double *from, const double *to)
{
    double linear = 0.0, rotary = 0.0;
    int stands = 1;
    for (int i = 0; i < AXES; i++) {
        const double way = to[i] - from[i];
        if (turning_axis[i]) {
            rotary += way / DEGREE * (way / DEGREE);
        } else {
            linear += way * way;
            stands &= fabs(way) < STILL;
        }
    }
    const Way way = {sqrt(linear), sqrt(rotary), sqrt(stands ? rotary : linear), stands};
    return way;
}

/* Measure a straight motion, whose speeds are told by LinuxCNC's way; 0 where there is nowhere to go. */
static int measure_line(Motion *m)
{
    const Way way = measure_way(m->start, m->end);
    if (!(way.linear > SHORTEST || way.rotary > SHORTEST))
        return 0;
    m->length = way.linear > SHORTEST && way.rotary <= MOST_TURN * way.linear ? way.linear : way.rotary;
    m->tip_slope = way.stands ? 0.0 : way.linear / m->length;
    m->speed *= m->length / way.told;
    m->most_speed *= m->length / way.told;
    return 1;
}

/* Describe the arc of a motion whose start and end are known; 0 where it is none. */
static int describe_arc(Motion *m, const PmCartesian *centre, const PmCartesian *normal, int turns)
{
    const double c[3] = {centre->x, centre->y, centre->z};
    double axis[3] = {normal->x, normal->y, normal->z}, from[3], to[3], length = 0.0, rise = 0.0;
    for (int k = 0; k < 3; k++)
        length += axis[k] * axis[k];
    if (!(length > 0.0))
        return 0;
    for (int k = 0; k < 3; k++) {
        axis[k] /= sqrt(length);
        from[k] = (place_columns[k] >= 0 ? m->start[place_columns[k]] : c[k]) - c[k];
        to[k] = (place_columns[k] >= 0 ? m->end[place_columns[k]] : c[k]) - c[k];
    }
    double low = 0.0, high = 0.0, first = 0.0, last = 0.0;
    for (int k = 0; k < 3; k++) {
        low += axis[k] * from[k];
        high += axis[k] * to[k];
    }
    for (int k = 0; k < 3; k++) {
        m->centre[k] = c[k] + low * axis[k]; /* in the start's plane */
        from[k] -= low * axis[k];
        to[k] -= high * axis[k];
        m->rise[k] = (high - low) * axis[k];
        first += from[k] * from[k];
        last += to[k] * to[k];
    }
    rise = high - low;
    if (!(first > SHORTEST * SHORTEST && last > SHORTEST * SHORTEST))
        return 0;
    for (int k = 0; k < 3; k++) {
        m->plane[0][k] = from[k];
        m->plane[1][k] = axis[(k + 1) % 3] * from[(k + 2) % 3] - axis[(k + 2) % 3] * from[(k + 1) % 3];
    }
    double along = 0.0, across = 0.0;
    for (int k = 0; k < 3; k++) {
        along += to[k] * m->plane[0][k];
        across += to[k] * m->plane[1][k];
    }
    const double least = 1e-9; /* rad: an end nearer to the start than this lies on it */
    double angle = atan2(across, along);
    if (turns >= 0) /* turns counts the whole ones that follow; negative ones go the other way */
        m->angle = (angle < least ? angle + TURN : angle) + TURN * turns;
    else
        m->angle = (angle > -least ? angle - TURN : angle) + TURN * (turns + 1);
    m->growth = sqrt(last / first) - 1.0;
    const double middle = sqrt(first) * (1.0 + 0.5 * m->growth) * m->angle;
    m->length = sqrt(middle * middle + rise * rise);
    return 1;
}
