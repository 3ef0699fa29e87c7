"""The machine on LinuxCNC's screen: a window with the moving machine, its joints, and what limits it."""

from .screen_module import (
    name_screen,
    name_screen_settings,
    write_screen,
    write_screen_hal,
    write_screen_settings,
)

__all__ = ["name_screen", "name_screen_settings", "write_screen", "write_screen_hal", "write_screen_settings"]
