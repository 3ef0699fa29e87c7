/* An independent model of LinuxCNC 2.9's trajectory planner: straight motions go in, the axes' place in every cycle
   comes out. It knows what the planner's documentation says (trapezoidal speeds, parabolic and circular blends, the
   look-ahead through tangent segments), and nothing of parakin. It takes for granted that motions are in the queue long
   before their turn. mm, degrees and seconds; an axis is one of X Y Z A B C U V W. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define CYCLE 1e-3
#define DEPTH 50          /* segments that the look-ahead goes back */
#define GAP 4             /* cycles: a shorter line before an arc becomes a part of it */
#define RAMP 0.01         /* s: shorter segments change their speed evenly */
#define KINK 0.1          /* share of the acceleration that a corner between tangent segments may take */
#define TINY 1e-7         /* mm or deg: an axis that goes less stands still */
#define SLOWEST (0.1 / 60.0) /* mm/s or deg/s, in inverse time */
#define SPEED_EPS 1e-8
#define PLACE_EPS 1e-12
#define TIME_EPS 1e-12

enum { STOP, EXACT, PARABOLIC, TANGENT };

typedef struct {
    double v[3];
} Vector;

typedef struct {
    double start[9], end[9];
    Vector way;                    /* direction of a line in X Y Z; X where only the tool turns */
    Vector center, radial, other;  /* of an arc: its centre, and from there to its start and to its end */
    double radius, angle, lead;    /* of an arc, and of the line before it that is a part of it */
    double length, nominal;        /* as it is now, and before blends */
    double asked, most, acceleration, tolerance;
    double kink, reduce, reduce_before; /* speed through the corner at its end, shares of acceleration for corners */
    double final;                  /* greatest speed at its end, by the look-ahead */
    long motion;
    int is_arc, ending, blends_before, settled, tip_moves, tool_turns, at_peak;
    /* while it runs */
    double progress, speed, cycle, end_speed;
    int active, ramps, blending, slowing, split, gone;
} Segment;

static double tip_speed, axis_speed[9], axis_acceleration[9];

static double within(double x, double most) { return fmax(fmin(x, most), -most); }
static Vector sum(Vector a, double s, Vector b, double t)
{
    Vector c;
    for (int i = 0; i < 3; i++)
        c.v[i] = s * a.v[i] + t * b.v[i];
    return c;
}
static double dot(Vector a, Vector b) { return a.v[0] * b.v[0] + a.v[1] * b.v[1] + a.v[2] * b.v[2]; }
static Vector unit(Vector a) { return sum(a, 1.0 / sqrt(dot(a, a)), a, 0.0); }
static Vector tip_of(const double *pose) { return (Vector){{pose[0], pose[1], pose[2]}}; }
static double distance(const double *a, const double *b) { return sqrt(pow(b[0] - a[0], 2) + pow(b[1] - a[1], 2) + pow(b[2] - a[2], 2)); }

/* Half where it blends, and on arcs; less at kinks. */
static double acceleration_of(const Segment *s)
{
    double share = 1.0 - fmax(s->reduce, s->reduce_before);
    if (s->blends_before || s->ending == PARABOLIC)
        share *= 0.5;
    return s->acceleration * share * (s->is_arc ? 0.5 : 1.0);
}

static double goal_speed(const Segment *s) { return fmin(s->tip_moves ? fmin(s->asked, tip_speed) : s->asked, s->most); }

/* The queue: what the interpreter makes of a block, how two segments meet, and the look-ahead. */

