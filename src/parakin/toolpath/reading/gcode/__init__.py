"""G-code, RS274/NGC as LinuxCNC reads it."""
