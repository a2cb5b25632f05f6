"""The tour in a browser: its one button, its card, and how soon it leads to a verdict."""

from __future__ import annotations

import time
from typing import Any

import pytest

from flexgui.session.session import Session
from flexgui.stages.diagnose.model_versions import ladder_steps
from tests.page.helpers import press, sees
from tests.page.test_diagnose import bars
from tests.session.helpers import until

INVITING = """() => [...document.querySelectorAll('.mantine-Button-root[data-block]')]
  .filter(b => b.offsetParent && !b.disabled && b.style.cssText.includes('-blue-filled)'))
  .map(b => b.innerText)"""
"""The blue ones; those of the row of stages are no blocks."""

ONLY = f"wanted => JSON.stringify(({INVITING})()) === JSON.stringify([wanted])"


def only_one_invites(page: Any, name: str) -> None:
    """Waits until it is this button and no other one."""
    page.wait_for_function(ONLY, arg=name)


@pytest.mark.long
def test_one_button_invites_and_the_tour_comes_back(page: Any, session: Session) -> None:
    only_one_invites(page, "Begin the tour")
    press(page, "Skip tour")
    only_one_invites(page, "Next: take measurements")
    press(page, "Diagnose")
    press(page, "Tour")
    only_one_invites(page, "Begin the tour")
    press(page, "Begin the tour")
    sees(page, "1 of 4: look")
    only_one_invites(page, "Next: identify")
    press(page, "Compare")
    sees(page, "The model is not fitted yet")
    only_one_invites(page, "Identify first")
    press(page, "Diagnose")
    sees(page, "3 of 4: diagnose")
    only_one_invites(page, "Find what is missing")
    press(page, "Leave the tour")
    page.get_by_text("3 of 4: diagnose").wait_for(state="detached")
    press(page, "Tour")
    sees(page, "3 of 4: diagnose")
    press(page, "Data")
    sees(page, "1 of 4: look")
    assert not session.diagnosis.versions


WAITING = 600_000
"""ms that a search takes on a busy machine."""
CLICKS = 5
"""To a verdict."""


@pytest.mark.long
def test_the_tour_leads_to_the_falling_error_in_five_clicks(page: Any, session: Session) -> None:
    clicks, begun = list[str](), time.monotonic()

    def click(name: str) -> None:
        button = page.get_by_role("button", name=name, exact=True).first
        button.wait_for(timeout=WAITING)
        button.click(timeout=WAITING)
        clicks.append(name)

    click("Begin the tour")
    click("Next: identify")
    click("Next: compare model and measurements")
    click("Next: diagnose")
    click("Add Coulomb friction")
    until(lambda: len(bars(page)) == 2, WAITING / 1000.0)
    print(f"{len(clicks)} clicks, {time.monotonic() - begun:.0f} s")
    assert len(clicks) <= CLICKS
    first, second = ladder_steps(session.diagnosis.shown_versions)
    assert second.cost_per_sample < 0.25 * first.cost_per_sample
