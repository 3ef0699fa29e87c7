"""Programs for controllers without kinematics: every block moves the joints."""
