/* LinuxCNC's side. */

KINEMATICS_TYPE kinematicsType(void) { return KINEMATICS_BOTH; }

EXPORT_SYMBOL(kinematicsInverse);
EXPORT_SYMBOL(kinematicsForward);
EXPORT_SYMBOL(kinematicsJacobian);
EXPORT_SYMBOL(kinematicsType);
EXPORT_SYMBOL(kinematicsSwitchable);
EXPORT_SYMBOL(kinematicsSwitch);

static int set_up(void)
{
    pins = hal_malloc(sizeof *pins);
    if (!pins)
        return -1;
    int failed = hal_pin_float_newf(HAL_IN, &pins->tool_offset, component, "kins.tool-offset");
    for (int i = 0; i < JOINTS; i++)
        failed |= hal_pin_float_newf(HAL_IN, &pins->joint[i], component, "kins.joint-%d", i);
    for (int i = 0; i < AXES; i++)
        failed |= hal_pin_float_newf(HAL_OUT, &pins->pose[i], component, "kins.%c", axis_letters[i]);
    failed |= hal_pin_bit_newf(HAL_IN, &pins->teleop, component, "kins.teleop-mode");
    failed |= hal_pin_bit_newf(HAL_IN, &pins->coordinated, component, "kins.coord-mode");
    failed |= hal_pin_bit_newf(HAL_IN, &pins->homed, component, "kins.homed");
    failed |= hal_pin_bit_newf(HAL_IN, &pins->in_position, component, "kins.in-position");
    failed |= hal_pin_bit_newf(HAL_OUT, &pins->identity, component, "kins.identity");
    failed |= hal_pin_bit_newf(HAL_OUT, &pins->pose_known, component, "kins.pose-known");
    failed |= hal_export_funct("kins.begin-steps", begin_steps, NULL, 0, 0, component);
    return failed | hal_export_funct("kins.end-steps", end_steps, NULL, 0, 0, component);
}
