"""The page of a machine in Chromium: its numbers are the library's, and it does what is clicked and dragged."""

import json
import re
import zipfile
from base64 import b64decode
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from browser import list_pale_texts, needs_chromium, open_browser, open_tab, wait_until
from dense_deviations import axis_of, path_of
from shipped import NAMES, REPRESENTATIVES, load_shipped

import parakin as pk
from parakin.cli import main
from parakin.errors import NoMethodError
from parakin.export.page import three_script
from parakin.export.page.page import render_machine_page, write_core, write_surface_worker
from parakin.export.page.path_data import encode_page_path
from parakin.kinematics.turns import wrap_angle
from parakin.model.size_rates import list_numbers
from parakin.performance.singularities import compute_singularity_margins

AGREE = 1e-9  # mm, rad
POSES = 12
MODES = 3

# For each pose: joints and margins in each mode; the wrenches; the pose again, from home, of the joints.
EVALUATE = """([poses, modes, joints]) => {
  const plain = values => values.map(value => Number.isFinite(value) ? value : null);
  const begin = {pose: machine.axes.map(axis => axis.home), signs: machine.mode};
  begin.joints = model.inverse(begin.pose, begin.signs);
  return {
    inverse: modes.map(signs => poses.map(pose => plain(model.inverse(pose, signs)))),
    margins: modes.map(signs => poses.map(pose => plain(model.margins(pose, model.inverse(pose, signs), signs)))),
    sides: poses.map((pose, i) => measureSide({pose, joints: joints[i]})),
    home: measureSide(begin),
    forward: joints.map(q => { const way = followJoints(begin, q); return way.complete ? way.state.pose : null; }),
  };
}"""


@pytest.fixture(scope="module")
def browser():
    with open_browser() as opened:
        yield opened


def seeded_poses(machine, seed):
    rng = np.random.default_rng(seed)
    size = max(machine.leg_sizes)
    reach = np.array([0.12 * size if unit == "mm" else 0.25 for unit in machine.axis_units])
    return machine.home + rng.uniform(-1.0, 1.0, (POSES, len(machine.axes))) * reach


def as_numbers(rows):
    return np.array(rows, float)  # None becomes NaN


@needs_chromium
@pytest.mark.parametrize("name", NAMES)
def test_a_page_computes_as_the_library(name, browser):
    machine = load_shipped(name)
    poses = seeded_poses(machine, 7)
    modes = machine.modes[:MODES]
    joints = machine.inverse(poses)
    closing = np.isfinite(joints).all(1)
    assert closing.sum() >= POSES // 3
    with open_tab(browser) as tab:
        tab.add_script_tag(content=write_core(machine))
        signs = [[1 if sign == "+" else -1 for sign in mode] for mode in modes]
        given = [poses.tolist(), signs, np.where(closing[:, None], joints, 0.0).tolist()]
        page = tab.evaluate(EVALUATE, given)
    for mode, own, margins in zip(modes, page["inverse"], page["margins"], strict=True):
        expected = machine.inverse(poses, mode)
        reached = np.isfinite(expected).all(1)
        assert (np.isfinite(as_numbers(own)).all(1) == reached).all()
        assert as_numbers(own)[reached] == pytest.approx(expected[reached], abs=AGREE)
        expected = machine.margins(poses[reached], mode=mode)
        assert as_numbers(margins)[reached] == pytest.approx(expected, abs=AGREE, rel=AGREE)
        assert not (as_numbers(margins)[~reached] >= 0.0).all(1).any()
    shares = as_numbers(page["sides"])[closing] / page["home"]
    parallel = compute_singularity_margins(machine, np.vstack([machine.home, poses[closing]]))[:, 0]
    assert shares == pytest.approx(parallel[1:] / parallel[0], abs=AGREE)
    solved = machine.forward(joints[closing], near=machine.home)
    both = [
        row is not None and ok
        for row, ok in zip(np.array(page["forward"], object)[closing], solved.converged, strict=True)
    ]
    assert sum(both) >= 0.8 * closing.sum()
    ours = np.array(
        [row for row, ok in zip(np.array(page["forward"], object)[closing], both, strict=True) if ok], float
    )
    off = ours - solved.poses[both]
    off[:, machine.turning_columns] = wrap_angle(off[:, machine.turning_columns])
    assert np.abs(off).max() < AGREE


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")

    def write(name):
        file = folder / f"{name}.html"
        if not file.exists():
            file.write_text(render_machine_page(load_shipped(name)), encoding="utf-8")
        return file.as_uri()

    return write


@needs_chromium
def test_a_page_is_one_small_file_without_a_network(pages, browser):
    assert len(render_machine_page(load_shipped("hexapod")).encode()) < 1_000_000
    with open_tab(browser) as tab:
        requests = []
        tab.on("request", lambda request: requests.append(request.url))
        tab.goto(pages("hexapod"))
        tab.wait_for_timeout(200)
        assert {url.split(":")[0] for url in requests} <= {"file", "blob"} and len(requests) <= 2


