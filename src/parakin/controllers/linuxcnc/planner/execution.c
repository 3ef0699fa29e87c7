/* The tool on the path: in every cycle as far as the profile, the feed and its override, a pause or an abort allow. */

#define ROUNDS 64 /* steps that a cycle may pass */
#define EMPTY 1e-12 /* of a step: what is left of it is rounding */

static double speed;      /* of the path, in its units a second */
static double step_place; /* on the step that the tool is on */
static double pose[AXES]; /* commanded */
static double tool_speed; /* mm/s, or degrees/s where X Y Z stand still */
static double most_tip_speed = HUGE_VAL; /* mm/s, of the operator */
static int pausing, aborting;
static unsigned begun_motion; /* the motions before this one have begun */

static void write_outputs(Motion *m)
{
    syncdio_t *out = &m->outputs;
    if (!out->anychanged)
        return;
    for (int i = 0; i < emcmotConfig->numDIO; i++)
        if (out->dio_mask >> i & 1 && out->dios[i])
            write_digital(i, out->dios[i] > 0);
    for (int i = 0; i < emcmotConfig->numAIO; i++)
        if (out->aio_mask >> i & 1)
            write_analog(i, out->aios[i]);
    out->anychanged = 0;
}

static int spindles_ready(void)
{
    for (int i = 0; i < emcmotConfig->numSpindles; i++)
        if (!emcmotStatus->spindle_status[i].at_speed)
            return 0;
    return 1;
}

/* Begin the motions up to one; 0 where it waits for the spindle. The ones before it leave the queue. */
static int begin_motions(unsigned index)
{
    while ((int)(index - begun_motion) >= 0) {
        Motion *m = motion_at(begun_motion);
        if (m->waits_for_spindle && !spindles_ready())
            return 0;
        first_motion = begun_motion++;
        write_outputs(m);
    }
    return 1;
}

/* The path's speed that is asked for on a piece. */
static double choose_target(const Piece *p, double at)
{
    if (pausing || aborting)
        return 0.0;
    const double scale = emcmotStatus->net_feed_scale;
    const double most = fmin(p->most_speed, most_tip_speed / measure_tip_slope(p, at));
    return fmin(p->speed * (p->shape == SPLINE ? fmin(scale, 1.0) : scale), most);
}

/* By how much the profile is passed after a time with an acceleration on a step. */
static double measure_excess(const Step *s, double next, double a, double time)
{
    const double place = fmin(step_place + (speed + 0.5 * a * time) * time, s->length * (1.0 - EMPTY));
    return speed + a * time - sqrt(find_controllable(s, place, next));
}

/* The greatest acceleration from low to high that ends within the profile on the same step, by regula falsi (Illinois). */
static double bound_acceleration(const Step *s, double next, double low, double high, double time)
{
    double over = measure_excess(s, next, high, time);
    if (over <= 0.0)
        return high;
    double under = measure_excess(s, next, low, time);
    const double fine = 1e-6 * (high - low);
    for (int round = 0; round < 8 && under < 0.0 && high - low > fine; round++) {
        const double a = low - under * (high - low) / (over - under), excess = measure_excess(s, next, a, time);
        if (excess <= 0.0) {
            low = a;
            under = excess;
            over *= 0.5;
        } else {
            high = a;
            over = excess;
            under *= 0.5;
        }
    }
    return low;
}

/* Move along the path for a time. */
static void advance(double time)
{
    for (int round = 0; round < ROUNDS && first_step != next_step; round++) {
        const Step *s = step_at(first_step);
        const Piece *p = piece_at(s->piece);
        const double rest = s->length - step_place, x = speed * speed;
        if (!(rest > EMPTY * s->length)) {
            step_place = 0.0;
            first_step++;
            continue;
        }
        if (!(time > 0.0) || !begin_motions(p->motion))
            return;
        const double next = first_step + 1 != next_step ? step_at(first_step + 1)->most : 0.0;
        double low[2], high[2];
        find_range(s, step_place, x, low, high);
        const double least = low[0] + low[1] * x;
        const double most = fmin(fmax(high[0] + high[1] * x, least), (choose_target(p, s->at + step_place) - speed) / time);
        const double to_end = fmax(fmin(most, 0.5 * (next - x) / rest), fmin(least, 0.0)), x_end = x + 2.0 * to_end * rest;
        if (x_end >= 0.0) {
            const double seconds = 2.0 * rest / (speed + sqrt(x_end));
            if (seconds <= time) {
                time -= seconds;
                speed = sqrt(x_end);
                step_place = 0.0;
                first_step++;
                continue;
            }
        }
        const double slowest = fmax(fmin(least, 0.0), -speed / time);
        const double on_step = fmin(most, 2.0 * (rest / time - speed) / time);
        const double a = on_step > slowest ? bound_acceleration(s, next, slowest, on_step, time) : slowest;
        step_place = fmin(step_place + (speed + 0.5 * a * time) * time, s->length);
        speed = fmax(speed + a * time, 0.0);
        return;
    }
}

/* The pose at the tool's place; after the last step at its end. */
static void locate_tool(double *x)
{
    const int on_step = first_step != next_step;
    const Step *s = step_at(on_step ? first_step : first_step - 1);
    locate(piece_at(s->piece), s->at + (on_step ? step_place : s->length), x);
}
