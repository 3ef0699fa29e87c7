"""More records, so that a controller's interpolation keeps to the programmed path."""
