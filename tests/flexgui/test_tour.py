"""The card of the tour follows from what has been done, and goes along with the person."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from flexgui.core.results import (
    MISSING,
    NOTHING,
    UNLISTED,
    ChannelError,
    Diagnosis,
    LadderStep,
    Outcome,
    RankedEffect,
)
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs.job import QUEUED, RUNNING, STOPPING, JobState
from flexgui.library.shipped import demo_scenario, hidden_scenario, is_of_tour
from flexgui.page.job_status import status_texts
from flexgui.page.panel import PageContext
from flexgui.page.tour import to_diagnosis, to_identification
from flexgui.session.scenario_edits import apply_edits
from flexgui.session.session import Session
from flexgui.session.state import STAGES
from flexgui.session.tour import (
    ADD,
    BEGIN,
    COMPARE,
    DIAGNOSE,
    DONE,
    END,
    LOOK,
    OFFERED,
    STARTED,
    Card,
    card,
    card_has_button,
    next_stage,
)
from flexgui.stages.diagnose.effects import with_effect
from flexgui.stages.diagnose.model_versions import (
    Change,
    ModelFindings,
    ModelVersion,
    error_rose,
    error_stayed,
    last_change,
)
from tests.session.helpers import alone

FRICTION, JOINT = "Coulomb friction", "Elastic joint"
WITH_FRICTION = apply_edits(hidden_scenario(), with_effect("coulomb_friction", None))


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    """On the tour, with nothing done yet."""
    made = alone("a-person", tmp_path / "own")
    made.document.scenario = hidden_scenario()
    made.tour.step = STARTED
    yield made
    made.close()


def fitted(session: Session, scenario: Scenario) -> None:
    """As after an identification of this scenario."""
    session.identification.outcome = cast(Outcome, SimpleNamespace(comparisons=()))
    session.identification.outcome_of = scenario


def ranked(title: str) -> RankedEffect:
    return RankedEffect(title.lower(), title, 9.0, 1e-9, 50.0, None, None)


def version(error: float, verdict: str | None, first: str, title: str = "") -> ModelVersion:
    """One look at a model whose error is so many floors; `title` of what was added to come here."""
    step = LadderStep(None, "", (), (ChannelError("z1", "m", error, 1.0),), None, error**2)
    diagnosis = None if verdict is None else Diagnosis(verdict, None, (), (step,), {})
    found = ModelFindings(
        step, ("th1",), (("z1",),), (0.1,), (np.ones((5, 1)),), (ranked(first),),
        diagnosis=diagnosis,
    )  # fmt: skip
    return ModelVersion(
        WITH_FRICTION if title else hidden_scenario(), title, title.lower() or None, found
    )


def go(session: Session, *versions: ModelVersion) -> None:
    """The way of these looks, at whose last model the person is."""
    session.diagnosis.versions = versions
    session.document.scenario = versions[-1].scenario if versions else hidden_scenario()


LACKING = version(9.7, MISSING, FRICTION)
ADDED = version(0.99, NOTHING, JOINT, FRICTION)


def at(session: Session, stage: str) -> Card:
    session.stage = stage
    shown = card(session)
    assert shown is not None
    return shown


@pytest.mark.parametrize("stage", STAGES)
def test_a_tour_that_was_dismissed_says_nothing(session: Session, stage: str) -> None:
    session.tour.step, session.stage = None, stage
    assert card(session) is None


def test_it_is_offered_at_the_first_stage_only(session: Session) -> None:
    session.tour.step, session.document.scenario = OFFERED, demo_scenario()
    assert at(session, "Arm").button == BEGIN
    session.stage = "Diagnose"
    assert card(session) is None


def test_other_recordings_are_not_the_tours(session: Session) -> None:
    session.document.scenario = demo_scenario()
    session.stage = "Data"
    assert card(session) is None


def test_an_effect_in_the_model_leaves_the_recordings_those_of_the_tour() -> None:
    assert is_of_tour(WITH_FRICTION)
    assert not is_of_tour(demo_scenario())


def test_walking_ahead_does_nothing_that_has_to_be_done(session: Session) -> None:
    for stage in STAGES:
        at(session, stage)
    assert at(session, "Compare").title == COMPARE
    assert "Identify first" in at(session, "Compare").text
    shown = at(session, "Diagnose")
    assert shown.title == DIAGNOSE
    assert shown.text.startswith("Press Find what is missing")


@pytest.mark.parametrize(
    ("stage", "title"),
    [("Arm", LOOK), ("Data", LOOK), ("Identify", COMPARE), ("Compare", COMPARE)],
)
def test_the_card_goes_back_with_the_person(session: Session, stage: str, title: str) -> None:
    fitted(session, session.document.scenario)
    go(session, LACKING)
    assert at(session, "Diagnose").title == ADD
    assert at(session, stage).title == title
    assert at(session, "Diagnose").title == ADD


def test_after_the_fit_the_card_points_to_what_is_next(session: Session) -> None:
    assert "Press Start identification" in at(session, "Identify").text
    fitted(session, session.document.scenario)
    assert "Press Next: compare" in at(session, "Identify").text


def test_a_fit_of_other_settings_is_to_be_done_again(session: Session) -> None:
    fitted(session, demo_scenario())
    assert "Press Start identification" in at(session, "Identify").text


def test_no_button_is_pressed_while_the_model_is_fitted(session: Session) -> None:
    session.run.state = JobState(kind="identify", phase=RUNNING)
    assert "Press" not in at(session, "Identify").text


def test_what_was_found_is_named_with_its_button(session: Session) -> None:
    go(session, LACKING)
    assert f"Press Add beside {FRICTION}:" in at(session, "Diagnose").text


def test_a_look_at_other_settings_is_to_be_taken_again(session: Session) -> None:
    go(session, LACKING)
    session.document.scenario = WITH_FRICTION
    assert at(session, "Diagnose").title == DIAGNOSE


def test_while_it_is_looked_for_nothing_is_pressed(session: Session) -> None:
    session.diagnosis.pending = ModelVersion(session.document.scenario)
    shown = at(session, "Diagnose")
    assert (shown.title, "Press" in shown.text) == (DIAGNOSE, False)


def test_while_it_is_added_the_card_says_what_is_fitted(session: Session) -> None:
    go(session, LACKING)
    session.diagnosis.pending = ModelVersion(WITH_FRICTION, FRICTION, "coulomb friction")
    assert f"fitted with {FRICTION}" in at(session, "Diagnose").text
    session.diagnosis.pending = version(0.99, None, JOINT, FRICTION)
    shown = at(session, "Diagnose").text
    assert "fell from 9.7 to 0.99 times the noise floor" in shown


def test_once_it_was_added_the_tour_is_done_and_names_no_other_effect(session: Session) -> None:
    go(session, LACKING, ADDED)
    shown = at(session, "Diagnose")
    assert shown.title == DONE
    assert shown.button == END
    assert f"fell from 9.7 to 0.99 times the noise floor: {FRICTION} was missing" in shown.text
    assert "Nothing else is missing" in shown.text
    assert JOINT not in shown.text


def test_once_nothing_is_missing_no_stage_sends_to_the_search_again(session: Session) -> None:
    go(session, LACKING, ADDED)
    assert "Press" not in at(session, "Compare").text


def test_undoing_leads_back_to_adding(session: Session) -> None:
    go(session, LACKING, ADDED)
    go(session, *session.diagnosis.versions[:-1])
    assert at(session, "Diagnose").title == ADD


@pytest.mark.parametrize("verdict", [MISSING, NOTHING, UNLISTED, None])
def test_an_error_that_did_not_fall_is_undone(session: Session, verdict: str | None) -> None:
    go(session, LACKING, ADDED, version(2.7, verdict, "Backlash", JOINT))
    shown = at(session, "Diagnose")
    assert shown.title == ADD
    assert "did not fall" in shown.text
    assert "from 0.99 to 2.7" in shown.text
    assert "Undo the last step" in shown.text
    assert "Backlash" not in shown.text


def test_an_error_that_fell_halfway_leads_on_or_back(session: Session) -> None:
    go(session, LACKING, version(7.7, MISSING, FRICTION, "Viscous joint friction"))
    shown = at(session, "Diagnose").text
    assert "from 9.7 to 7.7" in shown
    assert f"press Add beside {FRICTION}, or Undo" in shown


def test_elsewhere_the_card_says_where_the_tour_goes_on(session: Session) -> None:
    assert "continues at Identify" in at(session, "Export").text
    fitted(session, session.document.scenario)
    assert next_stage(session) == "Compare"
    go(session, LACKING)
    assert "continues at Diagnose" in at(session, "Export").text


def test_a_tour_that_is_through_holds_nobody_elsewhere(session: Session) -> None:
    go(session, LACKING, ADDED)
    session.stage = "Export"
    assert card(session) is None


def test_the_card_has_a_button_only_at_its_ends(session: Session) -> None:
    for versions in ((), (LACKING,), (LACKING, ADDED)):
        go(session, *versions)
        for stage in STAGES:
            session.stage = stage
            assert card_has_button(session) == (len(versions) == 2 and stage == "Diagnose")


def test_a_change_that_figures_do_not_show_is_none() -> None:
    assert Change(9.7, 0.99).fell
    assert not Change(0.99, 0.989).fell
    assert not Change(0.99, 2.7).fell
    assert last_change((LACKING,)) is None
    assert not error_stayed((LACKING, ADDED))
    needless = (ADDED, version(0.99, NOTHING, "Backlash", JOINT))
    assert error_stayed(needless) and not error_rose(needless)
    assert error_rose((ADDED, version(2.7, UNLISTED, "Backlash", JOINT)))


def test_progress_is_one_sentence_and_what_is_compiled_stands_apart() -> None:
    run = JobState("diagnose", RUNNING, stage="Trying every known effect", done=11, total=29)
    text = "Slow sensor (still to be compiled, once: Soft base)"
    assert status_texts(replace(run, text=text)) == (
        "Trying every known effect, 11 of 29", ": Slow sensor",
        "Still to be compiled, once: Soft base",
    )  # fmt: skip
    assert status_texts(replace(run, text="Slow sensor"))[2] == ""
    assert status_texts(replace(run, text=text, simulations=1234))[2] == (
        "1,234 simulations, still to be compiled, once: Soft base"
    )


def test_a_job_that_waits_or_ends_says_so() -> None:
    assert status_texts(JobState("diagnose", QUEUED, 2))[0] == "Waiting, place 2 in the queue."
    assert status_texts(JobState("diagnose", STOPPING, stage="x"))[0] == "Stopping …"


def test_an_effect_that_waits_to_be_added_does_not_lead_back_to_diagnosing(
    session: Session,
) -> None:
    session.diagnosis.pending = LACKING
    shown = at(session, "Diagnose")
    assert (shown.title, FRICTION in shown.text) == (DIAGNOSE, False), "nothing is decided yet"
    session.diagnosis.to_add = FRICTION
    assert at(session, "Diagnose").title == ADD
    session.diagnosis.pending = ModelVersion(WITH_FRICTION, FRICTION, "coulomb friction")
    assert at(session, "Diagnose").title == ADD


@pytest.mark.parametrize("tours", [True, False])
def test_on_the_tour_the_way_on_begins_what_is_done_there(
    session: Session, monkeypatch: pytest.MonkeyPatch, tours: bool
) -> None:
    begun: list[str] = []
    monkeypatch.setattr(session.identification, "start", lambda: begun.append("fit"))
    monkeypatch.setattr(session.diagnosis, "search", lambda: begun.append("search"))
    session.tour.step = STARTED if tours else None
    context = cast(PageContext, SimpleNamespace(session=session, services=None))
    to_identification(context)
    assert session.stage == "Identify"
    to_diagnosis(context)
    assert session.stage == "Diagnose"
    assert begun == (["fit", "search"] if tours else [])
    fitted(session, session.document.scenario)
    go(session, LACKING)
    to_identification(context)
    to_diagnosis(context)
    assert len(begun) == (2 if tours else 0)