@needs_chromium
def test_a_page_opens_from_a_disk_and_moves(pages, browser):
    with open_tab(browser) as tab:
        tab.goto(pages("tricept"))
        before = tab.locator("#stage").screenshot()
        number = tab.get_by_label("X, mm").nth(1)
        number.fill("150")
        number.press("Enter")
        assert tab.evaluate("parakin.state.pose[0]") == pytest.approx(150.0, abs=1e-9)
        machine = load_shipped("tricept")
        expected = machine.inverse({"X": 150.0})
        assert tab.evaluate("parakin.state.joints") == pytest.approx(expected, abs=AGREE)
        assert tab.locator("#verdict").inner_text() == "Allowed"
        tab.wait_for_timeout(100)
        assert tab.locator("#stage").screenshot() != before


@needs_chromium
def test_a_limit_that_stops_a_move_is_named(pages, browser):
    machine = load_shipped("tricept")
    with open_tab(browser) as tab:
        tab.goto(pages("tricept"))
        tab.evaluate("parakin.moveToPose([0, 0, -2100, 0, 0])")
        assert tab.locator("#verdict").inner_text().startswith("Stopped: d")
        reached = np.array(tab.evaluate("parakin.state.pose"))
        assert machine.check(reached) == 0
        assert machine.check(reached - [0, 0, 0.01, 0, 0]) != 0
        tab.get_by_label("stop at limits").uncheck()
        tab.evaluate("parakin.moveToPose([0, 0, -1990, 0, 0])")
        assert tab.locator("#verdict").inner_text().startswith("Off limits: d")
        assert tab.locator(".gauge.bad").first.is_visible()


@needs_chromium
@pytest.mark.parametrize(("name", "place"), [("tricept", (500, 700)), ("five_bar", (300, 200))])
def test_the_tool_and_a_strut_are_dragged(name, place, pages, browser):
    with open_tab(browser) as tab:
        tab.goto(pages(name))
        for aim in ("parakin.tipInPicture()", "parakin.strutInPicture(0)"):
            before = tab.evaluate("parakin.state")
            x, y = tab.evaluate(aim)
            tab.mouse.move(x, y)
            tab.mouse.down()
            tab.mouse.move(x + 14, y - 9, steps=3)
            tab.mouse.up()
            after = tab.evaluate("parakin.state")
            assert np.abs(np.subtract(after["pose"], before["pose"])).max() > 1.0
            if aim.startswith("parakin.strut"):
                moved = np.abs(np.subtract(after["joints"], before["joints"])) > 1e-9
                assert moved[0] and not moved[1]


@needs_chromium
def test_drives_are_taken_by_their_names(pages, browser):
    """A strut under another one in the picture, and a turn about the place that is taken."""
    with open_tab(browser) as tab:
        tab.goto(pages("orthoglide5_table"))
        for number, name in ((1, "rho_y"), (4, "c")):
            before = tab.evaluate("parakin.state.joints")
            box = tab.locator("#overlay b", has_text=name).last.bounding_box()
            x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
            tab.mouse.move(x, y)
            tab.mouse.down()
            tab.mouse.move(x + 12, y + 8, steps=3)
            tab.mouse.up()
            moved = np.abs(np.subtract(tab.evaluate("parakin.state.joints"), before)) > 1e-6
            assert moved.tolist() == [k == number for k in range(5)]


@needs_chromium
def test_a_driven_link_of_more_drives_than_freedoms_is_taken_by_its_name(pages, browser):
    with open_tab(browser) as tab:
        tab.goto(pages("eclipse_overactuated"))
        before = tab.evaluate("parakin.state.joints[6]")
        box = tab.locator("#overlay b", has_text="a1").bounding_box()
        tab.mouse.move(box["x"] + 5, box["y"] + 5)
        tab.mouse.down()
        tab.mouse.move(box["x"] + 17, box["y"] + 13, steps=3)
        tab.mouse.up()
        assert abs(tab.evaluate("parakin.state.joints[6]") - before) > 1e-4


DRAG_DRIVES = """shares => {
  const {machine} = parakin, inverse = window.stateAtPose, results = [];
  machine.joints.forEach(({unit}, drive) => {
    for (const share of shares) {
      let count = 0;
      parakin.goHome();
      window.stateAtPose = (...given) => { count += 1; return inverse(...given); };
      const step = share * (unit === "rad" ? 1 : machine.size);
      const goal = parakin.state.joints.map((q, i) => i === drive ? q + step : q);
      parakin.moveToJoints(goal);
      window.stateAtPose = inverse;
      const {pose, joints} = parakin.state;
      results.push({count, pose, joints, off: joints[drive] - goal[drive], stopped: parakin.stoppedBy});
    }
  });
  return results;
}"""


