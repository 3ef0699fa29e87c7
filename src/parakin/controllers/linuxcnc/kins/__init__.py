"""C sources of the kinematics module; what they do stands at their heads."""
