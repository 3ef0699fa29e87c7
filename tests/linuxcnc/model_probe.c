/* A machine's model, row by row: poses (n, AXES) and joints (n, JOINTS), mm and rad. */
#include "stub_hal.h"

#include MODEL_HEADER

void probe_rates(long n, const double *x, const double *q, double *rates, int *codes)
{
    for (long i = 0; i < n; i++)
        codes[i] = joint_rates(x + i * AXES, q + i * JOINTS, (double(*)[AXES])(rates + i * JOINTS * AXES));
}

void probe_singularities(long n, const double *x, const double *q, double *margins)
{
    for (long i = 0; i < n; i++)
        measure_singularities(x + i * AXES, q + i * JOINTS, margins + i * SINGULARITIES);
}

void probe_distances(long n, const double *x, const double *q, double *distances, int *nearest)
{
    for (long i = 0; i < n; i++)
        distances[i] = distance_to_limits(x + i * AXES, q + i * JOINTS, &nearest[i]);
}

void probe_telling(long n, const double *margins, double share, int *codes)
{
    for (long i = 0; i < n; i++)
        codes[i] = joints_tell_pose(margins + i * SINGULARITIES, share);
}
