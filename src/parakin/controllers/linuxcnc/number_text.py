"""Numbers as they stand in LinuxCNC's files."""

from __future__ import annotations


def format_number(value: float) -> str:
    """Format with nine digits after the point at most, a thousandth of a nanometre."""
    text = f"{value:.9f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
