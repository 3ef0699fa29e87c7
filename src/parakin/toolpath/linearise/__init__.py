"""Linearise a posted path: more records, so that a controller's interpolation keeps the tool on the programmed path."""
