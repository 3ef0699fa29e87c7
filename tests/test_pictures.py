"""Pictures and the report: geometry that agrees with the joints, pages that load nothing, figures that hide nothing."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from shipped import REPRESENTATIVES

import parakin as pk
from parakin.dynamics.polygon import order_polygon
from parakin.export.machine.picture import render_machine_picture
from parakin.export.machine.scene import build_scene
from parakin.export.machine.solids import build_solids
from parakin.export.number_format import format_value
from parakin.export.page.page import render_machine_page
from parakin.export.report.joint_curves import pick_extremes
from parakin.export.report.report import render_report
from parakin.toolpath.path import Note, ToolPath
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.posting.posted import Posted
from parakin.toolpath.posting.range_use import measure_range_use
from parakin.toolpath.reading.cl.reader import read_cl

OWN = Path(__file__).parent / "machines" / "rpr3.yaml"
MACHINES = [*REPRESENTATIVES, str(OWN)]
LOADED = {name: pk.load(name) for name in MACHINES}
machines = pytest.mark.parametrize("machine", LOADED.values(), ids=lambda machine: machine.name)


def near_home(machine, seed=1):
    """A pose near home that is allowed."""
    rng = np.random.default_rng(seed)
    sizes = [5.0 if axis in "XYZ" else 0.02 for axis in machine.axes]
    poses = machine.home + rng.uniform(-1.0, 1.0, (50, len(sizes))) * sizes
    return poses[machine.check(poses) == 0][0]


def tip_of(machine, pose):
    return np.array([pose[machine.axes.index(c)] if c in machine.axes else 0.0 for c in "XYZ"])


def axis_of(machine, pose):
    """The tool's axis, Rz(C)·Ry(B)·Rx(A)·z."""
    given = dict(zip(machine.axes, pose, strict=True))
    a, b, c = (given.get(letter, 0.0) for letter in "ABC")
    k = np.array([np.sin(b) * np.cos(a), -np.sin(a), np.cos(b) * np.cos(a)])
    return np.array([np.cos(c) * k[0] - np.sin(c) * k[1], np.sin(c) * k[0] + np.cos(c) * k[1], k[2]])


def path_of(tip, source="part.cls", axis=None, rapid=None, notes=()):
    n = len(tip)
    axis = np.tile([0.0, 0.0, 1.0], (n, 1)) if axis is None else axis
    rapid = np.zeros(n, bool) if rapid is None else rapid
    lines = np.arange(11, 11 + n)
    return ToolPath(source, tip, axis, lines, rapid, np.full(n, 1000.0), np.full(n, np.nan), notes=notes)


def circles(machine, n, radius, turns=7.0):
    """A path round home, in the plane where the machine works in one."""
    turn = np.linspace(0.0, 2.0 * np.pi * turns, n)
    free = np.array([c in machine.axes for c in "XYZ"], float)
    growing = radius * turn / turn[-1]
    around_home = np.column_stack([growing * np.cos(turn), growing * np.sin(turn), 0.1 * radius * np.sin(5.0 * turn)])
    return tip_of(machine, machine.home) + around_home * free


def figures_of(html):
    found = re.findall(r'<script type="application/json" data-figure="(\w+)">(.*?)</script>', html, re.DOTALL)
    return {name: json.loads(text) for name, text in found}


def own_text(html):
    """The report without its scripts and without the frame of the page in it, which has no address."""
    html = re.sub(r'<iframe class=page title="[^"<>]*"></iframe>', "", html)
    html = re.sub(r'<script type="text/plain" id="pages">[A-Za-z0-9+/=]*</script>', "", html)
    return html[: html.index("<script>")]


# The scene.


@machines
@pytest.mark.parametrize("at_home", [True, False])
def test_struts_have_their_lengths(machine, at_home):
    pose = machine.home if at_home else near_home(machine)
    joints = dict(zip(machine.joints, machine.inverse(pose), strict=True))
    drawn = build_scene(machine, pose)
    lengths = {(item.kind, item.name): np.linalg.norm(np.diff(item.points, axis=0)) for item in drawn.items}
    for leg in machine.spec.legs:
        first, last = leg.drives[0].name, leg.drives[-1].name
        if leg.kind in ("length", "ring"):
            assert lengths["telescope", first] == pytest.approx(joints[first], abs=1e-9)
        elif leg.kind == "lambda":
            assert lengths["rod", first] == pytest.approx(leg.long, abs=1e-9)
            assert lengths["arm", last] == pytest.approx(leg.short, abs=1e-9)
        else:
            assert lengths["rod", first] == pytest.approx(leg.rod, abs=1e-9)


