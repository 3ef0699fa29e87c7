"""The machine on LinuxCNC's screen: a window with the moving machine, its joints, and what limits it."""

from .screen_module import name_screen, write_axis_settings, write_screen, write_screen_hal

__all__ = ["name_screen", "write_axis_settings", "write_screen", "write_screen_hal"]
