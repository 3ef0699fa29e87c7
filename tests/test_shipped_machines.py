"""The shipped machines: their files hold what their sources say."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import product
from math import cos, hypot, isfinite, pi, radians, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.description import list_shipped_machines, read_machine
from parakin.description.writing import format_spec
from parakin.model.elements import Range

# The shipped machines.


@pytest.mark.parametrize("name", list_shipped_machines())
def test_shipped(name):
    text = list_shipped_machines()[name].read_text(encoding="utf-8")
    spec = read_machine(list_shipped_machines()[name])
    assert spec.name == name
    assert text.startswith("#"), "says what the machine is"
    assert len(spec.source) > 60
    assert "chosen" in spec.source
    assert all(isfinite(d.low) and isfinite(d.high) for d in spec.drives)


def test_shipped_names():
    assert sorted(list_shipped_machines()) == [
        "cmw_300", "eclipse", "eclipse_overactuated", "exechon", "five_bar", "five_bar_slides",
        "four_struts", "g500", "george_v", "hbg80_2d", "hbg80_3d",
        "hexaglide",
        "hexam", "hexapod", "lambda6", "linapod3", "linapod6", "linear_delta", "mikromat_6x", "okuma_hexapod",
        "orthoglide", "orthoglide5_head", "orthoglide5_table", "pentapod", "prr3", "quickstep", "rotary_delta", "rpr3",
        "rrr3", "rus6", "sprint_z3", "tornado_2000", "tricept", "tricept_805", "triglide",
        "triglide_pairs", "urane_sx", "variax",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "sizes"),
    [
        ("tricept", {"R": 350, "r": 100, "l1": 300, "l2": 150}),
        ("hbg80_2d", {"l1": 400, "l2": 400}),
        ("hbg80_3d", {"l0": 600, "xPT1": 80, "yPT1": 80, "h": 120}),
        ("lambda6", {"C": 900, "D": 230, "c": 1200, "u": 800, "r": 300}),
    ],
)
def test_published_sizes(name, sizes):
    assert read_machine(list_shipped_machines()[name]).sizes == sizes


def ranges(name):
    return {d.name: (d.low, d.high) for d in read_machine(list_shipped_machines()[name]).drives}


def assert_inside(name, joints):
    for drive, q in zip(read_machine(list_shipped_machines()[name]).drives, joints, strict=True):
        assert drive.low < q < drive.high, drive


def test_tricept():
    assert ranges("tricept")["d1"] == (934, 1520)
    spec = read_machine(list_shipped_machines()["tricept"])
    assert [(s.axis, s.value, s.sign) for s in spec.head] == [
        ("tz", -300, 1), ("rz", 0, 1), ("ry", 0, -1), ("tz", -150, 1)
    ]  # fmt: skip
    assert spec.limits.passive == tuple(Range(n, pytest.approx(-pi / 3), pytest.approx(pi / 3)) for n in ("rx", "ry"))
    # (26)-(28) at some tilt, from the feet and platform points as read
    psi, theta, p = 0.3, -0.4, 1100.0
    sp, cp, st_, ct = sin(psi), cos(psi), sin(theta), cos(theta)
    rotation = np.array([[ct, 0, st_], [sp * st_, cp, -sp * ct], [-cp * st_, sp, cp * ct]])
    d = [hypot(*(rotation @ (np.array(leg.platform) - [0, 0, p]) - leg.foot)) for leg in spec.legs]
    big, small = 350.0, 100.0
    common = p * p + small**2 + big**2
    half = small * big / 2
    assert [x * x for x in d] == pytest.approx(
        [
            common - 2 * p * big * ct * sp - 2 * small * big * cp,
            common + p * big * (ct * sp - sqrt(3) * st_) + half * (-3 * ct - sqrt(3) * st_ * sp - cp),
            common + p * big * (ct * sp + sqrt(3) * st_) + half * (-3 * ct + sqrt(3) * st_ * sp - cp),
        ]
    )
    p = -spec.home["Z"] - 450
    assert_inside("tricept", [hypot(p, 250)] * 3 + [0, 0])


def test_hbg80():
    assert set(ranges("hbg80_2d").values()) == {(-400, 200)}
    home = read_machine(list_shipped_machines()["hbg80_2d"]).home
    x, y = home["X"], home["Y"]
    assert_inside("hbg80_2d", [x - sqrt(400**2 - y * y), y - sqrt(400**2 - x * x)])
    assert ranges("hbg80_3d") == dict.fromkeys(("Xhbg", "Yhbg", "Zhbg"), (-750, -350))
    spec = read_machine(list_shipped_machines()["hbg80_3d"])
    assert spec.home == {"X": 80, "Y": 80, "Z": -120}
    assert {leg.platform for leg in spec.legs} == {(-80, -80, 120)}
    assert [leg.rail for leg in spec.legs] == [(1, 0, 0), (0, 1, 0), (0, 0, -1)]
    assert_inside("hbg80_3d", [-600] * 3)


def test_lambda6():
    spec = read_machine(list_shipped_machines()["lambda6"])
    assert [d.name for d in spec.drives] == ["l1", "l2", "l3", "l4", "l5", "l6"]
    assert [leg.foot[:2] for leg in spec.legs] == [
        pytest.approx((900 * cos(radians(a)), 900 * sin(radians(a))), abs=1e-9) for a in (180, 60, -60)
    ]
    rise = sqrt(1200**2 - 670**2)
    reach = 0.75 * rise
    gap = reach + sqrt(reach**2 - 900**2 + 800**2)
    low = spec.home["Z"] - rise
    home = (*[low] * 3, *[low + gap] * 3)
    table = [
        (398.89, 299.68, 414.67, 1758.75, 1714.02, 1723.08),
        (164.59, 223.16, 467.37, 1587.58, 1565.02, 1514.00),
    ]
    for joints in (home, *table):
        assert_inside("lambda6", joints)
        for i, limit in enumerate(spec.limits.gaps):
            assert limit.low < joints[i + 3] - joints[i] < limit.high
            assert (limit.first, limit.second) == (f"l{i + 1}", f"l{i + 4}")


def test_orthoglide_is_designed_for_its_cube():
    """1/3 ≤ ψ ≤ 3 all over the cube and exactly 3 at two opposite corners; the strokes just cover the cube."""
    spec = read_machine(list_shipped_machines()["orthoglide"])
    length = spec.sizes["L"]
    assert length == pytest.approx(254.26446168553)
    a, b = -2 * length / sqrt(17), length / sqrt(11)
    assert b - a == pytest.approx(200)

    def roots(x, y, z):
        return [sqrt(length**2 - y * y - z * z), sqrt(length**2 - x * x - z * z), sqrt(length**2 - x * x - y * y)]

    def amplifications(x, y, z):
        s = roots(x, y, z)
        rods = np.array([[-s[0], y, z], [x, -s[1], z], [x, y, -s[2]]])
        return np.linalg.svd(np.linalg.solve(rods, np.diag([-v for v in s])), compute_uv=False)

    grid = list(product(np.linspace(a, b, 16), repeat=3))
    psi = np.array([amplifications(*p) for p in grid])
    assert psi.max() == pytest.approx(3)
    assert psi.min() > 1 / 3
    assert amplifications(a, a, a)[0] == pytest.approx(3)
    assert amplifications(b, b, b)[0] == pytest.approx(3)
    least = min(x + roots(x, y, z)[0] for x, y, z in grid)
    (low, high) = ranges("orthoglide")["rho_x"]
    assert low == pytest.approx(least)
    assert high == pytest.approx(b + length)
    for name in ("orthoglide", "orthoglide5_head", "orthoglide5_table"):
        assert ranges(name)["rho_y"] == (low, high)
    assert_inside("orthoglide", [length] * 3)
    assert_inside("orthoglide5_head", [length] * 3 + [0, 0])
    m = (a + b) / 2
    table = read_machine(list_shipped_machines()["orthoglide5_table"])
    assert [s.value for s in table.table[:3]] == pytest.approx([m, m, m - 100])
    assert_inside("orthoglide5_table", [m + sqrt(length**2 - 2 * m * m)] * 3 + [0, 0])


def test_hexapod():
    spec = read_machine(list_shipped_machines()["hexapod"])
    base = [(-22.95, 13.25), (22.95, 13.25), (22.95, 13.25), (0, -26.5), (0, -26.5), (-22.95, 13.25)]
    top = [(-1, 11.5), (1, 11.5), (10.459, -4.884), (9.459, -6.616), (-9.459, -6.616), (-10.459, -4.884)]
    assert np.allclose([leg.foot for leg in spec.legs], [(25.4 * x, 25.4 * y, 0) for x, y in base])
    assert np.allclose([leg.platform for leg in spec.legs], [(25.4 * x, 25.4 * y, 0) for x, y in top])
    tool = spec.sizes["tool"]
    z = spec.home["Z"] + tool
    assert_inside(
        "hexapod", [hypot(25.4 * (p[0] - f[0]), 25.4 * (p[1] - f[1]), z) for f, p in zip(base, top, strict=True)]
    )


def test_linear_delta():
    spec = read_machine(list_shipped_machines()["linear_delta"])
    rise = sqrt(spec.sizes["rod"] ** 2 - (spec.sizes["tower"] - spec.sizes["plate"]) ** 2)
    assert_inside("linear_delta", [spec.home["Z"] + spec.sizes["tool"] + rise] * 3)
    for x, y in [(200 * cos(w), 200 * sin(w)) for w in np.linspace(0, 2 * pi, 37)]:
        for leg in spec.legs:
            rod = np.array([leg.foot[0] - leg.platform[0] - x, leg.foot[1] - leg.platform[1] - y])
            assert 300 < sqrt(spec.sizes["rod"] ** 2 - rod @ rod) < 700


def test_every_source_ends_with_who_built_the_machine_or_that_it_is_not_known():
    said = re.compile(r"(?:(?!Built: ).)+\. Built: (not known|by (the )?[A-Z].+|at .*[A-Z].+)\.")
    silent = [name for name in list_shipped_machines() if not said.fullmatch(load_shipped(name).spec.source.strip())]
    assert not silent
    page = (Path(__file__).parents[1] / "docs" / "machines.md").read_text(encoding="utf-8")
    missing = [name for name in list_shipped_machines() if " ".join(load_shipped(name).spec.source.split()) not in page]
    assert not missing


@pytest.mark.parametrize("name", list_shipped_machines())
def test_a_machine_written_with_every_number_is_the_same_machine(name, tmp_path):
    machine, file = load_shipped(name), tmp_path / "written.yaml"
    file.write_text(machine.format_yaml(), encoding="utf-8")
    written = pk.load(file)
    poses = machine.home + np.random.default_rng(1).uniform(-0.3, 0.3, (1000, len(machine.axes))) * [
        1.0 if unit == "rad" else 500.0 for unit in machine.axis_units
    ]
    joints = machine.inverse(poses)
    assert np.array_equal(written.inverse(poses), joints, equal_nan=True)
    assert np.array_equal(written.margins(poses), machine.margins(poses), equal_nan=True)
    assert written.drives == machine.drives
    assert (written.limits, written.mode, written.home.tolist()) == (
        machine.limits,
        machine.mode,
        machine.home.tolist(),
    )
    assert len(written.legs) == file.read_text(encoding="utf-8").count("  - kind: ")


def test_a_written_machine_keeps_controllers_numbers_and_odd_titles(tmp_path):
    text = """\
