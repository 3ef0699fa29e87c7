"""Mesa's 7I96S: five step generators, 11 inputs, 6 outputs, an analog output for the spindle."""

from __future__ import annotations

from .card import FLOOD, MACHINE_ON, MIST, SPINDLE_ON, SPINDLE_REVERSE
from .mesa import STEPGENS, Board, make_card

_INPUTS, _RELAYS, _DRIVERS = 11, 4, 2


def _list_inputs(card: str) -> list[str]:
    return [f"{card}.inm.00.input-{i:02d}" for i in range(_INPUTS)]


def _list_outputs(card: str) -> list[str]:
    relays = [f"{card}.ssr.00.out-{i:02d}" for i in range(_RELAYS)]
    return [*relays, *(f"{card}.outm.00.out-{i:02d}" for i in range(_RELAYS, _RELAYS + _DRIVERS))]


def _set_spindle(card: str) -> tuple[str, ...]:
    return (
        f"setp {card}.pwmgen.pwm_frequency 20000",
        f"setp {card}.pwmgen.00.output-type 1",
        f"setp {card}.pwmgen.00.scale [SPINDLE_0]MAX_FORWARD_VELOCITY",
    )


def _turn_spindle(card: str) -> tuple[str, ...]:
    return (f"net spindle-on => {card}.pwmgen.00.enable", f"net spindle-speed => {card}.pwmgen.00.value")


MESA_7I96S = make_card(
    Board(
        title="Mesa 7I96S",
        device="hm2_7i96s",
        config=f"num_encoders=0 num_pwmgens=1 num_stepgens={STEPGENS}",
        inputs=_list_inputs,
        outputs=_list_outputs,
        set_spindle=_set_spindle,
        turn_spindle=_turn_spindle,
        signals=(MACHINE_ON, SPINDLE_ON, FLOOD, MIST, SPINDLE_REVERSE),
        wiring=("the spindle's speed: SPINDLE-, SPINDLE OUT and SPINDLE+, in the place of a potentiometer",),
        left=(
            "The card needs LinuxCNC 2.9 and the firmware that it comes with (5 step generators; `mesaflash "
            "--readhmid` shows it), and a network port for itself: see `man hm2_eth`. Set the address in `board_ip`; "
            "of several cards each has its own.",
        ),
    )
)
