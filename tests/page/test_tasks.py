"""Three ways to a verdict as a person walks them: the clicks that they take, and the waiting."""

from __future__ import annotations

import time
from typing import Any

import pytest

from flexgui.session.session import Session
from flexgui.stages.diagnose.model_versions import ladder_steps
from tests.page.test_diagnose import bars
from tests.session.helpers import until

pytestmark = pytest.mark.long

WAITING = 600_000
"""ms that a search takes on a busy machine."""
CLICKS = 5


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
