"""How machines, workspaces and jobs show themselves in a notebook: the page, in a frame."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .machine import Machine
    from .toolpath.job import Job
    from .workspaces.certified.workspace import Workspace

_HEIGHT = 560  # px
_SECONDS = 10.0  # for a surface
_STEPS = {2: 100, 3: 36}  # of an area and of a surface along the longest edge: a page is to stay small


def format_machine(machine: Machine) -> str:
    """Format a machine as its page in a frame."""
    from .export.page.page import render_machine_page

    return _embed_page(render_machine_page(machine))


def format_job(job: Job) -> str:
    """Format a job as the page on which its tool path is played."""
    from .export.page.page import render_path_page

    return _embed_page(render_path_page(job.posted, job.trajectory))


def format_workspace(workspace: Workspace) -> str | None:
    """Format a workspace as its machine's page with its surface; none for a line, or where there is no time for one."""
    from .export.page.page import render_workspace_page
    from .workspaces.sampled.distance_field import sample_field

    if workspace.box is None or len(workspace.axes) == 1:
        return None
    step = float((workspace.box[1] - workspace.box[0]).max()) / _STEPS[len(workspace.axes)]
    field = sample_field(workspace.region, workspace.box, step, seconds=_SECONDS)
    return f"<p>{escape(repr(workspace)[1:-1])}</p>\n{_embed_page(render_workspace_page(field))}"


def _embed_page(page: str) -> str:
    """Embed a page in a frame that needs no file and no server."""
    return (
        f'<iframe srcdoc="{escape(page)}" sandbox="allow-scripts" '
        f'style="width: 100%; height: {_HEIGHT}px; border: 0"></iframe>'
    )