/* Set up a line; tell whether it goes anywhere. */
static int add_line(Segment *s, const double *start, const double *end, double rate, int ending, double tolerance)
{
    const double tip = distance(start, end), turn = distance(start + 3, end + 3);
    double seconds = 0.0, rise = 0.0, step[9];
    const double zero[3] = {0.0, 0.0, 0.0};
    memset(s, 0, sizeof *s);
    for (int i = 0; i < 9; i++) {
        step[i] = fabs(end[i] - start[i]);
        if (step[i] < TINY)
            step[i] = 0.0;
        if (step[i] > 0.0) {
            seconds = fmax(seconds, step[i] / axis_speed[i]);
            rise = fmax(rise, step[i] / axis_acceleration[i]);
        }
    }
    double way = distance(zero, step);
    if (way == 0.0)
        way = distance(zero, step + 3);
    s->tip_moves = tip > 1e-8, s->tool_turns = turn > 1e-8;
    s->length = s->nominal = s->tip_moves ? tip : turn;
    if (way == 0.0 || s->length < PLACE_EPS)
        return 0;
    s->acceleration = way / rise;
    s->asked = fmin(fmax(SLOWEST, (tip > 0.0 ? tip : turn) * rate / 60.0), way / seconds);
    s->most = fmin(way / seconds, s->length / CYCLE);
    s->ending = ending, s->tolerance = tolerance, s->kink = -1.0, s->cycle = CYCLE;
    memcpy(s->start, start, sizeof s->start), memcpy(s->end, end, sizeof s->end);
    s->way = s->tip_moves ? sum(tip_of(end), 1.0 / tip, tip_of(start), -1.0 / tip) : (Vector){{1.0, 0.0, 0.0}};
    return 1;
}

static void settle(Segment *s) { s->most = fmin(s->most, s->length / CYCLE), s->settled = 1; }

static void set_kink(Segment *s, Segment *next, double speed, double reduce)
{
    s->kink = speed;
    s->reduce = fmax(reduce, s->reduce), next->reduce_before = fmax(reduce, next->reduce_before);
}

static void clear_kink(Segment *s, Segment *next) { s->kink = -1.0, s->reduce = next->reduce_before = 0.0; }

static double half_angle(Vector u, Vector v) { return acos(-within(dot(u, v), 1.0)) / 2.0; }

/* Below which speed one segment blends into the next, which speed that has by then, and the speed past the corner. */
static double blend_speeds(const Segment *s, const Segment *next, double this, double other, double *blend)
{
    const double a = acceleration_of(s), b = acceleration_of(next), theta = half_angle(s->way, next->way);
    this = fmin(sqrt(a * (s->settled ? s->length : 0.5 * s->length)), this);
    other = fmin(sqrt(b * (next->settled ? next->length : 0.5 * next->length)), other);
    const double seconds = fmin(fmin(s->length / this, next->length / other), fmax(this / a, other / b));
    blend[0] = fmin(this, seconds * a), blend[1] = fmin(other, seconds * b);
    if (s->is_arc || next->is_arc) /* the planner knows no direction of theirs, and forgets the tolerance */
        return 0.0;
    if (s->tolerance > 0.0 && cos(theta) > cos(M_PI / 2.0 - 1e-3)) {
        const double most = 2.0 * sqrt(a * s->tolerance / cos(theta));
        blend[0] = fmin(blend[0], most), blend[1] = fmin(blend[1], most);
    }
    return sin(theta) * (blend[0] + blend[1]) / 2.0;
}

/* A segment without a tolerance gives a quarter of it away. */
static double blend_tolerance(const Segment *s)
{
    return s->tolerance == 0.0 ? 0.25 * s->nominal : fmin(s->tolerance, 0.25 * s->nominal);
}

