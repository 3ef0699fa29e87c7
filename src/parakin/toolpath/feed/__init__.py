"""Feed planning: a law of time along a posted tool path."""

from .law import Law
from .planning import plan
from .sampled import Setpoints
from .smooth import Corners

__all__ = ["Corners", "Law", "Setpoints", "plan"]
