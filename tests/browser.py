"""Chromium for the tests that open pages; they are skipped where it is not installed."""

from __future__ import annotations

import shutil
import time
from contextlib import contextmanager

import pytest
from playwright.sync_api import sync_playwright

CHROMIUM = shutil.which("chromium")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed (scripts/chromium.sh)")
FLAGS = ["--no-sandbox", "--use-gl=swiftshader", "--enable-unsafe-swiftshader"]


@contextmanager
def open_browser():
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def open_tab(browser, width=1280, height=800):
    """A tab whose scripts must not fail."""
    errors = []
    tab = browser.new_page(viewport={"width": width, "height": height})
    tab.on("pageerror", lambda error: errors.append(f"{error}\n{error.stack}"))
    try:
        yield tab
        assert not errors
    finally:
        tab.close()


def wait_until(tab, expression, seconds=20.0):
    """Wait for an expression of the page; its content policy forbids Playwright's own way."""
    end = time.monotonic() + seconds
    while not tab.evaluate(expression):
        assert time.monotonic() < end, expression
        tab.wait_for_timeout(30)


PALE_TEXTS = r"""least => {
  const read = text => {
    const numbers = text.match(/[\d.]+(e-?\d+)?/g).map(Number), unit = text.startsWith("color(") ? 255 : 1;
    return [...numbers.slice(0, 3).map(x => unit * x), numbers[3] ?? 1];
  };
  const lay = (over, under) => under.map((x, i) => i < 3 ? over[3] * over[i] + (1 - over[3]) * x : 1);
  const listGrounds = one => {
    if (!one) return [[255, 255, 255, 1]];
    const {backgroundColor, backgroundImage} = getComputedStyle(one);
    const colour = /rgba?\([^)]*\)|color\([^)]*\)/g, stops = backgroundImage.match(colour) || [backgroundColor];
    return listGrounds(one.parentElement).flatMap(under => stops.map(stop => lay(read(stop), under)));
  };
  const light = x => x / 255 <= 0.04045 ? x / 255 / 12.92 : ((x / 255 + 0.055) / 1.055) ** 2.4;
  const brightness = colour => 0.2126 * light(colour[0]) + 0.7152 * light(colour[1]) + 0.0722 * light(colour[2]);
  const measure = (one, part) => Math.min(...listGrounds(one).map(ground => {
    const text = lay(read(getComputedStyle(one, part).color), ground);
    const [low, high] = [ground, text].map(brightness).sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05);
  }));
  for (const details of document.querySelectorAll("details")) details.open = true;
  const found = [];
  for (const one of document.body.querySelectorAll("*")) {
    const texts = [...one.childNodes].filter(node => node.nodeType === 3).map(node => node.data).join("").trim();
    if (!texts && !one.matches("input:not([type=range], [type=checkbox]), select, textarea")) continue;
    if (one.matches("script, style, option") || !one.checkVisibility({visibilityProperty: true})) continue;
    for (const part of one.placeholder ? [null, "::placeholder"] : [null]) {
      const contrast = measure(one, part);
      if (!(contrast >= least)) found.push(`${one.tagName} ${one.id} ${part || ""} ${texts}: ${contrast.toFixed(2)}`);
    }
  }
  return found;
}"""


def list_pale_texts(tab):
    """List the texts of a page, closed ones too, whose contrast by WCAG 2 is below 4.5, by their colours in CSS."""
    return tab.evaluate(PALE_TEXTS, 4.5)
