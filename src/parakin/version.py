"""The version of parakin."""

__version__ = "0.1.0"
