"""The common model of cards: which HAL pins and functions a card has, and by which lines it drives a joint.

A card's file says nothing else. What is wired to what is the same for all of them: :mod:`.wiring`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from ....model.elements import Drive

SERVO_PERIOD = 1e-3  # s


@dataclass(frozen=True)
class Signal:
    """A HAL signal for a digital output: its name, the pin that gives it (none where it has one), what it switches."""

    name: str
    source: str
    switches: str


MACHINE_ON = Signal("enabled", "", "drives on, or their contactor")
SPINDLE_ON = Signal("spindle-on", "", "spindle on")
SPINDLE_REVERSE = Signal("spindle-reverse", "spindle.0.reverse", "spindle backward (M4)")
FLOOD = Signal("flood", "iocontrol.0.coolant-flood", "flood coolant (M8)")
MIST = Signal("mist", "iocontrol.0.coolant-mist", "mist (M7)")


@dataclass(frozen=True)
class Layout:
    """The pins and lines of a card, or of as many cards as a machine's drives need.

    load : HAL commands that load and set up the driver
    read, write : functions of the servo thread, before and behind the motion controller
    fast : functions of the base thread, for pulses made by software
    loops : for each joint, HAL lines from its signals joint-N-command, joint-N-enable to joint-N-feedback
    inputs, outputs : digital pins that are free, in the order of use; ``PIN-not`` is an input's opposite
    faults : pins that are true while something is wrong with the card
    spindle : lines that take the signals spindle-on and spindle-speed (rpm) to the card
    signals : what the outputs are for, the most needed first
    files : further files of the configuration, by name
    wiring : a line of words on each terminal that is not digital
    """

    load: tuple[str, ...]
    read: tuple[str, ...]
    write: tuple[str, ...]
    loops: tuple[tuple[str, ...], ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    spindle: tuple[str, ...]
    signals: tuple[Signal, ...]
    fast: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    wiring: tuple[str, ...] = ()


@dataclass(frozen=True)
class Card:
    """A kind of card.

    title : its name for people
    source : where its pins' names are documented
    most_joints : how many joints it drives
    most_rate : the greatest rate of steps a second of a joint; infinity where positions are sent
    has_steps : whether positions are counted in steps from wherever the joint stood, for no encoder is read
    arrange : make the layout for a machine's name, its joints' names and the number of inputs that it needs
    list_keys : make the lines of a joint's section in the ini file, for its drive and its scale (steps or counts a mm
        or degree)
    period : of the base thread, ns; 0 without one
    left : what is left to the hand, lines of the page
    """

    title: str
    source: str
    most_joints: int
    most_rate: float
    has_steps: bool
    arrange: Callable[[str, Sequence[str], int], Layout]
    list_keys: Callable[[Drive, float], list[str]]
    left: tuple[str, ...]
    period: int = 0
