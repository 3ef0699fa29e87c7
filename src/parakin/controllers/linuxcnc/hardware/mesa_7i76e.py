"""Mesa's 7I76E: five step generators; 32 inputs, 16 outputs and the spindle's terminals as a smart serial device."""

from __future__ import annotations

from collections.abc import Sequence

from .card import FLOOD, MACHINE_ON, MIST, Card, Layout
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

_INPUTS, _OUTPUTS = 32, 16


def _arrange(name: str, joints: Sequence[str], inputs: int) -> Layout:
    count = count_cards(len(joints), inputs, _INPUTS)
    cards = [f"hm2_7i76e.{i}" for i in range(count)]
    terminals = [f"{card}.7i76.0.0" for card in cards]
    spindle = terminals[0]
    return Layout(
        load=(
            *list_loading(count, f"num_encoders=0 num_pwmgens=0 num_stepgens={STEPGENS} sserial_port_0=0xxxxxxx"),
            *list_setup(cards, len(joints)),
            f"setp {spindle}.spinout-minlim 0",
            f"setp {spindle}.spinout-maxlim [SPINDLE_0]MAX_FORWARD_VELOCITY",
            f"setp {spindle}.spinout-scalemax [SPINDLE_0]MAX_FORWARD_VELOCITY",
        ),
        read=list_reading(cards),
        write=list_writing(cards, len(joints)),
        loops=tuple(list_loop(cards[i // STEPGENS], i % STEPGENS, i) for i in range(len(joints))),
        inputs=tuple(f"{card}.input-{i:02d}" for card in terminals for i in range(_INPUTS)),
        outputs=tuple(f"{card}.output-{i:02d}" for card in terminals for i in range(_OUTPUTS)),
        spindle=(
            f"net spindle-on => {spindle}.spinena",
            f"net spindle-reverse spindle.0.reverse => {spindle}.spindir",
            f"net spindle-speed => {spindle}.spinout",
        ),
        signals=(MACHINE_ON, FLOOD, MIST),
        faults=tuple(f"{card}.watchdog.has_bit" for card in cards),
        wiring=("the spindle: its terminals on TB4, enable, direction and speed (0 to 10 V)",),
    )


MESA_7I76E = Card(
    title="Mesa 7I76E",
    source=SOURCE,
    most_joints=MOST_JOINTS,
    most_rate=MOST_RATE,
    has_steps=True,
    arrange=_arrange,
    list_keys=list_joint_keys,
    left=(
        "The card needs the firmware that it comes with (5 step generators), field power for its terminals, and a "
        "network port for itself: see `man hm2_eth`. Set the address in `board_ip`; of several cards each has its own.",
        "A bitten watchdog stays an emergency stop until `halcmd sets card-fault-0 0`.",
    ),
)
