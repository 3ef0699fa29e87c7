"""Readers of CL files and G-code."""
