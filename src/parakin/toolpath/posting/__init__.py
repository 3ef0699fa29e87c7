"""From the workpiece to the machine: frames, turns of the pose, and the working mode."""
