"""Compare in a browser: each view of the error that its folder holds, and the worst places."""

from __future__ import annotations

from typing import Any

import pytest

import flexgui as fg
from flexgui.sentences.written import channel_symbol
from flexgui.session.session import Session
from flexgui.session.state import Topic
from flexgui.views.names import output_title
from flexgui.views.of_recording import recording_views
from tests.page.helpers import pick, press, sees
from tests.page.test_diagnose import few


def compared() -> fg.Identification:
    """Of two short recordings, at the refinement's end."""
    rig = fg.load("paper_glocal")
    recordings = rig.scenario.model_dump(exclude_unset=True)["recordings"][1:3]
    for entry in recordings:
        entry["simulate"]["seconds"] = 0.5
    return rig.with_settings(recordings=recordings, identify={"generations": 0}).identify()


@pytest.mark.long
def test_each_view_of_the_folder_is_offered_and_drawn(page: Any, session: Session) -> None:
    found = compared()
    assert session.document.change(
        lambda document: document.update(found.given.scenario.model_dump())
    )
    session.identification.outcome, session.identification.outcome_of = (
        found.outcome,
        session.document.scenario,
    )
    session.notify(Topic.OUTCOME)
    session.show("Compare")
    sees(page, "± noise floor")
    for view in recording_views().values():
        pick(page, "Show", view.title)
        page.get_by_text(view.about).or_(page.get_by_text(view.nothing)).first.wait_for()
    pick(page, "Show", "signals")
    sees(page, "± noise floor")


@pytest.mark.long
def test_a_worst_place_is_one_click_away(page: Any, session: Session) -> None:
    few(session)
    press(page, "Identify")
    press(page, "Start identification")
    press(page, "Next: compare model and measurements")
    row = page.locator("table.worst tbody tr").nth(1)
    row.click()
    page.locator("table.worst [aria-current]").wait_for()
    assert session.comparison.failing is not None
    cell = session.comparison.failing.maps.worst[1]
    assert session.playback.cursor.recording == cell.recording
    assert session.playback.cursor.time > 0.0
    sees(page, f"Recording {cell.recording}, ")
    sees(page, output_title(cell.channel, cell.unit))
    page.wait_for_function(
        """name => [...document.querySelectorAll('.js-plotly-plot')].some(
          p => p.layout.shapes?.length === 1 && p.layout.annotations?.[0]?.text.endsWith(name))""",
        arg=channel_symbol(cell.channel, cell.unit),
    )
