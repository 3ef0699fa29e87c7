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
