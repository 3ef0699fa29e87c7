/* Proves straight moves of %(title)s inside its limits. Written by parakin %(version)s; plain C99.
 *
 * int check_move(const double start[%(axes)d], const double end[%(axes)d])
 *
 * Poses are %(names)s, in mm and rad. Returns 1 where every pose on the straight way from start to end is proved to keep
 * every limit of the machine and to stay clear of parallel singularities; 0 where one breaks a limit, or where that is
 * so close that CHECK_MOVE_SPANS spans prove nothing. So a yes is never wrong, and a no may be.
 *
 * It runs two lists of operations on intervals that are rounded outward: bounds of all margins over a span of the way,
 * and bounds of their rates. It needs doubles, IEEE 754 and a libm that is right to 1e-15; it allocates nothing, and is
 * not reentrant. It must not be compiled with -ffast-math.
 */
#ifndef PARAKIN_CHECK_MOVE_H
#define PARAKIN_CHECK_MOVE_H

#include <math.h>

#ifdef __FAST_MATH__
#error "check_move: -ffast-math breaks the proofs"
#endif

#ifndef CHECK_MOVE_SPANS
#define CHECK_MOVE_SPANS 400 /* spans of a move that are tried before it is given up */
#endif

#ifndef CHECK_MOVE_SLACK
#define CHECK_MOVE_SLACK 0.0 /* mm, rad and the like: a limit that is exceeded by no more counts as kept */
#endif

#define CM_AXES %(axes)d
#define CM_MARGINS %(margins)d
#define CM_SIGN %(sign)s /* of det A at home */
#define CM_FLOOR %(floor)s /* what det A has to stay above */

/* Operations: opcode, destination, operands. Inputs stand in the first registers, outputs in the next. */
%(tables)s

typedef struct {
    double low, high;
} cm_interval;

static cm_interval cm_r[%(registers)d];

static double cm_min(double x, double y) { return x < y ? x : y; }
static double cm_max(double x, double y) { return x > y ? x : y; }
static double cm_magnitude(cm_interval x) { return cm_max(fabs(x.low), fabs(x.high)); }

static cm_interval cm_round(double low, double high, double size)
{
    const double wide = size * 8.8817841970012523e-16 + (size > 0.0 ? 1e-300 : 0.0);
    cm_interval y = {low - wide, high + wide};
    if (y.low != y.low) y.low = -HUGE_VAL;
    if (y.high != y.high) y.high = HUGE_VAL;
    return y;
}

static double cm_times(double x, double y)
{
    const double z = x * y;
    return z == z ? z : 0.0; /* 0 * infinity: an infinite end is never reached */
}

static cm_interval cm_multiply(cm_interval a, cm_interval b)
{
    const double p = cm_times(a.low, b.low), q = cm_times(a.low, b.high);
    const double s = cm_times(a.high, b.low), t = cm_times(a.high, b.high);
    const cm_interval y = {cm_min(cm_min(p, q), cm_min(s, t)), cm_max(cm_max(p, q), cm_max(s, t))};
    return y;
}

static cm_interval cm_scale(double k, cm_interval a)
{
    const double low = k * a.low, high = k * a.high;
    const cm_interval y = {cm_min(low, high), cm_max(low, high)};
    return y;
}

static cm_interval cm_span(double low, double high)
{
    const cm_interval y = {low, high};
    return y;
}

static cm_interval cm_product(double k, int a, int b)
{
    cm_interval y = cm_multiply(cm_r[a], cm_r[b]);
    if (a == b && y.low < 0.0) y.low = 0.0;
    return cm_scale(k, y);
}

/* sin(x + phase) over an interval, from its values at the ends */
static cm_interval cm_sine(double at_low, double at_high, cm_interval x, double phase)
{
    const double slack = 1e-15 * (1.0 + cm_magnitude(x));
    const double a = (x.low + phase - slack) * 0.15915494309189535, b = (x.high + phase + slack) * 0.15915494309189535;
    cm_interval y = {cm_min(at_low, at_high) - 2e-15, cm_max(at_low, at_high) + 2e-15};
    if (!(cm_magnitude(x) < 1e5) || floor(b + 0.25) >= ceil(a + 0.25) || y.low < -1.0) y.low = -1.0;
    if (!(cm_magnitude(x) < 1e5) || floor(b - 0.25) >= ceil(a - 0.25) || y.high > 1.0) y.high = 1.0;
    return y;
}

