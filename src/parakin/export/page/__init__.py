"""A machine as one self-contained page that lives: its equations as JavaScript, its scene, its limits."""
