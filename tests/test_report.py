"""The report on a trajectory: its numbers in the page and in the figures, against the trajectory sampled densely."""

import json
import re
from base64 import b64decode
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.export.page.path_data import encode_page_path
from parakin.export.report.report import render_report
from parakin.machine import Machine
from parakin.toolpath.checking.check import check_path
from parakin.toolpath.path import Note, ToolPath
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.posting.range_use import measure_range_use
from parakin.toolpath.timing import plan_trajectory

SLOW, FAST = 2400.0, 9000.0  # mm/min


def path_of(tip, axis=(0.0, 0.0, 1.0), feed=SLOW, rapid=False, **more):
    tip = np.asarray(tip, float)
    n = len(tip)
    feeds, rapids = np.broadcast_to(np.asarray(feed, float), n), np.broadcast_to(rapid, n)
    axis = np.broadcast_to(np.asarray(axis, float), (n, 3))
    return ToolPath("part.cls", tip, axis, 3 * np.arange(n) + 7, rapids, feeds, np.full(n, np.nan), **more)


def spiral(n):
    """A path for the tricept: slow, fast, and in rapid, with corners in between."""
    turn = np.linspace(0.0, 9.0, n)
    tip = np.stack([(60 + 15 * turn) * np.cos(turn), (60 + 15 * turn) * np.sin(turn), -1650 + 0 * turn], axis=1)
    tip[::7, 2] += 3.0
    lean = 0.25 + 0.1 * np.sin(3 * turn)
    axis = np.stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)], axis=1)
    third = np.arange(n) * 3 // n
    return path_of(tip, axis, np.where(third == 1, FAST, SLOW), third == 2)


@pytest.fixture(scope="module")
def without_jerk(tmp_path_factory):
    """A shipped machine, by its name, whose drives have no limits of jerk: their accelerations are used fully."""

    def load(name):
        text = (files("parakin") / "machines" / f"{name}.yaml").read_text(encoding="utf-8")
        file = tmp_path_factory.mktemp(name) / "machine.yaml"
        file.write_text(re.sub(r"\n *jerk:.*|, jerk: [^,}]*", "", text), encoding="utf-8")
        return pk.load(file)

    return load


@pytest.fixture(scope="module")
def trajectory(without_jerk):
    return plan_trajectory(post_path(without_jerk("tricept"), spiral(600)))


@pytest.fixture(scope="module")
def html(trajectory):
    return render_report(trajectory.posted, trajectory)


@pytest.fixture(scope="module")
def figures(html):
    return figures_of(html)


@pytest.fixture(scope="module")
def dense(trajectory):
    return trajectory.at(np.linspace(0.0, trajectory.seconds, 200_000))


def figures_of(html):
    pattern = r'<script type="application/json" data-figure="(\w+)">(.*?)</script>'
    return {name: json.loads(data) for name, data in re.findall(pattern, html, re.DOTALL)}