static cm_interval cm_angle(cm_interval y, cm_interval x)
{
    const double p = atan2(y.low, x.low), q = atan2(y.low, x.high), s = atan2(y.high, x.low), t = atan2(y.high, x.high);
    cm_interval z = {cm_min(cm_min(p, q), cm_min(s, t)) - 2e-15, cm_max(cm_max(p, q), cm_max(s, t)) + 2e-15};
    if ((y.low < 0.0 && y.high >= 0.0 && x.low <= 0.0) || !(cm_magnitude(y) + cm_magnitude(x) < 1e300)) {
        z.low = -3.1415926535897936; /* the angle jumps there, and at the origin it is any */
        z.high = 3.1415926535897936;
    }
    return z;
}

static cm_interval cm_size(cm_interval a)
{
    cm_interval y = {cm_min(fabs(a.low), fabs(a.high)), cm_magnitude(a)};
    if (a.low <= 0.0 && a.high >= 0.0) y.low = 0.0;
    return y;
}

static cm_interval cm_divide(cm_interval a, cm_interval b)
{
    cm_interval y = {-HUGE_VAL, HUGE_VAL};
    if (b.low <= 0.0 && b.high >= 0.0) return y;
    b = cm_multiply(a, cm_span(1.0 / b.high, 1.0 / b.low));
    y.low = cm_round(b.low, b.low, 4.0 * fabs(b.low)).low;
    y.high = cm_round(b.high, b.high, 4.0 * fabs(b.high)).high;
    return y;
}

static cm_interval cm_root(cm_interval a)
{
    const double low = sqrt(cm_max(a.low, 0.0)), high = sqrt(cm_max(a.high, 0.0));
    cm_interval y = {cm_max(cm_round(low, low, low).low, 0.0), cm_round(high, high, high).high};
    return y;
}

/* k + the sum of n terms, each an interval */
static cm_interval cm_sum(double k, const cm_interval *terms, int n)
{
    double low = k, high = k, size = fabs(k);
    int i;
    for (i = 0; i < n; i++) {
        low += terms[i].low;
        high += terms[i].high;
        size += cm_magnitude(terms[i]);
    }
    return cm_round(low, high, size);
}

static cm_interval cm_copy_sign(cm_interval a, cm_interval b)
{
    const cm_interval size = cm_size(a);
    cm_interval y = {b.low >= 0.0 ? size.low : -size.high, b.high < 0.0 ? -size.low : size.high};
    return y;
}

static cm_interval cm_select(cm_interval a, cm_interval b, cm_interval below, cm_interval otherwise)
{
    const cm_interval both = {cm_min(below.low, otherwise.low), cm_max(below.high, otherwise.high)};
    return a.high < b.low ? below : (a.low >= b.high ? otherwise : both);
}

static void cm_run(const unsigned short (*code)[8], const double (*constants)[4], int count)
{
    int i, n;
    for (i = 0; i < count; i++) {
        const unsigned short *c = code[i];
        const double *k = constants[i];
        const cm_interval a = cm_r[c[2]], b = cm_r[c[3]];
        cm_interval terms[3];
        switch (c[0]) {
        case 0: cm_r[c[1]] = cm_round(k[0], k[0], fabs(k[0])); break;
        case 1: case 2: case 3: /* k0 + k1 a + k2 b + k3 c */
            for (n = 0; n < c[0]; n++) terms[n] = cm_scale(k[1 + n], cm_r[c[2 + n]]);
            cm_r[c[1]] = cm_sum(k[0], terms, n);
            break;
        case 4: case 5: case 6: /* k3 + k0 a b + k1 c e + k2 f g */
            for (n = 0; n < c[0] - 3; n++) terms[n] = cm_product(k[n], c[2 + 2 * n], c[3 + 2 * n]);
            cm_r[c[1]] = cm_sum(k[3], terms, n);
            break;
        case 7: /* k2 + k0 a b + k1 c */
            terms[0] = cm_product(k[0], c[2], c[3]);
            terms[1] = cm_scale(k[1], cm_r[c[4]]);
            cm_r[c[1]] = cm_sum(k[2], terms, 2);
            break;
        case 8: cm_r[c[1]] = cm_divide(a, b); break;
        case 9: cm_r[c[1]] = cm_root(a); break;
        case 10: /* sine and cosine of b into two registers */
            terms[0] = cm_sine(sin(b.low), sin(b.high), b, 0.0);
            cm_r[c[2]] = cm_sine(cos(b.low), cos(b.high), b, 1.5707963267948966);
            cm_r[c[1]] = terms[0];
            break;
        case 11: cm_r[c[1]] = cm_angle(a, b); break;
        case 12: terms[0] = cm_span(cm_min(a.low, b.low), cm_min(a.high, b.high)); cm_r[c[1]] = terms[0]; break;
        case 13: terms[0] = cm_span(cm_max(a.low, b.low), cm_max(a.high, b.high)); cm_r[c[1]] = terms[0]; break;
        case 14: cm_r[c[1]] = cm_size(a); break;
        case 15: cm_r[c[1]] = cm_copy_sign(a, b); break;
        default: cm_r[c[1]] = cm_select(a, b, cm_r[c[4]], cm_r[c[5]]); break;
        }
    }
}