@needs_chromium
def test_each_of_more_drives_than_freedoms_goes_where_it_is_dragged(pages, browser):
    """The others follow, in so few steps that no picture is late: an inverse takes 2 us on the page."""
    with open_tab(browser) as tab:
        tab.goto(pages("eclipse_overactuated"))
        results = tab.evaluate(DRAG_DRIVES, [-0.2, -0.1, 0.002, 0.2])
    assert len(results) == 32
    assert {one["stopped"] for one in results} == {None, "c1.platform", "c2.platform", "c3.platform"}
    assert all((one["stopped"] is None) == (abs(one["off"]) < 1e-9) for one in results)
    joints = pk.load("eclipse_overactuated").inverse([one["pose"] for one in results])
    assert joints == pytest.approx(np.array([one["joints"] for one in results]), abs=1e-6)
    assert 100 < max(one["count"] for one in results) < 2500


@needs_chromium
def test_names_that_meet_are_placed_below_each_other(browser):
    """Also where a line more is rounded to less than a line."""
    text = (Path(pk.__file__).parent / "export" / "page" / "labels.js").read_text(encoding="utf-8")
    (function,) = re.findall(r"^function findClear.*?^}", text, re.MULTILINE | re.DOTALL)
    heights = np.random.default_rng(1).uniform(499.0, 512.0, 200).tolist()
    with open_tab(browser) as tab:
        places = tab.evaluate(
            f"""heights => {{ const LINE = 13, {{abs}} = Math; {function}
          return heights.map(y => {{
            const taken = [];
            for (const more of [0, 5, 0, 20]) findClear(100, y + more, 40, taken);
            return taken.map(label => label.y);
          }}); }}""",
            heights,
        )
    assert np.diff(np.sort(places, 1), axis=1).min() > 13.0 - 1e-9


@needs_chromium
def test_home_that_sizes_put_out_of_reach_is_told(pages, browser):
    with open_tab(browser) as tab:
        tab.goto(pages("five_bar"))
        tab.get_by_label("stop at limits").uncheck()
        tab.evaluate("parakin.moveToPose([0, 250])")
        tab.evaluate("parakin.moveToSizes([120, 200, 150])")  # home's Y is 380
        before = tab.evaluate("parakin.state.pose")
        tab.get_by_role("button", name="Home").click()
        assert tab.locator("#verdict").inner_text().startswith("Stopped: home: ")
        assert tab.evaluate("parakin.state.pose") == before


@needs_chromium
def test_modes_are_switched(pages, browser):
    machine = load_shipped("five_bar")
    with open_tab(browser) as tab:
        tab.goto(pages("five_bar"))
        tab.get_by_role("button", name=f"{machine.joints[0]} −").click()
        state = tab.evaluate("parakin.state")
        assert state["signs"] == [1, 1]
        assert state["joints"] == pytest.approx(machine.inverse(machine.home, "++"), abs=AGREE)
        tab.get_by_role("button", name="Home").click()
        tab.get_by_role("button", name="Next assembly").click()
        pose = tab.evaluate("parakin.state.pose")
        known = machine.assemblies(machine.inverse(machine.home)).poses
        assert min(np.abs(known - pose).max(1)) < 1e-6
        assert np.abs(np.array(pose) - machine.home).max() > 1.0
        assert tab.evaluate("parakin.singularity.share") < 0.0


@needs_chromium
def test_a_free_motion_is_the_null_space_of_a(pages, browser):
    """Next to a singularity a step along the arrow changes the struts least."""
    machine = load_shipped("hexapod")
    with open_tab(browser) as tab:
        tab.goto(pages("hexapod"))
        tab.evaluate("() => { parakin.options.stops = false; parakin.moveToPose([0, 0, -950, 0, 0, 1.5]); }")
        assert abs(tab.evaluate("parakin.singularity.share")) < 0.1
        motion = tab.evaluate("parakin.findFreeMotion(parakin.state)")
        pose, length = np.array(tab.evaluate("parakin.state.pose")), tab.evaluate("parakin.machine.length")
    a, _, norms = machine.twist_rates(pose[None], machine.inverse(pose)[None])
    scaled = a[0] / norms[0][:, None] * np.repeat([1.0, 1.0 / length], 3)
    _, _, directions = np.linalg.svd(scaled)
    vector = np.array(motion["velocity"] + motion["turn"])
    assert abs(vector @ directions[-1]) == pytest.approx(1.0, abs=1e-7)


@needs_chromium
@pytest.mark.parametrize("name", ["hbg80_2d", "rotary_delta", "eclipse", "orthoglide5_table", "lambda6"])
def test_pages_of_every_kind_open(name, pages, browser):
    with open_tab(browser, 820, 1100) as tab:
        tab.goto(pages(name))
        assert tab.locator("#verdict").inner_text().startswith("Allowed")
        assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_the_command_writes_a_page_and_spares_other_files(tmp_path, capsys):
    target = tmp_path / "machine.html"
    assert main(["page", "orthoglide", "-o", str(target)]) == 0
    assert main(["page", "tricept", "-o", str(target)]) == 0  # its own page is replaced
    assert "tricept" in target.read_text(encoding="utf-8")
    target.write_text("mine", encoding="utf-8")
    assert main(["page", "tricept", "-o", str(target)]) == 2
    assert "--force" in capsys.readouterr().err
    assert target.read_text(encoding="utf-8") == "mine"
    assert main(["page", "tricept", "-o", str(target), "--force"]) == 0
    assert main(["page", "tricept", "-o", str(tmp_path / "machine.png")]) == 2


