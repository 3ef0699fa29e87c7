"""What Mesa's Ethernet cards have in common: HostMot2's step generators behind PID loops, read and written by hm2_eth.

Pins as in LinuxCNC 2.9: man hm2_eth(9), hostmot2(9), sserial(9), pid(9), and as exported by stepgen.c, inm.c, ssr.c,
outm.c, pwmgen.c and watchdog.c of its driver.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil

from ....model.elements import Drive
from ....units import to_display
from ..axis_rates import choose_drive_rates
from ..number_text import format_number
from .card import SERVO_PERIOD, Card, Layout, Signal
from .scale import RESERVE
from .stepper import list_step_keys, list_step_settings

_MOST_RATE = 1e6  # steps/s: pulses and pauses of 500 ns, which drives for fast steps take
STEPGENS = 5  # of a card, with the firmware that it comes with
_USUAL_PULSE = 2500.0  # ns, which nearly every drive takes
_DIRECTION = 5000.0  # ns
_CORRECTION = 0.025  # of a joint's speed: by which a loop may correct at most, as pncconf has it
_MOST_CARDS = 4  # that hm2_eth takes
_MOST_JOINTS = STEPGENS * _MOST_CARDS

_SOURCE = "man hm2_eth(9), hostmot2(9), sserial(9) and pid(9) of LinuxCNC 2.9"


@dataclass(frozen=True)
class Board:
    """What one kind of card has of its own.

    title, left : as of :class:`Card`
    device : its name in HAL, without its number
    config : what HostMot2 is to take of its firmware
    inputs, outputs : make the digital pins of a card, given by its name in HAL
    set_spindle : make the lines that set up the spindle's output of the first card
    turn_spindle, signals, wiring : as of :class:`Layout`, the first made for the first card
    """

    title: str
    device: str
    config: str
    inputs: Callable[[str], list[str]]
    outputs: Callable[[str], list[str]]
    set_spindle: Callable[[str], tuple[str, ...]]
    turn_spindle: Callable[[str], tuple[str, ...]]
    signals: tuple[Signal, ...]
    wiring: tuple[str, ...]
    left: tuple[str, ...]


def make_card(board: Board) -> Card:
    """Make the card of a board."""

    def arrange(name: str, joints: Sequence[str], inputs: int) -> Layout:
        count = _count_cards(len(joints), inputs, len(board.inputs(board.device)))
        cards = [f"{board.device}.{i}" for i in range(count)]
        return Layout(
            load=(
                *_list_loading(count, board.config),
                *_list_setup(cards, len(joints)),
                *board.set_spindle(cards[0]),
            ),
            read=_list_reading(cards),
            write=_list_writing(cards, len(joints)),
            loops=tuple(_list_loop(cards[i // STEPGENS], i % STEPGENS, i) for i in range(len(joints))),
            inputs=tuple(pin for card in cards for pin in board.inputs(card)),
            outputs=tuple(pin for card in cards for pin in board.outputs(card)),
            spindle=board.turn_spindle(cards[0]),
            signals=board.signals,
            faults=tuple(f"{card}.watchdog.has_bit" for card in cards),
            wiring=board.wiring,
        )

    return Card(
        title=board.title,
        source=_SOURCE,
        most_joints=_MOST_JOINTS,
        most_rate=_MOST_RATE,
        has_steps=True,
        arrange=arrange,
        list_keys=_list_joint_keys,
        left=(*board.left, "A bitten watchdog stays an emergency stop until `halcmd sets card-fault-0 0`."),
    )


def _count_cards(joints: int, inputs: int, inputs_of_card: int) -> int:
    """Count the cards that have step generators and inputs enough, at most as many as hm2_eth takes."""
    return min(_MOST_CARDS, max(ceil(joints / STEPGENS), ceil(inputs / inputs_of_card)))


def _list_loading(cards: int, config: str) -> tuple[str, ...]:
    """List the commands that load the driver; the first address is that of a card's jumpers."""
    addresses = ",".join(f"10.10.10.{10 + i}" for i in range(cards))
    configs = ",".join([config] * cards)
    return ("loadrt hostmot2", f'loadrt hm2_eth board_ip="{addresses}" config="{configs}"')


def _list_setup(cards: list[str], joints: int) -> tuple[str, ...]:
    """List what is set on every card, and the PID loops' loading."""
    watchdogs = [f"setp {card}.watchdog.timeout_ns 5000000" for card in cards]
    sampling = [
        line
        for card in cards
        for line in (f"#setp {card}.dpll.01.timer-us -50", f"#setp {card}.stepgen.timer-number 1")
    ]
    note = "# Steadier feedback, where the firmware has a DPLL (halcmd show pin dpll): take these lines in."
    return (*watchdogs, note, *sampling, f"loadrt pid num_chan={joints}")


def _list_reading(cards: list[str]) -> tuple[str, ...]:
    """List the functions before the motion controller: all cards are asked before the first answer is waited for."""
    return (*(f"{card}.read-request" for card in cards), *(f"{card}.read" for card in cards))


def _list_writing(cards: list[str], joints: int) -> tuple[str, ...]:
    """List the functions behind the motion controller."""
    return (*(f"pid.{i}.do-pid-calcs" for i in range(joints)), *(f"{card}.write" for card in cards))


def _list_loop(card: str, channel: int, index: int) -> tuple[str, ...]:
    """List the lines of a joint's loop: a PID tells the step generator how fast, from where it is."""
    stepgen, pid, section = f"{card}.stepgen.{channel:02d}", f"pid.{index}", f"[JOINT_{index}]"
    return (
        *list_step_settings(stepgen, index),
        f"setp {stepgen}.step_type 0",
        f"setp {stepgen}.control-type 1",
        f"setp {pid}.Pgain {section}P",
        f"setp {pid}.FF1 {section}FF1",
        f"setp {pid}.maxerror {section}MAX_ERROR",
        f"setp {pid}.maxoutput {section}STEPGEN_MAXVEL",
        f"setp {pid}.error-previous-target true",
        f"net joint-{index}-command => {pid}.command",
        f"net joint-{index}-feedback {stepgen}.position-fb => {pid}.feedback",
        f"net joint-{index}-velocity {pid}.output => {stepgen}.velocity-cmd",
        f"net joint-{index}-enable => {pid}.enable {stepgen}.enable",
    )


def _list_joint_keys(drive: Drive, scale: float) -> list[str]:
    """List a joint's keys in the ini file: pulses as short as the speed asks for, and the loop's gains."""
    speed = to_display(choose_drive_rates(drive)[0], drive.unit)
    pulse = min(_USUAL_PULSE, 0.5e9 / (RESERVE * speed * abs(scale)))
    error = _CORRECTION * speed * SERVO_PERIOD
    gains = [f"P = {format_number(1.0 / SERVO_PERIOD)}", "FF1 = 1", f"MAX_ERROR = {format_number(error)}"]
    return [*list_step_keys(drive, pulse, _DIRECTION), *gains]
