"""Bodies with masses, and the forces that their motion asks of the drives."""
