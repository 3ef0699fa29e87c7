/* How LinuxCNC loads the module: not if the configuration was made from another description. */

MODULE_LICENSE("GPL");

static char *made = "";
RTAPI_MP_STRING(made, "the making of the configuration that loads this");

int rtapi_app_main(void); /* not every LinuxCNC declares them */
void rtapi_app_exit(void);

int rtapi_app_main(void)
{
    if (*made && strcmp(made, MADE) != 0) {
        rtapi_print_msg(RTAPI_MSG_ERR, MODULE " was made from another description than the configuration: install its "
                        "file with sudo halcompile --install " MODULE ".c\n");
        return -1;
    }
    component = hal_init(MODULE);
    if (component < 0)
        return component;
    if (set_up()) {
        hal_exit(component);
        return -1;
    }
    hal_ready(component);
    return 0;
}

void rtapi_app_exit(void) { hal_exit(component); }
