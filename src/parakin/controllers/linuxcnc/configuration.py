"""A machine as a LinuxCNC configuration: its kinematics in C, and the files that LinuxCNC starts with."""

from __future__ import annotations

from typing import Literal

from ...arguments import check_arguments
from ...machine import Machine
from .config import write_hal, write_ini, write_rates_hal, write_tool_table
from .first_program import write_first_program
from .guard import name_guard, write_guard
from .hand_box import find_hand_box
from .hardware import equip_machine
from .kinematics_module import name_kinematics, write_module
from .kinematics_switch import write_switch_programs
from .model_header import name_model, write_model
from .page import write_page
from .planner import name_planner, write_planner
from .screen import (
    name_screen,
    name_screen_settings,
    write_screen,
    write_screen_hal,
    write_screen_settings,
)
from .stamp import stamp_file


@check_arguments
def make_linuxcnc_configuration(
    machine: Machine, hardware: str | None = None, screen: Literal["axis", "gmoccapy"] = "axis"
) -> dict[str, str]:
    """Make a configuration for LinuxCNC 2.9, {file: text}: a simulation, or a template for a card of a real machine.

    The files are kinematics, trajectory planner and guard (C, built by LinuxCNC's ``halcompile --install``), the header
    that all include, the ini and HAL files, the window that shows the machine, the tool table, a first program and a
    page that tells how to start, all named after the machine. The last line of each tells by a hash whether the file
    was edited since.

    machine : in whose default working mode the kinematics is
    hardware : ``mesa-7i96s``, ``mesa-7i76e``, ``parport`` or ``ethercat``; None: a simulation
    screen : ``axis`` or ``gmoccapy``, LinuxCNC's own, beside the window that shows the machine

    Raises :class:`InputError` for an unknown card, one with too few joints or inputs, joints that have counts or a lead
    alone, and home switches that can't be reached.
    """
    equipment = None if hardware is None else equip_machine(machine, hardware)
    texts = {
        f"{name_kinematics(machine)}.c": write_module(machine, find_hand_box(machine)),
        f"{name_guard(machine)}.c": write_guard(machine),
        f"{name_planner(machine)}.c": write_planner(machine),
        name_model(machine): write_model(machine),
        f"{machine.name}.ini": write_ini(machine, equipment, screen),
        f"{machine.name}.hal": write_hal(machine, equipment),
        f"{machine.name}_rates.hal": write_rates_hal(machine),
        f"{name_screen(machine)}.py": write_screen(machine),
        f"{name_screen(machine)}.hal": write_screen_hal(machine),
        name_screen_settings(machine, screen): write_screen_settings(machine, screen),
        f"{machine.name}.tbl": write_tool_table(machine),
        f"{machine.name}.ngc": write_first_program(machine),
        f"{machine.name}.md": write_page(machine, equipment, screen),
        **write_switch_programs(machine),
        **(equipment.layout.files if equipment else {}),
    }
    return {name: stamp_file(name, text) for name, text in texts.items()}
