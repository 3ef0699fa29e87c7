"""Absolute encoders beside step generators, which count from zero whenever they start."""

from __future__ import annotations

from collections.abc import Sequence


def name_encoder(joint: str) -> str:
    """Name the pin that stands for a joint's encoder until a hand puts its real one there; no driver has it."""
    return f"ENCODER-{joint}"


def list_loading(indices: Sequence[int]) -> list[str]:
    """List the HAL lines that load what is needed for joints, and what runs before the motion controller."""
    names = [f"encoder-{i}" for i in indices]
    lines = [f"loadrt {kind} names={','.join(f'{name}-{kind}' for name in names)}" for kind in ("sum2", "mux2")]
    lines.append(f"loadrt offset names={','.join(names)}")
    for name in names:
        lines += [f"addf {name}-sum2 servo-thread", f"addf {name}-mux2 servo-thread"]
        lines.append(f"addf {name}.update-feedback servo-thread")
    return lines


def list_loop(index: int, joint: str) -> list[str]:
    """List the HAL lines between a joint and its loop: what the loop counts is shifted to what the encoder reads.

    The shift is taken anew while the machine is off, and kept while it is on.
    """
    name, pin = f"encoder-{index}", name_encoder(joint)
    return [
        f"# Put its absolute encoder's pin, mm or degrees, in the place of {pin}: else LinuxCNC does not start.",
        f"net joint-{index}-encoder {pin} => {name}-sum2.in1",
        f"setp {name}-sum2.gain1 -1",
        f"net joint-{index}-feedback => {name}-sum2.in0 {name}.fb-in",
        f"net joint-{index}-off {name}-sum2.out => {name}-mux2.in0",
        f"net joint-{index}-shift {name}-mux2.out => {name}-mux2.in1 {name}.offset",
        f"net enabled => {name}-mux2.sel",
        f"net joint-{index}-told joint.{index}.motor-pos-cmd => {name}.in",
        f"net joint-{index}-command {name}.out",
        f"net joint-{index}-seen {name}.fb-out => joint.{index}.motor-pos-fb",
    ]


def list_writing(indices: Sequence[int]) -> list[str]:
    """List the functions behind the motion controller."""
    return [f"addf encoder-{i}.update-output servo-thread" for i in indices]