def test_a_trimesh_without_three_js_is_told(tmp_path, monkeypatch):
    folder = tmp_path / "resources" / "templates"
    folder.mkdir(parents=True)
    package = SimpleNamespace(submodule_search_locations=[str(tmp_path)])
    monkeypatch.setattr(three_script, "find_spec", lambda name: package)
    with pytest.raises(NoMethodError, match=r"three\.js r140"):
        three_script.read_three_script()
    with zipfile.ZipFile(folder / "viewer.zip", "w") as archive:
        archive.writestr("viewer.html.template", "<script>another</script>")
    with pytest.raises(NoMethodError, match=r"three\.js r140"):
        three_script.read_three_script()
    monkeypatch.setattr(three_script, "find_spec", lambda name: None)
    with pytest.raises(NoMethodError, match=r"three\.js r140"):
        three_script.read_three_script()


def test_three_js_is_as_known():
    script = three_script.read_three_script()
    assert 600_000 < len(script) < 640_000 and "SPDX-License-Identifier: MIT" in script[:120]


SQUARE = "G90 G21\nG0 X-40 Y-40 Z300\nG1 X40 F3000\nG1 Y40\nG1 X-40\nG1 Y-40\n"


@needs_chromium
def test_a_part_is_played(tmp_path, browser):
    part = tmp_path / "square.ngc"
    part.write_text(SQUARE)
    assert main(["page", str(part), "-m", "linear_delta", "-o", str(tmp_path / "square.html")]) == 0
    machine = load_shipped("linear_delta")
    job = pk.prepare(machine, pk.read_path(part))
    with open_tab(browser) as tab:
        tab.goto((tmp_path / "square.html").as_uri())
        for share in (0.0, 0.37, 1.0):
            time = share * job.seconds
            tab.evaluate(f"parakin.seek({time})")
            state, expected = tab.evaluate("parakin.state"), job.trajectory.at([time])
            assert state["pose"] == pytest.approx(expected.poses[0], abs=0.05)
            assert state["joints"] == pytest.approx(expected.joints[0], abs=0.05)
        assert tab.evaluate("parakin.path.end") == pytest.approx(job.seconds)
        tab.get_by_role("button", name="Play").click()
        wait_until(tab, "parakin.player.time > 0.2 && parakin.player.time < parakin.path.end")
        tab.get_by_role("button", name="Pause").click()
        for colours in ("feed", "pace", "motion", "margin"):
            tab.locator("#colours").select_option(colours)
            tab.click("#theme")
            assert not list_pale_texts(tab)
        tab.get_by_role("button", name="Path", exact=True).click()
        assert "mm/min" in tab.locator("#clock").inner_text()
        tab.locator("#curves").click(position={"x": 10, "y": 40})
        assert tab.evaluate("parakin.player.time") < 0.05 * job.seconds


COARSE = """() => {
  const request = {pose: machine.axes.map(axis => axis.home), signs: machine.mode};
  const lattice = makeLattice(places, ...findRanges(places), LEVELS[0]);
  for (let layer = 0; layer < lattice.count; layer++) fillLayer(lattice, layer, request);
  return marchLattice(lattice, request).positions;
}"""


@needs_chromium
def test_a_coarse_workspace_ends_where_the_limits_do(browser):
    """Also where a leg can't close, and its other limits have no margin beyond: the area is that which is proved."""
    machine = load_shipped("five_bar")
    with open_tab(browser) as tab:
        tab.add_script_tag(content=write_core(machine) + write_surface_worker())
        corners = as_numbers(tab.evaluate(COARSE)).reshape(-1, 3, 2)
    area = 0.5 * np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum()
    assert area == pytest.approx(pk.workspace(pk.region(machine), gap=0.01).volume.estimate, rel=1e-3)
    inside = machine.home + 0.999 * (corners.reshape(-1, 2) - machine.home)
    assert (machine.check(inside) == 0).all()


def read_column(tab, name):
    return np.array(tab.evaluate(f"Array.from(parakin.placing.columns.{name}, x => x === x ? x : null)"), float)


def test_the_last_sample_is_reached_at_the_end(tmp_path):
    """Times are float32 there: the end is not before the last of them."""
    part, machine = tmp_path / "line.ngc", load_shipped("linear_delta")
    for way in range(20, 32):
        part.write_text(f"G90 G21\nG0 X0 Y0 Z300\nG1 X{way} F3000\n")
        job = pk.prepare(machine, pk.read_path(part))
        path = encode_page_path(job.posted, job.trajectory, 10_000)
        assert np.frombuffer(b64decode(path["columns"]["times"]), "<f4")[-1] == path["end"]


