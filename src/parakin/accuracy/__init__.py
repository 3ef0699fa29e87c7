"""Accuracy: how far the tool is off where the numbers of a machine are within tolerances."""
