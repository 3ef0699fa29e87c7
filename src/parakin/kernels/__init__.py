"""Compiled interpreters of a machine's traces: over blocks of poses, over intervals, in Newton's method, in sweeps."""