/* Set up the arc between two lines; tell whether there is one. */
static int make_arc(Segment *arc, const Segment *s, const Segment *next)
{
    const Vector u = s->way, v = next->way;
    const double theta = half_angle(u, v), phi = M_PI - 2.0 * theta;
    if (theta < 1e-3 || phi < 1e-3)
        return 0;
    const Vector normal = unit((Vector){{u.v[1] * v.v[2] - u.v[2] * v.v[1], u.v[2] * v.v[0] - u.v[0] * v.v[2],
                                         u.v[0] * v.v[1] - u.v[1] * v.v[0]}});
    double acceleration = INFINITY, planar = INFINITY;
    for (int i = 0; i < 3; i++) {
        const double across = fmax(sqrt(fmax(1.0 - normal.v[i] * normal.v[i], 0.0)), PLACE_EPS);
        acceleration = fmin(acceleration, axis_acceleration[i] / across);
        planar = fmin(planar, axis_speed[i] / across);
    }
    const double tolerance = fmin(blend_tolerance(s), blend_tolerance(next));
    const double asked = fmax(fmin(s->asked, s->most), fmin(next->asked, next->most));
    const double bent = cos(fmin(phi, 0.49 * M_PI));
    const double one = fmin(s->most, next->most / bent), two = fmin(next->most, s->most / bent);
    const Vector base = sum(v, two, u, -one);
    const double goal = fmin(asked, fmax(one * two * sin(phi) / sqrt(dot(base, base)), planar));
    const double room = fmin(fmin(fmin(s->length, 0.5 * s->nominal), 0.5 * next->length),
                             cos(theta) * tolerance / (1.0 - sin(theta)));
    const double radius = tan(theta) * room, normal_acceleration = acceleration * sqrt(0.75);
    const double speed = fmin(sqrt(normal_acceleration * radius), goal);
    const double seconds = fmin(sqrt(acceleration * room), speed) / (0.5 * acceleration);
    *arc = *s;
    arc->is_arc = 1, arc->angle = phi;
    arc->radius = fmax(speed * speed / normal_acceleration, fmin(seconds * speed / phi, radius));
    const double trim = arc->radius / tan(theta);
    if (arc->radius < PLACE_EPS || arc->radius * phi < 1e-6)
        return 0;
    const Vector corner = tip_of(s->end), inward = unit(sum(v, 1.0, u, -1.0));
    const Vector first = sum(corner, 1.0, u, -trim), last = sum(corner, 1.0, v, trim);
    arc->center = sum(corner, 1.0, inward, arc->radius / sin(theta));
    arc->radial = sum(first, 1.0, arc->center, -1.0), arc->other = sum(last, 1.0, arc->center, -1.0);
    memcpy(arc->start, s->end, sizeof s->end);
    memcpy(arc->start, first.v, sizeof first.v), memcpy(arc->end, last.v, sizeof last.v);
    const double lead = s->length - trim;
    arc->lead = !s->blends_before && lead / speed < GAP * CYCLE ? lead : 0.0;
    arc->ending = TANGENT, arc->blends_before = 0, arc->kink = -1.0, arc->reduce = arc->reduce_before = 0.0;
    arc->length = arc->nominal = arc->radius * phi + arc->lead;
    arc->asked = asked, arc->most = speed, arc->acceleration = acceleration;
    settle(arc);
    return 1;
}

/* Find how the last segment of a queue goes over into the next, which then stands behind it, or behind an arc between
   the two. Return its index. */
static long join(Segment *queue, long i)
{
    Segment *s = &queue[i - 1], *next = &queue[i], arc;
    if (s->tool_turns || next->tool_turns || s->ending == STOP)
        return i;
    const Vector both = sum(s->way, 1.0, next->way, 1.0);
    if (dot(both, both) < pow(2.0 * M_PI / 180.0, 2)) {
        s->ending = STOP, next->blends_before = 0;
        return i;
    }
    const double speed = fmin(fmin(s->most, s->asked), fmin(next->most, next->asked));
    double scale = 0.0, blend[2];
    for (int k = 0; k < 3; k++)
        scale = fmax(scale, fabs(next->way.v[k] - s->way.v[k]) * (speed / CYCLE + next->acceleration) / axis_acceleration[k]);
    if (scale < KINK) {
        s->ending = TANGENT, next->blends_before = 0;
        set_kink(s, next, speed, scale);
        return i;
    }
    set_kink(s, next, speed * KINK / scale, KINK);
    if (s->ending != PARABOLIC)
        return i;
    const int made = !s->settled && make_arc(&arc, s, next);
    const double parabolic = blend_speeds(s, next, goal_speed(s), goal_speed(next), blend) / 2.0;
    if (made && arc.most > fmax(parabolic, s->kink)) {
        clear_kink(s, next);
        next->blends_before = 0;
        memcpy(next->start, arc.end, 3 * sizeof(double));
        next->length = distance(next->start, next->end);
        if (arc.lead != 0.0) {
            *s = arc;
            return i;
        }
        s->ending = TANGENT;
        memcpy(s->end, arc.start, 3 * sizeof(double));
        s->length = distance(s->start, s->end);
        settle(s);
        queue[i + 1] = *next;
        queue[i] = arc;
        return i + 1;
    }
    if (s->kink > parabolic)
        s->ending = TANGENT, next->blends_before = 0;
    else
        next->blends_before = 1, clear_kink(s, next);
    return i;
}