def test_the_workpiece_of_a_page_is_without_the_files_own_frame():
    own, placed = pk.workpiece(X=20, Z=-3, C=0.4), pk.workpiece(X=-5, Y=7, Z=-1600, C=0.3)
    path = path_of([[-60.0, 0.0, 0.0], [90.0, 20.0, 0.0]], axis_of([4.0, 20.0], [10.0, 90.0]), frame=own)
    job = pk.prepare(load_shipped("tricept"), path, workpiece=placed)
    assert len(job.posted.path) > len(path)  # it was posted again, with records inserted
    assert encode_page_path(job.posted, job.trajectory, 3000)["workpiece"] == pytest.approx([-5, 7, -1600, 0, 0, 0.3])


@needs_chromium
def test_a_part_is_placed(tmp_path, browser):
    part, page = tmp_path / "square.ngc", tmp_path / "square.html"
    part.write_text(SQUARE)
    assert main(["page", str(part), "-m", "linear_delta", "--workpiece", "X=5,C=30", "-o", str(page)]) == 0
    machine = load_shipped("linear_delta")
    with open_tab(browser) as tab:
        tab.goto(page.as_uri())
        assert tab.inner_text("#workpiece") == "--workpiece X=5,C=30"
        tab.locator("#arrows").check()
        before = read_column(tab, "poses").reshape(-1, 3)
        for axis in range(3):
            x, y = tab.evaluate(f"parakin.arrowInPicture({axis})")
            tab.mouse.move(x, y)
            tab.mouse.down()
            tab.mouse.move(x + 30, y - 25, steps=3)
            tab.mouse.up()
        shift = np.array(tab.evaluate("parakin.placing.shift"))
        assert (np.abs(shift) > 1.0).all()
        x, y, z = shift
        assert tab.inner_text("#workpiece") == f"--workpiece X={5 + x:.4f},Y={y:.4f},Z={z:.4f},C=30".replace("0,", ",")
        poses = read_column(tab, "poses").reshape(-1, 3)
        assert poses == pytest.approx(before + shift, abs=1e-3)
        # Far out, half of the part is off limits, as the library has it there.
        tab.evaluate("parakin.movePath([320, 0, 0])")
        poses, joints = (read_column(tab, name).reshape(-1, 3) for name in ("poses", "joints"))
        broken = machine.check(poses) != 0
        assert 0 < broken.sum() < len(poses)
        assert tab.evaluate("parakin.placing.broken") == pytest.approx(broken.sum(), abs=2)
        assert joints == pytest.approx(machine.inverse(poses), abs=1e-3, nan_ok=True)
        assert (
            f"of {len(poses)} samples are off limits" in tab.locator("section", has_text="Place the part").inner_text()
        )
        tab.click("#unplace")
        assert (read_column(tab, "poses").reshape(-1, 3) == before).all()


@needs_chromium
def test_a_placed_part_counts_turns_as_posting_does_and_passes_no_singularity(tmp_path, browser):
    parts = {"tricept": "G1 C500 F8000\nX120", "hbg80_2d": "G1 X252.12 Y218.36 F600"}
    starts = {"tricept": "X100 Y0 Z-1500 B20 C0", "hbg80_2d": "X207.88 Y241.64"}
    with open_tab(browser) as tab:
        for name, cut in parts.items():
            part, page = tmp_path / f"{name}.ngc", tmp_path / f"{name}.html"
            part.write_text(f"G21 G90 G94\nG0 {starts[name]}\n{cut}\nM2\n")
            assert main(["page", str(part), "-m", name, "-o", str(page)]) == 0
            machine = load_shipped(name)
            width = len(machine.joints)
            tab.goto(page.as_uri())
            before = read_column(tab, "joints").reshape(-1, width)
            shift = [0.001, 0, 0] if name == "tricept" else [137.68, -72.47, 0]
            tab.evaluate(f"parakin.movePath({shift})")
            if name == "tricept":  # theta1 begins half a turn back, so that all its turns have room
                assert read_column(tab, "joints").reshape(-1, width) == pytest.approx(before, abs=1e-3)
                assert tab.evaluate("parakin.placing.broken") == 0
            else:
                poses = read_column(tab, "poses").reshape(-1, 2)
                sides = np.sign(machine.sides(poses))
                assert (machine.check(poses) == 0).all()
                assert 0 < (sides != sides[0]).sum() < len(sides)
                assert tab.evaluate("parakin.placing.broken") == pytest.approx((sides != sides[0]).sum(), abs=2)


