"""A real browser for a served page, and hands and eyes in it."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
NONE = "no Chromium on this machine: the page is not looked at"
FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync "
    "--use-angle=swiftshader --enable-unsafe-swiftshader"
).split()
PATIENCE = 30_000
"""ms that a click or a sentence may take on a busy machine without a graphics card."""
SIZE = {"width": 1600, "height": 900}
SMALL = {"width": 1280, "height": 720}

SHOWN = """() => JSON.stringify([
  [...document.querySelectorAll('.js-plotly-plot')].map(p => p.data.map(t => [t.name, t.x, t.y])),
  Object.values(window.__viserTestpoints.uplots ?? {}).map(u => u.chart.data.map(c => [...c]))])"""
FIRST = """document.querySelectorAll('.uplot').length >= 2
  && document.querySelectorAll('.js-plotly-plot').length >= 1"""
"""The plots of the first stage stand."""


@contextlib.contextmanager
def chromium() -> Iterator[Any]:
    """Without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


@contextlib.contextmanager
def visit(browser: Any, address: str, size: dict[str, int] = SIZE) -> Iterator[Any]:
    """A page of a person of its own (a context shares no storage), once its plots stand."""
    context = browser.new_context(viewport=size)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    page.goto(address)
    ready(page)
    yield page
    context.close()


def ready(page: Any) -> None:
    page.wait_for_function(FIRST)


def box(page: Any, label: str) -> Any:
    """The text box beside a slider."""
    found = page.get_by_text(label, exact=True).first.get_attribute("for")
    return page.locator(f'[id="{found}"]').locator("xpath=..").get_by_role("textbox")


def shows(page: Any, label: str, value: str) -> None:
    """Waits until the slider's box has the value."""
    found = box(page, label).element_handle()
    page.wait_for_function("([e, v]) => e.value === v", arg=[found, value])


def press(page: Any, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).first.click()


def sees(page: Any, text: str) -> None:
    """Waits until the text stands on the page."""
    page.get_by_text(text).first.wait_for()


def drawn(page: Any) -> str:
    """All that the plots show."""
    return str(page.evaluate(SHOWN))


def redrawn(page: Any, before: str) -> None:
    """Waits until they show something else."""
    page.wait_for_function(f"before => ({SHOWN})() !== before", arg=before)
