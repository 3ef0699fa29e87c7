"""G-code, RS274/NGC."""
