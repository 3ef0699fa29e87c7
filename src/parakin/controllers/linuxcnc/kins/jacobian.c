/* The joints' rates by the pose's coordinates, which LinuxCNC asks for from 2.10 on: jac[j][a], in the units of joints and
   axes that LinuxCNC has. */

/* The rates of the own tip's place by the turns, for a tool longer by a length: that tip stands off the given one by the
   length times the tool's axis, which the turns X, Y, Z move about the axes that stand behind them. */
static void add_tool_rates(const double *x, double length, double rates[JOINTS][AXES])
{
    double axis[3] = {0.0, 0.0, 1.0}, about[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    for (int i = 0; i < 3; i++)
        if (turn_columns[i] >= 0) {
            const double s = sin(x[turn_columns[i]]), c = cos(x[turn_columns[i]]);
            const int a = (i + 1) % 3, b = (i + 2) % 3;
            double *turned[3] = {axis, about[0], about[1]};
            for (int k = 0; k <= i; k++) {
                const double u = c * turned[k][a] - s * turned[k][b];
                turned[k][b] = s * turned[k][a] + c * turned[k][b];
                turned[k][a] = u;
            }
        }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3 && turn_columns[i] >= 0; k++) {
            const double way = about[i][(k + 1) % 3] * axis[(k + 2) % 3] - about[i][(k + 2) % 3] * axis[(k + 1) % 3];
            for (int j = 0; j < JOINTS && place_columns[k] >= 0; j++)
                rates[j][turn_columns[i]] += length * way * rates[j][place_columns[k]];
        }
}

int kinematicsJacobian(const double *joints, const EmcPose *world, double jac[EMCMOT_MAX_JOINTS][EMCMOT_MAX_AXIS],
                       const KINEMATICS_INVERSE_FLAGS *iflags);

int kinematicsJacobian(const double *joints, const EmcPose *world, double jac[EMCMOT_MAX_JOINTS][EMCMOT_MAX_AXIS],
                       const KINEMATICS_INVERSE_FLAGS *iflags)
{
    double x[AXES], q[JOINTS], rates[JOINTS][AXES] = {{0.0}};
    (void)iflags;
    memset(jac, 0, EMCMOT_MAX_JOINTS * sizeof *jac);
    read_pose(world, x);
    read_joints(joints, q);
    if (!finite_all(x, AXES) || !finite_all(q, JOINTS))
        return -1;
    if (hal_get_bool(pins->identity)) {
        for (int i = 0; i < AXES; i++)
            jac[i][axis_numbers[i]] = 1.0;
        return 0;
    }
    shift_tip(x, hal_get_real(pins->tool_offset));
    if (!joint_rates(x, q, rates))
        return -1;
    add_tool_rates(x, hal_get_real(pins->tool_offset), rates);
    for (int j = 0; j < JOINTS; j++)
        for (int i = 0; i < AXES; i++)
            jac[j][axis_numbers[i]] = rates[j][i] * (turning_axis[i] ? DEGREE : 1.0) / (turning[j] ? DEGREE : 1.0);
    return 0;
}
