"""Check a posted path between its records too: bounds by interval arithmetic, and bisection of what they leave open."""
