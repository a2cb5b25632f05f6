"""The tour in a browser: one button invites, and a card that was sent away comes back."""

from __future__ import annotations

from typing import Any

from flexgui.session.session import Session
from tests.page.helpers import press, sees

INVITING = """() => [...document.querySelectorAll('.mantine-Button-root[data-block]')]
  .filter(b => b.offsetParent && !b.disabled && b.style.cssText.includes('-blue-filled)'))
  .map(b => b.innerText)"""
"""The blue ones; those of the row of stages are no blocks."""

ONLY = f"wanted => JSON.stringify(({INVITING})()) === JSON.stringify([wanted])"


def only_one_invites(page: Any, name: str) -> None:
    """Waits until it is this button and no other one."""
    page.wait_for_function(ONLY, arg=name)


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
