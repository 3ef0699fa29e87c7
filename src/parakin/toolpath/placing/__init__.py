"""Where the part lies best."""
