"""A machine as figures, scenes and pictures."""
