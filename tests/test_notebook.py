"""In a notebook machines, workspaces and jobs show themselves."""

import html
import re

from IPython.core.interactiveshell import InteractiveShell

import parakin as pk
from parakin.notebook import register_displays

PART = "UNITS/MM\nFEDRAT/900,MMPM\nRAPID\nGOTO/0,0,250\nGOTO/40,10,250\nGOTO/40,-30,250\nFINI\n"


def test_what_a_cell_shows(tmp_path):
    shell = InteractiveShell.instance()
    try:
        assert register_displays()
        format_html = shell.display_formatter.formatters["text/html"]
        machine = pk.load("linear_delta")
        page = html.unescape(re.fullmatch(r'<iframe srcdoc="([^"]*)".*</iframe>', format_html(machine), re.S)[1])
        assert page == pk.render_machine_page(machine)
        shown = format_html(pk.workspace(pk.region(machine), gap=0.3))
        assert "<svg" in shown
        assert "X [mm]" in shown
        (tmp_path / "part.apt").write_text(PART, encoding="utf-8")
        job = pk.prepare(machine, pk.read_path(tmp_path / "part.apt"))
        assert "part.apt" in format_html(job)
        assert format_html(pk.region(machine)) is None  # its repr will do
    finally:
        InteractiveShell.clear_instance()
    assert not register_displays()
