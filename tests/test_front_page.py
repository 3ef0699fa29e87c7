"""The front of the closed form as the command finds it, and its page: each point leads to its file and its machine."""

import json
import re
from base64 import b64decode
from contextlib import redirect_stdout
from io import StringIO
from zlib import decompress

import pytest
from browser import needs_chromium, open_browser, open_tab, wait_until
from test_designs import GLIDE

import parakin as pk
from parakin.cli import main
from parakin.performance.design import design_orthoglide

# Where a point of the plot is on the screen.
POINT = """(number) => {
  const place = document.getElementById("front"), { left, top } = place.getBoundingClientRect();
  const { data: [trace], layout } = JSON.parse(document.querySelector("script[data-figure]").textContent);
  const { margin, height, xaxis, yaxis } = layout, [low, high] = yaxis.domain;
  const find = (value, [least, most]) => (value - least) / (most - least);
  const x = find(trace.x[number], xaxis.range), y = low + (high - low) * find(trace.y[number], yaxis.range);
  return [left + margin.l + x * (place.clientWidth - margin.l - margin.r),
          top + margin.t + (1 - y) * (height - margin.t - margin.b)];
}"""
NAMES = [f"design_{number}" for number in (1, 2, 3)]


def unpack_pages(text):
    packed = re.search(r'<script type="text/plain" id="pages">(.*?)</script>', text)[1]
    found = json.loads(decompress(b64decode(packed)))
    return ["\n".join(found["lines"][number] for number in page) for page in found["pages"]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("front")
    (folder / "glide.yaml").write_text(GLIDE.replace("minimise: L", "minimise: [L, amplification]"))
    return folder


@pytest.fixture(scope="module")
def answer(folder):
    with redirect_stdout(StringIO()) as said:
        assert main(["design", str(folder / "glide.yaml"), "--count", "3", "-o", str(folder / "out"), "--json"]) == 0
    return json.loads(said.getvalue())


def test_the_command_finds_the_front_of_the_closed_form(answer, folder):
    assert answer["schema"] == "parakin.designs/1"
    assert [found["verdict"] for found in answer["designs"]] == ["proved"] * 3
    rods, bounds = ([found["values"][name] for found in answer["designs"]] for name in ("L", "amplification"))
    assert rods == sorted(rods)
    assert bounds[0] == pytest.approx(3.0, rel=1e-5)
    assert rods[-1] == pytest.approx(500.0, rel=1e-5)
    assert rods == pytest.approx([design_orthoglide(200.0, bound).rod for bound in bounds], rel=1e-5)
    output = folder / "out"
    fronts = ["front.html", "front.pdf", "front.png"]
    assert sorted(p.name for p in output.iterdir()) == [*(f"{name}.yaml" for name in NAMES), *fronts]
    assert pk.load(output / "design_1.yaml").inverse([0.0, 0.0, 0.0]) == pytest.approx([rods[0]] * 3)
    assert (output / "front.png").read_bytes().startswith(b"\x89PNG")


def test_the_page_holds_every_design(answer, folder):
    text = (folder / "out" / "front.html").read_text("utf-8")
    assert len(text) < 400_000
    assert not re.search(r"(src|href)=.?(https?:)?//", text)
    (source,) = re.findall(r'<script type="application/json" data-figure="front">(.*?)</script>', text)
    (trace,) = json.loads(source)["data"]
    assert trace["links"] == [f"#{name}" for name in NAMES]
    assert trace["x"] == [found["values"]["L"] for found in answer["designs"]]
    assert trace["y"] == [found["values"]["amplification"] for found in answer["designs"]]
    for name, page in zip(NAMES, unpack_pages(text), strict=True):
        file = re.search(f'<a download="{name}.yaml" href="data:text/yaml;base64,(.*?)">', text)[1]
        assert b64decode(file).decode() == (folder / "out" / f"{name}.yaml").read_text("utf-8")
        assert page.startswith("<!DOCTYPE html>")
        machine = json.loads(re.search(r"^const machine = (.*);$", page, re.MULTILINE)[1])
        drives = pk.load(folder / "out" / f"{name}.yaml").drives
        assert [(joint["low"], joint["high"]) for joint in machine["joints"]] == [(d.low, d.high) for d in drives]


@needs_chromium
def test_a_point_leads_to_its_machine(answer, folder):
    with open_browser() as browser, open_tab(browser, 1360, 900) as tab:
        tab.goto((folder / "out" / "front.html").as_uri())
        wait_until(tab, "location.hash === '#design_1'")
        tab.locator("#front").focus()
        for key in ("ArrowRight", "ArrowRight", "Enter"):
            tab.keyboard.press(key)
        shown = "[...document.querySelectorAll('[data-choice]:not([hidden])')].map((one) => one.dataset.choice).join()"
        wait_until(tab, f"location.hash === '#design_2' && {shown} === 'design_2'")
        wait_until(tab, "document.querySelector('iframe').contentWindow.parakin?.pictures > 0")
        machine = pk.load(folder / "out" / "design_2.yaml")
        joints = tab.evaluate("document.querySelector('iframe').contentWindow.parakin.state.joints")
        assert joints == pytest.approx(machine.inverse(machine.home), abs=1e-6)
        tab.mouse.click(*tab.evaluate(POINT, 2))
        wait_until(tab, f"{shown} === 'design_3'")
        with tab.expect_download() as saved:
            tab.locator('a[download="design_3.yaml"]').click()
        assert pk.load(saved.value.path()).inverse([0.0, 0.0, 0.0])[0] == pytest.approx(500.0, rel=1e-5)
