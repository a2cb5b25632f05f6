"""Hands and eyes for the page."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from typing import Any

from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from tests.session.helpers import shortened, until

PLOTS = """() => JSON.stringify([
  [...document.querySelectorAll('.js-plotly-plot')].map(p => p.data.map(t => [t.name, t.x, t.y])),
  Object.values(window.__viserTestpoints.uplots ?? {}).map(u => u.chart.data.map(c => [...c]))])"""
FIRST = """document.querySelectorAll('.uplot').length >= 2
  && document.querySelectorAll('.js-plotly-plot').length >= 1"""
"""The plots of the first stage stand."""
PATIENCE = 30_000
"""ms that a click or a sentence may take on a busy machine without a graphics card."""
SIZE = {"width": 1600, "height": 900}
LOOK = 300
"""ms between two looks at plots: what is drawn is drawn anew within a quarter of a second."""


@contextlib.contextmanager
def visit(
    browser: Any, address: str, viewport: dict[str, int] = SIZE, **more: Any
) -> Iterator[Any]:
    """A page of a person of its own (a context shares no storage), once its plots stand."""
    context = browser.new_context(viewport=viewport, **more)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    page.goto(address)
    ready(page)
    yield page
    context.close()


def ready(page: Any) -> None:
    page.wait_for_function(FIRST)


def plots(page: Any) -> str:
    """All that the plots show."""
    return str(page.evaluate(PLOTS))


def still(page: Any) -> str:
    """All that the plots show, once they stand still: they come one after the other."""
    found = [""]

    def stands() -> bool:
        before, found[0] = found[0], plots(page)
        page.wait_for_timeout(LOOK)
        return found[0] == before and [] not in json.loads(found[0])

    until(stands)
    return found[0]


def redrawn(page: Any, before: str, patience: float = PATIENCE) -> None:
    """Waits until the plots show something else, for `patience` ms."""
    page.wait_for_function(f"before => ({PLOTS})() !== before", arg=before, timeout=patience)


def labelled(page: Any, label: str) -> Any:
    """The input that the label is of."""
    found = page.get_by_text(label, exact=True).first.get_attribute("for")
    return page.locator(f'[id="{found}"]')


def box(page: Any, label: str) -> Any:
    """The box of a slider or a number field."""
    found = labelled(page, label)
    if found.evaluate("e => e.tagName") == "INPUT":
        return found
    return found.locator("xpath=..").get_by_role("textbox")


def enter(page: Any, label: str, value: str) -> None:
    box(page, label).fill(value)


def shows(page: Any, label: str, value: str) -> None:
    """Waits until the box has the value."""
    found = box(page, label).element_handle()
    page.wait_for_function("([e, v]) => e.value === v", arg=[found, value])


def pick(page: Any, label: str, option: str) -> None:
    """An option of a drop-down."""
    labelled(page, label).click()
    page.get_by_role("option", name=option, exact=True).click()


def field(page: Any, label: str) -> Any:
    """The box of a text field: it has no id, but it comes next after the label."""
    return page.get_by_text(label, exact=True).first.locator("xpath=following::input[1]")


def press(page: Any, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).first.click()


def sees(page: Any, text: str) -> None:
    """Waits until the text stands on the page."""
    page.get_by_text(text).first.wait_for()


def small(session: Session) -> None:
    """Two short recordings and a validation: an identification takes a moment."""
    assert session.document.change(
        shortened(1, 2, 7),
        set_value(("identify", "population"), 8),
        set_value(("identify", "generations"), 6),
    )
