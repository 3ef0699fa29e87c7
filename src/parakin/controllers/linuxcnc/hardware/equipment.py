"""A machine on a card: layout, scales and homing, all that the files of a configuration are written from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from ....errors import InputError, quote, suggest
from ....machine import Machine
from ..homing import HomingPlan, find_homing
from .card import Card, Layout
from .cards import CARDS
from .scale import find_scale

ESTOP, PROBE = 0, 1  # inputs; home switches follow
_COMMON_INPUTS = 2


@dataclass(frozen=True, eq=False)
class Equipment:
    """What drives a machine.

    scales : steps or counts a mm or degree of each joint, and whether the description says them
    switches : the input of each joint's home switch; None where it has none
    """

    card: Card
    layout: Layout
    homing: HomingPlan
    scales: tuple[tuple[float, bool], ...]
    switches: tuple[str | None, ...]


@lru_cache(maxsize=32)
def equip_machine(machine: Machine, hardware: str) -> Equipment:
    """Equip a machine with a card, or with as many as it needs; ``hardware`` is one of :data:`.CARDS`.

    Raises :class:`InputError` where the card can't drive it.
    """
    if hardware not in CARDS:
        raise InputError(f"unknown card {quote(hardware)}{suggest(hardware, CARDS)}", "hardware")
    card, homing = CARDS[hardware], find_homing(machine)
    if len(machine.joints) > card.most_joints:
        raise InputError(f"{len(machine.joints)} joints, the {card.title} drives at most {card.most_joints}")
    needed = _COMMON_INPUTS + sum(joint.switch is not None for joint in homing.joints)
    layout = card.arrange(machine.name, machine.joints, needed)
    if needed > len(layout.inputs):
        raise InputError(f"{needed} inputs are needed, the {card.title} has {len(layout.inputs)}")
    scales = tuple(find_scale(drive, card.most_rate, card.title) for drive in machine.drives)
    pins = iter(layout.inputs[_COMMON_INPUTS:])
    switches = tuple(None if joint.switch is None else next(pins) for joint in homing.joints)
    return Equipment(card, layout, homing, scales, switches)
