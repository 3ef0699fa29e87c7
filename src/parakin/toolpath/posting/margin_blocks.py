"""Margins of a long path, a block of records at a time: all of them would not fit."""

from __future__ import annotations

from collections.abc import Iterator

from ...arrays import Array, split_rows
from ...machine import Machine

BLOCK = 1 << 16  # records whose margins are in memory at once


def split_margins(machine: Machine, poses: Array, joints: Array, mode: str) -> Iterator[tuple[slice, Array]]:
    """Compute the margins (records, limits) of each block of poses (n, axes) and joints (n, joints), with its slice."""
    for block in split_rows(len(joints), BLOCK):
        yield block, machine.margins(poses[block], joints[block], mode)