name: odd
title: '"quoted" \\ and # more: [x]'
source: "Sizes were chosen, no: - nothing ~ \u00b5"
sizes: {R: 500 mm}
mounting: inclined 30 deg
motion: tx ty tz
legs:
  - {kind: slider, joints: [a], foot: [R, 0, 0], rail: [0, 0.1, 1], rod: 700 mm, branch: "+", platform: [1 in, 0, 0],
     range: [-2 m, 2 m], counts: 10000, lead: -5 mm, homing: 915 mm}
  - {kind: slider, joints: [b], foot: [-R / 2, R * sqrt(3) / 2, 0], rail: [0, 0, 1], rod: 710 mm, branch: "+",
     platform: [0, 0, 0], range: [-2 m, 2 m], homing: absolute}
  - {kind: crank, joints: [c], pivot: [-R / 2, -R, 400 mm], axis: [1, 0, 0], zero: [0, 1, 0], arm: 300 mm, rod: 800 mm,
     branch: "-", platform: [0, 0, 0], range: [-720 deg, 720 deg], speed: 10 rpm}
head:
  - rz: {joint: h1, range: [-1 rad, 1 rad], reverse: true, offset: 0.1 deg, jerk: 5 rad/s3, homing: 3 deg}
  - ry: {joint: h2, range: [-1 rad, 1 rad]}
  - tz: -100 mm
limits:
  gaps: [{between: [a, b], range: [-3 m, 3 m]}]
  cones: [{at: foot, angle: 170 deg, axis: [0, 0, -1]}, {at: platform, angle: 170 deg}]
  clearance: 1 mm
home: {X: 10 mm, Y: 200 mm, Z: -200 mm, B: 40 deg, C: 10 deg}
"""
    (tmp_path / "odd.yaml").write_text(text, encoding="utf-8")
    spec = read_machine(tmp_path / "odd.yaml")
    (tmp_path / "again.yaml").write_text(format_spec(spec), encoding="utf-8")
    again = read_machine(tmp_path / "again.yaml")
    assert again == replace(spec, sizes={}, size_units={})
    assert format_spec(again) == format_spec(spec)
