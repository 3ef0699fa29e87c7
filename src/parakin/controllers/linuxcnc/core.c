/* What every machine shares. Above stand its numbers and its mathematics, all in mm and rad; here is what is asked of
   them. No function keeps anything from one call to the next, nothing allocates, and every loop has an end. */

MODEL double within_half_a_turn(double angle, double near)
{
    return angle + TURN * rint((near - angle) / TURN);
}

MODEL int finite_all(const double *x, int count)
{
    for (int i = 0; i < count; i++)
        if (!isfinite(x[i]))
            return 0;
    return 1;
}

/* The tool's axis Rz(C) Ry(B) Rx(A) z, from the tip into the holder. */
MODEL void find_tool_axis(const double *x, double *k)
{
    k[0] = k[1] = 0.0;
    k[2] = 1.0;
    for (int i = 0; i < 3; i++) /* turned about X, then Y, then Z */
        if (turn_columns[i] >= 0) {
            const double s = sin(x[turn_columns[i]]), c = cos(x[turn_columns[i]]);
            double *u = &k[(i + 1) % 3], *v = &k[(i + 2) % 3];
            const double turned = c * *u - s * *v;
            *v = s * *u + c * *v;
            *u = turned;
        }
}

/* The pose of the machine's own tip for that of a tool longer by ``length`` mm, with the shift along Z that LinuxCNC has
   added to it taken off. */
MODEL void shift_tip(double *x, double length)
{
    double k[3];
    if (length == 0.0)
        return;
    find_tool_axis(x, k);
    k[2] -= 1.0;
    for (int i = 0; i < 3; i++)
        if (place_columns[i] >= 0)
            x[place_columns[i]] += length * k[i];
}

/* Kinematics without any: every axis moves the joint of its number. The axes' letters say mm or degrees, whatever the
   joints are; LinuxCNC's numbers are the same on both sides. */
MODEL void take_axes_as_joints(const double *x, double *q)
{
    for (int i = 0; i < JOINTS; i++)
        q[i] = i < AXES ? x[i] / (turning_axis[i] ? DEGREE : 1.0) * (turning[i] ? DEGREE : 1.0) : 0.0;
}

MODEL void take_joints_as_axes(const double *q, double *x)
{
    for (int i = 0; i < AXES; i++)
        x[i] = q[i] / (turning[i] ? DEGREE : 1.0) * (turning_axis[i] ? DEGREE : 1.0);
}

/* Joints for a pose. */

#if WRIST
/* Over the wrist's pole its other solution spares a swing: as parakin's Machine.follow goes on there. */
MODEL void go_over_the_pole(const double *x, const double *last, double *q)
{
    double other[JOINTS];
    const double stay[2] = {within_half_a_turn(q[FIRST] - last[FIRST], 0.0),
                            within_half_a_turn(q[SECOND] - last[SECOND], 0.0)};
    if (!(fabs(stay[0]) > @SWING@ * TURN))
        return;
    inverse_over(x, other);
    const double cross[2] = {within_half_a_turn(other[FIRST] - last[FIRST], 0.0),
                             within_half_a_turn(other[SECOND] - last[SECOND], 0.0)};
    if (cross[0] * cross[0] + cross[1] * cross[1] < @GAIN@ * (stay[0] * stay[0] + stay[1] * stay[1])
        && other[SECOND] >= SECOND_LOW && other[SECOND] <= SECOND_HIGH && finite_all(other, JOINTS))
        for (int i = 0; i < JOINTS; i++)
            q[i] = other[i];
}
#endif

/* The joints of a pose x near the last ones: of a wrist's two modes the one that spares a swing over the pole, its first
   joint as it is where it is free, turning joints on the nearest turn. 0 where a leg can't reach the pose; limits are
   not looked at. */
MODEL int find_joints(const double *x, const double *last, double *q)
{
    inverse(x, q);
    if (!finite_all(q, JOINTS))
        return 0;
#if WRIST
    double lean[1];
    freedom(x, lean);
    if (lean[0] < FREE * FREE)
        inverse_held(x, &last[FIRST], q);
    else
        go_over_the_pole(x, last, q);
#endif
    for (int i = 0; i < JOINTS; i++)
        if (turning[i])
            q[i] = within_half_a_turn(q[i], last[i]);
    return finite_all(q, JOINTS);
}

/* LU with row exchanges, in place; the determinant. */
MODEL inline double factor(int n, double a[n][n], int order[n])
{
    double det = 1.0;
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[i][k]) > fabs(a[best][k]))
                best = i;
        order[k] = best;
        if (best != k) {
            det = -det;
            for (int j = 0; j < n; j++) {
                const double swap = a[k][j];
                a[k][j] = a[best][j];
                a[best][j] = swap;
            }
        }
        det *= a[k][k];
        const double pivot = 1.0 / a[k][k];
        a[k][k] = pivot;
        for (int i = k + 1; i < n; i++) {
            const double share = a[i][k] *= pivot;
            for (int j = k + 1; j < n; j++)
                a[i][j] -= share * a[k][j];
        }
    }
    return det;
}

