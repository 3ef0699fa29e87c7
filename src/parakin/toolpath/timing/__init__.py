"""Feed planning: a law of time along a posted tool path."""

from .corners import Corners
from .plan import plan
from .setpoints import Setpoints
from .trajectory import Law

__all__ = ["Corners", "Law", "Setpoints", "plan"]
