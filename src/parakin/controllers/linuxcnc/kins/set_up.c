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
    int failed = hal_pin_new_real(component, HAL_IN, &pins->tool_offset, 0, "kins.tool-offset");
    for (int i = 0; i < JOINTS; i++)
        failed |= hal_pin_new_real(component, HAL_IN, &pins->joint[i], 0, "kins.joint-%d", i);
    for (int i = 0; i < AXES; i++)
        failed |= hal_pin_new_real(component, HAL_OUT, &pins->pose[i], 0, "kins.%c", axis_letters[i]);
    failed |= hal_pin_new_bool(component, HAL_IN, &pins->teleop, 0, "kins.teleop-mode");
    failed |= hal_pin_new_bool(component, HAL_IN, &pins->coordinated, 0, "kins.coord-mode");
    failed |= hal_pin_new_bool(component, HAL_IN, &pins->homed, 0, "kins.homed");
    failed |= hal_pin_new_bool(component, HAL_IN, &pins->in_position, 0, "kins.in-position");
    failed |= hal_pin_new_bool(component, HAL_OUT, &pins->identity, 0, "kins.identity");
    failed |= hal_pin_new_bool(component, HAL_OUT, &pins->pose_known, 0, "kins.pose-known");
    failed |= hal_export_funct("kins.begin-steps", begin_steps, NULL, 0, 0, component);
    return failed | hal_export_funct("kins.end-steps", end_steps, NULL, 0, 0, component);
}
