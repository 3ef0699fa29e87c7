/* Pins are handles, read and written by the functions of LinuxCNC 2.10, whose HAL defines one of these names. In 2.9 they
   are pointers, and begin at zero. */
#if !defined(HAL_BOOL) && !defined(COMPONENT_TYPE_USER)
typedef hal_float_t *hal_real_t;
typedef hal_bit_t *hal_bool_t;
typedef hal_u32_t *hal_uint_t;
typedef hal_pin_dir_t hal_pdir_t;
#define hal_get_real(pin) (*(pin))
#define hal_get_bool(pin) (*(pin))
#define hal_set_real(pin, value) (*(pin) = (value))
#define hal_set_bool(pin, value) (*(pin) = (value))
#define hal_set_ui32(pin, value) (*(pin) = (value))
#define hal_pin_new_real(owner, direction, pin, zero, ...) hal_pin_float_newf(direction, pin, owner, __VA_ARGS__)
#define hal_pin_new_bool(owner, direction, pin, zero, ...) hal_pin_bit_newf(direction, pin, owner, __VA_ARGS__)
#define hal_pin_new_ui32(owner, direction, pin, zero, ...) hal_pin_u32_newf(direction, pin, owner, __VA_ARGS__)
#endif
