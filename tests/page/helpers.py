"""Hands and eyes for the page."""

from __future__ import annotations

import json
from typing import Any

from flexgui.session.scenario_edits import ScenarioDict, set_value
from flexgui.session.session import Session
from tests.session.helpers import until

PLOTS = """() => JSON.stringify([
  [...document.querySelectorAll('.js-plotly-plot')].map(p => p.data.map(t => [t.name, t.x, t.y])),
  Object.values(window.__viserTestpoints.uplots ?? {}).map(u => u.chart.data.map(c => [...c]))])"""
FIRST = """document.querySelectorAll('.uplot').length >= 2
  && document.querySelectorAll('.js-plotly-plot').length >= 1"""
"""The plots of the first stage stand."""


LOOK = 300
"""ms between two looks at plots: what is drawn is drawn anew within a quarter of a second."""


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


def enter(page: Any, label: str, value: str) -> None:
    """Types a value into the box of a slider or a number field."""
    found = page.get_by_text(label, exact=True).first.get_attribute("for")
    field = page.locator(f'[id="{found}"]')
    box = field if field.evaluate("e => e.tagName") == "INPUT" else field.locator("xpath=..")
    target = box if box is field else box.get_by_role("textbox")
    target.fill(value)


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

    def edit(document: ScenarioDict) -> None:
        document["recordings"] = [document["recordings"][k] for k in (1, 2, 7)]
        for entry in document["recordings"]:
            entry["simulate"]["seconds"] = 1.0

    assert session.document.change(
        edit, set_value(("identify", "population"), 8), set_value(("identify", "generations"), 6)
    )
