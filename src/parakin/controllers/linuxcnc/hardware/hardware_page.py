"""Write what the page of a configuration says of a card: wiring, homing, and what is left to the hand."""

from __future__ import annotations

from ....machine import Machine
from ....units import name_display_unit, to_display
from ..number_text import format_number
from .absolute import name_encoder
from .equipment import ESTOP, PROBE, Equipment

_SECTION = """\
## On the machine

| terminal | what |
|---|---|
{terminals}

{homing}

### What is left to the hand

{left}

"""

_FOLLOWED = """\
This was followed from {starts} poses all over the workspace, in steps of 4 mm: none of them came to a singularity
(least regularity {least} of home's), and no limit but the drives' ranges was broken. {proof} It must
start where the machine may be left: inside its limits, on home's side of all singularities. Legs can't be jogged one
by one, for their sequence is negative."""

_PROVED_SAFE = """\
That none comes to a singularity, from wherever the machine may be left, is proved by intervals, for joints within
10 mm of their even motion; that no other limit is broken is sampled."""

_ONLY_SAMPLED = "Samples are no proof."

_UNSAFE = """\
Home switches will not do: from {share} of {starts} sampled poses the legs, all together in their best directions,
break a limit or come to a singularity."""

_FOUND = """\
Where the tool is, the kinematics finds from home: of {starts} sampled poses {share} came out as another pose with the
same joints. Samples are no proof."""

_COMMON_LEFT = (
    "Safety: the emergency stop must cut the drives' power by itself. LinuxCNC only watches its contact, which is "
    "closed, and true, while all is well; the drives' alarm contacts belong in the same chain. A drive that loses "
    "its power must hold the platform: brakes.",
    "Levels: home switches and probe are true where they trip; where yours are not, net the pin's `-not`.",
    "Direction: jog every joint a little, one drive switched on at a time, before they are coupled to the platform. "
    "A joint that moves the wrong way gets a negative SCALE (in the description: a negative lead). Legs can be jogged "
    "so while their HOME_SEQUENCE has no minus; put it back.",
    "Following errors: FERROR and MIN_FERROR are 10 ms of way; narrow them once the loops follow.",
    "Limit switches are not wired: with them, before homing, a joint stops that was sent too far "
    "(`joint.N.neg-lim-sw-in`, `joint.N.pos-lim-sw-in`).",
    "The spindle's full speed (`[SPINDLE_0] MAX_FORWARD_VELOCITY`); whether it is at speed nobody asks "
    "(`spindle.0.at-speed`).",
)


def list_files(equipment: Equipment) -> str:
    """List the card's own files, rows of the page's table."""
    return "".join(f"| `{name}` | the card's own description |\n" for name in equipment.layout.files)


def describe_equipment(machine: Machine, equipment: Equipment) -> str:
    """Describe terminals, homing and what is left, Markdown."""
    layout = equipment.layout
    rows = [("emergency stop, closed contact", layout.inputs[ESTOP]), ("probe", layout.inputs[PROBE])]
    rows += [
        (f"home switch of {name}", pin)
        for name, pin in zip(machine.joints, equipment.switches, strict=True)
        if pin is not None
    ]
    rows += [(signal.switches, pin) for signal, pin in zip(layout.signals, layout.outputs, strict=False)]
    missing = [f"{signal.switches}: no output is left for it." for signal in layout.signals[len(layout.outputs) :]]
    wired = [f"{words[0].upper()}{words[1:]}." for words in layout.wiring]
    left = [*_list_chosen(machine, equipment), *missing, *wired, *equipment.card.left, *_COMMON_LEFT]
    return _SECTION.format(
        terminals="\n".join(f"| `{pin}` | {words} |" for words, pin in rows),
        homing="\n".join(_describe_homing(machine, equipment)),
        left="\n".join(f"- {line}" for line in left),
    )


def _list_chosen(machine: Machine, equipment: Equipment) -> list[str]:
    """List the joints whose scale, or whose home switch's place, the description does not say."""
    scales = [name for name, (_, is_said) in zip(machine.joints, equipment.scales, strict=True) if not is_said]
    places = [
        drive.name
        for drive, joint in zip(machine.drives, equipment.homing.joints, strict=True)
        if drive.homing is None and joint.switch is not None
    ]
    encoders = [
        name for name, joint in zip(machine.joints, equipment.homing.joints, strict=True) if joint.switch is None
    ]
    lines = []
    if scales:
        lines.append(f"SCALE of {', '.join(scales)} is a guess: say `counts` and `lead` in the machine's description.")
    if places:
        lines.append(
            f"The home switches of {', '.join(places)} are taken to trip at an end of the range: measure it, "
            "and say it in the machine's description (`homing`)."
        )
    if encoders and equipment.card.has_steps:
        lines.append(
            "LinuxCNC does not start before the pins of the absolute encoders stand in the HAL file, in the place of "
            f"{', '.join(name_encoder(name) for name in encoders)}."
        )
    if encoders:
        lines.append(f"HOME_OFFSET of {', '.join(encoders)}: what the encoder reads where the joint is 0, negative.")
    return lines


def _describe_homing(machine: Machine, equipment: Equipment) -> list[str]:
    """Describe the homing, and what is known of it."""
    plan = equipment.homing
    legs = range(machine.leg_count)
    sequences = sorted({plan.joints[i].sequence for i in legs if plan.joints[i].switch is not None})
    lines = []
    for sequence in sequences:
        words = [_describe_search(machine, equipment, i) for i in legs if plan.joints[i].sequence == sequence]
        first = "Homing moves" if sequence == sequences[0] else "Then it moves"
        lines.append(f"{first} {', '.join(word for word in words if word)}, all together, and then together to home.")
    if sequences:
        lines.append(
            _FOLLOWED.format(
                starts=plan.starts, least=f"{plan.least:.2f}", proof=_PROVED_SAFE if plan.proved else _ONLY_SAMPLED
            )
        )
    else:
        lines.append("Homing moves no leg: their encoders are absolute.")
        if plan.unsafe is not None:
            lines.append(_UNSAFE.format(share=f"{100.0 * plan.unsafe:.3g} %", starts=plan.starts))
        share = "none" if plan.ambiguous == 0.0 else f"{100.0 * plan.ambiguous:.3g} %"
        lines.append(_FOUND.format(starts=plan.starts, share=share))
    serial = range(machine.leg_count, len(machine.joints))
    for i in serial:
        search = _describe_search(machine, equipment, i)
        moves = f"moves {search}" if search else f"leaves {machine.joints[i]}, whose encoder is absolute, where it is"
        lines.append(f"After the legs it {moves}.")
    if any(plan.joints[i].switch is not None for i in serial):
        lines.append("Head and table swing meanwhile: that nothing stands in their way is for you to see.")
    return lines


def _describe_search(machine: Machine, equipment: Equipment, index: int) -> str:
    drive, joint = machine.drives[index], equipment.homing.joints[index]
    if joint.switch is None:
        return ""
    place = format_number(to_display(joint.switch, drive.unit))
    return f"{drive.name} {'down' if joint.direction < 0.0 else 'up'} to {place} {name_display_unit(drive.unit)}"
