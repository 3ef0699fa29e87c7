"""In a notebook machines, workspaces and jobs show themselves."""

import html
import re

from IPython.core.formatters import HTMLFormatter

import parakin as pk

PART = "UNITS/MM\nFEDRAT/900,MMPM\nRAPID\nGOTO/0,0,250\nGOTO/40,10,250\nGOTO/40,-30,250\nFINI\n"


def test_what_a_cell_shows(tmp_path):
    format_html = HTMLFormatter()
    machine = pk.load("linear_delta")
    page = html.unescape(re.fullmatch(r'<iframe srcdoc="([^"]*)".*</iframe>', format_html(machine), re.S)[1])
    assert page == pk.render_machine_page(machine)
    assert machine._repr_html_() == format_html(machine)  # for notebooks that are not IPython's
    shown = format_html(pk.workspace(pk.region(machine), gap=0.3))
    assert "<svg" in shown
    assert "X [mm]" in shown
    (tmp_path / "part.apt").write_text(PART, encoding="utf-8")
    job = pk.prepare(machine, pk.read_path(tmp_path / "part.apt"))
    assert "part.apt" in format_html(job)
    assert format_html(pk.region(machine)) is None  # its repr will do


def test_what_can_not_be_drawn_is_told_by_its_repr():
    line = pk.workspace(pk.region(pk.load("linear_delta"), at={"X": 0.0, "Y": 0.0}), gap=0.1)
    assert line._repr_html_() is None
