"""In a notebook machines, workspaces and jobs show themselves."""

import html
import re

import numpy as np
import pytest
from browser import needs_chromium, open_browser, open_tab
from IPython.core.formatters import HTMLFormatter
from shipped import load_shipped

import parakin as pk

PART = "UNITS/MM\nFEDRAT/900,MMPM\nRAPID\nGOTO/0,0,250\nGOTO/40,10,250\nGOTO/40,-30,250\nFINI\n"


@pytest.fixture(scope="module")
def browser():
    with open_browser() as opened:
        yield opened


def unwrap(shown):
    return html.unescape(re.search(r'<iframe srcdoc="([^"]*)".*</iframe>', shown, re.S)[1])


def test_what_a_cell_shows(tmp_path):
    format_html = HTMLFormatter()
    machine = pk.load("linear_delta")
    assert unwrap(format_html(machine)) == pk.render_machine_page(machine)
    assert machine._repr_html_() == format_html(machine)  # for notebooks that are not IPython's
    (tmp_path / "part.apt").write_text(PART, encoding="utf-8")
    job = pk.prepare(machine, pk.read_path(tmp_path / "part.apt"))
    assert "part.apt" in format_html(job)
    assert format_html(pk.region(machine)) is None  # its repr will do


@needs_chromium
def test_a_cell_shows_a_workspace_on_its_machines_page(tmp_path, browser):
    regions = {
        "slice": pk.region(load_shipped("rpr3"), at={"C": 0.3}),
        "plane": pk.region(load_shipped("five_bar"), mode="++"),
        "space": pk.region(load_shipped("linear_delta")),
    }
    for name, region in regions.items():
        workspace = pk.workspace(region, gap=0.3)
        shown = workspace._repr_html_()
        assert html.escape(repr(workspace)[1:-1]) in shown
        page = tmp_path / f"{name}.html"
        page.write_text(unwrap(shown), encoding="utf-8")
        assert page.stat().st_size < 1_000_000
        with open_tab(browser) as tab:
            tab.goto(page.as_uri())
            corners = np.array(tab.evaluate("parakin.shownCorners()")).reshape(-1, 3, 3)
            begin = np.array(tab.evaluate("parakin.state.pose"))
            signs = "".join("+" if sign > 0 else "-" for sign in tab.evaluate("parakin.state.signs"))
        assert signs == region.mode
        assert region.machine.check(begin, mode=region.mode) == 0
        assert all(begin[region.machine.axes.index(axis)] == value for axis, value in region.fixed_axes.items())
        edges = np.diff(corners, axis=1)
        if len(workspace.axes) == 2:
            size = 0.5 * np.abs(np.linalg.det(edges[:, :, :2])).sum()
        else:
            size = np.linalg.det(corners).sum() / 6.0  # the divergence theorem: outward is counterclockwise
        assert workspace.volume.inner * 0.98 < size < workspace.volume.outer * 1.02


def test_what_can_not_be_drawn_is_told_by_its_repr():
    line = pk.workspace(pk.region(pk.load("linear_delta"), at={"X": 0.0, "Y": 0.0}), gap=0.1)
    assert line._repr_html_() is None