@machines
def test_the_tool_stands_at_the_pose(machine):
    pose = near_home(machine)
    drawn = build_scene(machine, pose)
    tip = drawn.workpiece[:, :3] @ tip_of(machine, pose) + drawn.workpiece[:, 3]
    np.testing.assert_allclose(drawn.frames["tool"][:, 3], tip, atol=1e-9)
    for item in drawn.of("tool"):
        np.testing.assert_allclose(item.points[-1], tip, atol=1e-9)
    if "B" in machine.axes:
        np.testing.assert_allclose(
            drawn.frames["tool"][:, 2], drawn.workpiece[:, :3] @ axis_of(machine, pose), atol=1e-9
        )


@machines
def test_rails_cover_the_range_and_carry_the_feet(machine):
    drawn = build_scene(machine)
    for leg in machine.spec.legs:
        for drive, unit in zip(leg.drives, leg.units, strict=True):
            rails = [item for item in drawn.of("rail") if item.name == drive.name]
            assert len(rails) == (leg.kind in ("slider", "lambda", "column"))
            if rails and unit == "mm":
                a, b = rails[0].points
                assert np.linalg.norm(b - a) == pytest.approx(drive.high - drive.low)
                carried = leg.drives[0] if leg.kind == "column" else drive  # one rod on carriage and slide
                feet = [item.points[0] for item in drawn.of("rod", "arm") if item.name == carried.name]
                assert np.linalg.norm(feet[0] - a) + np.linalg.norm(feet[0] - b) == pytest.approx(
                    drive.high - drive.low
                )


@machines
def test_every_drive_has_a_label(machine):
    names = ", ".join(name for name, _ in build_scene(machine).labels).split(", ")
    assert sorted(names) == sorted(machine.joints)


def test_planar_machines_have_a_normal():
    assert build_scene(LOADED["hbg80_2d"]).normal.tolist() == [0.0, 0.0, 1.0]
    assert build_scene(LOADED["tricept"]).normal is None


def test_out_of_reach_leaves_what_has_a_place():
    machine = LOADED["linear_delta"]
    drawn = build_scene(machine, [9000.0, 0.0, 0.0])
    assert not drawn.of("rod")
    assert drawn.of("platform")
    assert all(np.isfinite(item.points).all() for item in drawn.items)


def test_a_free_angle_is_the_paths():
    machine = LOADED["tricept"]
    joints = machine.inverse(machine.home)
    joints[machine.joints.index("theta1")] = 0.7
    turned = build_scene(machine, machine.home, joints).frames["tool"]
    np.testing.assert_allclose(turned[:, 3], build_scene(machine).frames["tool"][:, 3], atol=1e-9)
    assert turned[1, 0] == pytest.approx(np.sin(0.7))


def test_around_orders_points():
    square = np.array([[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)
    ring = order_polygon(square)
    assert len(ring) == 4
    np.testing.assert_allclose(np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1), 1.0)
    assert len(order_polygon(np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0]], float))) == 2