/* Set the inputs: start, direction, and a span of the way; the direction holds that of the exact ends. */
static void cm_set(const double *start, const double *end, double first, double last)
{
    int i;
    for (i = 0; i < CM_AXES; i++) {
        const double way = end[i] - start[i], off = 4.5e-16 * (fabs(start[i]) + fabs(end[i]));
        cm_r[i].low = cm_r[i].high = start[i];
        cm_r[CM_AXES + i].low = way == 0.0 ? 0.0 : way - off;
        cm_r[CM_AXES + i].high = way == 0.0 ? 0.0 : way + off;
    }
    cm_r[2 * CM_AXES].low = first;
    cm_r[2 * CM_AXES].high = last;
}

/* Bound margins and det A less its floor, of home's sign, over a span; 1 where all are proved, -1 where one is broken. */
static int cm_bound(const double *start, const double *end, double first, double last, double *least)
{
    const cm_interval *outputs = cm_r + CM_INPUTS;
    int i, verdict = 1;
    cm_set(start, end, first, last);
    cm_run(cm_values_code, cm_values_constants, CM_VALUES);
    for (i = 0; i <= CM_MARGINS; i++) {
        const cm_interval y = i < CM_MARGINS ? outputs[i] : cm_scale(CM_SIGN, outputs[i]);
        const double floor_ = i < CM_MARGINS ? -(CHECK_MOVE_SLACK) : CM_FLOOR;
        least[i] = y.low - floor_;
        if (!(least[i] >= 0.0) && verdict == 1) verdict = 0;
        if (y.high < floor_) verdict = -1;
    }
    return verdict;
}

/* Prove a span: by the bounds of its margins, or from its middle by the bounds of their rates. */
static int cm_prove(const double *start, const double *end, double first, double last)
{
    static double least[CM_MARGINS + 1], middle[CM_MARGINS + 1];
    const double half = 0.5 * (last - first) * (1.0 + 1e-15), at = 0.5 * (first + last);
    int i, verdict = cm_bound(start, end, first, last, least);
    if (verdict != 0) return verdict;
    verdict = cm_bound(start, end, at, at, middle);
    if (verdict != 1) return verdict;
    cm_set(start, end, first, last);
    cm_run(cm_rates_code, cm_rates_constants, CM_RATES);
    for (i = 0; i <= CM_MARGINS; i++) {
        const double change = cm_magnitude(cm_r[CM_INPUTS + i]) * half;
        if (!(least[i] >= 0.0) && !(middle[i] - change * (1.0 + 1e-15) >= 0.0)) return 0;
    }
    return 1;
}

static int check_move(const double *start, const double *end)
{
    double done = 0.0, step = 1.0;
    int i, spans;
    for (i = 0; i < CM_AXES; i++)
        if (!(fabs(start[i]) < 1e9) || !(fabs(end[i]) < 1e9)) return 0;
    for (spans = 0; spans < CHECK_MOVE_SPANS; spans++) {
        const double next = done + step >= 1.0 ? 1.0 : done + step;
        const int verdict = cm_prove(start, end, done, next);
        if (verdict < 0 && next - done < 1e-3) return 0;
        if (verdict == 1) {
            if (next == 1.0) return 1;
            done = next;
            step *= 2.0;
        } else {
            step = 0.5 * (next - done);
        }
    }
    return 0;
}

#endif
