"""The views of the error under Compare in a browser: each that its folder holds is offered."""

from __future__ import annotations

from typing import Any

import pytest

import flexgui as fg
from flexgui.session.session import Session
from flexgui.session.state import Topic
from flexgui.views.of_recording import recording_views
from tests.page.helpers import sees


def compared() -> fg.Identification:
    """Of two short recordings, at the refinement's end."""
    rig = fg.load("paper_glocal")
    recordings = rig.scenario.model_dump(exclude_unset=True)["recordings"][1:3]
    for entry in recordings:
        entry["simulate"]["seconds"] = 0.5
    return rig.with_settings(recordings=recordings, identify={"generations": 0}).identify()


def pick(page: Any, title: str) -> None:
    box = page.get_by_text("Show", exact=True).first.get_attribute("for")
    page.locator(f'[id="{box}"]').click()
    page.get_by_role("option", name=title, exact=True).click()


@pytest.mark.long
def test_each_view_of_the_folder_is_offered_and_drawn(page: Any, session: Session) -> None:
    found = compared()
    assert session.document.change(
        lambda document: document.update(found.project.scenario.model_dump())
    )
    session.identification.outcome, session.identification.outcome_of = (
        found.outcome,
        session.document.scenario,
    )
    session.notify(Topic.OUTCOME)
    session.show("Compare")
    sees(page, "fit of all recordings")
    for view in recording_views().values():
        pick(page, view.title)
        page.get_by_text(view.about).or_(page.get_by_text(view.nothing)).first.wait_for()
    pick(page, "signals")
    sees(page, "fit of all recordings")
