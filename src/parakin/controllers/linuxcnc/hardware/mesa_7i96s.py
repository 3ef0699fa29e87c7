"""Mesa's 7I96S: five step generators, 11 inputs, 6 outputs, an analog output for the spindle."""

from __future__ import annotations

from collections.abc import Sequence

from .card import FLOOD, MACHINE_ON, MIST, SPINDLE_ON, SPINDLE_REVERSE, Card, Layout
from .mesa import (
    MOST_JOINTS,
    MOST_RATE,
    SOURCE,
    STEPGENS,
    count_cards,
    list_joint_keys,
    list_loading,
    list_loop,
    list_reading,
    list_setup,
    list_writing,
)

_INPUTS, _RELAYS, _DRIVERS = 11, 4, 2


def _arrange(name: str, joints: Sequence[str], inputs: int) -> Layout:
    count = count_cards(len(joints), inputs, _INPUTS)
    cards = [f"hm2_7i96s.{i}" for i in range(count)]
    spindle = f"{cards[0]}.pwmgen.00"
    return Layout(
        load=(
            *list_loading(count, f"num_encoders=0 num_pwmgens=1 num_stepgens={STEPGENS}"),
            *list_setup(cards, len(joints)),
            f"setp {cards[0]}.pwmgen.pwm_frequency 20000",
            f"setp {spindle}.output-type 1",
            f"setp {spindle}.scale [SPINDLE_0]MAX_FORWARD_VELOCITY",
        ),
        read=list_reading(cards),
        write=list_writing(cards, len(joints)),
        loops=tuple(list_loop(cards[i // STEPGENS], i % STEPGENS, i) for i in range(len(joints))),
        inputs=tuple(f"{card}.inm.00.input-{i:02d}" for card in cards for i in range(_INPUTS)),
        outputs=tuple(pin for card in cards for pin in _list_outputs(card)),
        spindle=(f"net spindle-on => {spindle}.enable", f"net spindle-speed => {spindle}.value"),
        signals=(MACHINE_ON, SPINDLE_ON, FLOOD, MIST, SPINDLE_REVERSE),
        faults=tuple(f"{card}.watchdog.has_bit" for card in cards),
        wiring=("the spindle's speed: SPINDLE-, SPINDLE OUT and SPINDLE+, in the place of a potentiometer",),
    )


def _list_outputs(card: str) -> list[str]:
    relays = [f"{card}.ssr.00.out-{i:02d}" for i in range(_RELAYS)]
    return [*relays, *(f"{card}.outm.00.out-{i:02d}" for i in range(_RELAYS, _RELAYS + _DRIVERS))]


MESA_7I96S = Card(
    title="Mesa 7I96S",
    source=SOURCE,
    most_joints=MOST_JOINTS,
    most_rate=MOST_RATE,
    has_steps=True,
    arrange=_arrange,
    list_keys=list_joint_keys,
    left=(
        "The card needs LinuxCNC 2.9 and the firmware that it comes with (5 step generators; `mesaflash --readhmid` "
        "shows it), and a network port for itself: see `man hm2_eth`. Set the address in `board_ip`; of several cards "
        "each has its own.",
        "A bitten watchdog stays an emergency stop until `halcmd sets card-fault-0 0`.",
    ),
)
