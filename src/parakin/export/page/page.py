"""Render a machine's page: one HTML file that needs no server and no network."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arguments import RowsLike, check_arguments
from ...errors import PoseError
from ...machine import Machine
from .machine_data import encode_mode, encode_page_machine
from .model_script import write_model
from .path_data import encode_page_path
from .surface_data import encode_page_surface
from .three_script import read_three_script

if TYPE_CHECKING:
    from ...toolpath.posting.posted import Posted
    from ...toolpath.timing import Trajectory
    from ...workspaces.sampled.distance_field import SampledField

CORE = ("linear_algebra", "kinematics")
APP = (
    "motion",
    "sizes",
    "view",
    "orbit",
    "labels",
    "drag",
    "free_motion",
    "panel",
    "workspace",
    "section",
    "shown_surface",
    "shown_values",
    "path",
    "player",
    "place",
    "app",
)
WORKER = ("surface_worker",)


_MARK = '<meta name="generator" content="parakin">'


def is_page(path: Path) -> bool:
    """Tell whether a file is a page that was rendered here."""
    try:
        with path.open("rb") as file:
            return _MARK.encode() in file.read(2000)
    except OSError:
        return False


@check_arguments
def render_machine_page(machine: Machine, pose: RowsLike | None = None) -> str:
    """Render a self-contained HTML page on which a machine moves: by its tool, its joints and its modes.

    machine : its sizes, too, can be dragged on the page
    pose : (axes,) mm and rad, at which it stands at first; home by default

    Raises :class:`PoseError` for a pose out of reach, :class:`NoMethodError` where the installed trimesh does not bring
    three.js.
    """
    begin = machine.home if pose is None else machine.rows(pose, machine.axes, "pose")[0]
    if not np.isfinite(machine.inverse(begin)).all():
        raise PoseError("pose: one within reach expected")
    return _render_page(machine, _name_page(machine), {"begin": begin.ravel().tolist()})


def _name_page(machine: Machine) -> str:
    """Name a machine as its file does, on one line."""
    return " ".join(machine.spec.title.split()) or machine.name


@check_arguments
def render_workspace_page(field: SampledField) -> str:
    """Render such a page with the surface of a workspace, in its mode, at its orientation.

    field : of :func:`parakin.sample_field`, over two or three positions

    Raises :class:`PoseError` for an empty field, and as :func:`parakin.render_machine_page` does.
    """
    region, machine = field.region, field.region.machine
    if not len(field.inside):
        raise PoseError("field: a workspace that is not empty expected")
    places = region.home_position, field.low + field.inside[len(field.inside) // 2] * field.step
    pose = machine.home.copy()
    for axis, value in region.fixed_axes.items():
        pose[machine.axes.index(axis)] = value
    for place in places:  # home, or where there is none a place inside
        pose[[machine.axes.index(axis) for axis in region.free_axes]] = place
        if machine.check(pose, mode=region.mode) == 0:
            break
    given = {"begin": pose.tolist(), "signs": encode_mode(region.mode), "proved": encode_page_surface(field)}
    return _render_page(machine, f"Workspace of {_name_page(machine)}", given)


@check_arguments
def render_path_page(posted: Posted, trajectory: Trajectory | None = None, numbers: int = 30_000) -> str:
    """Render such a page with the tool path of a posted part, which can be played.

    posted : :attr:`Job.posted`, the path on a machine
    trajectory : :attr:`Job.trajectory`, by whose time it is played; without it record by record
    numbers : how many of the path the page may hold, some 5 bytes each; the fewer, the coarser are its samples

    Raises :class:`PoseError` for a path without records, and as :func:`parakin.render_machine_page` does.
    """
    if not len(posted.path):
        raise PoseError("posted: a path with records expected, this one has no motion")
    path = encode_page_path(posted, trajectory, numbers)
    title = f"{path['source']} on {_name_page(posted.machine)}"
    return _render_page(posted.machine, title, {"begin": posted.machine.home.tolist(), "path": path})


def _render_page(machine: Machine, title: str, given: dict[str, Any]) -> str:
    """Render the page of a machine that begins with what is given: a pose, a mode, a path, a surface."""
    what = f"{machine.name}: axes {' '.join(machine.axes)}, joints {' '.join(machine.joints)}"
    data = f"const {{begin, signs, path, proved}} = {json.dumps(given, separators=(',', ':'), allow_nan=False)};\n"
    return Template(_read_text("page.html")).substitute(
        mark=_MARK,
        title=escape(title),
        subtitle=escape(what),
        style=_read_text("page.css"),
        three=read_three_script(),
        core=_quote_script(write_core(machine)),
        worker=write_surface_worker(),
        script=f'(() => {{\n"use strict";\n{_quote_script(data)}{_join_scripts(APP)}}})();',
    )


def write_core(machine: Machine) -> str:
    """Write the script of a machine's data and mathematics, which needs no document."""
    data = json.dumps(encode_page_machine(machine), separators=(",", ":"), allow_nan=False)
    return f"const machine = {data};\n{_read_text('elementary.js')}{write_model(machine)}{_join_scripts(CORE)}"


def write_surface_worker() -> str:
    """Write the script that computes surfaces and sections beside a page, after that of :func:`write_core`."""
    return _join_scripts(WORKER)


def _join_scripts(names: tuple[str, ...]) -> str:
    return "".join(_read_text(f"{name}.js") for name in names)


def _read_text(name: str) -> str:
    return files(__package__).joinpath(name).read_text("utf-8")


def _quote_script(script: str) -> str:
    """Quote what could end or open an element within a script; in JavaScript that is in texts only."""
    return script.replace("</", "<\\/").replace("<!--", "<\\!--")
