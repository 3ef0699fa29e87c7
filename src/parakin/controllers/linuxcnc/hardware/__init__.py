"""Cards that drive a real machine, one file each over one model: see :mod:`.card`."""

from .cards import CARDS
from .equipment import Equipment, equip_machine

__all__ = ["CARDS", "Equipment", "equip_machine"]
