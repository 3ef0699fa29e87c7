"""Mesa's 7I76E: five step generators; 32 inputs, 16 outputs and the spindle's terminals as a smart serial device."""

from __future__ import annotations

from .card import FLOOD, MACHINE_ON, MIST
from .mesa import STEPGENS, Board, make_card

_INPUTS, _OUTPUTS = 32, 16


def _list_inputs(card: str) -> list[str]:
    return [f"{card}.7i76.0.0.input-{i:02d}" for i in range(_INPUTS)]


def _list_outputs(card: str) -> list[str]:
    return [f"{card}.7i76.0.0.output-{i:02d}" for i in range(_OUTPUTS)]


def _set_spindle(card: str) -> tuple[str, ...]:
    spindle = f"{card}.7i76.0.0.spinout"
    return (
        f"setp {spindle}-minlim 0",
        f"setp {spindle}-maxlim [SPINDLE_0]MAX_FORWARD_VELOCITY",
        f"setp {spindle}-scalemax [SPINDLE_0]MAX_FORWARD_VELOCITY",
    )


def _turn_spindle(card: str) -> tuple[str, ...]:
    return (
        f"net spindle-on => {card}.7i76.0.0.spinena",
        f"net spindle-reverse spindle.0.reverse => {card}.7i76.0.0.spindir",
        f"net spindle-speed => {card}.7i76.0.0.spinout",
    )


MESA_7I76E = make_card(
    Board(
        title="Mesa 7I76E",
        device="hm2_7i76e",
        config=f"num_encoders=0 num_pwmgens=0 num_stepgens={STEPGENS} sserial_port_0=0xxxxxxx",
        inputs=_list_inputs,
        outputs=_list_outputs,
        set_spindle=_set_spindle,
        turn_spindle=_turn_spindle,
        signals=(MACHINE_ON, FLOOD, MIST),
        wiring=("the spindle: its terminals on TB4, enable, direction and speed (0 to 10 V)",),
        left=(
            "The card needs the firmware that it comes with (5 step generators), field power for its terminals, and a "
            "network port for itself: see `man hm2_eth`. Set the address in `board_ip`; of several cards each has its "
            "own.",
        ),
    )
)
