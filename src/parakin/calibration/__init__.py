"""Calibration: the numbers of a machine from measurements of where its tool is."""