# Of the curves: how many gaps end beside a sample that has joints, and how many dots are inked between the two.
INK_IN_GAPS = """() => {
  const canvas = document.getElementById("curves"), pen = canvas.getContext("2d");
  const {times, joints} = parakin.placing.columns, width = parakin.machine.joints.length;
  let gaps = 0, inked = 0;
  for (let i = 1; i < times.length; i++) {
    if (Number.isFinite(joints[i * width]) === Number.isFinite(joints[(i - 1) * width])) continue;
    const x = Math.round(0.5 * (times[i] + times[i - 1]) / parakin.path.end * canvas.width);
    const dots = pen.getImageData(x, 18, 1, 60).data;
    gaps += 1;
    for (let k = 3; k < dots.length; k += 4) inked += dots[k] > 0;
  }
  return [gaps, inked];
}"""


@needs_chromium
def test_an_offence_is_clicked(tmp_path, browser):
    part = tmp_path / "long.ngc"
    part.write_text(SQUARE.replace("Y40", "Y700"))
    assert main(["post", str(part), "-m", "linear_delta", "-o", str(tmp_path)]) == 3
    assert main(["page", str(part), "-m", "linear_delta", "-o", str(tmp_path / "long.html")]) == 3
    with open_tab(browser) as tab:
        tab.goto((tmp_path / "long.report.html").as_uri())
        inside = tab.frame_locator("iframe")
        assert inside.locator("#verdict").get_attribute("class") == "bad"  # it begins at the first offence
        assert "long.ngc:4: leg tower_b can't close" in inside.locator(".offence").first.inner_text()
        assert not list_pale_texts(tab)
        tab.focus("#curves")
        for key in ("ArrowRight", "ArrowRight", "ArrowDown"):  # its first curve's second point, and the next curve
            tab.keyboard.press(key)
        read = tab.locator("#curves .note").inner_text().split("\n")
        figure = json.loads(tab.locator("[data-figure=curves]").inner_text())
        trace = next(trace for trace in figure["data"] if trace["name"] == read[2])
        assert read[:2] == [f"line {trace['customdata'][1]}, record 1", f"{trace['y'][1]:,.3f} mm"]
        box = tab.locator("#curves").bounding_box()
        tab.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 60)
        tab.mouse.down()
        tab.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 60)
        drawn = tab.evaluate("document.querySelector('#curves canvas').toDataURL()")
        tab.mouse.up()
        tab.mouse.move(0, 0)
        assert tab.evaluate("document.querySelector('#curves canvas').toDataURL()") != drawn  # a closer view
        tab.goto((tmp_path / "long.html").as_uri())
        offence = tab.locator(".offence").first
        assert offence.inner_text().startswith("long.ngc:4: leg tower_b can't close")  # no path of this computer
        offence.click()
        assert tab.locator("#verdict").get_attribute("class") == "bad"
        assert tab.inner_text("#verdict") == "Out of reach: tower_b.reach; the machine stays behind"
        gauge = tab.locator(".gauge:visible", has_text="tower_b.reach")
        assert (gauge.get_attribute("class"), gauge.locator("span").inner_text()) == ("gauge bad", "out of reach")
        said = tab.evaluate(
            "Array.from({length: 500}, (_, k) => (parakin.seek(k / 500 * parakin.path.end), parakin.stoppedBy))"
        )
        assert set(said) == {None, "tower_b.reach", "tower_c.reach"}  # each time by its name
        tab.set_viewport_size({"width": 820, "height": 590})  # of a tablet's page half
        side, stage, footer = (tab.locator(one).bounding_box() for one in ("#side", "#stage", "#player"))
        assert stage["height"] > 150 and side["height"] > 120
        assert stage["y"] + stage["height"] <= side["y"] + 1 and side["y"] + side["height"] <= footer["y"] + 1
        assert footer["y"] + footer["height"] <= 590.5
        tab.mouse.move(410, side["y"] + 60)
        tab.mouse.wheel(0, 3000)
        wait_until(tab, "document.getElementById('side').scrollTop > 0")
        wait_until(tab, f"document.getElementById('panel').getBoundingClientRect().bottom <= {footer['y'] + 1}")
        tab.set_viewport_size({"width": 1280, "height": 800})
        for _ in range(2):
            assert not list_pale_texts(tab)
            tab.click("#theme")  # light again, in the end
        gaps, inked = tab.evaluate(INK_IN_GAPS)
        assert gaps >= 1
        assert inked == 0


def test_options_of_a_part_ask_for_a_machine(tmp_path, capsys):
    assert main(["page", "tricept", "--workpiece", "0,0,0"]) == 2
    assert "--machine" in capsys.readouterr().err
    empty = tmp_path / "empty.ngc"
    empty.write_text("M2\n")
    assert main(["page", str(empty), "-m", "tricept", "-o", str(tmp_path / "empty.html")]) == 2
    assert not (tmp_path / "empty.html").exists()


@needs_chromium
def test_the_workspace_is_drawn_in_a_worker(pages, browser):
    machine = load_shipped("hbg80_2d")
    with open_tab(browser) as tab:
        tab.goto(pages("hbg80_2d"))
        tab.get_by_label("its surface at this orientation").check()
        wait_until(tab, "parakin.surface.last")
        volume = tab.evaluate("parakin.surface.volume")
    x, y = (np.linspace(-700.0, 700.0, 701) for _ in range(2))
    lattice = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    assert volume == pytest.approx(4.0 * (machine.check(lattice) == 0).sum(), rel=0.02)