def text_of(html):
    html = re.sub(r"<(script|style)\b.*?</\1>", "", html, flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", html))


def traces_of(figure, name):
    return [trace for trace in figure["data"] if trace["name"] == name]


def xy(trace):
    return np.array([trace["x"], trace["y"]], float)


def test_verdict_names_the_cycle_time(trajectory, html):
    verdict = text_of(html[html.index("<section class='card verdict'") :].partition("</section>")[0])
    path = trajectory.posted.path
    steps = np.linalg.norm(np.diff(path.tip, axis=0), axis=1)
    cut = ~path.rapid[1:]
    programmed = (steps / path.feed[1:])[cut].sum() * 60.0
    # The last record in feed is passed when the rapid begins.
    feed = trajectory.times[np.flatnonzero(~path.rapid)[-1]]
    assert feed < trajectory.seconds
    assert f"Cycle time {trajectory.seconds:.1f} s" in verdict.replace(" :", ":")
    assert f"{feed:.1f} s in feed motions ( {programmed:.1f} s at the programmed feeds)".replace("( ", "(") in verdict
    assert f"{trajectory.seconds - feed:.1f} s in rapid" in verdict
    assert "The motions between them were not checked." in verdict


def test_shares_are_those_of_dense_samples(trajectory, html, figures):
    assert len(trajectory.binding_fractions) > 4
    times, passed = (np.arange(100_000) + 0.5) * trajectory.seconds / 100_000, trajectory.profile.row_times
    behind = np.searchsorted(passed, times)
    nearest = behind - (times - passed[behind - 1] < passed[behind] - times)
    counts = np.bincount(trajectory.binding[nearest], minlength=len(trajectory.names)) / 100_000
    for name, share in trajectory.binding_fractions.items():
        trace = next(t for t in figures["time"]["data"] if t["type"] == "bar" and t["name"] == name)
        shown = sum(trace["y"]) * trace["width"] / trajectory.seconds
        assert shown == pytest.approx(share, abs=1e-4)
        assert shown == pytest.approx(counts[trajectory.names.index(name)], abs=1e-3)
        if share >= 0.001:
            label = name.replace(".", ".<wbr>")
            assert re.search(rf"<b>{re.escape(label)}</b>.*?{100 * share:.1f} %", html)
    bars = [t for t in figures["time"]["data"] if t["type"] == "bar"]
    total = {}
    for trace in bars:
        for x, y in zip(trace["x"], trace["y"], strict=True):
            total[x] = total.get(x, 0.0) + y
    np.testing.assert_allclose(list(total.values()), 1.0, atol=1e-3)


@pytest.mark.parametrize("kind", ["", " speed", " acceleration"])
def test_curves_keep_the_extremes_and_lie_on_the_trajectory(trajectory, figures, dense, kind):
    machine = trajectory.posted.machine
    rounding = 1e-4 * {"": 500.0, " speed": 5000.0}.get(kind, 0.0)  # of times, mm or deg and their rates
    for j, name in enumerate(machine.joints):
        scale = 180.0 / np.pi if machine.joint_units[j] == "rad" else 1.0
        of = {"": lambda p: p.joints, " speed": lambda p: p.speeds, " acceleration": lambda p: p.accelerations}[kind]
        x, y = xy(traces_of(figures["time"], f"{name}{kind}")[0])
        exact, size = of(dense)[:, j] * scale, np.abs(of(dense)[:, j]).max() * scale
        assert y.max() >= exact.max() - 1e-4 * size
        assert y.min() <= exact.min() + 1e-4 * size
        assert len(x) <= 3200
        if kind != " acceleration":
            assert np.abs(y - of(trajectory.at(x))[:, j] * scale).max() <= rounding + 1e-4 * size
        else:
            assert np.abs(y).max() <= machine.model.drives[j].acceleration * scale * (1.0 + 1e-3)


def test_what_binds_is_coloured(trajectory, figures):
    drive = trajectory.posted.machine.model.drives
    seen = 0
    for j, name in enumerate(trajectory.posted.machine.joints):
        scale = 180.0 / np.pi if drive[j].unit == "rad" else 1.0
        for kind in ("speed", "acceleration"):
            traces = traces_of(figures["time"], f"{name} {kind}")
            assert (len(traces) == 2) == (f"{name}.{kind}" in trajectory.binding_fractions)
            for trace in traces[1:]:
                _, y = xy(trace)
                assert trace["line"]["color"] != traces[0]["line"]["color"]
                assert np.nanmax(np.abs(y)) == pytest.approx(getattr(drive[j], kind) * scale, rel=2e-2)
                seen += 1
    assert seen > 2


def test_every_point_knows_its_record_and_line(trajectory, figures):
    trace = traces_of(figures["time"], "d1")[0]
    record, line = np.array(trace["customdata"]).T
    assert (line == 3 * record + 7).all()
    x = np.array(trace["x"])
    assert (x <= trajectory.times[record] + 1e-3).all()
    assert (x >= trajectory.times[record - 1] - 1e-3).all()


def test_feed_reached_beside_the_programmed(trajectory, figures, dense):
    programmed = np.array(traces_of(figures["time"], "programmed feed")[0]["y"], float)
    assert set(programmed[~np.isnan(programmed)]) == {SLOW, FAST}
    assert np.isnan(programmed).any()  # in rapid
    x, y = xy(traces_of(figures["time"], "feed reached")[0])
    cut = x < trajectory.times[np.flatnonzero(~trajectory.posted.path.rapid)[-1]]
    assert SLOW < y[cut].max() <= FAST * 1.001
    steps = np.linalg.norm(np.diff(dense.poses[:, :3], axis=0), axis=1)
    exact = 60.0 * steps / (dense.times[1] - dense.times[0])
    middle = 0.5 * (dense.times[1:] + dense.times[:-1])
    assert y.max() == pytest.approx(exact.max(), rel=1e-3)
    assert np.median(np.abs(y[cut] - np.interp(x[cut], middle, exact))) < 1e-3 * SLOW
    assert (y[cut & (x < trajectory.times[150])] <= SLOW * 1.001).all()
    x, y = xy(traces_of(figures["time"], "set by the feed")[0])
    assert np.nanmax(y) == pytest.approx(FAST, rel=1e-3)
    assert x.max() < trajectory.times[np.flatnonzero(~trajectory.posted.path.rapid)[-1]] + 0.1


def test_feed_is_seen_among_many_short_rapids(without_jerk):
    turn = np.linspace(0.0, 200.0, 4000)
    tip = np.stack([80 * np.cos(turn), 80 * np.sin(turn), 280 + 0 * turn], axis=1)
    path = path_of(tip, rapid=np.arange(4000) % 10 < 2)
    trajectory = plan_trajectory(post_path(without_jerk("linear_delta"), path))
    figure = figures_of(render_report(trajectory.posted, trajectory))["time"]
    assert 3 * len(trajectory.profile.row) > 9000
    for name in ("programmed feed", "set by the feed"):
        y = np.array(traces_of(figure, name)[0]["y"], float)
        drawn = ~np.isnan(y)
        assert (drawn[1:] & drawn[:-1]).sum() > 0.8 * len(y)  # a line, not single points between gaps
        assert y[drawn].max() <= SLOW * 1.001


def test_the_page_has_the_colours_of_what_binds(trajectory, figures):
    path = encode_page_path(trajectory.posted, trajectory, 30_000)
    colours = {one["name"]: one["colour"] for one in path["bindings"] if one["colour"]}
    assert set(colours) == set(trajectory.binding_fractions)
    assert len(set(colours.values())) == len(colours)
    assert {t["name"]: t["marker"]["color"] for t in figures["time"]["data"] if t["type"] == "bar"} == colours
    columns = decode_columns(path)
    bound = {path["bindings"][int(number)]["name"] for number in columns["binding"]}
    assert bound <= set(colours)
    assert not columns["broken"].any()
    assert (columns["lines"] == 3 * columns["records"] + 7).all()
    assert (columns["times"] <= trajectory.times[columns["records"].astype(int)] + 1e-2).all()


def test_the_page_hides_no_offence_and_no_tight_place():
    tip = np.zeros((20_000, 3)) + [0.0, 0.0, -1650.0]
    tip[:, 0] = np.linspace(-100.0, 100.0, 20_000)
    tip[7_777, 2], tip[11_111, 2] = -1300.0, -1400.0
    posted = post_path(load_shipped("tricept"), path_of(tip))
    relative = measure_range_use(posted)[1]
    assert posted.broken_record_count == 1
    for numbers in (600, 30_000, 500_000):
        columns = decode_columns(encode_page_path(posted, None, numbers))
        assert len(columns["times"]) * 17 <= numbers + 5 * 17
        assert columns["margins"].min() == pytest.approx(relative.min(), rel=1e-6)
        (at,) = np.flatnonzero(columns["broken"])
        assert columns["records"][at - 1] < 7_777 <= columns["records"][at]
        behind = np.searchsorted(columns["records"], 11_111)
        assert columns["margins"][behind] <= relative[11_111] + 1e-6


def decode_columns(path):
    return {name: np.frombuffer(b64decode(text), "<f4") for name, text in path["columns"].items()}


def test_panels_share_their_time(figures, trajectory):
    layout = figures["time"]["layout"]
    joints = len(trajectory.posted.machine.joints)
    assert sum(key.startswith("yaxis") for key in layout) == 2 + 3 * joints
    assert layout["xaxis"]["range"] == [0.0, trajectory.seconds]
    assert [layout[f"xaxis{i}"]["matches"] for i in (2, 3, 4)] == ["x"] * 3
    used = {(t.get("xaxis", "x"), t["yaxis"]) for t in figures["time"]["data"]}
    assert len(used) == 2 + 3 * joints
    ends = [end for i in (2, 3, 4) for end in layout[f"xaxis{i}"]["domain"]]
    assert ends == sorted(set(ends))


def test_long_trajectories_stay_small(trajectory, html):
    assert 3 * len(trajectory.profile.row) > 9000  # so curves are thinned here
    assert len(html) < 2_000_000


def test_jerks_are_drawn_where_they_are_limited():
    machine = load_shipped("linear_delta")
    legs = tuple(
        replace(leg, drives=tuple(d and replace(d, jerk=2e5) for d in leg.drives)) for leg in machine.spec.legs
    )
    trajectory = plan_trajectory(
        post_path(Machine(replace(machine.spec, legs=legs)), path_of([[0, 0, 280], [30, 10, 285], [0, 40, 280]]))
    )
    figure = figures_of(render_report(trajectory.posted, trajectory))["time"]
    for name in machine.joints:
        _, y = xy(traces_of(figure, f"{name} jerk")[0])
        assert 1e4 < np.abs(y).max() <= 2e5 * 1.0005
    assert not traces_of(figure, "tower_a speed")[1:]
    points = trajectory.at(np.linspace(0.0, trajectory.seconds, 100_000))
    jerk = np.diff(points.accelerations[:, 0]) / (points.times[1] - points.times[0])
    assert np.abs(xy(traces_of(figure, "tower_a jerk")[0])[1]).max() >= 0.999 * np.abs(jerk).max() - 1.0


def test_a_trajectory_that_stands_still():
    trajectory = plan_trajectory(post_path(load_shipped("linear_delta"), path_of([[0, 0, 280]])))
    html = render_report(trajectory.posted, trajectory)
    assert set(figures_of(html)) == {"curves"}
    assert "Cycle time 0 s" in text_of(html)


def test_without_a_trajectory_nothing_is_said_of_it(trajectory):
    html = render_report(trajectory.posted)
    assert set(figures_of(html)) == {"curves"}
    assert "Cycle time" not in html
    assert "<h2>Time</h2>" not in html


def test_inverse_time_counts_as_programmed():
    path = path_of([[0, 0, 280], [30, 0, 280], [60, 0, 280]], feed=np.array([np.nan, np.nan, 1200.0]))
    path = replace(path, seconds=np.array([np.nan, 4.0, np.nan]), dialect="gcode", notes=(Note(0, "of all"),))
    trajectory = plan_trajectory(post_path(load_shipped("linear_delta"), path))
    html = render_report(trajectory.posted, trajectory)
    assert "5.5 s in feed motions, at the programmed feeds<" in html  # 4 s, and 30 mm at 20 mm/s
    programmed = np.array(traces_of(figures_of(html)["time"], "programmed feed")[0]["y"], float)
    np.testing.assert_allclose(np.unique(programmed), [450.0, 1200.0])
    assert "G-code, in mm" in html
    assert "<td class=k>file</td><td>of all</td>" in html


def test_offences_on_the_way_say_where():
    # Both ends are 934 mm or more from each foot's joint, the middle is not.
    posted = check_path(post_path(load_shipped("tricept"), path_of([[-300, 0, -1450], [0, 0, -1340], [300, 0, -1450]])))
    halfway = check_path(post_path(load_shipped("tricept"), path_of([[-200, 0, -1345], [200, 0, -1345]])))
    for checked in (posted, halfway):
        html = render_report(checked)
        assert "were not checked" not in html
        assert "Records and motions" in html
        between_records = [offence for offence in checked.offences if offence.share < 1.0]
        for offence in between_records:
            assert f"<small>on the way, {100 * offence.share:.0f} %</small>" in html
        if checked.broken_motion_count:
            assert decode_columns(encode_page_path(checked, None, 30_000))["broken"].any()
    assert any(offence.share < 1.0 for offence in (*posted.offences, *halfway.offences))
    runs = check_path(post_path(load_shipped("tricept"), path_of([[0, 0, -1650], [50, 0, -1650]])))
    assert "All 2 records and the motions between them stay within every limit of tricept.<" in render_report(runs)
