"""Seeded random interactions leave a page alive; PARAKIN_INTERACTIONS asks for more of them."""

import os

import numpy as np
import pytest
from browser import needs_chromium, open_browser, open_tab
from shipped import load_shipped

import parakin as pk

COUNT = int(os.environ.get("PARAKIN_INTERACTIONS", "30"))
KEYS = ["ArrowLeft", "ArrowUp", "+", "-", "h", "v", "p", "Tab", "Enter", " ", "Escape", "PageDown", "Home", "End"]
NUMBERS = ["0", "1e9", "-250", "abc", "", "37.5", "-1e-7", "1e308", "180"]
PARTS = {
    "tricept": "G90 G21\nG0 X0 Y0 Z-1500\nG1 X120 Y40 B12 C30 F3000\nG1 X-90 Z-1600 B0 C0\nG1 X3000\n",
    "exechon": "",  # a machine's page, with its sizes, which move its home
    "rrr3": "G90 G21\nG0 X0 Y0 C0\nG1 X40 Y10 C10 F900\nG1 X-20 Y30 C-5\n",
}


def write_page(name, folder):
    file = folder / f"{name}.html"
    if not PARTS.get(name):
        file.write_text(pk.render_machine_page(load_shipped(name)), encoding="utf-8")
        return file.as_uri()
    part = folder / f"{name}.ngc"
    part.write_text(PARTS[name])
    job = pk.prepare(load_shipped(name), pk.read_path(part))
    file.write_text(pk.render_path_page(job.posted, job.trajectory), encoding="utf-8")
    return file.as_uri()


def interact(tab, rng):
    """One of the things that a hand does; returns what it was."""
    box = tab.locator("#canvas").bounding_box()
    x, y = box["x"] + box["width"] * rng.uniform(0.02, 0.98), box["y"] + box["height"] * rng.uniform(0.02, 0.98)
    kind = rng.choice(["drag", "tool", "strut", "wheel", "slide", "type", "button", "box", "key", "choice"])
    if kind in ("tool", "strut"):
        joints = tab.evaluate("parakin.machine.legJoints")
        drive = int(rng.integers(joints))
        x, y = tab.evaluate("parakin.tipInPicture()" if kind == "tool" else f"parakin.strutInPicture({drive})")
    if kind in ("drag", "tool", "strut"):
        if rng.random() < 0.3:
            tab.keyboard.down("Shift")
        tab.mouse.move(x, y)
        tab.mouse.down(button="right" if rng.random() < 0.2 else "left")
        tab.mouse.move(x + rng.normal(0.0, 80.0), y + rng.normal(0.0, 80.0), steps=int(rng.integers(1, 5)))
        tab.mouse.up(button="left")
        tab.mouse.up(button="right")
        tab.keyboard.up("Shift")
    elif kind == "wheel":
        tab.mouse.move(x, y)
        tab.mouse.wheel(0, rng.normal(0.0, 300.0))
    elif kind in ("slide", "type", "button", "box", "choice"):
        selector = {"slide": "input[type=range]", "type": "input[type=number]", "button": "button:visible"}
        selector |= {"box": "input[type=checkbox]", "choice": "select"}
        controls = tab.locator(selector[kind])
        if not controls.count():
            return kind
        control = controls.nth(int(rng.integers(controls.count())))
        if kind == "slide":
            control.evaluate(
                "(input, share) => { input.value = Number(input.min) + share * (input.max - input.min);"
                " input.dispatchEvent(new Event('input')); }",
                rng.random(),
            )
        elif kind == "type":
            control.evaluate(
                "(input, text) => { input.value = text; input.dispatchEvent(new Event('change')); }",
                str(rng.choice(NUMBERS)),
            )
        elif kind == "choice":
            control.select_option(index=int(rng.integers(control.locator("option").count())))
        else:
            control.click(force=True)
    else:
        tab.keyboard.press(str(rng.choice(KEYS)))
    return str(kind)


def find_difference(tab, machine):
    """What a page shows otherwise than the library; None for nothing, or where the sizes can't be read."""
    state, page, sizes = tab.evaluate(
        "[parakin.state, parakin.marginsAt(parakin.state).map(x => x === x ? x : null), parakin.model.sizes]"
    )
    if not np.isfinite(state["pose"] + state["joints"]).all():
        return state
    mode = "".join("+" if sign > 0 else "-" for sign in state["signs"])
    if sizes != list(machine.size_rates.nominal):
        try:
            machine = pk.load(machine.name, parameters=dict(zip(machine.size_rates.names, sizes, strict=True)))
        except pk.ParakinError:  # its home is off limits with these sizes
            return None
    margins = machine.margins([state["pose"]], [state["joints"]], mode)[0]
    same = np.array(page, float) == pytest.approx(margins, abs=1e-9, rel=1e-9, nan_ok=True)
    return None if same else (state, page, margins.tolist())


@needs_chromium
@pytest.mark.parametrize("name", sorted(PARTS))
def test_seeded_interactions_leave_a_page_alive(name, tmp_path):
    machine, rng = load_shipped(name), np.random.default_rng(20261129)
    with open_browser() as browser, open_tab(browser) as tab:
        tab.goto(write_page(name, tmp_path))
        for number in range(COUNT):
            kind = interact(tab, rng)
            assert find_difference(tab, machine) is None, (number, kind)
        tab.keyboard.press("Escape")
        tab.get_by_role("button", name="Home").click()
        home = tab.evaluate("parakin.machine.axes.map(axis => axis.home)")
        assert tab.evaluate("parakin.state.pose") == pytest.approx(home, abs=1e-12)
