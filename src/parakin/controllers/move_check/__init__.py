"""A small C function for firmware that proves a straight move inside a machine's limits."""