@machines
def test_solids_are_closed(machine):
    for solid in build_solids(build_scene(machine)):
        edges = np.sort(solid.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        assert np.isfinite(solid.vertices).all()
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


# Pictures.


@machines
def test_picture_page(machine):
    html = render_machine_page(machine, near_home(machine))
    assert len(html.encode()) < 1_000_000
    assert "default-src 'none'" in html


@pytest.mark.parametrize("name", ["hbg80_2d", "orthoglide5_table"])
def test_png(name):
    data = render_machine_picture(LOADED[name], near_home(LOADED[name]))
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    assert data[16:24] == bytes([0, 0, 4, 128, 0, 0, 4, 128])  # 1152 x 1152


def check_nothing_is_loaded(html):
    assert "default-src 'none'" in html
    assert html.count("<script>") == 2
    assert not re.search(r"""(src|href)\s*=\s*["']?\s*(https?:)?//|@import|url\(|<link|<iframe""", own_text(html))


# The report.


@machines
def test_clean_path_runs(machine):
    html = render_report(post_path(machine, path_of(*clean(machine))))
    check_nothing_is_loaded(html)
    assert "<strong>Runs</strong>" in html
    assert "<h2>Offences</h2>" not in html
    figures = figures_of(html)
    assert set(figures) == {"curves"}
    curves = [trace for trace in figures["curves"]["data"] if trace["line"]["color"] == "#2f6fb3"]
    assert [trace["name"] for trace in curves] == list(machine.joints)


def clean(machine):
    """Tips and axes of a small path with home's tool axis."""
    return circles(machine, 40, 10.0, 0.4), "part.cls", np.tile(axis_of(machine, machine.home), (40, 1))


def test_off_limits_says_where_and_how_much(tmp_path):
    machine = LOADED["tricept"]
    part = tmp_path / "part.cls"
    lines = [f"GOTO/{x},0,-1650,0,0,1" for x in (0, 10, 20, 900, 30, 950)]
    part.write_text("\n".join(["FEDRAT/900,MMPM", *lines]) + "\n")
    posted = post_path(machine, read_cl(part))
    html = render_report(posted)
    assert posted.first is not None
    assert "<strong>Does not run</strong>" in html
    assert f"part.cls:5: {posted.first.text}" in html
    assert "2 of 6 records off limits (33.33%)" in html
    assert "<code>GOTO/900,0,-1650,0,0,1</code>" in html
    assert "<code>GOTO/950,0,-1650,0,0,1</code>" in html
    part.unlink()  # the report does without the source
    assert "<code></code>" in render_report(posted)


def test_nothing_to_run():
    machine, none = LOADED["tricept"], np.empty((0, 5))
    broken = np.empty(0, np.int64)
    path = path_of(np.empty((0, 3)))
    posted = Posted(machine, path, "+", np.eye(3, 4), none, none, broken, machine.limits, (), None, None)
    html = render_report(posted)
    assert "Nothing to run" in html
    assert not figures_of(html)


@pytest.mark.parametrize("n", [1, 2])
def test_very_short_paths(n):
    machine = LOADED["tricept"]
    html = render_report(post_path(machine, path_of(np.tile(tip_of(machine, machine.home), (n, 1)))))
    assert "<strong>Runs</strong>" in html


def test_everything_out_of_reach():
    machine = LOADED["linear_delta"]
    html = render_report(post_path(machine, path_of(circles(machine, 30, 5.0) + np.array([9000.0, 0.0, 0.0]))))
    assert "<strong>Does not run</strong>" in html
    assert "never reached" in html


def test_untrusted_text_is_escaped(tmp_path):
    machine = LOADED["tricept"]
    evil = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&"
    part = tmp_path / evil.replace("/", "_")
    part.write_text(f"GOTO/0,0,-1650 $$ {evil}\n" * 30)
    notes = (Note(1, f"unknown word {evil}"), Note(0, evil))
    posted = post_path(machine, path_of(np.array([[900.0, 0, -1650], [0, 0, -1650]]), str(part), notes=notes))
    text = own_text(render_report(posted))
    assert "<img" not in text
    assert "alert(1)</script>" not in text
    assert text.count("&lt;/script&gt;&lt;script&gt;alert(1)") == 4  # two quoted lines, two notes
    assert "&lt;img src=x onerror=alert(2)&gt;&amp;" in text


def test_long_paths_stay_small_and_keep_extremes():
    machine = LOADED["hexapod"]
    n = 150_000
    tip = circles(machine, n, 700.0)
    tip[77_777, 2] += 40.0
    rapid = np.arange(n) % 50 < 5
    posted = post_path(machine, path_of(tip, rapid=rapid))
    html = render_report(posted)
    assert posted.broken_record_count > 10_000
    assert len(html) < 2_000_000
    for curve, values in zip(figures_of(html)["curves"]["data"][::2], posted.joints.T, strict=True):
        y = [v for v in curve["y"] if v is not None]
        assert len(y) <= 4002
        assert min(y) == pytest.approx(values.min(), abs=1e-3)
        assert max(y) == pytest.approx(values.max(), abs=1e-3)


def test_use_agrees_with_the_joints():
    machine = LOADED["lambda6"]
    posted = post_path(machine, path_of(circles(machine, 500, 300.0)))
    uses, relative = measure_range_use(posted)
    for use, drive, values in zip(uses, machine.model.drives, posted.joints.T, strict=False):
        assert (use.low, use.high) == (drive.low, drive.high)
        assert (use.least, use.most) == pytest.approx((values.min(), values.max()))
        assert use.margin == pytest.approx(min(values.min() - drive.low, drive.high - values.max()))
    assert ["gap l1-l4" in use.name for use in uses[6:7]] == [True]
    assert ((relative < 0.0) == (posted.broken > 0)).all()


@pytest.mark.parametrize("most", [30, 300, 4000])
def test_extremes_are_kept(most):
    rng = np.random.default_rng(most)
    values = np.cumsum(rng.normal(size=10_007))
    values[5000:5600] = np.nan
    values[1234], values[9876] = 1e6, -1e6
    kept = pick_extremes(values, most)
    assert (np.diff(kept) > 0).all()
    assert len(kept) <= most + 2
    assert {0, 1234, 9876, 10_006} <= set(kept.tolist())
    assert np.isnan(values[kept]).any()
    assert len(pick_extremes(values, 20_000)) == len(values)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(1533.24, "mm", "1,533.2 mm"), (-0.5, "rad", "-28.65°"), (0.0, "mm", "0.0 mm"), (-0.0, "mm", "0.0 mm"),
     (-3e-4, "mm", "-0.0003 mm"), (float("nan"), "mm", "–")],
)  # fmt: skip
def test_values_for_people(value, unit, text):
    assert format_value(value, unit) == text
