"""The list of the cards, by the names that people type."""

from __future__ import annotations

from .card import Card
from .ethercat import ETHERCAT
from .mesa_7i76e import MESA_7I76E
from .mesa_7i96s import MESA_7I96S
from .parport import PARPORT

CARDS: dict[str, Card] = {
    "mesa-7i96s": MESA_7I96S,
    "mesa-7i76e": MESA_7I76E,
    "parport": PARPORT,
    "ethercat": ETHERCAT,
}