@needs_chromium
def test_the_picture_has_room_for_a_section_and_the_workspace(pages, browser):
    distances = []
    boxes = {
        "its surface at this orientation": "parakin.surface.last",
        "a section through": "parakin.section.corners > 0",
    }
    for order in (list(boxes), list(boxes)[::-1]):
        with open_tab(browser, 768, 1024) as tab:
            tab.goto(pages("tricept"))
            before = tab.evaluate("parakin.orbit.distance")
            for label in order:
                tab.get_by_label(label).check()
                wait_until(tab, boxes[label])
            distances.append(tab.evaluate("parakin.orbit.distance"))
    assert distances[0] == pytest.approx(distances[1])
    assert distances[0] > 1.1 * before


@needs_chromium
@pytest.mark.parametrize("name", ["hbg80_2d", "tricept"])
def test_a_section_shows_how_far_singularities_are(pages, browser, name):
    machine = load_shipped(name)
    with open_tab(browser) as tab:
        tab.goto(pages(name))
        tab.get_by_label("a section through the tool, by det A").check()
        wait_until(tab, "parakin.section.corners > 0")
        drawn = tab.evaluate("parakin.section")
        if "Z" in machine.axes:  # while the tool moves, sections follow
            place = machine.axes.index("Z")
            for step in range(12):
                moved = machine.home + step * (np.arange(len(machine.axes)) == place)
                tab.evaluate("pose => parakin.moveToPose(pose)", moved.tolist())
            wait_until(tab, "parakin.section.count >= 3")
    poses = np.tile(machine.home, (40_000, 1))
    poses[:, :2] = np.random.default_rng(5).uniform(-1400.0, 1400.0, (len(poses), 2))
    poses = poses[machine.check(poses) == 0]
    assert len(poses) > 1000
    parallel = compute_singularity_margins(machine, np.vstack([machine.home, poses]))[:, 0]
    shares = parallel[1:] / parallel[0]
    span = shares.max() - shares.min()
    assert drawn["least"] == pytest.approx(shares.min(), abs=0.03 * span)
    assert drawn["most"] == pytest.approx(shares.max(), abs=0.03 * span)


SIZED = """([poses, signs, sizes]) => {
  const plain = values => values.map(value => Number.isFinite(value) ? value : null);
  sizes.forEach((size, i) => { model.sizes[i] = size; });
  const begin = {pose: model.given().slice(0, machine.axes.length), signs};
  begin.joints = model.inverse(begin.pose, signs);
  return {
    given: plain(model.given()),
    side: measureSide(begin),
    joints: poses.map(pose => plain(model.inverse(pose, signs))),
    margins: poses.map(pose => plain(model.margins(pose, model.inverse(pose, signs), signs))),
    forward: poses.map(pose => followJoints(begin, model.inverse(pose, signs)).state.pose),
  };
}"""


@needs_chromium
@pytest.mark.parametrize("name", REPRESENTATIVES)
def test_sizes_are_inputs_of_a_page(name, browser):
    """With other sizes a page computes as the machine that is read with these."""
    machine = load_shipped(name)
    rates, rng = machine.size_rates, np.random.default_rng(11)
    sizes = np.array(rates.nominal) * (1.0 + rng.uniform(-0.04, 0.04, len(rates.nominal)))
    every = {**machine.spec.sizes, **dict(zip(rates.names, sizes.tolist(), strict=True))}
    other = pk.load(name, parameters=every)
    poses = seeded_poses(other, 5)
    if other.direction is not None:
        poses[:, other.direction.b] = np.abs(poses[:, other.direction.b])
    poses = poses[np.isfinite(other.inverse(poses)).all(1)]
    with open_tab(browser) as tab:
        tab.add_script_tag(content=write_core(machine))
        signs = [1 if sign == "+" else -1 for sign in machine.mode]
        page = tab.evaluate(SIZED, [poses.tolist(), signs, sizes.tolist()])
    assert as_numbers(page["joints"]) == pytest.approx(other.inverse(poses), abs=AGREE)
    assert as_numbers(page["margins"]) == pytest.approx(other.margins(poses), abs=AGREE, rel=AGREE)
    bounds = [limit.bound for limit in other.limit_definitions]
    given = as_numbers(page["given"])
    assert given[: len(machine.axes)] == pytest.approx(other.home, abs=AGREE)
    assert given[len(machine.axes) :][: len(bounds)] == pytest.approx(bounds, abs=AGREE)
    off = as_numbers(page["forward"]) - poses
    off[:, machine.turning_columns] = wrap_angle(off[:, machine.turning_columns])
    assert np.abs(off).max() < AGREE


