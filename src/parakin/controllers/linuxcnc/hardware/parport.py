"""A parallel port, or two: steps made by software in a fast thread.

Pins as in LinuxCNC 2.9: man hal_parport, stepgen(9), pwmgen(9).
"""

from __future__ import annotations

from collections.abc import Sequence

from ....model.elements import Drive
from .card import FLOOD, MACHINE_ON, MIST, SPINDLE_ON, SPINDLE_REVERSE, Card, Layout, Signal
from .stepper import list_step_keys, list_step_settings

_PERIOD = 40_000  # ns
_RESET = 5000  # ns from a step's begin to its end, which the port makes in the same cycle
_OUT = (2, 3, 4, 5, 6, 7, 8, 9, 1, 14, 16, 17)  # pins of a port "out"
_OUT_INPUTS = (10, 11, 12, 13, 15)
_IN = (2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 15)  # inputs of a port "in", which has four outputs
_IN_OUTPUTS = (1, 14, 16, 17)
_SPINDLE_PWM = Signal("spindle-pwm", "pwmgen.0.pwm", "the spindle's speed, as PWM of 100 Hz")
_SIGNALS = (MACHINE_ON, SPINDLE_ON, FLOOD, _SPINDLE_PWM, SPINDLE_REVERSE, MIST)


def _arrange(name: str, joints: Sequence[str], inputs: int) -> Layout:
    count = len(joints)
    two = inputs > len(_OUT_INPUTS) or 2 * count + len(_SIGNALS) > len(_OUT)
    first = [f"parport.0.pin-{pin:02d}-out" for pin in _OUT]
    second = [f"parport.1.pin-{pin:02d}-out" for pin in _IN_OUTPUTS] if two else []
    ports = range(2 if two else 1)
    steps, directions = first[0 : 2 * count : 2], first[1 : 2 * count : 2]
    return Layout(
        load=(
            f'loadrt hal_parport cfg="{"0 out 1 in" if two else "0 out"}"',
            f"loadrt stepgen step_type={','.join(['0'] * count)} ctrl_type={','.join(['p'] * count)}",
            "loadrt pwmgen output_type=0",
            f"setp parport.0.reset-time {_RESET}",
            *(f"setp {pin}-reset 1" for pin in steps),
            "setp pwmgen.0.pwm-freq 100",
            "setp pwmgen.0.scale [SPINDLE_0]MAX_FORWARD_VELOCITY",
        ),
        fast=(
            *(f"parport.{i}.read" for i in ports),
            "stepgen.make-pulses",
            "pwmgen.make-pulses",
            *(f"parport.{i}.write" for i in ports),
            "parport.0.reset",
        ),
        read=("stepgen.capture-position",),
        write=("stepgen.update-freq", "pwmgen.update"),
        loops=tuple(_list_loop(i, steps[i], directions[i]) for i in range(count)),
        inputs=(
            *(f"parport.0.pin-{pin:02d}-in" for pin in _OUT_INPUTS),
            *(f"parport.1.pin-{pin:02d}-in" for pin in (_IN if two else ())),
        ),
        outputs=(*first[2 * count :], *second),
        spindle=("net spindle-on => pwmgen.0.enable", "net spindle-speed => pwmgen.0.value"),
        signals=_SIGNALS,
    )


def _list_loop(index: int, step: str, direction: str) -> tuple[str, ...]:
    stepgen = f"stepgen.{index}"
    return (
        *list_step_settings(stepgen, index),
        f"net joint-{index}-command => {stepgen}.position-cmd",
        f"net joint-{index}-feedback {stepgen}.position-fb",
        f"net joint-{index}-enable => {stepgen}.enable",
        f"net joint-{index}-step {stepgen}.step => {step}",
        f"net joint-{index}-direction {stepgen}.dir => {direction}",
    )


def _list_joint_keys(drive: Drive, scale: float) -> list[str]:
    """List a joint's keys: a pause of 0 lets the port end a step in the cycle that begins it."""
    keys = list_step_keys(drive, 1.0, _PERIOD)
    return ["STEPSPACE = 0" if key.startswith("STEPSPACE") else key for key in keys]


PARPORT = Card(
    title="parallel port",
    source="man hal_parport, stepgen(9) and pwmgen(9) of LinuxCNC 2.9",
    most_joints=len(_OUT) // 2,
    most_rate=1e9 / _PERIOD,
    has_steps=True,
    arrange=_arrange,
    list_keys=_list_joint_keys,
    period=_PERIOD,
    left=(
        "Run LinuxCNC's latency test first: the base thread has 40 µs a cycle (BASE_PERIOD). A step lasts 5 µs "
        "(`parport.0.reset-time`), and a direction is set 40 µs before (DIRSETUP).",
        "Ports are numbered as Linux detects them; `0 out 1 in` may be addresses instead, as `0x378 out`. The second "
        "port must be able to read its data pins.",
    ),
)