/* Go back from the last segment: how fast may each one end that goes over into the next. */
static void look_ahead(Segment *queue, long count)
{
    int peaks = 0, parted = 0;
    for (long x = 1; x < DEPTH + 2 && count - x - 1 >= 0; x++) {
        Segment *s = &queue[count - x], *before = s - 1;
        if (before->ending != TANGENT) {
            if (parted)
                return;
            parted = 1;
            continue;
        }
        double most = before->most;
        if (before->kink >= 0.0)
            most = fmin(most, before->kink);
        if (!s->settled) {
            before->final = fmin(most, fmin(sqrt(acceleration_of(s) * s->length), goal_speed(s)));
            s->final = 0.0;
        } else {
            const double back = sqrt(s->final * s->final + 2.0 * acceleration_of(s) * s->length);
            before->final = fmin(back, fmin(most, s->most));
            if (back >= fmin(most, s->most))
                before->at_peak = 1;
            s->most = fmin(s->most, s->length / (1.02 * CYCLE));
        }
        peaks += s->at_peak;
        if (peaks > 4)
            return;
    }
}

/* The cycles. */

static Vector point_on_arc(const Segment *s, double progress)
{
    const double way = progress - s->lead, turned = way / s->radius;
    if (way <= 0.0 && s->lead > 0.0)
        return sum(tip_of(s->start), 1.0, s->way, way);
    const Vector point = sum(s->radial, sin(s->angle - turned) / sin(s->angle), s->other, sin(turned) / sin(s->angle));
    return sum(point, 1.0, s->center, 1.0);
}

/* Add to the place the step along a segment from where it was before. */
static void move(const Segment *s, double before, double *place)
{
    if (s->is_arc) {
        const Vector step = sum(point_on_arc(s, s->progress), 1.0, point_on_arc(s, before), -1.0);
        for (int i = 0; i < 3; i++)
            place[i] += step.v[i];
        return;
    }
    for (int i = 0; i < 9; i++)
        place[i] += (s->end[i] - s->start[i]) * ((s->progress - before) / s->length);
}

static void part(Segment *s, double cycle, double speed)
{
    if (!s->split || cycle <= 0.0)
        s->split = 1, s->cycle = cycle, s->end_speed = speed;
}

/* Mark a segment that ends within the next cycle, with the part of it that remains. */
static void check_end(Segment *s, double final, double most)
{
    const double left = s->length - s->progress, mean = 0.5 * (s->speed + final);
    s->cycle = CYCLE;
    if (left <= PLACE_EPS) {
        s->progress = s->length;
        part(s, 0.0, s->speed);
        s->gone = s->ending <= EXACT;
        return;
    }
    if (s->ending <= EXACT || (mean <= SPEED_EPS && left > mean * CYCLE))
        return;
    double seconds = fmax(0.5 * TIME_EPS, mean > SPEED_EPS ? left / mean : 0.0);
    double acceleration = (final - s->speed) / seconds;
    if (fabs(acceleration) > most) {
        acceleration = within(acceleration, most);
        const double square = pow(s->speed / acceleration, 2) + 2.0 / acceleration * left;
        if (square < 0.0)
            return;
        seconds = -s->speed / acceleration;
        if (square >= TIME_EPS * TIME_EPS)
            seconds += acceleration > 0.0 ? sqrt(square) : -sqrt(square);
        final = s->speed + seconds * acceleration;
    }
    if (seconds < TIME_EPS)
        s->progress = s->length, part(s, 0.0, final);
    else if (seconds < CYCLE)
        part(s, seconds, final);
}