def test_numbers_follow_lengths_angles_and_sizes_that_others_are_calculated_from(tmp_path):
    hexam = load_shipped("hexam")
    rates, other = hexam.size_rates, {"lean": 0.8, "rod": 640.0, "R": 430.0}
    assert rates.names == rates.acting == ("R", "r", "rod", "lean", "tool")
    numbers = list_numbers(rates.apply(hexam.spec, [other.get(n, hexam.spec.sizes[n]) for n in rates.names]))
    assert numbers == pytest.approx(list_numbers(pk.load("hexam", other).spec), rel=1e-12, abs=1e-12)
    rails = pk.family(hexam, free=["lean"]).inverse(hexam.home, {"lean": "41 deg"})
    assert rails == pytest.approx(pk.load("hexam", {"lean": "41 deg"}).inverse(hexam.home), abs=1e-9)
    table = load_shipped("orthoglide5_table").size_rates
    assert (table.names, table.acting) == (("cube", "L", "middle", "tool"), ("L", "middle", "tool"))
    text = (Path(pk.__file__).parent / "machines" / "rpr3.yaml").read_text(encoding="utf-8")
    text = re.sub("sizes: .*", "sizes: {R: 500 mm, v: 1 m/s, turn: 4 deg, r: 120 mm, e: R * R / 5 m}", text)
    text = re.sub("r, at: .30 deg", "r, at: [30 deg + turn", text)
    (tmp_path / "rpr3.yaml").write_text(re.sub(r"range: \[", "range: [0.5 * e + ", text), encoding="utf-8")
    assert pk.load(tmp_path / "rpr3.yaml").size_rates.names == (
        "turn",
        "e",
    )  # r times a turn is no sum


def test_sizes_that_change_numbers_unevenly_or_the_structure_are_left_out(tmp_path):
    assert load_shipped("tricept").size_rates.names == ("R", "r", "l1", "l2")
    text = (Path(pk.__file__).parent / "machines" / "triglide_pairs.yaml").read_text(encoding="utf-8")
    text = text.replace("  half:", "  second: 650 mm\n  half:").replace("{rod: rod, on: left", "{rod: second, on: left")
    (tmp_path / "pairs.yaml").write_text(text, encoding="utf-8")
    assert pk.load(tmp_path / "pairs.yaml").size_rates.names == (
        "side",
        "wide",
        "half",
        "tool",
    )  # of rods one skews the pair
    machine = load_shipped("tricept").replace_parameters({"legs.d1.foot.x": 1.0})
    assert machine.size_rates.names == ("R", "r", "l1", "l2")  # one foot has an error of its own beside R's


@needs_chromium
def test_a_size_is_dragged(pages, browser):
    with open_tab(browser) as tab:
        tab.goto(pages("tricept"))
        slider = tab.get_by_label("R, mm", exact=True).first
        slider.evaluate("input => { input.value = 380; input.dispatchEvent(new Event('input')); }")
        machine = pk.load("tricept", parameters={"R": tab.evaluate("parakin.model.sizes[0]")})
        assert abs(tab.evaluate("parakin.model.sizes[0]") - 380.0) < 1.0
        assert [own["name"] for own in tab.evaluate("parakin.listOwnSizes()")] == ["R"]
        assert tab.evaluate("parakin.state.joints") == pytest.approx(machine.inverse(machine.home), abs=AGREE)
        tab.evaluate("parakin.moveToSizes([2000, 100, 300, 150])")  # struts end before that
        assert tab.locator("#verdict").inner_text().startswith("Stopped: d")
        tab.get_by_role("button", name="As in the file").click()
        assert tab.evaluate("parakin.state.joints") == pytest.approx(
            load_shipped("tricept").inverse(machine.home), abs=AGREE
        )


@needs_chromium
def test_sizes_follow_one_that_the_file_calculates_them_from(pages, browser):
    with open_tab(browser) as tab:
        tab.goto(pages("orthoglide5_table"))
        for name, value in (("cube", "206"), ("L", "265")):
            number = tab.get_by_label(f"{name}, mm").nth(1)
            number.fill(value)
            number.press("Enter")
        own = {size["name"]: size["value"] for size in tab.evaluate("parakin.listOwnSizes()")}
        assert own == {"cube": 206.0, "L": 265.0}
        machine = pk.load("orthoglide5_table", parameters=own)  # middle follows L
        assert tab.evaluate("parakin.model.sizes") == pytest.approx(list(machine.spec.sizes.values()), abs=AGREE)
        joints = machine.inverse(tab.evaluate("parakin.state.pose"))
        assert tab.evaluate("parakin.state.joints") == pytest.approx(joints, abs=AGREE)


@needs_chromium
@pytest.mark.parametrize("name", ["eclipse_overactuated", "tricept"])  # links of three drives each; a head that turns
def test_every_drive_is_named_in_the_picture(name, pages, browser):
    machine = load_shipped(name)
    with open_tab(browser) as tab:
        tab.goto(pages(name))
        names = tab.locator("#overlay span:not(.axis)").all_inner_texts()
    assert sorted(name for label in names for name in label.split(", ")) == sorted(machine.joints)