MODEL inline void substitute(int n, double a[n][n], const int order[n], double f[n])
{
    for (int k = 0; k < n; k++) {
        const double swap = f[order[k]];
        f[order[k]] = f[k];
        f[k] = swap;
    }
    for (int k = 1; k < n; k++)
        for (int j = 0; j < k; j++)
            f[k] -= a[k][j] * f[j];
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            f[k] -= a[k][j] * f[j];
        f[k] *= a[k][k];
    }
}

#if REDUNDANT
/* A matrix of m rows and fewer columns as Q R by Gram and Schmidt: Q in place, R with its diagonal's reciprocals; the
   volume. */
MODEL inline double orthogonalise(int m, int n, double q[m][n], double r[n][n])
{
    double volume = 1.0;
    for (int k = 0; k < n; k++) {
        for (int j = k; j < n; j++) {
            r[k][j] = 0.0;
            for (int i = 0; i < m; i++)
                r[k][j] += q[i][k] * q[i][j];
        }
        const double size = sqrt(r[k][k]);
        volume *= size;
        r[k][k] = 1.0 / size;
        for (int i = 0; i < m; i++)
            q[i][k] *= r[k][k];
        for (int j = k + 1; j < n; j++) {
            r[k][j] *= r[k][k];
            for (int i = 0; i < m; i++)
                q[i][j] -= r[k][j] * q[i][k];
        }
    }
    return volume;
}

/* The x of least squares of A x = f; what it leaves of f stays there. */
MODEL inline void solve_least_squares(int m, int n, double q[m][n], double r[n][n], double f[m], double x[n])
{
    for (int k = 0; k < n; k++) {
        x[k] = 0.0;
        for (int i = 0; i < m; i++)
            x[k] += q[i][k] * f[i];
        for (int i = 0; i < m; i++)
            f[i] -= x[k] * q[i][k];
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            x[k] -= r[k][j] * x[j];
        x[k] *= r[k][k];
    }
}
#endif

/* Rates, and how far a pose is from what it must not reach. */

/* The joints' rates by the pose's coordinates, dq/dx; 0 where the machine is singular. A x' = B q', where head and
   table's rows of B hang on their own joints only. */
MODEL int joint_rates(const double *x, const double *q, double rates[JOINTS][AXES])
{
    double a[JOINTS * AXES], b[JOINTS * JOINTS], legs[CLOSURES][CLOSURES], column[JOINTS];
    int order[JOINTS];
    jacobians(x, q, a, b);
    for (int i = 0; i < CLOSURES; i++)
        for (int j = 0; j < CLOSURES; j++)
            legs[i][j] = b[i * JOINTS + j];
    if (!(fabs(factor(CLOSURES, legs, order)) > 0.0))
        return 0;
#if SERIAL
    double turns[SERIAL][SERIAL];
    int turns_order[SERIAL];
    for (int i = 0; i < SERIAL; i++)
        for (int j = 0; j < SERIAL; j++)
            turns[i][j] = b[(CLOSURES + i) * JOINTS + CLOSURES + j];
    factor(SERIAL, turns, turns_order);
#endif
    for (int k = 0; k < AXES; k++) {
        for (int i = 0; i < JOINTS; i++)
            column[i] = a[i * AXES + k];
#if SERIAL
        substitute(SERIAL, turns, turns_order, &column[CLOSURES]);
        for (int i = 0; i < CLOSURES; i++)
            for (int j = CLOSURES; j < JOINTS; j++)
                column[i] -= b[i * JOINTS + j] * column[j];
#endif
        substitute(CLOSURES, legs, order, column);
        for (int i = 0; i < JOINTS; i++)
            rates[i][k] = column[i];
    }
    return finite_all(rates[0], JOINTS * AXES);
}

/* Whether a pose keeps its distance to every singularity, on home's side of them. */
MODEL int regular(const double *x, const double *q)
{
    double margins[SINGULARITIES];
    measure_singularities(x, q, margins);
    for (int i = 0; i < SINGULARITIES; i++)
        if (!(margins[i] >= least_singularity[i]))
            return 0;
    return 1;
}

/* Whether joints tell their pose: it is farther than a share of the least margins from the singularities across which they
   have another pose, the parallel ones and those of constraints. */
MODEL int joints_tell_pose(const double *margins, double share)
{
    return fabs(margins[0]) > share * least_singularity[0]
        && fabs(margins[CONSTRAINT]) > share * least_singularity[CONSTRAINT];
}

/* How far a pose is from its nearest limit or singularity, and which of limit_names that is: 0 where it is reached, 1
   where jogs stop. */
MODEL double distance_to_limits(const double *x, const double *q, int *nearest)
{
    double limits[LIMITS + 1], margins[SINGULARITIES], least = HUGE_VAL;
    *nearest = 0;
    measure_limits(x, q, limits);
    measure_singularities(x, q, margins);
    for (int i = 0; i < LIMITS + SINGULARITIES; i++) {
        const int j = i - LIMITS;
        if (j >= 0 && !(least_singularity[j] > 0.0))
            continue;
        const double distance = j < 0 ? limits[i] / near_limit[i] : margins[j] / least_singularity[j] - 1.0;
        if (distance < least || isnan(distance)) {
            least = isnan(distance) ? -HUGE_VAL : distance;
            *nearest = i;
        }
    }
    return least;
}