/* Go on for a cycle along a segment; the next one may be unknown. */
static void update(Segment *s, const Segment *next, double *place)
{
    const double most = acceleration_of(s), left = s->length - s->progress, goal = goal_speed(s), before = s->progress;
    double final = 0.0, wanted, acceleration;
    if (s->ending == TANGENT && next)
        final = fmin(s->final, fmin(goal, goal_speed(next)));
    if (s->ramps && s->ending == TANGENT && final >= SPEED_EPS) {
        wanted = final;
        acceleration = (final - s->speed) / fmax(left / (0.5 * (s->speed + final)), 1e-16);
    } else {
        const double half = 0.5 * most * s->cycle;
        const double square = final * final + most * (2.0 * left - s->speed * s->cycle) + half * half;
        wanted = -half + (square > half * half ? sqrt(square) : 0.0);
        acceleration = (within(wanted, goal) - s->speed) / fmax(s->cycle, TIME_EPS);
    }
    acceleration = within(acceleration, most);
    const double speed = s->speed + acceleration * s->cycle;
    if (speed >= 0.0)
        s->progress = fmin(s->progress + 0.5 * (speed + s->speed) * s->cycle, s->length);
    else if (left < s->speed * s->cycle)
        s->progress = s->length;
    s->speed = fmax(speed, 0.0);
    s->slowing = fabs(wanted - s->speed) < SPEED_EPS && acceleration < 0.0;
    check_end(s, final, most);
    move(s, before, place);
}

/* Let the next segment begin where this one slows down for its end. */
static void blend(Segment *s, Segment *next, double *place)
{
    double speeds[2];
    blend_speeds(s, next, goal_speed(s), goal_speed(next), speeds);
    s->blending |= s->slowing && s->speed < speeds[0];
    if (s->blending)
        update(next, NULL, place);
}

static void run_cycle(Segment *s, Segment *next, Segment *one_more, double *place)
{
    if (!s->active) {
        s->active = 1, s->blending = s->slowing = 0;
        s->ramps = s->ending == TANGENT && 2.0 * (s->length - s->progress) < RAMP * (s->speed + fmin(s->final, goal_speed(s)));
    }
    if (!s->split) {
        s->cycle = CYCLE;
        update(s, next, place);
        if (next && s->ending == PARABOLIC)
            blend(s, next, place);
        return;
    }
    const double before = s->progress;
    s->progress = s->length, s->gone = 1;
    move(s, before, place);
    if (!next)
        return;
    if (s->ending == TANGENT)
        next->cycle = CYCLE - s->cycle, next->speed = s->end_speed;
    update(next, one_more, place);
}

/* Run n motions from a start: poses (room, 9) and motions (room,) of every cycle. Return how many cycles they take, -1
   if more than there is room for. */
long simulate_motions(long n, const double *ends, const double *rates, const long *endings, const double *tolerances,
                      const double *start, const double *limits, long room, double *poses, long *motions)
{
    Segment *queue = calloc(2 * n + 1, sizeof *queue);
    const double *from = start;
    double place[9];
    long count = 0, cycle = 0;
    memcpy(axis_speed, limits, sizeof axis_speed), memcpy(axis_acceleration, limits + 9, sizeof axis_acceleration);
    tip_speed = limits[18];
    for (long k = 0; k < n; from = ends + 9 * k++) {
        if (!add_line(&queue[count], from, ends + 9 * k, rates[k], (int)endings[k], tolerances[k]))
            continue;
        queue[count].motion = k;
        if (count) {
            count = join(queue, count);
            settle(&queue[count - 1]);
        }
        look_ahead(queue, ++count);
    }
    memcpy(place, start, sizeof place);
    for (long at = 0; at < count && cycle <= room; at += queue[at].gone) {
        Segment *s = &queue[at];
        if (cycle == room) {
            cycle = -1;
            break;
        }
        run_cycle(s, at + 1 < count ? s + 1 : NULL, at + 2 < count ? s + 2 : NULL, place);
        motions[cycle] = s->motion;
        memcpy(poses + 9 * cycle++, place, sizeof place);
    }
    free(queue);
    return cycle;
}
