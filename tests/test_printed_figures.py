"""Figures for a printed page: vectors with their text, of one size and width, without a heading."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.export.position_map import LEVELS, extend_grid, fill_map, set_bar_ticks
from parakin.export.space_axes import add_space_axes, fit_to_room

COMMANDS = {
    "plane": ("workspace", "hbg80_2d", "--gap", "0.05"),
    "space": ("workspace", "linear_delta", "--gap", "0.2", "--step", "40"),
    "curves": ("workspace", "hbg80_2d", "--method", "drives"),
    "machine": ("show", "tricept"),
    "planar machine": ("show", "rpr3"),
    "map": ("atlas", "hbg80_2d", "--step", "40"),
    "accuracy": ("accuracy", "rpr3", "--tolerance", "feet=0.05mm", "--samples", "40"),
    "stiffness": ("stiffness", "hbg80_2d", "--drives", "100N/um", "--samples", "40"),
}
IN_A_COLUMN = ("machine", "planar machine", "accuracy", "stiffness")
SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("kind", COMMANDS)
def test_a_figure_for_a_page(kind, tmp_path, capsys):
    command = COMMANDS[kind]
    path = tmp_path / "figure.svg"
    assert main([*command, "-o", str(path)]) == 0
    said = capsys.readouterr().out
    if command[0] == "atlas":
        assert "hbg80_2d: performance, constant orientation" in said  # what a caption needs
    root = ElementTree.parse(path).getroot()
    page = 3.5 if kind in IN_A_COLUMN else 7.2  # inches
    assert 0.7 * page < float(root.get("width").removesuffix("pt")) / 72.0 <= page + 0.05
    texts = list(root.iter(f"{SVG}text"))
    assert {"X [mm]", "Y [mm]"} <= {text.text for text in texts}
    upright = {text.text for text in texts if "rotate(-90" in text.get("transform", "")}
    assert upright <= {"Y [mm]"}  # a scale's name beside it would be longer than the scale of a flat map
    sizes = {re.search(r"([\d.]+)px", text.get("style"))[1] for text in texts}
    assert sizes == {"7"}
    assert path.stat().st_size < 2_000_000
    assert not list(root.iter(f"{SVG}image"))
    first = path.read_bytes()
    assert main([*command, "-o", str(path)]) == 0
    assert path.read_bytes() == first  # no date, no random names


def test_a_finer_map_has_no_more_corners_than_show(tmp_path):
    for step in ("10", "2.5"):
        assert main(["atlas", "hbg80_2d", "--step", step, "-o", str(tmp_path / f"{step}.svg")]) == 0
    coarse, fine = ((tmp_path / f"{step}.svg").stat().st_size for step in ("10", "2.5"))
    assert fine < 1.3 * coarse  # four times as many places along each line


def test_a_pdf_and_a_heading_on_the_screen_only(tmp_path, capsys):
    assert main(["workspace", "hbg80_2d", "--gap", "0.05", "-o", str(tmp_path / "a.pdf")]) == 0
    data = (tmp_path / "a.pdf").read_bytes()
    assert data.startswith(b"%PDF-1.")
    assert b"CreationDate" not in data


def test_several_slices_need_a_folder(tmp_path, capsys):
    words = ["atlas", "orthoglide", "--slice", "Z=0", "--slice", "Z=-20", "-o", str(tmp_path / "a.pdf")]
    assert main(words) == 2
    assert "several slices are several pictures" in capsys.readouterr().err


def test_a_map_goes_on_evenly_beyond_what_is_known():
    x, y = np.meshgrid(np.arange(9.0), np.arange(7.0), indexing="ij")
    plane = 3.0 - 0.5 * x + 0.2 * y
    extended = extend_grid(np.where(x + y < 8.0, plane, np.nan))
    near = (x + y < 10.0) & (np.abs(x - y) < 6.0)
    assert extended[near] == pytest.approx(plane[near], abs=1e-12)
    assert np.isnan(extended[-1, -1])


def test_a_scale_has_colours_for_all_that_is_shown_and_no_more_numbers_than_room():
    machine = load_shipped("five_bar_slides")
    x, y = np.linspace(-700.0, 700.0, 57), np.linspace(-500.0, -100.0, 33)
    figure = Figure()
    axes = figure.subplots()
    levels = np.linspace(-400.0, -200.0, LEVELS + 1)  # values go on beyond both ends
    filled = fill_map(axes, (x, y), np.tile(y, (57, 1)), pk.region(machine), levels, "neither")
    assert filled.get_array().size == LEVELS
    assert min(path.get_extents().y0 for path in filled.get_paths() if len(path)) == y[0]
    assert max(path.get_extents().y1 for path in filled.get_paths() if len(path)) == y[-1]
    for height, count in ((2000.0, 7), (400.0, 4), (150.0, 2)):
        axes.set(xlim=(-700.0, 700.0), ylim=(-height, 0.0))
        bar = figure.colorbar(filled, cax=axes.inset_axes((1.04, 0.0, 0.045, 1.0)))
        set_bar_ticks(bar, axes, levels)
        assert len(bar.get_ticks()) == count


def test_short_axes_in_space_have_few_numbers():
    axes = add_space_axes(Figure(), np.zeros(3), np.array([900.0, 120.0, 450.0]), "XYZ")
    counts = []
    for letter in "xyz":
        low, high = getattr(axes, f"get_{letter}lim")()
        ticks = getattr(axes, f"{letter}axis").get_majorticklocs()
        counts.append(sum(low <= tick <= high for tick in ticks))
    assert counts[0] >= 3
    assert counts[1] <= 2


@pytest.mark.parametrize("half", [(600.0, 130.0, 180.0), (300.0, 300.0, 300.0), (900.0, 80.0, 900.0)])
def test_names_of_axes_in_space_are_clear_of_their_numbers(half):
    figure = Figure(figsize=(12.0, 6.6))
    axes = add_space_axes(figure, np.zeros(3), np.array(half), "XYZ")
    fit_to_room(axes, np.array(half), (0.02, 0.1, 0.6, 0.85))
    figure.draw_without_rendering()
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        name = axis.label.get_window_extent()
        assert not [tick for tick in axis.get_major_ticks() if name.overlaps(tick.label1.get_window_extent())]


def test_an_outline_is_smooth_where_legs_end_to_close():
    """Arm and rod straight: there no joint tells how near the end is, and the margins jump."""
    machine = load_shipped("five_bar")
    grid = [np.linspace(-400.0, 400.0, 81), np.linspace(100.0, 620.0, 53)]  # 10 mm apart
    axes = Figure().subplots()
    fill_map(axes, grid, np.ones((81, 53)), pk.region(machine), np.array([0.0, 2.0]), "neither")
    outline = axes.collections[-1].get_paths()[0].vertices
    base, arm, rod = (machine.spec.sizes[name] for name in ("base", "arm", "rod"))
    away = np.linalg.norm(outline[:, None] - [[-base, 0.0], [base, 0.0]], axis=2).max(1)
    upper = (outline[:, 1] > 400.0) & (np.abs(outline[:, 0]) < 200.0)
    assert upper.sum() > 100
    assert np.abs(away[upper] - (arm + rod)).max() < 1.0
