"""The unit of a CL file's lengths: as it is stated, and where only speeds tell that it is not mm."""

from collections.abc import Iterable
from typing import Literal

from ..text import refuse

INCH_SPEEDS = frozenset(("IPM", "IPR", "SFM"))  # units of feeds and surface speeds


class StatedUnits:
    """The unit stated before the first motion, mm until then."""

    def __init__(self) -> None:
        self.name: Literal["mm", "inch"] = "mm"
        self.stated = False
        self.inch_line: int | None = None  # where a speed in inches or feet first stood without a stated unit

    def state(self, scale: float, *, in_motion: bool) -> None:
        """Take a stated unit, whose length is ``scale`` mm; behind the first motion it does not hold for that."""
        if not in_motion:
            self.name = "mm" if scale == 1.0 else "inch"
            self.inch_line = None
        self.stated = True

    def note_speed(self, args: Iterable[str], line: int) -> None:
        """Take the words of a speed, which may tell inches or feet."""
        if not self.stated and self.inch_line is None and not INCH_SPEEDS.isdisjoint(args):
            self.inch_line = line

    def check(self) -> None:
        """Refuse lengths without a unit beside speeds in inches or feet: mm would be 25.4 times too small."""
        if self.inch_line is not None:
            refuse(
                "a speed in inches or feet while no unit of length is stated; expected UNITS/INCHES or UNITS/MM "
                "before the first motion",
                self.inch_line,
            )
