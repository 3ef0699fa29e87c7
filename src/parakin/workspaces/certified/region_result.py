"""What all results about a region tell: its machine, the axes of a position, and the unit of a volume."""

from __future__ import annotations

from dataclasses import dataclass

from ...machine import Machine
from .region import Region


@dataclass(frozen=True, eq=False)
class RegionResult:
    """A result about a region.

    region : the one that it is about
    """

    region: Region

    @property
    def machine(self) -> Machine:
        """The machine that it is about."""
        return self.region.machine

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes of a position."""
        return self.region.free_axes

    @property
    def unit(self) -> str:
        """The unit of a volume: mm³, in the plane mm², along a line mm."""
        return self.region.volume_unit
